#include "stage.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace costate::app {

namespace {

using Eigen::Quaterniond;

constexpr unsigned kBodyColor = 0x4a6fa5, kPlateColor = 0xa9c0de, kSpringColor = 0xc8641e, kLoadColor = 0xa3195b,
                   kJointColor = 0x1f6f4a, kPointColor = 0x222222, kGroundColor = 0x8a8a8a, kRoundColor = 0x777777;

class StageMaker {
 public:
  StageMaker(const std::vector<double>& times, const std::vector<Figure>& figures) : figures_(figures) {
    const Figure& first = figures.front();
    stage_.times = times;
    stage_.size = first.size;
    stage_.up = first.spatial ? first.up : 1;
    thin_ = 0.012 * first.size;
    for (auto* make : {unit_sphere, unit_cylinder, unit_box, unit_coil, unit_arrow, unit_wheel})
      stage_.meshes.push_back(make());
  }

  Stage make() {
    const Figure& first = figures_.front();
    for (std::size_t i = 0; i < first.bodies.size(); ++i) add_body(i);
    for (std::size_t i = 0; i < first.links.size(); ++i) add_link(i);
    for (std::size_t i = 0; i < first.places.size(); ++i) add_place(i);
    return std::move(stage_);
  }

 private:
  enum Mesh { sphere, cylinder, cube, coil, arrow, wheel };

  /// A solid whose pose at each figure `pose` gives.
  template <class F>
  Solid& add(const std::string& name, int mesh, unsigned color, F&& pose) {
    Solid s{name, mesh, color, 1, {}};
    for (const Figure& f : figures_) {
      s.poses.push_back(pose(f));
      if (s.poses.size() < 2) continue;
      Quaterniond& q = s.poses.back().turn;
      if (q.dot(s.poses[s.poses.size() - 2].turn) < 0) q.coeffs() = -q.coeffs();
    }
    stage_.solids.push_back(std::move(s));
    return stage_.solids.back();
  }

  /// y of the mesh along the way from a to b, without more twist about it than it has to have.
  class Along {
   public:
    Pose operator()(const Vector3d& a, const Vector3d& b, double radius) {
      const double length = (b - a).norm();
      if (length > 0) {
        const Vector3d u = (b - a) / length;
        turn_ = (Quaterniond::FromTwoVectors(before_, u) * turn_).normalized();
        before_ = u;
      }
      return {a, turn_, {radius, std::max(length, 1e-3 * radius), radius}};
    }

   private:
    Vector3d before_ = Vector3d::UnitY();
    Quaterniond turn_ = Quaterniond::Identity();
  };

  template <class F>
  Solid& add_between(const std::string& name, int mesh, unsigned color, double radius, F&& ends) {
    return add(name, mesh, color, [&, along = Along()](const Figure& f) mutable {
      const auto [a, b] = ends(f);
      return along(a, b, radius);
    });
  }
  template <class F>
  Solid& add_ball(const std::string& name, unsigned color, double radius, F&& at) {
    return add(name, sphere, color, [&](const Figure& f) {
      return Pose{at(f), Quaterniond::Identity(), Vector3d::Constant(radius)};
    });
  }
  /// A wheel, or a disc of the plane, about an axis; it turns with its body.
  template <class F>
  Solid& add_round(const std::string& name, int mesh, unsigned color, const Vector3d& scale, F&& at_axis_turned) {
    const auto [at0, axis0, turned0] = at_axis_turned(figures_.front());
    const Quaterniond still = Quaterniond(turned0).conjugate() * Quaterniond::FromTwoVectors(Vector3d::UnitY(), axis0);
    return add(name, mesh, color, [&](const Figure& f) {
      const auto [at, axis, turned] = at_axis_turned(f);
      Quaterniond turn = (Quaterniond(turned) * still).normalized();
      // Where the axis is not fixed in the body the wheel follows the axis.
      turn = (Quaterniond::FromTwoVectors(turn * Vector3d::UnitY(), axis) * turn).normalized();
      const Vector3d back = mesh == cylinder ? Vector3d(-0.5 * scale[1] * axis) : Vector3d(Vector3d::Zero());
      return Pose{at + back, turn, scale};
    });
  }

