// The three kinds of physical things a mechanism is made of: bodies (inertia), constraints (joints, drivers)
// and forces. An element states its physics once, on its own local coordinates and numbers; it knows neither
// global indices nor other elements nor time stepping. From the templated physics the base classes derive
// every derivative block by dual numbers (exact); a derived class overrides them by hand where that pays.
//
// Local shapes: nq = coordinates().size(), np = numbers().size(), nr = rows(), nz = states().
// All output blocks are zero on entry and column-major.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "costate/derivative/dual.h"

namespace costate {

using LocalMatrix = Eigen::Map<Eigen::MatrixXd>;

/// The arguments of a kernel, gathered to the element's own numbering.
struct LocalState {
  double t = 0;                    // s
  const double* q = nullptr;       // generalized coordinates, nq
  const double* v = nullptr;       // velocities, nq
  const double* a = nullptr;       // accelerations, nq
  const double* lambda = nullptr;  // multipliers of the element's own rows, nr
  const double* z = nullptr;       // states of a force, nz
  const double* p = nullptr;       // numbers (mass, length, stiffness, ...), np
};

/// The arguments of a measure: everything local.
template <class S>
struct MeasureArgumentsOf {
  S t;
  const S* q = nullptr;
  const S* v = nullptr;
  const S* a = nullptr;
  const S* lambda = nullptr;
  const S* z = nullptr;
  const S* p = nullptr;
};
/// On path duals (only the dual part is seeded).
using MeasureArguments = MeasureArgumentsOf<PathDual>;
using ValueArguments = MeasureArgumentsOf<double>;

/// A scalar that an element can report: "length" in m, "force" in N.
struct Measure {
  std::string name, unit;
  bool needs_accelerations = false;  // depends on accelerations or multipliers
};

/// What every element has: a name, its coordinates and its numbers (as indices into the mechanism's tables).
class Element {
 public:
  Element(std::string kind, std::string name) : kind_(std::move(kind)), name_(std::move(name)) {}
  Element(const Element&) = delete;
  Element& operator=(const Element&) = delete;
  virtual ~Element() = default;

  const std::string& kind() const { return kind_; }  // "bar", "spring", ...
  const std::string& name() const { return name_; }  // "A1"
  std::string path() const { return kind_ + "." + name_; }
  const std::vector<int>& coordinates() const { return coordinates_; }
  const std::vector<int>& numbers() const { return numbers_; }

  /// Whether all derivative blocks are hand-written; the checker lists those that are not yet.
  virtual bool by_hand() const { return false; }

  /// Scalars this element can report, as outputs "NAME.measure" and in costs.
  virtual std::vector<Measure> measures() const { return {}; }
  virtual PathDual measure(int, const MeasureArguments&) const { return {}; }
  /// The same on plain numbers, which cost a tenth; false of elements that have it on path duals alone.
  virtual bool measure_value(int, const ValueArguments&, double&) const { return false; }

 protected:
  void append_coordinates(const std::vector<int>& c) { coordinates_.insert(coordinates_.end(), c.begin(), c.end()); }
  void append_numbers(const std::vector<int>& n) { numbers_.insert(numbers_.end(), n.begin(), n.end()); }

 private:
  std::string kind_, name_;
  std::vector<int> coordinates_, numbers_;
};

/// Inertia and what comes with it (gyroscopic terms, weight). Its residual is r = M(q, p) a - Q(q, v, p).
class Body : public Element {
 public:
  using Element::Element;

  /// r, evaluated on path duals: the oracle and the default of every block below.
  virtual void residual(const PathDual* q, const PathDual* v, const PathDual* a, const PathDual* p,
                        PathDual* r) const = 0;

