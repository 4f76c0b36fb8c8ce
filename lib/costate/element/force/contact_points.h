// The points of a contact with the ground and the forces there (contact.h), for every scalar type that they are
// compiled for; numbers and states are laid out there.
#pragma once

#include <algorithm>
#include <limits>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "costate/element/conditional_guard.h"
#include "costate/element/force/contact_laws.h"
#include "costate/element/force/contact_surface.h"
#include "costate/element/force/road.h"
#include "costate/element/guarded_force.h"

namespace costate {

/// The arguments of a kernel of any scalar type.
template <class S>
struct ContactArguments {
  S t{};
  const S *q = nullptr, *v = nullptr, *z = nullptr, *p = nullptr;
};

/// What is no plane at rest: a road on it, if any, and the coordinates of the body of the plane that carries it, if
/// any.
struct ContactGround {
  std::shared_ptr<const Road> road;
  std::vector<int> carrier;
};

enum class ContactMaterial { none, body, both };  // whether Hertz's stiffness is that of materials

struct ContactSetup {
  NormalLaw law = NormalLaw::hertz;
  FrictionModel friction = FrictionModel::none;
  bool round = false, rolling = false, energy = false;
  ContactMaterial material = ContactMaterial::none;
};

/// Ground: ContactSurface, or RoadSurface (contact_road.h).
template <class Point, class Ground>
class ContactPoints {
 public:
  using Surface = Ground;
  /// Whether the ground is one of contact_road.h.
  static constexpr bool on_road = !std::is_same_v<Ground, ContactSurface<Point>>;
  static constexpr int dim = Surface::dim, tangents = Surface::tangents, turns = Surface::turns;
  static constexpr int kFriction = 4, kGround = kFriction + kFrictionNumbers, kApproach = kGround + Surface::kNumbers,
                       kRest = kApproach + 1, kRolling = kRest + 1, kSpinning = kRolling + 1, kTurnSpeed = kRolling + 2,
                       kMaterial = kRolling + 3, kNumbers = kMaterial + 4;
  using Material = ContactMaterial;
  using Options = ContactSetup;

 protected:
  ContactPoints(const std::vector<Point>& points, const Point* ahead_of, const Options& options, int first_number,
                const ContactGround& ground)
      : options_(options), latches_(touch_is_event(options.law, options.friction) || ahead_of != nullptr) {
    int at = first_number;
    const auto add = [&](std::vector<At>& to, const Point& point, bool round) {
      if constexpr (on_road)
        to.push_back({Surface(point, round, ground.road, !ground.carrier.empty()), at});
      else
        to.push_back({Surface(point, round), at});
      at += static_cast<int>(point.numbers().size());
    };
    for (const Point& point : points) add(surfaces_, point, options.round);
    if (ahead_of) add(ahead_of_, *ahead_of, false);
    road_ = at;
  }

  struct At {
    Surface surface;
    int numbers;  // where those of its point begin
  };
  template <class S>
  struct Forces {
    S normal{}, friction[tangents] = {}, moment[turns] = {}, lost{};
    typename Surface::template Motion<S> motion;
    bool touches = false;
  };

