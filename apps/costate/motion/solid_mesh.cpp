#include "solid_mesh.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

namespace costate::app {

using Eigen::Vector3d;

namespace {

constexpr double kTurn = 2 * std::numbers::pi;

/// A surface of revolution about y: rings (radius, height) joined smoothly within a run, `rounds` corners around.
void add_revolved(SolidMesh& mesh, const std::vector<std::pair<double, double>>& profile, int rounds) {
  for (std::size_t i = 0; i + 1 < profile.size(); ++i) {
    const auto [r0, y0] = profile[i];
    const auto [r1, y1] = profile[i + 1];
    for (int k = 0; k < rounds; ++k) {
      const double a = kTurn * k / rounds, b = kTurn * (k + 1) / rounds;
      const auto at = [](double r, double y, double angle) {
        return Vector3d(r * std::cos(angle), y, r * std::sin(angle));
      };
      std::vector<Vector3d> face = {at(r0, y0, a), at(r1, y1, a)};
      if (r1 > 0) face.push_back(at(r1, y1, b));
      if (r0 > 0) face.push_back(at(r0, y0, b));
      mesh.add_face(face);
    }
  }
}

SolidMesh box(const Vector3d& low, const Vector3d& high) {
  SolidMesh mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (const bool top : {false, true}) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      std::vector<Vector3d> face;
      for (const auto& [du, dv] : {std::pair(0, 0), std::pair(1, 0), std::pair(1, 1), std::pair(0, 1)}) {
        Vector3d c;
        c[axis] = top ? high[axis] : low[axis];
        c[u] = du == 0 ? low[u] : high[u];
        c[v] = dv == 0 ? low[v] : high[v];
        face.push_back(c);
      }
      if (!top) std::reverse(face.begin(), face.end());
      mesh.add_face(face);
    }
  return mesh;
}

/// The corners of a plane's convex polygon, counter-clockwise about `normal`, from points in that plane.
std::vector<Vector3d> polygon_of(std::vector<Vector3d> points, const Vector3d& normal, double tiny) {
  const Vector3d e = normal.unitOrthogonal(), f = normal.cross(e);
  std::sort(points.begin(), points.end(), [&](const Vector3d& a, const Vector3d& b) {
    return std::abs(e.dot(a - b)) > tiny ? e.dot(a - b) < 0 : f.dot(a - b) < 0;
  });
  std::vector<Vector3d> hull;
  for (int pass = 0; pass < 2; ++pass) {
    const std::size_t start = hull.size();
    for (const Vector3d& p : points) {
      while (hull.size() >= start + 2) {
        const Vector3d a = hull.back() - hull[hull.size() - 2], b = p - hull.back();
        if (a.cross(b).dot(normal) > tiny * a.norm()) break;
        hull.pop_back();
      }
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

}  // namespace

void SolidMesh::add_face(const std::vector<Vector3d>& polygon) {
  if (polygon.size() < 3) return;
  Vector3d normal = Vector3d::Zero();  // Newell's, right for thin polygons, too
  for (std::size_t i = 0; i < polygon.size(); ++i) normal += polygon[i].cross(polygon[(i + 1) % polygon.size()]);
  if (!(normal.norm() > 0)) return;
  normal.normalize();
  const auto first = static_cast<std::uint32_t>(corners.size());
  for (const Vector3d& p : polygon) {
    corners.push_back(p.cast<float>());
    normals.push_back(normal.cast<float>());
  }
  for (std::uint32_t i = 1; i + 1 < polygon.size(); ++i)
    triangles.insert(triangles.end(), {first, first + i, first + i + 1});
}

void SolidMesh::add(const SolidMesh& other) {
  const auto first = static_cast<std::uint32_t>(corners.size());
  corners.insert(corners.end(), other.corners.begin(), other.corners.end());
  normals.insert(normals.end(), other.normals.begin(), other.normals.end());
  for (const auto i : other.triangles) triangles.push_back(first + i);
}

SolidMesh unit_sphere() {
  SolidMesh mesh;
  constexpr int rows = 8;
  std::vector<std::pair<double, double>> profile;
  for (int i = 0; i <= rows; ++i) {
    const double angle = std::numbers::pi * i / rows;
    profile.emplace_back(i == 0 || i == rows ? 0 : std::sin(angle), -std::cos(angle));
  }
  add_revolved(mesh, profile, 16);
  for (std::size_t i = 0; i < mesh.corners.size(); ++i) mesh.normals[i] = mesh.corners[i].normalized();
  return mesh;
}

SolidMesh unit_cylinder() {
  SolidMesh mesh;
  add_revolved(mesh, {{0, 0}, {1, 0}, {1, 1}, {0, 1}}, 16);
  return mesh;
}

SolidMesh unit_box() { return box(Vector3d::Constant(-0.5), Vector3d::Constant(0.5)); }

SolidMesh unit_arrow() {
  SolidMesh mesh;
  add_revolved(mesh, {{0, 0}, {0.4, 0}, {0.4, 0.7}, {1, 0.7}, {0, 1}}, 12);
  return mesh;
}

SolidMesh unit_wheel() {
  SolidMesh mesh;
  add_revolved(mesh, {{0.8, -0.25}, {1, -0.25}, {1, 0.25}, {0.8, 0.25}, {0.8, -0.25}}, 32);
  mesh.add(box({-0.82, -0.06, -0.06}, {0.82, 0.06, 0.06}));
  mesh.add(box({-0.06, -0.06, -0.82}, {0.06, 0.06, 0.82}));
  return mesh;
}

SolidMesh unit_coil() {
  constexpr int turns = 8, corners = 10, steps = turns * corners, around = 5;
  constexpr double wire = 0.16;
  const auto centre = [](double s) {  // straight for a little at both ends
    const double winding = std::clamp((s - 0.08) / 0.84, 0.0, 1.0), radius = s < 0.06 || s > 0.94 ? 0 : 1 - wire;
    return Vector3d(radius * std::cos(kTurn * turns * winding), s, radius * std::sin(kTurn * turns * winding));
  };
  SolidMesh mesh;
  const auto ring = [&](int i) {
    const Vector3d c = centre(static_cast<double>(i) / steps), radial(c[0], 0, c[2]);
    const bool straight = radial.norm() == 0;
    const Vector3d out = straight ? Vector3d(Vector3d::UnitX()) : radial.normalized();
    // A coil is drawn out along y, so that its wire is thin there from the start.
    const Vector3d other = straight ? Vector3d(-wire * Vector3d::UnitZ()) : Vector3d(0.012 * Vector3d::UnitY());
    std::vector<Vector3d> r;
    for (int k = 0; k < around; ++k) {
      const double angle = kTurn * k / around;
      r.push_back(c + wire * std::cos(angle) * out + std::sin(angle) * other);
    }
    return r;
  };
  auto before = ring(0);
  for (int i = 1; i <= steps; ++i) {
    const auto here = ring(i);
    for (std::size_t k = 0; k < around; ++k) {
      const std::size_t next = (k + 1) % around;
      mesh.add_face({before[k], before[next], here[next], here[k]});
    }
    before = here;
  }
  return mesh;
}

SolidMesh convex_solid(std::vector<Vector3d> points, double thickness) {
  SolidMesh mesh;
  if (points.empty()) return mesh;
  Vector3d mean = Vector3d::Zero();
  for (const auto& p : points) mean += p / static_cast<double>(points.size());
  double extent = 0;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const auto& p : points) {
    extent = std::max(extent, (p - mean).norm());
    spread += (p - mean) * (p - mean).transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread);
  const auto width = [&](int k) {  // along the principal axis k; the last one is the longest
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (const auto& p : points) {
      low = std::min(low, axes.eigenvectors().col(k).dot(p));
      high = std::max(high, axes.eigenvectors().col(k).dot(p));
    }
    return high - low;
  };
  const double flat = std::max(1e-3 * extent, 1e-6 * thickness);
  // Along axes in which the points have no extent they get one, so that what follows sees a solid.
  for (int k = 0; k < 3; ++k) {
    if (width(k) > flat) continue;
    const Vector3d off = 0.5 * thickness * axes.eigenvectors().col(k);
    std::vector<Vector3d> both;
    for (const auto& p : points) {
      both.push_back(p - off);
      both.push_back(p + off);
    }
    points = both;
  }
  // Few enough for a look at all planes through three points: those farthest from the middle.
  constexpr std::size_t most = 60;
  if (points.size() > most) {
    std::sort(points.begin(), points.end(),
              [&](const auto& a, const auto& b) { return (a - mean).norm() > (b - mean).norm(); });
    points.resize(most);
  }
  const double tiny = 1e-7 * std::max(extent, thickness);
  std::set<std::vector<std::size_t>> done;
  const std::size_t n = points.size();
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = i + 1; j < n; ++j)
      for (std::size_t k = j + 1; k < n; ++k) {
        Vector3d normal = (points[j] - points[i]).cross(points[k] - points[i]);
        if (normal.norm() < tiny * tiny) continue;
        normal.normalize();
        bool above = false, below = false;
        std::vector<std::size_t> in;
        for (std::size_t l = 0; l < n && !(above && below); ++l) {
          const double height = normal.dot(points[l] - points[i]);
          if (std::abs(height) <= 10 * tiny)
            in.push_back(l);
          else
            (height > 0 ? above : below) = true;
        }
        if (above && below) continue;
        if (above) normal = -normal;
        if (!done.insert(in).second) continue;
        std::vector<Vector3d> face;
        for (const std::size_t l : in) face.push_back(points[l]);
        mesh.add_face(polygon_of(face, normal, tiny));
      }
  return mesh;
}

}  // namespace costate::app
