// Compliant contact with a plane of the ground: of a point, of an arc or a sphere about it (contact_surface.h), or of
// several of these on one body, each with a share of the normal law: the corners of a box, the points of a patch (an
// elastic foundation). With the depth d, forces by contact_laws.h at each; where it is round, a moment resists rolling
// and spinning, M = -c N omega/|omega| tanh(|omega|/omega_s).
// States, point by point: the approach speed where the touch is an event (0: open), then the bristles of friction; at
// the end the energy lost, where it is asked for:
//   E' = (N - K d^n) ddot - F.v_t - M.omega,
// what the bodies gave and the elastic part of the normal force does not hold (bristles count as lost).
// Numbers: K, n, e, C, those of friction, h, alpha, R, the initial approach speed, zero (what starts at rest), those of
// rolling; Young's moduli and Poisson's ratios of body and ground, which in the place of K give Hertz's, 4/3 E*
// sqrt(R), 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2; a share a point where there are several; those of the points.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "costate/element/force/contact_laws.h"
#include "costate/element/force/contact_surface.h"
#include "costate/element/guarded_force.h"

namespace costate {

template <class Point>
class Contact final : public ForceOf<Contact<Point>>, public GuardedForce {
 public:
  using Surface = ContactSurface<Point>;
  static constexpr int dim = Surface::dim, tangents = Surface::tangents, turns = Surface::turns;
  static constexpr int kFriction = 4, kGround = kFriction + kFrictionNumbers, kApproach = kGround + Surface::kNumbers,
                       kRest = kApproach + 1, kRolling = kRest + 1, kSpinning = kRolling + 1, kTurnSpeed = kRolling + 2,
                       kMaterial = kRolling + 3, kNumbers = kMaterial + 4;
  enum class Material { none, body, both };  // whether Hertz's stiffness is that of materials

  struct Options {
    NormalLaw law = NormalLaw::hertz;
    FrictionModel friction = FrictionModel::none;
    bool round = false, rolling = false, energy = false;
    Material material = Material::none;
  };

