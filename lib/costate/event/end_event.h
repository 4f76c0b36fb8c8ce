// The end of a run where an output crosses a level: [run] ends_when. With x = (q, v, z), h = output - level, the
// running cost g and the terminal one w, at the end time te (lib/README.md (17.5)):
//   dte = -(h_x dx + h_rho drho)/h',   h' = h_t + h_x f
//   dpsi = w_x dx + w_rho drho + (g + w') dte = (w + kappa h)_x dx + (w + kappa h)_rho drho,   kappa = -(g + w')/h'
// so that the derivative is that of a run to the fixed time te whose terminal cost holds kappa h besides, whatever the
// formulation and the method.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>

#include "costate/objective/objective.h"

namespace costate {

/// What ends a run: `output` rises to the level (above), or falls to it (below).
struct EndEvent {
  std::shared_ptr<const Output> output;
  bool above = true;
  int level_number = -1;  // the level is this number of the mechanism; -1: it is `level`
  double level = 0;

  double level_in(const Assembly& assembly) const;
  /// Of h, output - level: its change along d, and its derivatives, added.
  double change(const StateView& s, Assembly& assembly, const Variation& d) const;
  void add_gradient(const StateView& s, Assembly& assembly, double factor, ScalarGradient& g) const;
  /// Negative until the end.
  double distance(const StateView& s, Assembly& assembly) const;
  /// "'pendulum.angle' above 1.5 rad".
  std::string text(const Assembly& assembly) const;
};

/// The term kappa h. Its value is psi's change, to first order, by what h is away from zero at the fixed time.
std::shared_ptr<const CostTerm> end_term(const EndEvent& end, double kappa);

/// Along the motion: (1, v, a, z', a', lambda') of (t, q, v, z, a, lambda), the last two from `rates` or without.
/// no_change: zeros, one a number; it, s, `rates` and the assembly's zdot are pointed to.
Variation along_motion(const StateView& s, Assembly& assembly, const std::vector<double>& no_change,
                       const Eigen::VectorXd& rates);

/// h' and kappa at the end; s has its accelerations and multipliers, `rates` are a' (n) and lambda' (m), or none where
/// nothing depends on those. Throws CapabilityError where an output or a term of the cost offers no time derivative.
struct EndRates {
  double h_rate = 0, kappa = 0;
};
EndRates end_rates(const EndEvent& end, const Objective& objective, const StateView& s, Assembly& assembly,
                   const Eigen::VectorXd& rates);
/// h' alone, which costs do not matter to.
double end_rate(const EndEvent& end, const StateView& s, Assembly& assembly, const Eigen::VectorXd& rates);

/// Looks for the end along the steps of a run, in order of time.
class EndSearch {
 public:
  EndSearch(EndEvent end, double t_start)
      : end_(std::move(end)), depends_on_(end_.output->depends_on()), t_start_(t_start) {}

  /// The distance at the start, and behind each step. Returns whether the end may lie within the step that ends here,
  /// so that find() must be asked.
  void begin(const StateView& s, Assembly& assembly);
  bool step(const StateView& s, Assembly& assembly);
  /// Within the last step: the end time, if there is one. `distance` gives the distance at times between.
  std::optional<double> find(const std::function<double(double)>& distance);

  /// How near the output came, when, and how far it ranged.
  double nearest() const { return nearest_; }
  double nearest_time() const { return nearest_time_; }
  double range() const { return largest_ - smallest_; }
  /// Whether the output has ever been on the side that it is to come from.
  bool armed() const { return armed_; }
  const EndEvent& end() const { return end_; }

 private:
  void note(double t, double h);
  /// Whether the last step ends at the level, but for rounding, that it rises to.
  bool ends_at_level() const;
  double turning_speed_of(const StateView& s, const Assembly& assembly) const;

  EndEvent end_;
  std::optional<std::vector<int>> depends_on_;  // coordinates
  double t_start_;
  double t_before_ = 0, t_ = 0, h_before_ = 0, h_ = 0, change_ = 0;
  double turning_ = 0, turn_ = 0;  // rad/s at the last step's end; rad within it
  double nearest_ = 0, nearest_time_ = 0, largest_ = 0, smallest_ = 0;
  long steps_ = 0;
  bool armed_ = false;
};

}  // namespace costate
