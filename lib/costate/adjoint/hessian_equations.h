// Hessian-vector products by differentiating the adjoint of the acceleration-level formulations along
// directions of the parameters (forward over adjoint, lib/README.md (13)). With L = g - s1^T R1 - s2^T R2 +
// mu_z^T f, the adjoint (3.4) is
//   L_a + mu_v = 0,  L_lambda = 0,  mu_q' = -L_q,  mu_v' = -L_v - mu_q,  mu_z' = -L_z,  gradient = integral
//   of L_rho.
// Along a direction d of rho the motion changes by its tangent (dq, dv, dz, da, dlambda), and with G_x the
// change of L_x at fixed (s1, s2, mu_z) (assembly/second_terms.h) the adjoint changes by (dmu, ds) with
//   KKT [ds1; ds2] = [dmu_v + G_a; G_lambda]
//   dmu_q' = -G_q + K^T ds1 + R2_q^T ds2 - f_q^T dmu_z        and so on, the same matrices as in (3.4)
//   (H d) = integral of G_rho - ds1^T F_rho - ds2^T R2_rho + dmu_z^T f_rho, and the ends' terms.
// All derivatives are exact; nothing is differenced. Several directions share one motion, one adjoint and all
// matrices.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "costate/adjoint/hand_equations.h"
#include "costate/adjoint/known_instant.h"
#include "costate/analysis/start.h"
#include "costate/assembly/second_terms.h"
#include "costate/event/end_event.h"
#include "costate/event/motion_events.h"

namespace costate {

class HessianEquations {
 public:
  HessianEquations(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters, Objective objective,
                   Stabilization stabilization);

  void set_parameters(const double* rho);
  /// np x k: one direction of the parameters a column.
  void set_directions(const Eigen::MatrixXd& directions);
  int directions() const { return static_cast<int>(directions_.cols()); }
  const Eigen::MatrixXd& direction_columns() const { return directions_; }
  int parameter_count() const { return assembly_.np(); }
  /// Of (q, v, z), which come in this order; a tangent and an adjoint have as many entries.
  int state_size() const { return 2 * n_ + nz_; }
  const Assembly& assembly() const { return assembly_; }
  const Objective& objective() const { return objective_; }
  const Stabilization& stabilization() const { return level_.stabilization(); }

  /// The start at time t and its tangents, state_size() x k.
  void start(double t, double* y, double* tangents);
  /// y' and the tangents' rates.
  void motion(double t, const double* y, const double* tangents, double* yp, double* tangents_p);

  /// Everything that the functions below need at a point of the motion.
  void evaluate(double t, const double* y, const double* tangents);
  /// mu(T), dmu(T) at the evaluated point; gradient (np) and products (np x k) gain the terms at T.
  void end(double* mu, double* dmu, double* gradient, double* products);
  /// mu', dmu' and the integrands of gradient and products, at the evaluated point.
  void adjoint(const double* mu, const double* dmu, double* mup, double* dmup, double* integrand,
               double* product_integrands);
  /// Of these mu' and the gradient's integrand alone.
  void adjoint(const double* mu, double* mup, double* integrand);
  /// The terms that gradient and products gain at the start, where the adjoint ends.
  void begin(double t, const double* mu, const double* dmu, double* gradient, double* products);

  // Bends, where derivatives of forces jump on the way: (13.13) (hessian_bends.cpp).
  /// What the motion is on either side of one, (y, tangents), as near to it as it is known.
  struct Bend {
    double before = 0, after = 0;
    std::vector<double> state_before, state_after;
    std::vector<std::pair<std::size_t, Eigen::VectorXd>> moved;  // the forces that bend; dt along each direction
  };
  /// For find_block_jumps(): what jumps there, at (t, y).
  void append_blocks(double t, const double* y, std::vector<double>& values, std::vector<std::size_t>& ends);
  /// The largest entries along the motion: of y' and of each tangent, state_size() x (1 + k).
  struct Sizes {
    double span = 0;  // t_end - t_start
    Eigen::MatrixXd columns;
  };
  /// Fills `moved`. Throws CapabilityError with the force and the time where psi has no second derivative, or none that
  /// is known here.
  void follow_bend(Bend& bend, const Sizes& sizes);
  /// Behind the bend mu, dmu and the products are given; dmu and products become those before it.
  void cross_bend(const Bend& bend, const double* mu, double* dmu, double* products);

  // Events of the mechanism, (13.14), and an end that one decides, (13.15) (hessian_events.cpp).
  /// One that the motion meets, or a known time at which laws jump: (y, tangents) before and behind it at its time, and
  /// so near to it that nothing else happens there, but on either side of it whatever rounding does.
  struct Event {
    double t = 0, behind = 0;  // its last instant before, and its first one behind, where laws tell them apart
    int event = -1;
    Eigen::VectorXd by = {};  // of a known time, event < 0: dt/drho
    std::vector<double> before = {}, after = {};
    double near_before = 0, near_after = 0;
    std::vector<double> state_before = {}, state_after = {};
    bool rigid = false, bends = false;  // of a rigid contact; and of one that lets go or begins to slide: (13.17)
    // Where a force begins as d^n, 1 < n < 2 (else `exponent` is 2): what depends on its slopes is as t^(n-1), t from
    // the event on, and its limit (ratio x(near) - x(further))/(ratio - 1); ratio: (further/near)^(n-1), or 0.
    double exponent = 2, further_before = 0, further_after = 0, ratio = 0;
    std::vector<double> state_further_before = {}, state_further_after = {};
  };
  /// Whose derivatives are taken, with an assembly of their own.
  struct Jumps {
    MotionEvents* events;  // null without any
    KnownInstant* instant;
  };
  /// Of an event whose y is there behind it, too, and of a known time whose y is there before it: what is behind.
  void cross_tangents(const Jumps& jumps, Event& event);
  /// Where a rigid contact lets go or begins to slide: how the instant moves along each direction.
  Eigen::VectorXd bend_shifts(const Jumps& jumps, const Event& event);
  /// mu, dmu, gradient and products behind the event become those before it.
  void cross_event(const Jumps& jumps, const Event& event, double* mu, double* dmu, double* gradient, double* products);
  /// The end of the motion is where this happens; the cost holds end_term() of it.
  void end_by(std::optional<EndEvent> end) { end_event_ = std::move(end); }