  virtual void calc_mass(const LocalState& s, LocalMatrix& M) const;                          // nq x nq
  virtual void calc_force(const LocalState& s, double* Q) const;                              // nq
  virtual void calc_partials(const LocalState& s, LocalMatrix& r_q, LocalMatrix& r_v) const;  // nq x nq each
  virtual void calc_number_partial(const LocalState& s, int number, double* r_p) const;       // nq
  /// True when M depends neither on q nor on time, so that it is assembled once per parameter set.
  virtual bool constant_mass() const { return false; }
  /// True when calc_force returns zero velocity derivatives and r_q = 0 (constant mass, constant weight).
  virtual bool constant_force() const { return false; }
  virtual double potential_energy(const LocalState&) const { return 0; }  // J
};

/// Weights of a constraint's values and of its reaction phi_q^T lambda, for derivatives of their weighted sum.
struct ConstraintWeights {
  const double *phi, *phid, *phidd;  // nr each
  const double* reaction = nullptr;  // nq, or null
};

/// Equations phi(t, q, p) = 0 with one multiplier a row; the reaction enters as M a + phi_q^T lambda = Q.
class Constraint : public Element {
 public:
  using Element::Element;
  virtual int rows() const = 0;
  /// "length", "x", ...: what row i keeps.
  virtual std::string row_name(int i) const = 0;
  /// Whether phi changes with time by itself: of others neither phi_t nor phi_tt is asked for.
  virtual bool rheonomic() const { return false; }
  /// Appends the times at which phi_t jumps, for the element's numbers p.
  virtual void add_kinks(const double*, std::vector<double>&) const {}
  /// Appends times at which phi_tt alone jumps, where the numbers p decide when.
  virtual void add_acceleration_jumps(const double*, std::vector<double>&) const {}
  /// The same where phi_ttt is the first to jump: the derivative of phi_tt by what moves the time jumps there.
  virtual void add_third_jumps(const double*, std::vector<double>&) const {}
  /// slopes[k] += dt/dp_k of such a time t.
  virtual void add_time_slopes(double, const double*, double*) const {}

  virtual void phi(const PathDual& t, const PathDual* q, const PathDual* p, PathDual* out) const = 0;
  /// The same with the change of everything along a direction: what Hessians need. Throws CapabilityError where it is
  /// not provided; ConstraintOf provides it.
  virtual void phi_directed(const DirectedPathDual& t, const DirectedPathDual* q, const DirectedPathDual* p,
                            DirectedPathDual* out) const;

  virtual void calc_phi(const LocalState& s, double* phi) const;           // nr
  virtual void calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const;  // nr x nq
  virtual void calc_phi_t(const LocalState& s, double* phi_t) const;       // nr
  /// Second time derivative of phi at a = 0: (phi_q v)_q v + 2 phi_qt v + phi_tt.
  virtual void calc_bias(const LocalState& s, double* bias) const;  // nr
  /// hessian = (phi_q^T lambda)_q (nq x nq), phid_q = d(phidot)/dq and phidd_q = d(phiddot)/dq at v, a (nr x nq).
  virtual void calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                             LocalMatrix& phidd_q) const;
  /// With respect to number k: phi, phidot, phiddot (nr each) and phi_q^T lambda (nq).
  virtual void calc_number_partial(const LocalState& s, int number, double* phi_p, double* phid_p, double* phidd_p,
                                   double* reaction_p) const;
  /// Derivative of phi.w + phidot.w + phiddot.w + (phi_q^T lambda).w with respect to number k, all at (t, q, v, a,
  /// lambda).
  virtual double calc_number_gradient(const LocalState& s, int number, const ConstraintWeights& w) const;
  /// Only hessian: what the index-2 stabilising multiplier needs.
  virtual void calc_hessian(const LocalState& s, LocalMatrix& hessian) const;
};

/// The derivative blocks of a force element.
struct ForcePartials {
  LocalMatrix& Q_q;  // nq x nq
  LocalMatrix& Q_v;  // nq x nq
  LocalMatrix& Q_z;  // nq x nz
  LocalMatrix& f_q;  // nz x nq, f = zdot
  LocalMatrix& f_v;  // nz x nq
  LocalMatrix& f_z;  // nz x nz
};

