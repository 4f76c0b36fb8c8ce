// A fixed-step implicit integrator of the index-3 equations with projections of velocities and accelerations, written
// so that its exact derivative is cheap (discrete_tangent.h, discrete_adjoint.h). With B, G, ... of a step h
// (alpha_coefficients.h) and everything on the left at the step's end:
//
//   1 step           q = q_g + B a*,  v* = v_g + G a*,  z = z_g + G_z f*       (_g: what the last state gives)
//                    M a* + Phi_q^T lambda* = Q(q, v*, z, t),  f* = f(q, v*, z, t),  Phi(q, t) = 0
//                    (Phid(q, v*, t) = 0 of rows that keep rates alone, and friction: stage_rows.h)
//   2 velocities     M u + Phi_q^T eta = 0,  Phi_q (v* + u) = -Phi_t,  v = v* + u
//   3 accelerations  M a + Phi_q^T lambda = Q(q, v, z, t),  Phi_q a = -(bias of Phidd),  f = f(q, v, z, t)
//   4 rates          alpha = new_a a + old_a a0 + old_alpha alpha0,  y likewise from f
//
// Positions, velocities and accelerations all satisfy their constraints to rounding, and R1 = 0 holds at the end state.
// 2 is the projection in the metric of the masses; 3 is the same projection of a* with the forces taken at v instead of
// v*: M a* differs from M^-1 Q only along Phi_q^T, which a projection does not see. Because a and lambda follow from
// (q, v, z), the noise of size eps/h^2 that a* and lambda* carry in index 3 reaches neither them nor the next step, and
// alpha filters consistent accelerations only. The state that a step hands on is (q, v, z, alpha, y); for the
// trapezoidal rule alpha = a and y = f.
//
// Unknowns of 1 are (a*, f*, lambda*), not q, so that nothing of size q / h^2 cancels. Newton's iteration runs on the
// matrix J of the last step's solution, started by extrapolation, until corrections are of rounding size: the matrix
// factored at this step's solution then serves this step's derivative and the next step's iteration. Two factorizations
// a step, J and P (step_matrices.h); a third only where the iteration contracts too slowly, or the step has another
// length than the last one, counted apart.
//
// A step may have a length of its own: it ends at an event, at a kink or where the run does, and the scheme then begins
// anew, with alpha = a and y = f as at the start (step_cut.h). Such steps are of the trapezoidal rule.
#pragma once

#include <array>
#include <memory>

#include "costate/analysis/start.h"
#include "costate/discrete/alpha_coefficients.h"
#include "costate/discrete/step_matrices.h"
#include "costate/formulation/system.h"
#include "costate/level/velocity_jump.h"

namespace costate {

struct DiscreteCounters {
  long steps = 0, newton_iterations = 0, residuals = 0;
  long extra_factorizations = 0;  // beyond two a step
};

/// One step's end: views into its record, so that a whole trajectory can be kept as plain numbers.
struct StepRecord {
  double *q = nullptr, *v = nullptr, *z = nullptr, *a = nullptr, *lambda = nullptr;  // n, n, nz, n, m
  double* x = nullptr;                                                               // (a*, f*, lambda*), n + nz + m
  double *u = nullptr, *eta = nullptr;                                               // n, m
  double *alpha = nullptr, *y = nullptr;                                             // n, nz
  double* f = nullptr;                                                               // nz
  double *t = nullptr, *h = nullptr;  // the step's end and its length, 0 where none leads there
};

class DiscreteScheme final : public System {
 public:
  DiscreteScheme(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters, Objective objective,
                 const AlphaCoefficients& coefficients);

  /// y = (q, v, z); accelerations and multipliers are solved for.
  MechanismState mechanism_state(double t, const double* y) override;
  MechanismState kinematic_state(double t, const double* y) override { return view(t, y); }
  bool carries_events() const override { return true; }
  /// Consistent start at t for steps of h, with its derivative with respect to the parameters as wanted.
  /// Throws SolverError for redundant constraints, naming them.
  void start(double t, double h, StartDerivative wanted);
  /// One step. Throws SolverError naming the time, the step and the worst components.
  void step() { step(length_, t_start_ + static_cast<double>(index_ + 1) * length_); }
  /// One of length h, which ends at t_end.
  void step(double h, double t_end);

