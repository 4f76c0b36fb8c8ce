// Runs whose end an event decides (event/end_event.h): until where they go, and the run to that fixed time that has the
// same derivatives.
#pragma once

#include <algorithm>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "costate/formulation/solved_state.h"
#include "costate/integrator/segment.h"
#include "costate/problem/problem.h"

namespace costate {

/// Follows the steps of a run to where it ends.
class EndWatch {
 public:
  EndWatch(const Problem& problem, System& system);

  /// Fed with the run's start and, behind `other`, with its steps; throws Look where a step may hold the end.
  void begin(const double* y);
  StepSink sink(StepSink other = {});

  /// The run to t, or to its end where that comes first: then false, and the state is that of the end. Throws
  /// SolverError where t is the problem's last time and no end has come.
  template <class Run>
  bool advance(Run& run, double t) {
    while (!end_) {
      try {
        run.advance(t);
        if (t >= problem_.solver.t_end) never();
        return true;
      } catch (const Look&) {
        look([&](double at) {
          run.advance(at);
          return run.y();
        });
      }
    }
    run.advance(std::min(t, *end_));
    return t <= *end_;
  }

  /// Of the run that has ended.
  double time() const { return *end_; }
  bool ended() const { return end_.has_value(); }
  RunEvent event() const;
  /// Gives notice where the output, at this state of the end, hardly crosses: then small errors move the end by much.
  void tell_if_grazed(const double* y);
  /// How fast the output crosses, over the run's length and against its range.
  double steepness(double rate) const;

 private:
  struct Look {};
  MechanismState state(double t, const double* y);
  void look(const std::function<const double*(double)>& at);
  [[noreturn]] void never() const;

  const Problem& problem_;
  System& system_;
  EndSearch search_;
  std::optional<double> end_;
};

// A problem without ends_when is returned as it is. The end is found by one run, on this integrator or the problem's
// own.
/// The same problem to the fixed time at which it ends at rho, with end_term() in its cost: psi and its gradient at rho
/// are the same, by every method but fixed steps, which end their run themselves. Throws SolverError where the end is
/// grazed.
Problem with_fixed_end(const Problem& problem, const std::vector<double>& rho, const std::string& integrator = "");
/// Without the term: for motions alone.
Problem until_its_end(const Problem& problem, const std::vector<double>& rho);

/// A run does not come to the event that is to end it.
class NoEndError : public SolverError {
 public:
  using SolverError::SolverError;
};

// What is told of an end, whatever carries the run: of its steepness, how fast the output crosses, over the run's
// length and against its range.
/// Of a gradient: SolverError where the end is grazed, a notice where it is nearly so.
void judge_end(const Problem& problem, const Assembly& assembly, double t, double rate, double steepness);
/// Of a simulation: a notice where small errors move the end by much.
void tell_hardly_crossed(const Problem& problem, const Assembly& assembly, double t, double rate, double steepness);
/// Of a run that has come to its last time: throws NoEndError.
[[noreturn]] void fail_without_end(const Problem& problem, const EndSearch& search, const Assembly& assembly);

/// (a', lambda') at a state of a run of this problem that an event ends, by the weights of its formulation.
Eigen::VectorXd reaction_rates(const Problem& problem, const StateView& s, Assembly& assembly);

/// Throws CapabilityError where the problem has ends_when ("Hessian products are").
void refuse_free_end(const Problem& problem, const std::string& what);

}  // namespace costate
