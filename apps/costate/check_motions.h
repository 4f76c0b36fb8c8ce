// What 'costate check' says about motions: coordinates, velocities, accelerations, multipliers and every output at
// samples, each formulation on each of its integrators, against a tighter run and against the equations of motion at
// the run's own state.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "check_judge.h"
#include "command.h"
#include "independent_state.h"

namespace costate::app {

struct MotionRow {
  std::string formulation, integrator;
  Verdict verdict = Verdict::ok;
  std::string why;               // refused, failed, cut: the reason
  double error = 0;              // of the worst quantity, against its range
  double independent_error = 0;  // the largest distance to the equations of motion at the run's own states
  std::string quantity, unit;    // the worst: the farthest beyond what is allowed
  double time = 0, found = 0, expected = 0;
  bool by_equations = false;  // `expected` is of the equations of motion at this state, not of the tighter run
  std::string remark;

  std::string text() const;  // a line of the table
  std::string sentence() const;
  Json json() const;
  static std::string heading();
};

class MotionCheck {
 public:
  /// `allow` begins a budget for one run.
  MotionCheck(const Problem& problem, const std::vector<double>& rho, std::function<void()> allow);

  /// The tighter run, of an exact formulation (or one that carries redundant rows), and from it what is allowed.
  void find_reference(const std::string& formulation, double rtol);
  MotionRow run(const std::string& formulation, const std::string& integrator);
  std::string note() const;  // what is left out, or empty
  std::size_t quantities() const { return state_.outputs().size(); }
  std::size_t samples() const { return times_.size(); }

 private:
  struct Sample {
    double t = 0;
    std::vector<double> q, v, z;
    std::vector<double> values, independent;  // as the run has them; by the equations of motion at its state
    std::vector<char> determined;
  };
  using Motion = std::vector<Sample>;
  struct Worst {
    double beyond = -1;  // error against what is allowed
    double error = 0;
    std::size_t sample = 0, column = 0;
    bool by_equations = false;
  };
  using Allowed = std::vector<std::vector<double>>;  // by sample and column

  Motion record(const Problem& p);
  std::vector<double> displaced(const Sample& s, double phase);
  double error(const Motion& m, std::size_t i, std::size_t c, bool by_equations) const;
  Worst worst(const Motion& m, const Allowed& allowed) const;
  void judge(MotionRow& row, const Problem& p);

  Problem problem_;
  const std::vector<double>& rho_;
  std::function<void()> allow_;
  IndependentState state_;
  std::vector<double> times_;
  Motion reference_;
  long steps_ = 0;                    // of the last run
  std::vector<double> range_, unit_;  // of each column; what an error is relative to
  Allowed allowed_;
};

}  // namespace costate::app
