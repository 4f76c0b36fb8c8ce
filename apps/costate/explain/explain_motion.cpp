#include "explain_motion.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "costate/element/body/rotor.h"

namespace costate::app {

namespace {

// Across a line by no more than this part of its way, a motion is one along the line.
constexpr double kStraight = 1e-6;

/// Where the coordinates of one body or free point in space are: x, y, z; e0 ... e3 or u1x ... u3z of what turns.
struct SpatialPlaces {
  std::array<int, 3> origin = {-1, -1, -1};
  std::array<int, 4> euler = {-1, -1, -1, -1};
  std::array<int, 9> base = {-1, -1, -1, -1, -1, -1, -1, -1, -1};

  bool in_space() const { return origin[0] >= 0 && origin[1] >= 0 && origin[2] >= 0; }
};

std::map<std::string, SpatialPlaces> spatial_places(const Mechanism& mechanism) {
  std::map<std::string, SpatialPlaces> bodies;
  const auto names = mechanism.coordinate_names();
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::size_t dot = names[i].rfind('.');
    if (dot == std::string::npos) continue;
    const std::string key = names[i].substr(dot + 1), axes = "xyz";
    SpatialPlaces& at = bodies[names[i].substr(0, dot)];
    const std::size_t axis = axes.find(key.back());
    if (key.size() == 1 && axis < 3) at.origin[axis] = static_cast<int>(i);
    if (key.size() == 2 && key[0] == 'e' && key[1] >= '0' && key[1] <= '3')
      at.euler[static_cast<std::size_t>(key[1] - '0')] = static_cast<int>(i);
    if (key.size() == 3 && key[0] == 'u' && key[1] >= '1' && key[1] <= '3' && axis < 3)
      at.base[static_cast<std::size_t>(key[1] - '1') * 3 + axis] = static_cast<int>(i);
  }
  std::erase_if(bodies, [](const auto& b) { return !b.second.in_space(); });
  return bodies;
}

Eigen::Vector3d turned(const double* e, const Eigen::Vector3d& s) {
  Eigen::Vector3d r;
  rotated(e, s.data(), r.data());
  return r;
}

/// In the frame of the body that carries it, by its mass matrix there: M(e, theta) = 2 J a.
Eigen::Vector3d axis_of(const Rotor& rotor) {
  const double upright[5] = {1, 0, 0, 0, 0}, inertia = 1;
  LocalState s;
  s.q = s.v = upright;
  s.p = &inertia;
  Eigen::Matrix<double, 5, 5> mass = Eigen::Matrix<double, 5, 5>::Zero();
  LocalMatrix block(mass.data(), 5, 5);
  rotor.calc_mass(s, block);
  return mass.block<3, 1>(1, 4).normalized();
}

/// The origins and, of those that turn, points on their axes, and on the rims of rotors: 1 m away.
std::vector<Eigen::Vector3d> marks(const Mechanism& mechanism, const std::map<std::string, SpatialPlaces>& bodies,
                                   const std::vector<double>& q) {
  const auto value = [&](int i) { return q[static_cast<std::size_t>(i)]; };
  std::vector<Eigen::Vector3d> list;
  for (const auto& [name, at] : bodies) {
    const Eigen::Vector3d origin(value(at.origin[0]), value(at.origin[1]), value(at.origin[2]));
    list.push_back(origin);
    if (at.euler[3] >= 0) {
      const double e[4] = {value(at.euler[0]), value(at.euler[1]), value(at.euler[2]), value(at.euler[3])};
      for (int axis = 0; axis < 3; ++axis) list.push_back(origin + turned(e, Eigen::Vector3d::Unit(axis)));
    }
    for (std::size_t k = 0; k < 3 && at.base[8] >= 0; ++k)
      list.push_back(origin +
                     Eigen::Vector3d(value(at.base[3 * k]), value(at.base[3 * k + 1]), value(at.base[3 * k + 2])));
  }
  for (const auto& b : mechanism.bodies())
    if (const auto* rotor = dynamic_cast<const Rotor*>(b.get())) {
      const auto& c = rotor->coordinates();
      const double e[4] = {value(c[0]), value(c[1]), value(c[2]), value(c[3])}, spin = value(c[4]);
      const Eigen::Vector3d axis = axis_of(*rotor), across = axis.unitOrthogonal(), third = axis.cross(across);
      list.push_back(turned(e, std::cos(spin) * across + std::sin(spin) * third));
    }
  return list;
}

/// Of its two directions the one whose largest entry is positive; what is rounding of zero is zero.
Eigen::Vector3d tidy(Eigen::Vector3d d) {
  Eigen::Index largest = 0;
  d.cwiseAbs().maxCoeff(&largest);
  if (d[largest] < 0) d = -d;
  for (double& x : d)
    if (std::abs(x) < 1e-6) x = 0;
  return d;
}

/// A normal across the line, of the plane through it in which the marks lie best; else any.
Eigen::Vector3d normal_of_line(const Eigen::Vector3d& line, const std::vector<Eigen::Vector3d>& marks) {
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - line * line.transpose();
  for (const Eigen::Vector3d& m : marks) {
    const Eigen::Vector3d d = across * (m - marks.front());
    spread += d * d.transpose();
  }
  // The line itself, whose spread is zero, must not be taken for the normal.
  spread += (1 + spread.trace()) * line * line.transpose();
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(0);
}

}  // namespace

