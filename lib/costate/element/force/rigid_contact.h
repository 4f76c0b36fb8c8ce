// Rigid contact with a plane of the ground: of a point, of an arc or a sphere about it (contact_surface.h). It holds no
// force of its own: where the gap closes velocities jump (event/impact.h), and while it is closed the ground's forces
// are those of its rows (constraint/contact_rows.h). States, of one that may close: 1 while it is closed, else 0; with
// friction the direction in which it slides along the plane, 1 or -1, or 0 where it sticks. In space 1 where it slides,
// and the offset of its velocity (element/switched_rows.h), which is 0 but where sliding has begun from rest.
// Numbers: e, mu of sliding and of impacts, mu_s up to which it sticks, the approach speed below which it closes, h,
// alpha, R, x0, the states at the start; those of the points.
#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "costate/element/conditional_guard.h"
#include "costate/element/constraint/contact_rows.h"
#include "costate/element/force/contact_surface.h"
#include "costate/element/unilateral_force.h"

namespace costate {

/// In space: the offset [m/s] with which sliding begins from rest, along the friction that it takes.
inline constexpr double kSlidingOffset = 1e-9;

template <class Point>
class RigidContact final : public Force, public UnilateralForce, public ConditionalGuard, public GapElement {
 public:
  using Surface = ContactSurface<Point>;
  static constexpr int kRestitution = 0, kFriction = 1, kSticking = 2, kClosing = 3, kGround = 4,
                       kClosed = kGround + Surface::kNumbers, kSliding = kClosed + 1, kOffset = kSliding + 1,
                       kNumbers = Surface::dim == 3 ? kOffset + 1 : kOffset;
  static constexpr bool kSpace = Surface::dim == 3;

  struct Options {
    bool round = false, closes = false, sticks = false, poisson = false;
  };

  /// `ahead_of`: it closes only where it is ahead of that point along the plane's first direction.
  RigidContact(std::string name, const Point& point, const Point* ahead_of, const Options& options,
               const std::vector<int>& numbers)
      : Force("contact", std::move(name)), surface_(point, options.round), options_(options) {
    append_coordinates(point.coordinates());
    append_numbers(numbers);
    append_numbers(point.numbers());
    if (!ahead_of) return;
    ahead_of_.emplace_back(*ahead_of, false);
    append_coordinates(ahead_of->coordinates());
    append_numbers(ahead_of->numbers());
  }
  /// The constraint that holds it while it is closed, of one that may close.
  void hold_by(const Constraint& rows) { rows_ = &rows; }

  int states() const override { return options_.closes ? options_.sticks ? kSpace ? 4 : 2 : 1 : 0; }
  std::string state_name(int i) const override {
    constexpr const char* names[] = {"closed", "sliding", "offset_along", "offset_across"};
    return names[i];
  }
  int initial_state_number(int i) const override { return i == 0 ? kClosed : i == 1 ? kSliding : kOffset; }

  void force(const PathDual&, const PathDual*, const PathDual*, const PathDual*, const PathDual*, PathDual*,
             PathDual*) const override {}
  void calc_force(const LocalState&, double*, double*) const override {}
  void calc_partials(const LocalState&, ForcePartials) const override {}
  void calc_number_partial(const LocalState&, int, double*, double*) const override {}
  void add_number_gradient(const LocalState&, const double*, const double*, const int*, int, double*) const override {}

  // The touch; of one that closes its end, where N falls to 0; with friction the two limits mu_s N -+ F of sticking,
  // and the end of sliding, where s v_t falls to 0. In space mu_s N - |F|, and the end where |w| falls to half an
  // offset.
  int guard_count() const override { return options_.closes ? options_.sticks ? kSpace ? 4 : 5 : 2 : 1; }
  Guard guard_kind(int k) const override {
    constexpr Guard plane[] = {Guard::touch, Guard::release, Guard::slip_backward, Guard::slip_forward, Guard::stop};
    constexpr Guard space[] = {Guard::touch, Guard::release, Guard::slip_forward, Guard::stop};
    return kSpace ? space[k] : plane[k];
  }
  std::string guard_name(int k) const override {
    return k == 0 ? "touch" : k == 1 ? "release" : is_stop(k) ? "stop" : "slip";
  }
  std::string mode_behind(int k) const override {
    return k == 0 ? "touched" : k == 1 ? "open" : is_stop(k) ? "sticks" : "slides";
  }
  int guard_direction(int) const override { return -1; }
  bool guard_armed(int k, const double* z) const override {
    if (!options_.closes) return true;
    if ((z[0] > 0.5) != (k > 0)) return false;
    return k < 2 || is_stop(k) == (std::abs(z[1]) > 0.5);
  }
  std::string past_at_start(int k) const override {
    return k == 0       ? "a rigid contact is above the ground where it starts, or 'closed'."
           : k == 1     ? "what is closed at the start is pressed to the ground; leave 'closed' out."
           : is_stop(k) ? kSpace ? "it slides along its velocity, and has none; see 'sliding'."
                                 : "it slides the other way; see 'sliding'."
                        : "what sticks at the start needs more friction, or give 'sliding'.";
  }
  PathDual guard(int k, const MeasureArguments& x) const override {
    if (k == 0) return is_ahead(x.q, x.p) ? gap(x.q, x.p) : PathDual(std::nan(""));
    if (is_stop(k)) return speed(x.q, x.v, x.z, x.p);
    return x.lambda ? pressed(k, x.lambda, x.p) : PathDual(std::nan(""));
  }
  double guard_value(int k, const LocalState& s) const override {
    if (k == 0) return is_ahead(s.q, s.p) ? gap(s.q, s.p) : std::nan("");
    if (is_stop(k)) return speed(s.q, s.v, s.z, s.p);
    return s.lambda ? pressed(k, s.lambda, s.p) : std::nan("");
  }
  Other other(int k, const LocalState& s) const override {
    if (k != 0 || ahead_of_.empty()) return {std::nan(""), std::nan("")};
    const auto [q, p] = of_other(s.q, s.p);
    return {ahead(s.q, s.p), ahead_of_.front().gap(q, s.p + kGround, p)};
  }
  int gap_count() const override { return 1; }
  GapMotion gap_motion(int, const LocalState& s) const override {
    return surface_.gap_motion(s.q, s.v, s.p + kGround, s.p + kNumbers);
  }
  bool gap_presses(int, const double*) const override { return false; }
  int gap_of_guard(int k) const override { return k == 0 ? 0 : -1; }
  void transition(int, const MeasureArguments&, PathDual* z_after) const override {
    for (int i = 0; i < states(); ++i) z_after[i] = PathDual(0.0);
  }

