// One problem at the extremes of what can be set: tolerances, steps, weights, stabilization. Every run is judged
// against a proven reference: it holds what it claims, it says that it does not, it refuses, or it is wrong in silence.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "costate/tradeoff/trade_reference.h"

namespace costate {

enum class StressVerdict { held, warned, refused, cut, unjudged, wrong };
const char* name_of(StressVerdict verdict);

struct StressEntry {
  std::string axis, value;  // "tolerance", "rtol 0.1"
  Combination what;
  StressVerdict verdict = StressVerdict::held;
  double error = 0, allowed = 0;  // the worst measure against what it may be off by, both relative
  std::string measure;            // "psi", or the output that is farthest off
  double drift = 0;               // largest |Phi| of a row along the motion [SI]
  std::string why;                // refused, cut, unjudged: the cause; warned: what it said
};

/// How much an error may be at this tolerance: what it claims (tradeoff/motion_confirmation.h), or kAmplified times
/// what the reference's own formulations make of a tolerance along this motion; never more than the most that any
/// tolerance claims, and what is certified in any case.
struct StressClaim {
  static constexpr double kAmplified = 100;
  /// Constraints that the user has made soft may cost so much.
  static constexpr double kSoft = 1e-2;
  double amplification = 0;  // error / rtol of the reference's formulations
  double floor = 0;
  double allowed(double rtol) const;
};

class StressCase {
 public:
  /// `limit_s`: processor time of one run; `time_left`: whether more may be begun.
  StressCase(const Problem& problem, const std::vector<double>& rho, const std::vector<std::string>& outputs,
             double limit_s, std::function<bool()> time_left);
  StressCase(const StressCase&) = delete;
  StressCase& operator=(const StressCase&) = delete;

  /// Throws where no combination carries the problem, and what the monitor throws.
  void find_reference(double seconds, bool with_gradient = false);
  const TradeReference& reference() const { return reference_; }
  const std::string& unit_of_output(std::size_t o) const { return probe_.outputs()[o]->unit(); }
  /// Why nothing can be judged, or empty.
  std::string unjudged() const;

  // Each adds its entries; where the time is up, none. Runs stand beside each other where there are jobs()
  // (record/jobs.h), in the same order and with the same numbers.
  void every_combination(std::vector<StressEntry>& entries, const std::string& axis, const std::string& value);
  /// Gradients by every method of the problem's formulation, as a user gets them; of a reference with one.
  void gradients(std::vector<StressEntry>& entries, const std::string& axis, const std::string& value);
  void tolerances(std::vector<StressEntry>& entries, const std::vector<double>& rtols);
  void steps(std::vector<StressEntry>& entries, const std::vector<long>& counts);
  void weights(std::vector<StressEntry>& entries, const std::vector<double>& alphas);
  void stabilizations(std::vector<StressEntry>& entries);
  /// Another problem that should give this one's psi and outputs once `back` has been applied to its values.
  StressEntry same(const Problem& other, const std::vector<double>& rho, const std::string& axis,
                   const std::string& value, const std::function<void(TradeValues&)>& back);

 private:
  std::vector<Combination> combinations() const;
  StressEntry run(const TradeProbe& probe, const Combination& c, double rtol, double step_s, double allowed,
                  const std::function<void(TradeValues&)>& back = {});
  StressClaim claim(TradeMeasure m) const { return claims_[static_cast<std::size_t>(m)]; }
  StressEntry run_at(const TradeProbe& probe, const Combination& c, double rtol, const std::string& axis,
                     const std::string& value);
  void beside_each_other(std::vector<StressEntry>& entries, const std::vector<Combination>& list,
                         const std::function<void(const Combination&, std::vector<StressEntry>&)>& work);
  double allowed_at(double rtol) const;

  Problem problem_;
  std::vector<double> rho_;
  std::vector<std::string> outputs_;
  double limit_s_;
  std::function<bool()> time_left_;
  TradeProbe probe_;
  std::string redundant_;
  TradeReference reference_;
  std::array<StressClaim, 3> claims_ = {};
};

}  // namespace costate
