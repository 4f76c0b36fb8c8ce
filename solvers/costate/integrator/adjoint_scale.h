// How large an adjoint gets, for its absolute tolerances; it has nothing to do with the state's size. With
// mu' = ... - g_y it is about the integral of |g_y|, or what it begins with. Adjoints of velocities are smaller where
// the motion is fast: psi changes by mu_q dq + mu_v dv, and a velocity is a position over the time that the motion
// takes.
#pragma once

#include <functional>
#include <limits>
#include <vector>

#include "costate/formulation/system.h"

namespace costate {

/// Sizes of the adjoint's components, at least.
struct AdjointSize {
  double all = 0;
  double velocity_factor = 1;  // of velocities against the others
  double value = 0;            // psi's own size per position: rounding makes eps times that of an adjoint that is zero
  double least = 0;            // what of an adjoint is rounding, in any case
  double cost = 0;             // psi's own size, of what its parts amount to
};

/// Gathers the sizes on the way forward: integrals, as steps crowd where a cost is short and large.
class AdjointScale {
 public:
  /// At each evaluation of the running cost g, in order of time but for attempts that are repeated: whether g_y is to
  /// be looked at, by sample(); now and then, and where g has become another.
  bool is_due(double t, double g);
  void sample(const double* y, const std::vector<double>& g_y, const std::vector<Unknown>& unknowns);
  /// Derivatives by reactions count in this unit of force: what these depend on is as small as they are.
  void measure_forces_in(double unit) { force_ = unit; }
  /// Another segment of the same run, over `span`, behind those before it.
  void add_segment(const AdjointScale& other, double span);
  /// With what add_segment() gathered, or for one segment alone.
  AdjointSize size() const;
  AdjointSize size(double span) const;
  /// The same of a cost with a terminal part, too, at the last state y.
  AdjointSize with_terminal(double cost, const double* y, const std::vector<Unknown>& unknowns) const;
  /// The largest position met.
  double position() const { return position_; }

 private:
  double gradient_ = 0, integral_ = 0;  // integral of the largest |g_y|; that of the segments
  double cost_ = 0, value_ = 0;         // integral of |g|; that of the segments
  double position_ = 0, velocity_ = 0;  // largest met
  double force_ = 1;
  // The last evaluation, the one before it, and how the last one began; t_ is not a number before the first.
  double t_ = std::numeric_limits<double>::quiet_NaN(), step_ = 0, gradient_before_ = 0, cost_before_ = 0;
  double sampled_gradient_ = 0, sampled_cost_ = 0, largest_cost_ = 0;  // of the last sample; met
  double first_ = 0, at_first_ = 0, cost_at_first_ = 0;
  long evaluations_ = 0, samples_ = 0;
};

/// What rounding makes of g_y at y, its largest component; of unknowns that are algebraic what is below `atol` of their
/// sizes is no more than that. Where a cost is stationary (the square of an output that rests at zero) this may be all
/// there is of it: the adjoint is then driven by noise, which no step follows.
double rounding_of_cost_gradient(System& system, const double* y, double atol,
                                 const std::function<void(const double* y, double* g_y)>& gradient);

/// What adjoints of unlike unknowns are compared in. Beside lengths those of angles count per the mechanism's length:
/// an angle's adjoint in a small mechanism would be below the tolerance of its lengths' adjoints.
struct AdjointUnits {
  AdjointUnits() = default;
  explicit AdjointUnits(const System& system);
  std::vector<double> levers;  // of each unknown: what an adjoint is per that of a length of the same effect on psi
  double least_position = 0;   // positions that are less are rounding
  // Of each unknown: adjoints of accelerations are those of velocities over masses, which beside light ones are larger
  // than their tolerance knows; of others 1.
  std::vector<double> lightness;
};

/// Absolute tolerances for an adjoint that begins with mu (unknowns outside the norm get `unweighted`); returns the
/// largest size of a component, in these units.
double set_adjoint_tolerances(const std::vector<Unknown>& unknowns, const AdjointUnits& units,
                              const std::vector<double>& mu, const AdjointSize& expected, double rtol,
                              double unweighted, double* atol);

/// Absolute tolerances for the gradient's integral, an entry a parameter: an adjoint of the size that
/// set_adjoint_tolerances() returns acts on positions of the size in y, per the parameter's scale; where there are none
/// (a driver for each freedom) of psi's size.
void set_gradient_tolerances(const System& system, const AdjointUnits& units, const double* y, double adjoint_size,
                             double cost, double rtol, double* atol);

}  // namespace costate