std::optional<PlaneMotion> plane_of(const Mechanism& mechanism, const std::vector<std::vector<double>>& positions) {
  const auto bodies = spatial_places(mechanism);
  if (bodies.empty() || positions.size() < 2) return std::nullopt;
  const auto first = marks(mechanism, bodies, positions.front());
  std::vector<Eigen::Vector3d> moves;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  double largest = 0;
  for (const auto& q : positions) {
    const auto now = marks(mechanism, bodies, q);
    for (std::size_t i = 0; i < now.size(); ++i) {
      moves.push_back(now[i] - first[i]);
      spread += moves.back() * moves.back().transpose();
      largest = std::max(largest, moves.back().norm());
    }
  }
  if (!(largest > 0)) return std::nullopt;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  PlaneMotion r;
  r.normal = solver.eigenvectors().col(0);
  const Eigen::Vector3d line = tidy(solver.eigenvectors().col(2));
  const auto off = [&](const Eigen::Vector3d& d) { return (d - line * line.dot(d)).norm() <= kStraight * largest; };
  if (std::all_of(moves.begin(), moves.end(), off)) {
    r.line = line;
    r.normal = normal_of_line(solver.eigenvectors().col(2), first);
  }
  r.normal = tidy(r.normal);
  double out = 0;
  for (const auto& d : moves) out = std::max(out, std::abs(d.dot(r.normal)));
  r.out_of_plane = out / largest;
  return r;
}

GapWatch::GapWatch(const Mechanism& mechanism) {
  for (const auto& f : mechanism.forces())
    if (const auto* gaps = dynamic_cast<const GapElement*>(f.get()))
      for (int i = 0; i < gaps->gap_count(); ++i) gaps_.push_back({GapTrace(*f, *gaps, i)});
}

void GapWatch::add(const StateView& s, const Assembly& assembly) {
  times_.push_back(s.t);
  for (Gap& g : gaps_) {
    const GapMotion m = g.trace.look(s, assembly).m;
    g.fastest = std::max({g.fastest, std::abs(m.rate), m.speed});
    g.values.push_back(m.gap);
  }
}

std::vector<std::string> GapWatch::open() const {
  std::vector<std::string> names;
  std::set<std::string> touched;
  for (const Gap& g : gaps_) {
    const std::string path = g.trace.element().path();
    bool stays = times_.size() > 1;
    for (std::size_t i = 1; stays && i < times_.size(); ++i)
      stays = g.values[i - 1] > 0 && g.values[i] > 0 &&
              g.values[i - 1] + g.values[i] > 2 * g.fastest * (times_[i] - times_[i - 1]);
    if (!stays) touched.insert(path);
    if (std::find(names.begin(), names.end(), path) == names.end()) names.push_back(path);
  }
  std::erase_if(names, [&](const std::string& path) { return touched.contains(path); });
  return names;
}

}  // namespace costate::app