  static ContactArguments<PathDual> arguments(const MeasureArguments& x) { return {x.t, x.q, x.v, x.z, x.p}; }
  static ContactArguments<double> arguments(const LocalState& s) { return {s.t, s.q, s.v, s.z, s.p}; }
  const Surface& surface(int i) const { return surfaces_[static_cast<std::size_t>(i)].surface; }
  /// Coordinates that forces act on.
  int size() const {
    if constexpr (on_road) return surface(0).point().size() + surface(0).carrier_size();
    return surface(0).point().size();
  }
  int count() const { return static_cast<int>(surfaces_.size()); }
  int own_states() const { return (latches_ ? 1 : 0) + (has_bristles(options_.friction) ? tangents : 0); }
  std::string of_point(int i, const char* join) const {
    return count() == 1 ? std::string() : join + surface(i).point().name();
  }
  template <class S>
  const S* point_numbers(int i, const S* p) const {
    return p + surfaces_[static_cast<std::size_t>(i)].numbers;
  }
  template <class S>
  S share(int i, const S* p) const {
    return count() == 1 ? S(1.0) : p[kNumbers + i];
  }
  template <class S>
  S stiffness(const S* p) const {
    using std::sqrt;
    if (options_.material == Material::none) return p[0];
    const S *e = p + kMaterial, one(1.0);
    S compliance = (one - e[1] * e[1]) / e[0];
    if (options_.material == Material::both) compliance += (one - e[3] * e[3]) / e[2];
    return S(4.0 / 3.0) * sqrt(p[kGround + Surface::kRadius]) / compliance;
  }
  template <class S>
  S gap(int i, const ContactArguments<S>& x) const {
    if constexpr (on_road)
      return surface(i).gap(x.t, x.q, x.p + kGround, point_numbers(i, x.p), x.p + road_);
    else
      return surface(i).gap(x.q, x.p + kGround, point_numbers(i, x.p));
  }
  GapMotion gap_motion_of(int i, const LocalState& s) const {
    if constexpr (on_road)
      return surface(i).gap_motion(s.t, s.q, s.v, s.p + kGround, point_numbers(i, s.p), s.p + road_);
    else
      return surface(i).gap_motion(s.q, s.v, s.p + kGround, point_numbers(i, s.p));
  }
  template <class S>
  S along(int i, const S* q, const S* p) const {
    return surface(i).along(0, q, p + kGround, point_numbers(i, p));
  }
  template <class S>
  typename Surface::template Motion<S> motion(int i, const ContactArguments<S>& x) const {
    typename Surface::template Motion<S> m;
    if constexpr (on_road)
      surface(i).motion(x.t, x.q, x.v, x.p + kGround, point_numbers(i, x.p), x.p + road_, m);
    else
      surface(i).motion(x.q, x.v, x.p + kGround, point_numbers(i, x.p), m);
    return m;
  }
  template <class S>
  double ahead(int i, const S* q, const S* p) const {
    const At& other = ahead_of_.front();
    return value_of(along(i, q, p)) - value_of(other.surface.along(0, q + size(), p + kGround, p + other.numbers));
  }
  template <class S>
  bool is_ahead(int i, const S* q, const S* p) const {
    return ahead_of_.empty() || ahead(i, q, p) > 0;
  }
  /// Of point i; on a road the other one's gap is not asked for.
  ConditionalGuard::Other other_of(int i, const LocalState& s) const {
    ConditionalGuard::Other out{std::nan(""), std::nan("")};
    if (ahead_of_.empty()) return out;
    const At& other = ahead_of_.front();
    out.ahead = ahead(i, s.q, s.p);
    if constexpr (!on_road) out.guard = other.surface.gap(s.q + size(), s.p + kGround, s.p + other.numbers);
    return out;
  }
  template <class S>
  bool touches(int i, const ContactArguments<S>& x) const {
    return latches_ ? value_of(x.z[i * own_states()]) > 0 : value_of(gap(i, x)) < 0;
  }
  /// Of what latches its touch the states tell that it is open, of others on a plane the gap.
  double rest_of(const LocalState& s, double* slopes) const {
    if (latches_) {
      for (int i = 0; i < count(); ++i)
        if (s.z[i * own_states()] > 0) return 0;
      return std::numeric_limits<double>::infinity();
    }
    double least = std::numeric_limits<double>::infinity(), own[Point::kMaxCoordinates];
    if constexpr (on_road)
      return 0;
    else
      for (int i = 0; i < count(); ++i) {
        std::fill(own, own + size(), 0.0);
        least = std::min(least, surface(i).reach(s.q, s.p + kGround, point_numbers(i, s.p), own));
        for (int j = 0; j < size(); ++j) slopes[j] = std::max(slopes[j], own[j]);
      }
    return least;
  }
  std::vector<int> latch_states() const {
    std::vector<int> states;
    for (int i = 0; latches_ && i < count(); ++i) states.push_back(i * own_states());
    return states;
  }
  template <class S>
  void add_point(int i, const ContactArguments<S>& x, S* Q, S* zdot) const {
    Forces<S> f;
    calc(i, x, f, zdot);
    if (!f.touches) return;
    surface(i).add_force(f.motion, x.q, x.p + kGround, point_numbers(i, x.p), f.normal, f.friction, f.moment, Q);
    if (options_.energy) zdot[count() * own_states()] += f.lost;
  }

  template <class S>
  void calc(int i, const ContactArguments<S>& x, Forces<S>& f, S* zdot) const {
    f.touches = touches(i, x);
    if (!f.touches) return;
    // Within a step that ends at the release the gap is open already: the law goes on, and is zero there.
    f.motion = motion(i, x);
    if constexpr (on_road && std::is_same_v<S, double>) surface(i).require_one_foot(f.motion, x.t);
    const int first = i * own_states();
    apply_laws(i, x.p, x.z + first, f, zdot + first);
  }

  /// For GapElement::add_bends(): of each point the touch where that is no event, else where its force would pull.
  void add_bends_of(const ContactArguments<double>& x, std::vector<double>& beyond) const {
    for (int i = 0; i < count(); ++i)
      beyond.push_back(!latches_ ? -gap(i, x) : touches(i, x) ? uncut_force_of(i, x) : 0);
  }
  /// Of point i, which touches: as it would be if it could pull.
  double uncut_force_of(int i, const ContactArguments<double>& x) const {
    const double depth = -gap(i, x), law[4] = {stiffness(x.p), x.p[1], x.p[2], x.p[3]};
    return uncut_force(options_.law, law, depth, motion(i, x).closing, latches_ ? x.z[i * own_states()] : depth);
  }

  /// The forces at point i by its motion, own states and their rates.
  template <class S>
  void apply_laws(int i, const S* p, const S* z, Forces<S>& f, S* zdot) const {
    const auto& m = f.motion;
    const int bristles = latches_ ? 1 : 0;
    const S depth = -m.gap, law[4] = {stiffness(p), p[1], p[2], p[3]};
    f.normal = share(i, p) * normal_force(options_.law, law, depth, m.closing, latches_ ? z[0] : depth);
    if (options_.friction != FrictionModel::none)
      friction_force(options_.friction, tangents, p + kFriction, f.normal, m.slip, z + bristles, f.friction,
                     zdot + bristles);
    if (options_.rolling) turning_moment<dim>(m.omega, m.n, p + kRolling, f.normal, f.moment);
    if (!options_.energy) return;
    f.lost = (f.normal - share(i, p) * elastic_force(options_.law, law, depth)) * m.closing;
    for (int k = 0; k < tangents; ++k) f.lost -= f.friction[k] * m.slip[k];
    for (int k = 0; k < turns; ++k) f.lost -= f.moment[k] * m.omega[k];
  }

  std::vector<At> surfaces_, ahead_of_;
  Options options_;
  bool latches_;
  int road_ = 0;  // where the numbers of the ground's road begin
};

}  // namespace costate
