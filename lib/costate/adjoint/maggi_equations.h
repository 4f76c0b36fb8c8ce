// What the hand-derived tangent and adjoint equations of Maggi's formulations share: unknowns in independent
// coordinates along a motion given as (q, v, z), and the choice of these coordinates (lib/README.md (5.6)).
// The choices are their own, not those of the run, and are made from the motion alone, in order of time: the
// tangent and the adjoint along one motion change their coordinates at the same times, and so are exactly
// dual.
#pragma once

#include "costate/adjoint/hand_equations.h"
#include "costate/adjoint/maggi_blocks.h"

namespace costate {

class MaggiEquations : public HandEquations {
 public:
  MaggiEquations(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters, Objective objective,
                 Direction direction);
  void set_parameters(const double* rho) override;
  std::vector<double> plan(const std::vector<double>& times, const Motion& motion) override;
  bool before_step(double t, double next, const double* qvz, Eigen::MatrixXd& X, Eigen::VectorXd& gradient) override;
  long factorizations() const override { return at_.factorizations(); }
  bool carries_switched_rows() const override { return true; }

 protected:
  void solve_motion(const StateView& s) override;
  StateView state() const override { return at_.state(); }
  /// X, at an evaluated point, to the chart of number `to`: on return that is in force and the point
  /// evaluated in it.
  virtual void change_chart(int to, Eigen::MatrixXd& X, Eigen::VectorXd& gradient) = 0;
  ImpulseJump& velocity_jump() override {
    return assembly_.has_switched_rows() ? HandEquations::velocity_jump() : velocity_jump_;
  }

  /// "independent.0", ...: which coordinates these are changes on the way.
  std::vector<std::string> independent_names() const;
  /// Evaluates the point (t_start; q, v, z) of the start.
  void evaluate_start();
  /// The next evaluated point is the beginning of a pass.
  void begin_afresh() { fresh_ = true; }
  /// The evaluated point once more, in another chart.
  void evaluate_in_chart(int chart);
  /// Nr, Vr, Ar, Fy, Zr at the evaluated point.
  void evaluate_parameters();

  MaggiBlocks at_;
  ImpulseJump velocity_jump_;
  const int f_;

 private:
  /// The chart between two times.
  int planned(double t, double next) const;
  /// The planned chart of the rows that this state has, the nearest in time.
  int chart_for(const StateView& s);
  struct Stretch {
    double end;
    int chart;
  };
  std::vector<Stretch> plan_;  // in order of time; the last one has no end
  bool fresh_ = true, has_parameters_ = false;
};

SparsePattern full_pattern(int rows, int cols);
/// (a, b, c), any of which may be empty.
Eigen::VectorXd stacked(const Eigen::VectorXd& a, const Eigen::VectorXd& b, const Eigen::VectorXd& c);

}  // namespace costate
