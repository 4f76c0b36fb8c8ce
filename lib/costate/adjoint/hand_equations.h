// Hand-derived tangent and adjoint equations of a formulation, each written as its own linear system along a stored
// trajectory (lib/README.md, sensitivities). All have the form
//   d/dt (D(t) X + d(t)) = A(t) X + b(t)   on differential rows,
//                      0 = A(t) X + b(t)   on algebraic rows,
// with X of N rows and one column (adjoint) or one column a parameter (tangent). D and d keep momenta such as
// P = M mu - g_a as they are, so that no time derivative of M is needed. They are integrated by their own Radau scheme,
// not by the adjoint modules of IDAS or CVODES: two independent witnesses.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "costate/adjoint/motion_jump.h"
#include "costate/event/motion_events.h"
#include "costate/level/acceleration_level.h"
#include "costate/level/velocity_jump.h"
#include "costate/objective/objective.h"

namespace costate {

class HandEquations {
 public:
  enum class Direction { forward, backward };
  /// (q, v, z) at time t.
  using Motion = std::function<void(double t, double* qvz)>;

  HandEquations(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters, Objective objective,
                Stabilization stabilization, Direction direction);
  virtual ~HandEquations();
  HandEquations(const HandEquations&) = delete;
  HandEquations& operator=(const HandEquations&) = delete;

  Direction direction() const { return direction_; }
  /// N, the number of rows of X; names of them ("mu.P1.x") for reports.
  int size() const { return static_cast<int>(names_.size()); }
  const std::vector<std::string>& names() const { return names_; }
  /// Columns of X.
  int columns() const { return direction_ == Direction::forward ? assembly_.np() : 1; }
  bool differential(int row) const { return differential_[row] != 0; }
  /// The power of the step by which a row is multiplied before a stage is solved for; unknowns that grow like its
  /// inverse (in systems of index 3 accelerations and multipliers) then do not make the matrix of a small step
  /// singular.
  virtual int step_power(int) const { return 0; }
  /// The rows that were added together are a group, of one kind of unknown.
  int group(int row) const { return group_[row]; }
  int groups() const { return group_.empty() ? 0 : group_.back() + 1; }
  int parameter_count() const { return assembly_.np(); }
  virtual void set_parameters(const double* rho);

  // The matrices share one pattern.
  const SparsePattern& pattern() const { return A_.pattern(); }
  std::span<const double> A() const { return A_.values(); }
  std::span<const double> D() const { return D_.values(); }
  const Eigen::MatrixXd& b() const { return b_; }
  const Eigen::MatrixXd& d() const { return d_; }

  /// Evaluates A, D, b, d at the trajectory's point (t, q, v, z); accelerations and multipliers are solved for.
  void evaluate(double t, const double* qvz);
  /// Points are led back to the constraints before anything is evaluated there. Rows that depend on others do so where
  /// the others hold, and off by e are rows of their own, of that slope: under a weight alpha they bind from
  /// alpha e^2 = 1 on.
  void lead_back() { leads_back_ = true; }
  /// For equations whose unknowns depend on a choice (of independent coordinates): fixes the choices along a motion,
  /// given the ends of its steps in order of time, and returns the times where they change, which grids must contain.
  virtual std::vector<double> plan(const std::vector<double>& times, const Motion& motion);
  /// Before the step from t to `next`, at the point (t; q, v, z): where the choice changes, X is expressed in the new
  /// one, the gradient gains what depends on the parameters in that, and the result is true.
  virtual bool before_step(double t, double next, const double* qvz, Eigen::MatrixXd& X, Eigen::VectorXd& gradient);
  /// Where the motion jumps, in order of time, and what the run's events had behind them; to be said before plan().
  void set_jumps(std::vector<MotionJump> jumps, MotionEvents::History history = {}) {
    jumps_ = std::move(jumps);
    history_ = std::move(history);
  }
  /// Whether rows may come and go with contacts that close.
  virtual bool carries_switched_rows() const { return false; }
  const std::vector<MotionJump>& jumps() const { return jumps_; }
  /// X across one of these, at the kink of a driver from the state `qvz` before it: forward from before to behind,
  /// backward from behind to before. The gradient gains the jump's own dependence on the parameters, and what the time
  /// of the jump brings psi. The point of the side that X is then on is evaluated. In hand_jumps.cpp.
  void cross(const MotionJump& jump, const double* qvz, Eigen::MatrixXd& X, Eigen::VectorXd& gradient);
  /// X where the integration begins (t_start forward, t_end backward) at an evaluated point, and the terms that the
  /// gradient gains there.
  virtual void begin(Eigen::MatrixXd& X, Eigen::VectorXd& gradient) = 0;
  /// The gradient's integrand (np entries) at an evaluated point, or at one that recall() has brought back.
  virtual void integrand(const Eigen::MatrixXd& X, Eigen::VectorXd& out) = 0;
  /// Keeps the evaluated point under a small number. recall() brings back as much of it as integrand() needs; the
  /// matrices are then no longer defined.
  void keep(int number);
  void recall(int number);
  /// The terms that the gradient gains where the integration ends.
  virtual void finish(const Eigen::MatrixXd& X, Eigen::VectorXd& gradient) = 0;