  /// Several points are on one body. `ahead_of`: it closes only where it is ahead of that point along the plane's first
  /// direction (a leg that swings through is let pass; a touch is an event then, whatever the law).
  Contact(std::string name, const std::vector<Point>& points, const Point* ahead_of, const Options& options,
          const std::vector<int>& numbers)
      : ForceOf<Contact<Point>>("contact", std::move(name)),
        options_(options),
        latches_(latches(options.law) || ahead_of != nullptr) {
    this->append_coordinates(points.front().coordinates());
    this->append_numbers(numbers);
    int at = static_cast<int>(numbers.size());
    for (const Point& point : points) {
      surfaces_.push_back({Surface(point, options.round), at});
      this->append_numbers(point.numbers());
      at += static_cast<int>(point.numbers().size());
    }
    if (!ahead_of) return;
    ahead_of_.push_back({Surface(*ahead_of, false), at});
    this->append_coordinates(ahead_of->coordinates());
    this->append_numbers(ahead_of->numbers());
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
  void physics(const S&, const S* q, const S* v, const S* z, const S* p, S* Q, S* zdot) const {
    for (int i = 0; i < count(); ++i) add_point(i, q, v, z, p, Q, zdot);
  }

  // Derivative blocks: one pass of dual numbers a point that touches, and none where nothing does.
  void calc_partials(const LocalState& s, ForcePartials out) const override {
    constexpr int rigid = dim == 2 ? 3 : 7;
    if (surfaces_.front().surface.point().size() <= rigid)
      partials<rigid>(s, out);
    else
      partials<Point::kMaxCoordinates>(s, out);
  }
  void calc_number_partial(const LocalState& s, int number, double* Q_p, double* f_p) const override {
    std::fill(Q_p, Q_p + this->coordinates().size(), 0.0);
    std::fill(f_p, f_p + states(), 0.0);
    number_partials<1>(s, &number, 1, [&](int, const auto* Q, const auto* f) {
      for (int r = 0; r < surfaces_.front().surface.point().size(); ++r) Q_p[r] = Q[r].d[0];
      for (int r = 0; r < states(); ++r) f_p[r] = f[r].d[0];
    });
  }
  void add_number_gradient(const LocalState& s, const double* w_Q, const double* w_f, const int* numbers, int n,
                           double* out) const override {
    constexpr int width = 6;
    for (int first = 0; first < n; first += width)
      number_partials<width>(s, numbers + first, std::min(width, n - first), [&](int j, const auto* Q, const auto* f) {
        const auto at = static_cast<std::size_t>(j);
        for (int r = 0; w_Q && r < surfaces_.front().surface.point().size(); ++r) out[first + j] += w_Q[r] * Q[r].d[at];
        for (int r = 0; w_f && r < states(); ++r) out[first + j] += w_f[r] * f[r].d[at];
      });
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
  std::string past_at_start(int k) const override {
    if (!latches_) return {};
    return k % 2 == 0
               ? "a contact that is closed at the start needs 'approach_speed_m_per_s', the speed it was closed with."
               : "a contact that is open at the start has no 'approach_speed_m_per_s'.";
  }
  PathDual guard(int k, const MeasureArguments& x) const override {
    if (k % 2 == 0 && !is_ahead(k / 2, x.q, x.p)) return PathDual(std::nan(""));
    return gap(k / 2, x.q, x.p);
  }
  double guard_value(int k, const LocalState& s) const override {
    if (k % 2 == 0 && !is_ahead(k / 2, s.q, s.p)) return std::nan("");
    return gap(k / 2, s.q, s.p);
  }
  void transition(int k, const MeasureArguments& x, PathDual* z_after) const override {
    for (int i = 0; i < states(); ++i) z_after[i] = x.z[i];
    const int i = k / 2, first = i * own_states();
    for (int j = 0; j < own_states(); ++j) z_after[first + j] = PathDual(0.0);
    if (k % 2 == 0) z_after[first] = motion(i, x.q, x.v, x.p).closing;
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
  PathDual measure(int i, const MeasureArguments& x) const override {
    if (i == 6 && count() == 1) i = 7;
    if (i == 7) return x.z[count() * own_states()];
    if (i < 3 || i == 5) {
      const int k = deepest(x.q, x.p);
      const PathDual g = gap(k, x.q, x.p);
      if (i == 0) return g;
      if (i == 1) return touches(k, x.q, x.z, x.p) && value_of(g) < 0 ? -g : PathDual(0.0);
      const auto m = motion(k, x.q, x.v, x.p);
      if (i == 2) return m.closing;
      return tangents == 1 ? m.slip[0] : length(m.slip);
    }
    PathDual N(0.0), F[tangents] = {}, moment(0.0);
    for (int k = 0; k < count(); ++k) {
      Forces<PathDual> f;
      std::vector<PathDual> rates(static_cast<std::size_t>(states()) + 1);
      calc(k, x.q, x.v, x.z, x.p, f, rates.data());
      if (!f.touches) continue;
      N += f.normal;
      for (int j = 0; j < tangents; ++j) F[j] += f.friction[j];
      if (i == 6) moment += f.normal * along(k, x.q, x.p);
    }
    if (i == 3) return N;
    if (i == 6) return value_of(N) > 0 ? moment / N : along(deepest(x.q, x.p), x.q, x.p);
    return tangents == 1 ? F[0] : length(F);
  }
  double potential_energy(const LocalState& s) const override {
    double energy = 0;
    for (int i = 0; i < count(); ++i) {
      const double d = -gap(i, s.q, s.p), n = options_.law == NormalLaw::linear ? 1 : s.p[1];
      if (d > 0 && (!latches_ || s.z[i * own_states()] > 0))
        energy += share(i, s.p) * stiffness(s.p) * std::pow(d, n + 1) / (n + 1);
    }
    return energy;
  }

 private:
  struct At {
    Surface surface;
    int numbers;  // where those of its point begin
  };
  template <class S>
  struct Forces {
    S normal{}, friction[tangents] = {}, moment[turns] = {}, lost{};
    bool touches = false;
  };

  int count() const { return static_cast<int>(surfaces_.size()); }
  int own_states() const { return (latches_ ? 1 : 0) + (has_bristles(options_.friction) ? tangents : 0); }
  std::string of_point(int i, const char* join) const {
    return count() == 1 ? std::string() : join + surfaces_[static_cast<std::size_t>(i)].surface.point().name();
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
  S gap(int i, const S* q, const S* p) const {
    return surfaces_[static_cast<std::size_t>(i)].surface.gap(q, p + kGround, point_numbers(i, p));
  }
  template <class S>
  S along(int i, const S* q, const S* p) const {
    return surfaces_[static_cast<std::size_t>(i)].surface.along(0, q, p + kGround, point_numbers(i, p));
  }
  template <class S>
  typename Surface::template Motion<S> motion(int i, const S* q, const S* v, const S* p) const {
    typename Surface::template Motion<S> m;
    surfaces_[static_cast<std::size_t>(i)].surface.motion(q, v, p + kGround, point_numbers(i, p), m);
    return m;
  }
  template <class S>
  bool is_ahead(int i, const S* q, const S* p) const {
    if (ahead_of_.empty()) return true;
    const At& other = ahead_of_.front();
    const S* own = q + surfaces_.front().surface.point().size();
    return value_of(along(i, q, p)) > value_of(other.surface.along(0, own, p + kGround, p + other.numbers));
  }
  template <class S>
  bool touches(int i, const S* q, const S* z, const S* p) const {
    return latches_ ? value_of(z[i * own_states()]) > 0 : value_of(gap(i, q, p)) < 0;
  }
  /// The numbers as constants, in a buffer of the thread.
  template <class S>
  S* constants(const double* p) const {
    thread_local std::vector<S> buffer;
    const std::size_t n = this->numbers().size();
    if (buffer.size() < n) buffer.resize(n);
    for (std::size_t i = 0; i < n; ++i) buffer[i] = S(p[i]);
    return buffer.data();
  }

  /// take(j, Q, zdot), the forces with their derivatives by n <= width numbers in the j-th directions; not called where
  /// nothing touches: they are zero.
  template <int width, class Take>
  void number_partials(const LocalState& s, const int* numbers, int n, const Take& take) const {
    using D = Dual<width>;
    D* p = nullptr;
    D q[Point::kMaxCoordinates], v[Point::kMaxCoordinates], Q[Point::kMaxCoordinates];
    std::vector<D> z, f;
    for (int i = 0; i < count(); ++i) {
      if (!touches(i, s.q, s.z, s.p)) continue;
      if (!p) {
        p = constants<D>(s.p);
        for (int j = 0; j < n; ++j) p[numbers[j]].d[static_cast<std::size_t>(j)] = 1;
        for (int j = 0; j < surfaces_.front().surface.point().size(); ++j) {
          q[j] = D(s.q[j]);
          v[j] = D(s.v[j]);
        }
        z.assign(s.z, s.z + states());
        f.assign(z.size() + 1, D());
      }
      add_point(i, q, v, z.data(), p, Q, f.data());
    }
    if (!p) return;
    for (int j = 0; j < n; ++j) take(j, Q, f.data());
  }
  int deepest(const PathDual* q, const PathDual* p) const {
    int k = 0;
    for (int i = 1; i < count(); ++i)
      if (value_of(gap(i, q, p)) < value_of(gap(k, q, p))) k = i;
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
    const int n = surfaces_.front().surface.point().size(), own = own_states(), end = count() * own;
    std::vector<D> z, f;
    const D* p = nullptr;
    for (int i = 0; i < count(); ++i) {
      if (!touches(i, s.q, s.z, s.p)) continue;
      D q[nq], v[nq], Q[nq];
      for (int j = 0; j < n; ++j) {
        q[j] = D::variable(s.q[j], j);
        v[j] = D::variable(s.v[j], nq + j);
      }
      z.assign(static_cast<std::size_t>(states()) + 1, D());
      f.assign(z.size(), D());
      for (int j = 0; j < own; ++j)
        z[static_cast<std::size_t>(i * own + j)] = D::variable(s.z[i * own + j], 2 * nq + j);
      if (!p) p = constants<D>(s.p);
      add_point(i, q, v, z.data(), p, Q, f.data());
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

  template <class S>
  void add_point(int i, const S* q, const S* v, const S* z, const S* p, S* Q, S* zdot) const {
    Forces<S> f;
    calc(i, q, v, z, p, f, zdot);
    if (!f.touches) return;
    surfaces_[static_cast<std::size_t>(i)].surface.add_force(q, p + kGround, point_numbers(i, p), f.normal, f.friction,
                                                             f.moment, Q);
    if (options_.energy) zdot[count() * own_states()] += f.lost;
  }

  template <class S>
  void calc(int i, const S* q, const S* v, const S* z, const S* p, Forces<S>& f, S* zdot) const {
    const int first = i * own_states(), bristles = first + (latches_ ? 1 : 0);
    f.touches = touches(i, q, z, p);
    if (!f.touches) return;
    const S depth = -gap(i, q, p);
    // Within a step that ends at the release the gap is open already: the law goes on, and is zero there.
    const auto m = motion(i, q, v, p);
    const S law[4] = {stiffness(p), p[1], p[2], p[3]};
    f.normal = share(i, p) * normal_force(options_.law, law, depth, m.closing, latches_ ? z[first] : depth);
    if (options_.friction != FrictionModel::none)
      friction_force(options_.friction, tangents, p + kFriction, f.normal, m.slip, z + bristles, f.friction,
                     zdot + bristles);
    if (options_.rolling) turning_moment(m.omega, p, f.normal, f.moment);
    if (!options_.energy) return;
    f.lost = (f.normal - share(i, p) * elastic_force(options_.law, law, depth)) * m.closing;
    for (int k = 0; k < tangents; ++k) f.lost -= f.friction[k] * m.slip[k];
    for (int k = 0; k < turns; ++k) f.lost -= f.moment[k] * m.omega[k];
  }

  /// Against rolling, and in space against spinning about the normal.
  template <class S>
  static void turning_moment(const S* omega, const S* p, const S& N, S* moment) {
    using std::sqrt;
    using std::tanh;
    const S& scale = p[kTurnSpeed];
    const auto factor = [&](const S& square, const S& arm) {
      const S speed = sqrt(square + S(1e-12) * scale * scale);
      return arm * N * tanh(speed / scale) / speed;
    };
    if constexpr (dim == 2) {
      moment[0] = -(factor(omega[0] * omega[0], p[kRolling]) * omega[0]);
    } else {
      S n[3], t[2][3], roll[3], square(0.0);
      Surface::frame(p + kGround, n, t);
      const S spin = dot3(n, omega);
      for (int i = 0; i < 3; ++i) {
        roll[i] = omega[i] - spin * n[i];
        square += roll[i] * roll[i];
      }
      const S rolling = factor(square, p[kRolling]), spinning = factor(spin * spin, p[kSpinning]);
      for (int i = 0; i < 3; ++i) moment[i] = -(rolling * roll[i]) - spinning * spin * n[i];
    }
  }

  std::vector<At> surfaces_, ahead_of_;
  Options options_;
  bool latches_;
};

}  // namespace costate