  void add_body(std::size_t i) {
    const BodyShape& b = figures_.front().bodies[i];
    if (b.frame) {
      const BodyFrame& f = *b.frame;
      std::vector<Vector3d> local;
      for (const auto& c : b.corners) local.push_back(f.rotation.transpose() * (c - f.origin));
      stage_.meshes.push_back(convex_solid(local, 2 * thin_));
      add(b.name, static_cast<int>(stage_.meshes.size()) - 1, local.size() > 2 ? kPlateColor : kBodyColor,
          [&](const Figure& at) {
            const BodyFrame& frame = *at.bodies[i].frame;
            return Pose{frame.origin, Quaterniond(frame.rotation).normalized(), Vector3d::Ones()};
          })
          .opacity = local.size() > 2 ? 0.85 : 1;
    } else if (b.corners.size() == 1) {  // a mass at a point
      add_ball(b.name, kBodyColor, 3 * thin_, [&](const Figure& f) { return f.bodies[i].corners[0]; });
    } else {
      for (std::size_t k = 1; k < b.corners.size(); ++k)
        add_between(b.name, cylinder, kBodyColor, thin_,
                    [&](const Figure& f) { return std::pair(f.bodies[i].corners[k - 1], f.bodies[i].corners[k]); });
    }
  }

  void add_link(std::size_t i) {
    const LinkShape& l = figures_.front().links[i];
    const auto place = [i](std::size_t k) { return [i, k](const Figure& f) { return f.links[i].at[k]; }; };
    switch (l.role) {
      case LinkRole::joint:
        add_joint(i);
        break;
      case LinkRole::rod:
      case LinkRole::guide:
      case LinkRole::driver:
      case LinkRole::spring: {
        const bool spring = l.role == LinkRole::spring;
        const unsigned color = spring                       ? kSpringColor
                               : l.role == LinkRole::driver ? kLoadColor
                               : l.role == LinkRole::rod    ? kBodyColor
                                                            : kJointColor;
        const double radius = spring ? 2 * thin_ : l.role == LinkRole::guide ? 0.3 * thin_ : 0.6 * thin_;
        // Pairs of points are lines that are compared; of three points the first belongs to both.
        const bool pairs = l.at.size() % 2 == 0 && !spring;
        for (std::size_t k = 0; k + 1 < l.at.size(); k += pairs ? 2 : 1)
          add_between(l.name, spring ? coil : cylinder, color, radius, [&](const Figure& f) {
            return std::pair(f.links[i].at[pairs || spring ? k : 0], f.links[i].at[k + 1]);
          });
        break;
      }
      case LinkRole::load:
        add_between(l.name, arrow, kLoadColor, 1.5 * thin_, [&](const Figure& f) {
          const auto& here = f.links[i];
          const double length = here.direction ? 0.15 * f.size : 0;  // no force, no arrow
          return std::pair(here.at[0], Vector3d(here.at[0] + length * here.direction.value_or(Vector3d::UnitY())));
        }).reverses = true;
        break;
      case LinkRole::couple:
        add_ball(l.name, kLoadColor, 1.8 * thin_, place(0)).opacity = 0.5;
        break;
      case LinkRole::wheel:
        add_round(l.name, wheel, kRoundColor, Vector3d(l.radius, 0.5 * l.radius, l.radius), [i](const Figure& f) {
          const auto& here = f.links[i];
          return std::tuple(here.at[0], here.direction.value_or(Vector3d::UnitY()), here.turned);
        });
        break;
      case LinkRole::contact:
        for (std::size_t k = 0; k + 1 < l.at.size() && l.radius > 0; ++k) add_circle(i, k, l.radius);
        add_ground(i);
        break;
      case LinkRole::pair:
        if (l.radius > 0) add_circle(i, 0, l.radius);
        if (l.other_radius > 0) add_circle(i, 1, l.other_radius);
        break;
    }
  }