  int row_count() const override { return options_.sticks ? 1 + Surface::tangents : 1; }
  PathDual row(int i, const MeasureArguments& x) const override { return row_of(i, x.q, x.p); }
  DirectedPathDual row_directed(int i, const DirectedPathDual* q, const DirectedPathDual* p) const override {
    return row_of(i, q, p);
  }
  int restitution_number() const override { return kRestitution; }
  int friction_number() const override { return kFriction; }
  int sticking_number() const override { return kSticking; }
  int closing_speed_number() const override { return kClosing; }
  bool gives_impulse_back() const override { return options_.poisson; }
  int closed_state() const override { return options_.closes ? 0 : -1; }
  int sliding_state() const override { return options_.closes && options_.sticks ? 1 : -1; }
  const Constraint* rows() const override { return rows_; }

  // Those of a compliant contact. One that closes has its forces from its rows, and what bounces for good has none.
  std::vector<Measure> measures() const override {
    std::vector<Measure> m{{"gap", "m", false},
                           {"penetration", "m", false},
                           {"penetration_rate", "m/s", false},
                           {"slip_velocity", "m/s", false}};
    if (!options_.closes) m.push_back({"normal_force", "N", false});
    if (!options_.closes || !options_.sticks) m.push_back({"friction_force", "N", false});
    return m;
  }
  PathDual measure(int i, const MeasureArguments& x) const override {
    if (i == 0) return gap(x.q, x.p);
    if (i == 1 || i > 3) return PathDual(0.0);
    typename Surface::template Motion<PathDual> m;
    surface_.motion(x.q, x.v, x.p + kGround, x.p + kNumbers, m);
    if (i == 2) return m.closing;
    if constexpr (Surface::tangents == 1) return m.slip[0];
    return sqrt(m.slip[0] * m.slip[0] + m.slip[1] * m.slip[1] + PathDual(1e-24));
  }

 private:
  template <class S>
  S row_of(int i, const S* q, const S* p) const {
    return i == 0 ? gap(q, p) : ContactRows<Point>::place(surface_, i - 1, q, p + kGround, p + kNumbers);
  }
  template <class S>
  S gap(const S* q, const S* p) const {
    return surface_.gap(q, p + kGround, p + kNumbers);
  }
  bool is_stop(int k) const { return k == (kSpace ? 3 : 4); }
  /// Along the plane, of the material point: s v_t; in space |v_t + o| less half an offset.
  template <class S>
  S speed(const S* q, const S* v, const S* z, const S* p) const {
    using std::sqrt;
    typename Surface::template Motion<S> m;
    surface_.motion(q, v, p + kGround, p + kNumbers, m);
    if constexpr (!kSpace) {
      return z[1] * m.slip[0];
    } else {
      const S along = m.slip[0] + z[2], across = m.slip[1] + z[3];
      return sqrt(along * along + across * across) - S(0.5 * kSlidingOffset);
    }
  }
  /// N, and mu_s N -+ F; the multipliers are -N and -F.
  template <class S>
  S pressed(int k, const S* lambda, const S* p) const {
    using std::sqrt;
    if (k == 1) return -lambda[0];
    if constexpr (kSpace)
      return -p[kSticking] * lambda[0] - sqrt(lambda[1] * lambda[1] + lambda[2] * lambda[2] + S(1e-300));
    return k == 2 ? lambda[1] - p[kSticking] * lambda[0] : -lambda[1] - p[kSticking] * lambda[0];
  }
  /// Where the other point's coordinates and numbers begin.
  template <class S>
  std::pair<const S*, const S*> of_other(const S* q, const S* p) const {
    return {q + surface_.point().size(), p + kNumbers + surface_.point().numbers().size()};
  }
  template <class S>
  double ahead(const S* q, const S* p) const {
    const auto [own, numbers] = of_other(q, p);
    return value_of(surface_.along(0, q, p + kGround, p + kNumbers)) -
           value_of(ahead_of_.front().along(0, own, p + kGround, numbers));
  }
  template <class S>
  bool is_ahead(const S* q, const S* p) const {
    return ahead_of_.empty() || ahead(q, p) > 0;
  }

  Surface surface_;
  Options options_;
  std::vector<Surface> ahead_of_;
  const Constraint* rows_ = nullptr;
};

}  // namespace costate