 private:
  /// (v, a, z') and the running cost on one side of an event, their rates along the motion, and, of an adjoint, mu' and
  /// the gradient's integrand.
  struct Flow {
    Eigen::VectorXd f, f_rate, mup, rho;
    double cost = 0, cost_rate = 0;
    /// The rate of L = g + mu^T f at fixed mu.
    double rate(const Eigen::VectorXd& mu) const { return mu.dot(f_rate) + cost_rate; }
  };
  /// Beside the event, with rates and, where `mu` is given, what an adjoint has.
  Flow flow_beside(const Event& event, bool after, const Eigen::VectorXd* mu);
  /// At the evaluated point; without rates, and what an adjoint has.
  Flow flow() const;
  void add_rates(Flow& flow);
  void add_adjoint(const Eigen::VectorXd& mu, Flow& flow);
  MotionEvents::Side side_of(const Flow& flow) const;
  /// What an instant depends on by its multipliers: the weights s of the equations that say so, and (a', lambda') along
  /// the motion (hessian_reactions.cpp).
  struct Reactions {
    std::vector<double> s;
    Eigen::VectorXd rates;
  };
  /// Where friction falls, at the evaluated point before, at which the motion goes on with f: to h.
  Reactions add_reactions(const Eigen::VectorXd& f, MotionEvents::Gradient& h);
  /// The change of that along d, which is so of (a, lambda), too; W has what weights of multipliers change by.
  void add_reactions_change(const std::vector<double>& s, const Variation& d, MotionEvents::Gradient& W);
  /// cross_event() where a rigid contact lets go or begins to slide.
  void cross_bend_of_contact(const Jumps& jumps, const Event& event, const double* mu, double* dmu, double* products);
  /// Along direction j with the time and the state changing by these.
  Variation moved(int j, double dt, const Eigen::VectorXd& dx) const;
  /// What the end's own time adds to the terms at T.
  void move_end(const double* mu, double* dmu, double* products);
  StateView view(double t, const double* y) const;
  void solve_tangent(double t, const double* y, const double* tangents);
  Variation variation(int k) const;
  /// change_ = G along direction k, of the running or the terminal cost and of the equations with weights (s,
  /// mu_z).
  void calc_change(bool terminal, int k, const double* s, const double* mu_z);
  /// change_ += that of the equations alone, along d; and by time, where that is asked for.
  void add_equations_change(const Variation& d, const double* s, const double* mu_z, double* by_time = nullptr);
  /// s, x' and the integrand of the adjoint x or of a change of it, with g = L's own gradient or its change.
  void solve_adjoint(const ScalarGradient& g, const double* x, std::vector<double>& s, double* xp, double* integrand);
  /// out = -x of the linear part: out += K^T s1 + R2_q^T s2 - f_q^T mu_z and so on.
  void add_transposed(double c, const double* s, const double* mu_z, double* out) const;
  const Start& start_point(double t);
  /// Multipliers x, y of Phi = 0 and Phid = 0 at the start, which the terms mu^T S(0) of the gradient stand
  /// for.
  void solve_start_multipliers(const Start& start, const double* mu, double t, Eigen::VectorXd& x, Eigen::VectorXd& y);
  /// And s, w of the balance and of the force states' rates at a start at equilibrium (hessian_start.cpp).
  void solve_balance_multipliers(const Start& start, const Eigen::VectorXd& weight_q, const double* mu_z, double t,
                                 Eigen::VectorXd& x);
  /// moved and change_.rho gain what the balance, with dx = (dq, dz, dlambda) along direction k, adds to E_x,x dx.
  void add_balance_change(double t, const Start& start, int k, const Eigen::VectorXd& dq, const Eigen::VectorXd& dz,
                          Eigen::VectorXd& moved, double* rho);

  Assembly assembly_;
  Objective objective_;
  AccelerationLevel level_;
  int n_, m_, nz_;
  Eigen::MatrixXd directions_;
  std::vector<std::vector<double>> number_changes_;  // one list a direction
  std::unique_ptr<Start> start_;
  Assembly::ParameterColumns columns_, along_;  // of parameters, of directions
  std::vector<const double*> tangent_columns_;
  Eigen::MatrixXd tangents_, accelerations_;  // (dq, dv, dz) and (da, dlambda), one direction a column
  ScalarGradient gradient_, change_;
  Eigen::VectorXd balance_s_, balance_w_;
  std::optional<EndEvent> end_event_;
  std::vector<double> s_, ds_, rows_;
};

}  // namespace costate