  void add_joint(std::size_t i) {
    const LinkShape& l = figures_.front().links[i];
    if (!l.direction) {
      add_ball(l.name, kJointColor, 1.6 * thin_, [i](const Figure& f) { return f.links[i].at[0]; });
      return;
    }
    add_between(l.name, cylinder, kJointColor, 1.2 * thin_, [&](const Figure& f) {
      const auto& here = f.links[i];
      const Vector3d reach = 3 * thin_ * here.direction.value_or(*l.direction);
      return std::pair(Vector3d(here.at[0] - reach), Vector3d(here.at[0] + reach));
    });
  }

  /// A circle of the plane is a disc, one in space a sphere.
  void add_circle(std::size_t i, std::size_t k, double radius) {
    const LinkShape& l = figures_.front().links[i];
    if (figures_.front().spatial)
      add_ball(l.name, kRoundColor, radius, [i, k](const Figure& f) { return f.links[i].at[k]; }).opacity = 0.5;
    else
      add_round(l.name, cylinder, kRoundColor, Vector3d(radius, thin_, radius), [i, k](const Figure& f) {
        return std::tuple(f.links[i].at[k], Vector3d(Vector3d::UnitZ()), f.links[i].turned);
      }).opacity = 0.5;
  }

  /// The ground below a contact, as far as it is used; one plate where several contacts share it.
  void add_ground(std::size_t i) {
    const LinkShape& l = figures_.front().links[i];
    const Vector3d x = l.direction.value_or(Vector3d::UnitX()), from = l.at.back();
    const Vector3d z = figures_.front().spatial ? Vector3d(Vector3d::UnitY()) : Vector3d(Vector3d::UnitZ());
    const Vector3d y = z.cross(x).dot(Vector3d::Unit(stage_.up)) < 0 ? Vector3d(-z.cross(x)) : Vector3d(z.cross(x));
    Vector3d low = Vector3d::Zero(), high = low;
    for (const Figure& f : figures_) {
      const Vector3d off = f.links[i].at.back() - from;
      const Vector3d local(x.dot(off), 0, z.dot(off));
      low = low.cwiseMin(local);
      high = high.cwiseMax(local);
    }
    const double rim = 0.25 * stage_.size;
    Eigen::Matrix3d axes;
    axes << x, y, x.cross(y);
    const Vector3d middle = 0.5 * (low + high), span = high - low;
    Pose pose;
    pose.at = from + middle[0] * x + middle[2] * z - 0.5 * thin_ * y;
    pose.turn = Quaterniond(axes).normalized();
    pose.scale = Vector3d(span[0] + 2 * rim, thin_, span[2] + 2 * rim);
    for (const Pose& other : grounds_)
      if (std::abs(y.dot(other.at - pose.at)) < 1e-6 * stage_.size && other.turn.angularDistance(pose.turn) < 1e-9 &&
          (other.at - pose.at).norm() < rim)
        return;
    grounds_.push_back(pose);
    add("ground." + l.name, cube, kGroundColor, [&](const Figure&) { return pose; }).opacity = 0.6;
  }

  void add_place(std::size_t i) {
    const Place& p = figures_.front().places[i];
    if (p.ground)
      add(p.name, cube, kGroundColor, [&](const Figure& f) {
        return Pose{f.places[i].at, Quaterniond::Identity(), Vector3d::Constant(3 * thin_)};
      });
    else
      add_ball(p.name, kPointColor, 1.4 * thin_, [i](const Figure& f) { return f.places[i].at; });
  }

  const std::vector<Figure>& figures_;
  double thin_ = 0.01;
  std::vector<Pose> grounds_;
  Stage stage_;
};

}  // namespace

Stage make_stage(const std::vector<double>& times, const std::vector<Figure>& figures) {
  return StageMaker(times, figures).make();
}

std::pair<double, std::string> largest_turn(const Stage& stage) {
  std::pair<double, std::string> most{0, ""};
  for (const Solid& s : stage.solids)
    for (std::size_t i = 1; i < s.poses.size(); ++i)
      if (const double turn = s.poses[i].turn.angularDistance(s.poses[i - 1].turn),
          angle = s.reverses ? std::min(turn, std::numbers::pi - turn) : turn;
          angle > most.first)
        most = {angle, s.name};
  return most;
}

}  // namespace costate::app
