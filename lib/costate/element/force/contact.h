// Compliant contact with a plane of the ground: of a point, of an arc or a sphere about it (contact_surface.h), or of
// several of these on one body, each with a share of the normal law: the corners of a box, the points of a patch (an
// elastic foundation). With the depth d, forces by contact_laws.h at each; where it is round, a moment resists rolling
// and spinning, M = -c N omega/|omega| tanh(|omega|/omega_s).
// States, point by point: the approach speed where the touch is an event (0: open), then the bristles of friction; at
// the end the energy lost, where it is asked for:
//   E' = (N - K d^n) ddot - F.v_t - M.omega,
// what the bodies gave and the elastic part of the normal force does not hold (bristles count as lost).
// Numbers: K, n, e, C, those of friction, h, alpha, R, x0, the initial approach speed, zero (what starts at rest),
// those of rolling; Young's moduli and Poisson's ratios of body and ground, which in the place of K give Hertz's, 4/3
// E* sqrt(R), 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2; a share a point where there are several; those of the points.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "costate/element/force/contact_chain.h"
#include "costate/element/guarded_force.h"
#include "costate/element/power_touch.h"

namespace costate {

template <class Point, class Ground = ContactSurface<Point>>
class Contact : public ForceOf<Contact<Point, Ground>>,
                public ContactChain<Point, Ground>,
                public GuardedForce,
                public ConditionalGuard,
                public GapElement,
                public PowerTouch {
  using Points = ContactChain<Point, Ground>;

 public:
  using Points::dim, Points::tangents, Points::on_road, Points::kNumbers, Points::kApproach, Points::kRest;
  using typename Points::Options;

  /// Several points are on one body. `ahead_of`: it closes only where it is ahead of that point along the plane's first
  /// direction (a leg that swings through is let pass; a touch is an event then, whatever the law).
  Contact(std::string name, const std::vector<Point>& points, const Point* ahead_of, const Options& options,
          const std::vector<int>& numbers, const ContactGround& ground = {})
      : ForceOf<Contact<Point, Ground>>("contact", std::move(name)),
        Points(points, ahead_of, options, static_cast<int>(numbers.size()), ground) {
    this->append_coordinates(points.front().coordinates());
    this->append_coordinates(ground.carrier);
    this->append_numbers(numbers);
    for (const Point& point : points) this->append_numbers(point.numbers());
    if (ahead_of) {
      this->append_coordinates(ahead_of->coordinates());
      this->append_numbers(ahead_of->numbers());
    }
    if (ground.road) this->append_numbers(ground.road->numbers());
  }

  int states() const override { return count() * own_states() + (options_.energy ? 1 : 0); }
  std::string state_name(int i) const override {
    if (i == count() * own_states()) return "energy_lost";
    const int k = i % own_states();
    const std::string name =
        latches_ && k == 0 ? "approach_speed" : "bristle" + std::to_string(k - (latches_ ? 1 : 0) + 1);
    return name + of_point(i / own_states(), "_");
  }
  std::string state_unit(int i) const override {
    if (i == count() * own_states()) return "J";
    return latches_ && i % own_states() == 0 ? "m/s" : "m";
  }
  int initial_state_number(int i) const override {
    return i < count() * own_states() && latches_ && i % own_states() == 0 ? kApproach : kRest;
  }

  template <class S>
  void physics(const S& t, const S* q, const S* v, const S* z, const S* p, S* Q, S* zdot) const {
    const ContactArguments<S> x{t, q, v, z, p};
    for (int i = 0; i < count(); ++i) add_point(i, x, Q, zdot);
  }

  bool may_rest() const override { return latches_ || !on_road; }
  double calc_rest(const LocalState& s, double* slopes) const override { return this->rest_of(s, slopes); }
  std::vector<int> states_that_wake() const override { return this->latch_states(); }

  // Derivative blocks: by the chain rule (contact_chain.h), or one pass of dual numbers a point that touches; none
  // where nothing does.
  void calc_partials(const LocalState& s, ForcePartials out) const override {
    if constexpr (Points::by_chain) {
      for (LocalMatrix* m : {&out.Q_q, &out.Q_v, &out.Q_z, &out.f_q, &out.f_v, &out.f_z}) m->setZero();
      for (int i = 0; i < count(); ++i)
        if (touches(i, arguments(s))) this->add_chained_partials(i, s, out);
      return;
    }
    constexpr int carrier = on_road && dim == 2 ? 3 : 0, rigid = (dim == 2 ? 3 : 7) + carrier;
    if (size() <= rigid)
      partials<rigid>(s, out);
    else
      partials<Point::kMaxCoordinates + carrier>(s, out);
  }
  void calc_number_partial(const LocalState& s, int number, double* Q_p, double* f_p) const override {
    if (of_road(number)) return Force::calc_number_partial(s, number, Q_p, f_p);
    std::fill(Q_p, Q_p + this->coordinates().size(), 0.0);
    std::fill(f_p, f_p + states(), 0.0);
    number_partials<1>(s, &number, 1, [&](int, const auto* Q, const auto* f) {
      for (int r = 0; r < size(); ++r) Q_p[r] = Q[r].d[0];
      for (int r = 0; r < states(); ++r) f_p[r] = f[r].d[0];
    });
  }
  void add_number_gradient(const LocalState& s, const double* w_Q, const double* w_f, const int* numbers, int n,
                           double* out) const override {
    constexpr int width = 6;
    if constexpr (Points::by_chain) {
      int chained[width], where[width], m = 0;
      for (int j = 0; j < n; ++j) {
        if (this->is_chained(numbers[j])) {
          chained[m] = numbers[j];
          where[m++] = j;
        } else {
          double one = 0;
          Force::add_number_gradient(s, w_Q, w_f, numbers + j, 1, &one);
          out[j] += one;
        }
        if (m < width && j + 1 < n) continue;
        for (int i = 0; m > 0 && i < count(); ++i)
          if (touches(i, arguments(s)))
            this->template add_chained_gradient<width>(i, s, w_Q, w_f, chained, where, m, out);
        m = 0;
      }
      return;
    }
    for (int first = 0; first < n; first += width)
      number_partials<width>(s, numbers + first, std::min(width, n - first), [&](int j, const auto* Q, const auto* f) {
        const auto at = static_cast<std::size_t>(j);
        for (int r = 0; w_Q && r < size(); ++r) out[first + j] += w_Q[r] * Q[r].d[at];
        for (int r = 0; w_f && r < states(); ++r) out[first + j] += w_f[r] * f[r].d[at];
      });
    for (int j = 0; j < n; ++j)
      if (of_road(numbers[j]) && touches_anywhere(s)) Force::add_number_gradient(s, w_Q, w_f, numbers + j, 1, out + j);
  }

  // Events: the touch, and the end of the contact where the gap opens again. The force has ended before, or ends there.
  int guard_count() const override { return latches_ || has_bristles(options_.friction) ? 2 * count() : 0; }
  std::string guard_name(int k) const override { return (k % 2 == 0 ? "touch" : "release") + of_point(k / 2, " "); }
  std::string mode_behind(int k) const override { return k % 2 == 0 ? "closed" : "open"; }
  int guard_direction(int k) const override { return k % 2 == 0 ? -1 : 1; }
  bool guard_armed(int k, const double* z) const override {
    if (!latches_) return k % 2 == 1;  // nothing is latched at the touch; bristles start anew behind a release
    return (z[k / 2 * own_states()] > 0) == (k % 2 == 1);
  }
  bool force_jumps(int k) const override { return k % 2 == 0 && options_.law == NormalLaw::kelvin_voigt; }
  bool latches_speed(int k) const override { return k % 2 == 0 && latches_ && uses_latched_speed(options_.law); }
  std::string past_at_start(int k) const override {
    if (!latches_) return {};
    return k % 2 == 0 ? "a contact that is closed at the start needs an 'approach_speed_m_per_s' above 0, the speed it "
                        "was closed with."
                      : "a contact that is open at the start has no 'approach_speed_m_per_s'.";
  }
  PathDual guard(int k, const MeasureArguments& x) const override {
    if (k % 2 == 0 && !is_ahead(k / 2, x.q, x.p)) return PathDual(std::nan(""));
    return gap(k / 2, arguments(x));
  }
  double guard_value(int k, const LocalState& s) const override {
    if (k % 2 == 0 && !is_ahead(k / 2, s.q, s.p)) return std::nan("");
    return gap(k / 2, arguments(s));
  }
  Other other(int k, const LocalState& s) const override {
    return k % 2 == 0 ? this->other_of(k / 2, s) : Other{std::nan(""), std::nan("")};
  }
  int gap_count() const override { return count(); }
  GapMotion gap_motion(int i, const LocalState& s) const override { return gap_motion_of(i, s); }
  bool gap_presses(int i, const double* z) const override { return !latches_ || z[i * own_states()] > 0; }
  double gap_force(int i, const LocalState& s) const override { return this->uncut_force_of(i, arguments(s)); }
  int gap_of_guard(int k) const override { return k / 2; }
  void add_open_at_start(const LocalState& s, std::vector<int>& states) const override {
    if (!latches_ || count() == 1) return;
    double of_all = 0;
    for (int c = 0; c < size(); ++c) of_all = std::max(of_all, std::abs(s.q[c]));
    std::vector<int> open;
    for (int i = 0; i < count(); ++i)
      if (gap(i, arguments(s)) > kTouches * of_all) open.push_back(i * own_states());
    if (static_cast<int>(open.size()) < count()) states.insert(states.end(), open.begin(), open.end());
  }
  double touch_exponent(const double* p) const override { return p[1]; }
  bool tells_bends() const override { return true; }
  void add_bends(const LocalState& s, std::vector<double>& beyond) const override {
    this->add_bends_of(arguments(s), beyond);
  }
  void transition(int k, const MeasureArguments& x, PathDual* z_after) const override {
    for (int i = 0; i < states(); ++i) z_after[i] = x.z[i];
    const int i = k / 2, first = i * own_states();
    for (int j = 0; j < own_states(); ++j) z_after[first + j] = PathDual(0.0);
    if (k % 2 == 0) z_after[first] = motion(i, arguments(x)).closing;
  }

  std::vector<Measure> measures() const override {
    std::vector<Measure> m{
        {"gap", "m", false},          {"penetration", "m", false},    {"penetration_rate", "m/s", false},
        {"normal_force", "N", false}, {"friction_force", "N", false}, {"slip_velocity", "m/s", false}};
    if (count() > 1) m.push_back({"centre_of_pressure", "m", false});
    if (options_.energy) m.push_back({"energy_lost", "J", false});
    return m;
  }
  /// Nothing that is let pass penetrates. Of several points: gap, penetration, its rate and the slip of the deepest;
  /// forces of all; the centre of pressure along the plane's first direction, of the deepest where nothing presses.
  PathDual measure(int i, const MeasureArguments& given) const override {
    const ContactArguments<PathDual> x = arguments(given);
    if (i == 6 && count() == 1) i = 7;
    if (i == 7) return x.z[count() * own_states()];
    if (i < 3 || i == 5) {
      const int k = deepest(x);
      const PathDual g = gap(k, x);
      if (i == 0) return g;
      if (i == 1) return touches(k, x) && value_of(g) < 0 ? -g : PathDual(0.0);
      const auto m = motion(k, x);
      if (i == 2) return m.closing;
      return tangents == 1 ? m.slip[0] : length(m.slip);
    }
    PathDual N(0.0), F[tangents] = {}, moment(0.0);
    for (int k = 0; k < count(); ++k) {
      Forces<PathDual> f;
      std::vector<PathDual> rates(static_cast<std::size_t>(states()) + 1);
      calc(k, x, f, rates.data());
      if (!f.touches) continue;
      N += f.normal;
      for (int j = 0; j < tangents; ++j) F[j] += f.friction[j];
      if (i == 6) moment += f.normal * along(k, x.q, x.p);
    }
    if (i == 3) return N;
    if (i == 6) return value_of(N) > 0 ? moment / N : along(deepest(x), x.q, x.p);
    return tangents == 1 ? F[0] : length(F);
  }
  double potential_energy(const LocalState& s) const override {
    double energy = 0;
    for (int i = 0; i < count(); ++i) {
      const double d = -gap(i, arguments(s)), n = options_.law == NormalLaw::linear ? 1 : s.p[1];
      if (d > 0 && (!latches_ || s.z[i * own_states()] > 0))
        energy += share(i, s.p) * stiffness(s.p) * std::pow(d, n + 1) / (n + 1);
    }
    return energy;
  }

 protected:
  // Of the coordinates: a gap that a start on the ground may leave.
  static constexpr double kTouches = 1e-9;
  using Points::count, Points::own_states, Points::of_point, Points::size, Points::gap, Points::gap_motion_of,
      Points::along, Points::motion, Points::touches, Points::is_ahead, Points::share, Points::stiffness,
      Points::arguments, Points::add_point, Points::calc, Points::options_, Points::latches_, Points::road_;
  template <class S>
  using Forces = typename Points::template Forces<S>;

  /// Laws of roads have derivatives by their numbers for path duals alone.
  bool of_road(int number) const { return on_road && number >= road_; }

  /// take(j, Q, zdot), the forces with their derivatives by n <= width numbers in the j-th directions; not called where
  /// nothing touches: they are zero.
  template <int width, class Take>
  void number_partials(const LocalState& s, const int* numbers, int n, const Take& take) const {
    using D = Dual<width>;
    D* p = nullptr;
    constexpr int most = Point::kMaxCoordinates + (on_road ? 3 : 0);
    D q[most], v[most], Q[most];
    std::vector<D> z, f;
    for (int i = 0; i < count(); ++i) {
      if (!touches(i, arguments(s))) continue;
      if (!p) {
        p = Points::template constants<D>(s.p, this->numbers().size());
        for (int j = 0; j < n; ++j) p[numbers[j]].d[static_cast<std::size_t>(j)] = 1;
        for (int j = 0; j < size(); ++j) {
          q[j] = D(s.q[j]);
          v[j] = D(s.v[j]);
        }
        z.assign(s.z, s.z + states());
        f.assign(z.size() + 1, D());
      }
      add_point(i, ContactArguments<D>{D(s.t), q, v, z.data(), p}, Q, f.data());
    }
    if (!p) return;
    for (int j = 0; j < n; ++j) take(j, Q, f.data());
  }
  bool touches_anywhere(const LocalState& s) const {
    for (int i = 0; i < count(); ++i)
      if (touches(i, arguments(s))) return true;
    return false;
  }
  int deepest(const ContactArguments<PathDual>& x) const {
    int k = 0;
    for (int i = 1; i < count(); ++i)
      if (value_of(gap(i, x)) < value_of(gap(k, x))) k = i;
    return k;
  }

  /// Of a vector along the plane, smooth at zero.
  static PathDual length(const PathDual* x) {
    using std::sqrt;
    PathDual square(1e-24);
    for (int k = 0; k < tangents; ++k) square += x[k] * x[k];
    return sqrt(square);
  }

  /// With room for nq coordinates.
  template <int nq>
  void partials(const LocalState& s, ForcePartials out) const {
    using D = Dual<2 * nq + 1 + tangents>;
    for (LocalMatrix* m : {&out.Q_q, &out.Q_v, &out.Q_z, &out.f_q, &out.f_v, &out.f_z}) m->setZero();
    const int n = size(), own = own_states(), end = count() * own;
    std::vector<D> z, f;
    const D* p = nullptr;
    for (int i = 0; i < count(); ++i) {
      if (!touches(i, arguments(s))) continue;
      D q[nq], v[nq], Q[nq];
      for (int j = 0; j < n; ++j) {
        q[j] = D::variable(s.q[j], j);
        v[j] = D::variable(s.v[j], nq + j);
      }
      z.assign(static_cast<std::size_t>(states()) + 1, D());
      f.assign(z.size(), D());
      for (int j = 0; j < own; ++j)
        z[static_cast<std::size_t>(i * own + j)] = D::variable(s.z[i * own + j], 2 * nq + j);
      if (!p) p = Points::template constants<D>(s.p, this->numbers().size());
      add_point(i, ContactArguments<D>{D(s.t), q, v, z.data(), p}, Q, f.data());
      for (int j = 0; j < n; ++j) {
        for (int r = 0; r < n; ++r) {
          out.Q_q(r, j) += Q[r].d[static_cast<std::size_t>(j)];
          out.Q_v(r, j) += Q[r].d[static_cast<std::size_t>(nq + j)];
        }
        for (int r = 0; r < states(); ++r) {
          const D& rate = f[static_cast<std::size_t>(r)];
          out.f_q(r, j) += rate.d[static_cast<std::size_t>(j)];
          out.f_v(r, j) += rate.d[static_cast<std::size_t>(nq + j)];
        }
      }
      for (int j = 0; j < own; ++j) {
        const auto at = static_cast<std::size_t>(2 * nq + j);
        for (int r = 0; r < n; ++r) out.Q_z(r, i * own + j) += Q[r].d[at];
        for (int r = 0; r < own; ++r)
          out.f_z(i * own + r, i * own + j) += f[static_cast<std::size_t>(i * own + r)].d[at];
        if (options_.energy) out.f_z(end, i * own + j) += f[static_cast<std::size_t>(end)].d[at];
      }
    }
  }
};

}  // namespace costate