/// A generalized force Q(t, q, v, z, p), possibly with states of its own, zdot = f(t, q, v, z, p). What it does by time
/// is searched for at the start of each run, so that no step passes over a pulse of more than 1e-4 of it; a
/// CourseElement (element/course.h) tells its places itself, and what jumps is a guarded_force.h.
class Force : public Element {
 public:
  using Element::Element;
  virtual int states() const { return 0; }
  virtual std::string state_name(int i) const { return "z" + std::to_string(i); }
  virtual std::string state_unit(int) const { return "1"; }
  /// Index into this element's local numbers of the initial value of state i.
  virtual int initial_state_number(int) const { return -1; }

  virtual void force(const PathDual& t, const PathDual* q, const PathDual* v, const PathDual* z, const PathDual* p,
                     PathDual* Q, PathDual* zdot) const = 0;

  virtual void calc_force(const LocalState& s, double* Q, double* zdot) const;
  virtual void calc_partials(const LocalState& s, ForcePartials out) const;
  virtual void calc_number_partial(const LocalState& s, int number, double* Q_p, double* f_p) const;
  /// out[i] += Q_k.w_Q + f_k.w_f for the numbers k = numbers[i]; w_Q has nq entries, w_f nz, either may be null.
  virtual void add_number_gradient(const LocalState& s, const double* w_Q, const double* w_f, const int* numbers,
                                   int count, double* out) const;
  virtual double potential_energy(const LocalState&) const { return 0; }  // J

  /// Whether it rests somewhere: vanishes with its rates and all derivatives, so that it need not be evaluated there.
  virtual bool may_rest() const { return false; }
  /// A region of rest about q: with the result d and the slopes L (nq, zero on entry) it is where sum_j L_j |q'_j -
  /// q_j| < d, whatever t and v, while none of states_that_wake() is above zero. 0 where it acts, or might.
  virtual double calc_rest(const LocalState&, double*) const { return 0; }
  virtual std::vector<int> states_that_wake() const { return {}; }
};

/// Mixins: a class derives from BodyOf<Derived> (...) and writes its physics as one template.
template <class Derived>
class BodyOf : public Body {
 public:
  using Body::Body;
  /// Derived provides: template <class S> void physics(const S* q, const S* v, const S* a, const S* p, S* r)
  void residual(const PathDual* q, const PathDual* v, const PathDual* a, const PathDual* p,
                PathDual* r) const override {
    static_cast<const Derived*>(this)->template physics<PathDual>(q, v, a, p, r);
  }
};

template <class Derived>
class ConstraintOf : public Constraint {
 public:
  using Constraint::Constraint;
  /// Derived provides: template <class S> void physics(const S& t, const S* q, const S* p, S* phi)
  void phi(const PathDual& t, const PathDual* q, const PathDual* p, PathDual* out) const override {
    static_cast<const Derived*>(this)->template physics<PathDual>(t, q, p, out);
  }
  void phi_directed(const DirectedPathDual& t, const DirectedPathDual* q, const DirectedPathDual* p,
                    DirectedPathDual* out) const override {
    static_cast<const Derived*>(this)->template physics<DirectedPathDual>(t, q, p, out);
  }
  void calc_phi(const LocalState& s, double* out) const override {
    static_cast<const Derived*>(this)->template physics<double>(s.t, s.q, s.p, out);
  }
};

template <class Derived>
class ForceOf : public Force {
 public:
  using Force::Force;
  /// Derived provides: template <class S> void physics(const S& t, const S* q, const S* v, const S* z,
  ///                                                  const S* p, S* Q, S* zdot)
  void force(const PathDual& t, const PathDual* q, const PathDual* v, const PathDual* z, const PathDual* p, PathDual* Q,
             PathDual* zdot) const override {
    static_cast<const Derived*>(this)->template physics<PathDual>(t, q, v, z, p, Q, zdot);
  }
  void calc_force(const LocalState& s, double* Q, double* zdot) const override {
    static_cast<const Derived*>(this)->template physics<double>(s.t, s.q, s.v, s.z, s.p, Q, zdot);
  }
};

/// Upper bound of local coordinates, rows and states of one element (kernels work on the stack).
inline constexpr int kMaxLocal = 32;

}  // namespace costate