  // For runs with steps of other lengths; in discrete_cuts.cpp.
  /// From here on each step keeps where it has begun.
  void keep_beginnings();
  /// Where the last step has begun.
  const StepRecord& beginning() const { return begun_; }
  StateView begun() const { return state_of(begun_); }
  void save_beginning(double* to) const { std::copy(begun_numbers_.begin(), begun_numbers_.end(), to); }
  /// Whether the last step has been but to find where a slip in space stops: it is to be repeated.
  bool only_looks() const { return stage_rows_.slips().holds(); }
  /// The last step once more, by another length; the next one has to be behind a jump.
  void repeat(double h, double t_end);
  /// Crosses the pending event, or the time `kink` of a law, from right before it to t_after, right behind it; and
  /// begins anew there.
  void cross_event();
  void cross_kink(double kink, double t_after);
  /// The last step has not been.
  void take_back() { load(index_ - 1, begun_numbers_.data()); }
  /// No step: what the rates at the present state make of it within an instant dt, to the time t.
  void move_on(double dt, double t);
  MotionEvents& events() { return *events_; }
  ImpulseJump& velocity_jump();

  double start_time() const { return t_start_; }
  double time() const { return *r_.t; }
  /// Of the step that ends here; and that of steps that end where no other is asked for.
  double length() const { return *r_.h; }
  double regular_length() const { return length_; }
  long index() const { return index_; }
  const StepCoefficients& coefficients() const { return c_; }
  /// (q, v, a, lambda, z) at the step's end.
  StateView state() const;
  /// (q, v*, a*, lambda*, z): where the step's equations hold. Valid until the next call.
  StateView stage();
  const StepRecord& record() const { return r_; }
  const Start& start_state() const { return start_; }
  StepMatrices& matrices() { return matrices_; }
  /// Derivative blocks of 1 at the stage s, in the assembly, and of its rows.
  void calc_stage_partials(const StateView& s) { stage_rows_.calc(assembly_, s, c_); }
  StageRows& stage_rows() { return stage_rows_; }
  /// What slides in space in the step that ends here, with derivatives; of matrices that are brought back.
  const StepSlips& slips_here();
  /// What Phidd_v of rows that roll has beside 2 Phid_q, on the Jacobian's pattern; null where there are none.
  const std::vector<double>* rolling_rates(const StateView& s);
  const DiscreteCounters& counters() const { return counters_; }

  // Records for a backward pass: copies of everything that a step ends with.
  std::size_t record_size() const { return numbers_.size(); }
  void save(double* to) const { std::copy(numbers_.begin(), numbers_.end(), to); }
  /// The step of that index becomes the present one; its matrices are not factored.
  void load(long index, const double* from);
  /// A record's state, as state() would have it, and its rates of force states.
  StateView state_of(const double* record) const;
  const double* rates_of(const double* record) const;
  /// Factors both matrices at the present record, to go on from it.
  void factor_here();
  /// The same, one by one. Both leave M and phi_q at the record's q in the assembly; factor_stage() also the derivative
  /// blocks of the stage.
  void factor_projection_here();
  void factor_stage_here();

 private:
  void lay_out();
  /// The parts of a record.
  StepRecord parts(double* numbers) const;
  StateView view(double t, const double* y) const;
  StateView state_of(const StepRecord& r) const;
  void set_length(double h);
  /// The step from the present record, whose x has been guessed.
  void advance(double h, double t_end);
  /// From q, v and z of the present record.
  void begin_anew(double t);
  AccelerationLevel& level();
  void find_rates(const char* where);
  void find_accelerations();
  /// From what the assembly has, by the directions that slips have.
  int factor_projection();
  void predict();
  void remember();
  void iterate();
  void evaluate_stage();
  double correction_size();
  void set_scales();
  void set_reaches();
  void check(int bad, const char* what);
  [[noreturn]] void fail_newton(int iterations, double size);
  [[noreturn]] void fail_singular(const std::string& what, int column);

  AlphaCoefficients alpha_coefficients_;
  StepCoefficients c_;
  StepMatrices matrices_;
  StageRows stage_rows_;
  int n_, m_, nz_;
  Start start_;
  double t_start_ = 0, length_ = 0;
  long index_ = 0;
  std::vector<double> numbers_;  // the record
  StepRecord r_;
  bool keeps_beginnings_ = false, stale_ = false;  // J is that of another length
  std::vector<double> begun_numbers_;
  StepRecord begun_;
  // Within a step: q_g, v_g, z_g; v*; right-hand sides and corrections.
  std::vector<double> q_g_, v_g_, z_g_, v_star_, rhs_;
  // Backward differences of x over the last steps, and the number of them that predicted best.
  std::array<std::vector<double>, 5> differences_;
  int known_differences_ = 0, order_ = 1;
  // Rounding is judged against the largest coordinate of the same unit.
  std::vector<int> group_;
  std::vector<double> group_scale_, reached_, state_scale_, state_reach_;
  std::vector<double> rolling_;
  DiscreteCounters counters_;
  std::unique_ptr<AccelerationLevel> level_;  // for mechanism_state and jumps
  std::unique_ptr<VelocityJump> velocity_jump_;
};

}  // namespace costate