  /// The start of the trajectory, found once per parameter set; with its derivative's columns for tangents.
  const struct Start& start();
  double t_start = 0;

  Assembly& assembly() { return assembly_; }
  virtual long factorizations() const { return level_.factorizations(); }

 protected:
  /// Adds rows of X: names, and whether they are differential rows of the system.
  void add_rows(const std::string& prefix, const std::vector<std::string>& names, bool differential);
  /// Placement of the same block in A and D; to be called in the constructor, then finalize().
  int place(const SparsePattern& block, int row, int column, bool transposed = false);
  void finalize();
  /// Fills A_, D_, b_, d_ (zeroed) at the evaluated point.
  virtual void fill() = 0;

  /// At an evaluated point: the tangents of (q, v, z), or the weights of their changes that an adjoint stands for.
  virtual Eigen::MatrixXd of_states(const Eigen::MatrixXd& X) = 0;
  /// X from those, at an evaluated point, with what the gradient gains by the constraints there.
  virtual void from_states(const Eigen::MatrixXd& Y, Eigen::MatrixXd& X, Eigen::VectorXd& gradient) = 0;
  /// The balance of impulses at the evaluated positions.
  virtual ImpulseJump& velocity_jump() { return velocity_jump_; }

  /// Accelerations, multipliers and the assembly's derivative blocks at (t, q, v, z).
  virtual void solve_motion(const StateView& s);
  /// Whether integrand() works with the blocks of the point, or with its state and the cost's gradient alone.
  virtual bool integrand_needs_blocks() const { return true; }
  // At the evaluated point.
  virtual StateView state() const { return recalled_ >= 0 ? view(kept_[recalled_]) : level_.state(); }
  /// Rows that are there, and directions in which contacts slide, of the evaluated point or of the one that was
  /// recalled; the matrices of the one are kept.
  void go_to_slips();
  /// Running cost gradient at the evaluated point.
  const ScalarGradient& running_gradient();
  const ScalarGradient& terminal_gradient();
  /// What the weights of the start's q, v, z (n, n, nz) bring the gradient.
  void add_start_gradient(const double* w_q, const double* w_v, const double* w_z, Eigen::VectorXd& gradient);
  /// Parameter columns at the evaluated point.
  const Assembly::ParameterColumns& parameter_columns();
  /// w with accelerations and multipliers eliminated (lib/README.md, terminal elimination); adds to the gradient.
  void eliminate_terminal(Eigen::VectorXd& wq, Eigen::VectorXd& wv, Eigen::VectorXd& wz, Eigen::VectorXd& gradient);
  /// w_q Sq + ... at the end of a tangent run: gradient_j += w_x S_j + w_rho.
  void add_terminal_tangent(const Eigen::MatrixXd& Sq, const Eigen::MatrixXd& Sv, const Eigen::MatrixXd& Sz,
                            const Eigen::MatrixXd& Sa, const Eigen::MatrixXd& Sl, Eigen::VectorXd& gradient);
  void add_running_tangent(const Eigen::MatrixXd& Sq, const Eigen::MatrixXd& Sv, const Eigen::MatrixXd& Sz,
                           const Eigen::MatrixXd& Sa, const Eigen::MatrixXd& Sl, Eigen::VectorXd& out);
  /// Tangents of a and lambda from those of q, v, z at the evaluated point.
  void solve_tangent_accelerations(const Eigen::MatrixXd& Sq, const Eigen::MatrixXd& Sv, const Eigen::MatrixXd& Sz,
                                   Eigen::MatrixXd& Sa, Eigen::MatrixXd& Sl);

  Assembly assembly_;
  Objective objective_;
  AccelerationLevel level_;
  VelocityJump velocity_jump_;
  int n_, m_, nz_;
  BlockMatrix A_, D_;
  Eigen::MatrixXd b_, d_;

 private:
  void cross_kink(double t_before, double t_after, const double* qvz, Eigen::MatrixXd& X, Eigen::VectorXd& gradient);
  void cross_stretch(const MotionJump& jump, Eigen::MatrixXd& X, Eigen::VectorXd& gradient);
  void cross_event(const MetEvent& met, Eigen::MatrixXd& X, Eigen::VectorXd& gradient);
  /// Accelerations, rates of force states and running cost at the evaluated point.
  MotionEvents::Side side();

  /// q - dq with Phi_q dq = Phi, then v - dv with Phi_q dv = Phidot, both the least by M.
  StateView led_back(const StateView& s);

  Direction direction_;
  bool leads_back_ = false;
  std::vector<double> led_back_;
  std::vector<MotionJump> jumps_;
  std::unique_ptr<MotionEvents> events_;  // once one has been crossed
  MotionEvents::History history_;
  std::vector<std::string> names_;
  std::vector<char> differential_;
  std::vector<int> group_;
  std::unique_ptr<Start> start_;
  ScalarGradient running_, terminal_;
  bool running_known_ = false;
  Assembly::ParameterColumns columns_;
  struct Kept {
    double t = 0;
    std::vector<double> values;  // q, v, z, a, lambda
    ScalarGradient running;
  };
  StateView view(const Kept& k) const;
  std::vector<Kept> kept_;
  int current_ = -1, recalled_ = -1;  // what is evaluated now was kept under this number; what recall() brought back
};

}  // namespace costate
