// Contacts that slide in space within a fixed step. The direction sigma of the step's friction is that of its stage;
// the impulses of the projection of velocities have it, eta_k + mu eta_n sigma_k = 0, but where w may vanish soon,
// whose slip they leave alone, J u = 0 (so it passes zero on a line; everywhere, steps were of first order beside
// joints), and the accelerations have it, too. Two pairs of rows of the step's own equations tell it, which have one
// solution as long as w = J v* + o, the velocity along the ground, points forward:
//   -(lambda_k + mu lambda_n sigma_k),  k = 1, 2,        sigma = w/|w|
//   -(|lambda_t| + mu lambda_n),  sigma_x w/G,           sigma = lambda_t/|lambda_t|,  sigma_x = (-sigma_2, sigma_1)
// The first one turns the faster the slower the slip is and ends where w = 0, the second one passes over that, as a row
// of the plane does, and knows no direction where nothing presses: it serves where w may vanish within a few steps.
// Where no step leads sigma is that of w. A step that goes far beyond a stop, to find it, holds the sigma of its
// beginning.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "costate/assembly/slip_on_line.h"
#include "costate/discrete/alpha_coefficients.h"

namespace costate {

class StepSlips {
 public:
  explicit StepSlips(const Assembly& assembly);

  /// Whether any contact may slide in space.
  bool possible() const { return possible_; }
  bool any() const { return !slips_.empty(); }
  /// Whether this is one of their rows along the ground.
  bool has(int row) const {
    return std::any_of(slips_.begin(), slips_.end(), [&](const Slip& x) { return x.has(row); });
  }
  /// Whether this is one of them whose slip the projection of velocities leaves alone; whether there are any.
  bool keeps(int row) const {
    return std::any_of(slips_.begin(), slips_.end(), [&](const Slip& x) { return x.kept() && x.has(row); });
  }
  bool keeps_any() const {
    return std::any_of(slips_.begin(), slips_.end(), [](const Slip& x) { return x.kept(); });
  }

  /// sigma and the rows at a stage (q, v*, a*, lambda*, z), or without a step at a state.
  void look(const Assembly& assembly, const StateView& s, const StepCoefficients* c) { look(assembly, s, c, false); }
  /// look(), with derivatives.
  void linearize(const Assembly& assembly, const StateView& s, const StepCoefficients* c) {
    look(assembly, s, c, true);
    linearized_ = pairs_;
  }

  /// Until release() sigma is what it is at the beginning `s` of a step of length h, if one of the slips stops in it at
  /// the rate of the beginning.
  void hold_if_stopping(const Assembly& assembly, const StateView& s, double h);
  void release() { held_.clear(); }
  /// v := such velocities that what is held slides along its sigma alone, forward or back, at the point (q, v, z).
  void straighten(const Assembly& assembly, const StateView& s, double* v) const;
  bool holds() const { return !held_.empty(); }
  /// Where no step leads and the slip of this normal row begins from rest its sigma is that of the multipliers
  /// `friction` before, on which it then depends in the place of w; until it is null again.
  void begin_from_rest(int normal, const double* friction);
  /// Whether the rows are others than those of the last linearize().
  bool have_changed() const { return pairs_ != linearized_; }

  /// Directions as the assembly's sliding rows have them, those of the plane among them.
  const std::vector<double>& directions() const { return directions_; }
  /// out := minus the rows.
  void subtract_rows(double* out) const;
  /// Their derivatives by q and v* on the Jacobian's pattern, and by multipliers (row, multiplier, derivative).
  void set_partials(const SparsePattern& pattern, std::vector<double>& by_q, std::vector<double>& by_v) const;
  template <class Visit>
  void for_each_multiplier(const Visit& visit) const {
    for (const Slip& slip : slips_)
      for (int k = 0; k < 2; ++k) {
        visit(slip.along + k, slip.normal, slip.row_by_normal[k]);
        for (int l = 0; l < 2; ++l) visit(slip.along + k, slip.along + l, slip.row_by_friction(k, l));
      }
  }
  /// out -= the rows' derivative by parameter j, whose columns are those of linearize().
  void subtract_columns(int j, double* out) const;
  /// gradient += factor s2^T of all of these.
  void add_gradient(const double* s2, double factor, double* gradient) const;

  /// The changes of sigma, two rows a slip, along columns of (q, v*, lambda*); where no step leads lambda* is null, or
  /// the multipliers before of begin_from_rest(). With those by parameters where a column is one.
  Eigen::MatrixXd turns(const Eigen::MatrixXd& q, const Eigen::MatrixXd& v, const Eigen::MatrixXd* lambda,
                        bool parameters) const;
  /// For the accelerations' rows -(lambda_k + mu lambda_n sigma_k): right (m rows) -= their derivatives along these
  /// turns, and by mu where a column is a parameter.
  void subtract_turns(const Eigen::MatrixXd& turns, const double* lambda, bool parameters,
                      Eigen::Ref<Eigen::MatrixXd> right) const;
  /// Of these rows' weights s2: `bars` of sigma, and the gradient, lose them.
  void take_turns(const double* s2, const double* lambda, Eigen::VectorXd& bars, double* gradient) const;
  /// For the projection's rows at the state s: right (m rows) -= their derivatives along columns of q and turns at
  /// fixed u and eta, and by parameters where a column is one.
  void subtract_projected(const Assembly& assembly, const StateView& s, const double* u, const double* eta,
                          const Eigen::MatrixXd& q, const Eigen::MatrixXd& turns, bool parameters,
                          Eigen::Ref<Eigen::MatrixXd> right) const;
  /// Of these rows' weights s2: the bars of q and of sigma, and the gradient, lose them.
  void take_projected(const Assembly& assembly, const StateView& s, const double* u, const double* eta,
                      const double* s2, double* q, Eigen::VectorXd& bars, double* gradient) const;
  /// The bars of sigma become those of (q, v*, lambda*), which gain them, and the gradient; lambda may be null.
  void give_turns(const Eigen::VectorXd& bars, double* q, double* v, double* lambda, double* gradient) const;
  Eigen::VectorXd no_bars() const { return Eigen::VectorXd::Zero(2 * static_cast<Eigen::Index>(slips_.size())); }

  /// What the assembly has of R2 of what slides in space, by its own direction: phidd_q := 0 and columns' phidd := 0.
  void clear_rows(Assembly& assembly, Assembly::ParameterColumns* columns = nullptr) const;
  /// s2 without the weights of these rows.
  std::vector<double> without(const double* s2, int m) const;

 private:
  enum class Kind { by_slip, by_friction, held };  // sigma
  struct Slip {
    bool has(int row) const { return row == along || row == along + 1; }
    bool kept() const { return kind != Kind::by_slip; }
    int normal, along, number;
    Kind kind = Kind::by_slip;
    double mu = 0;
    Eigen::Vector2d sigma, rows, slip, slip_rate;  // the latter w along the motion
    // Derivatives of the rows and of sigma by w, lambda_t; by lambda_n and mu.
    Eigen::Matrix2d row_by_slip, row_by_friction, sigma_by_slip, sigma_by_friction;
    Eigen::Vector2d row_by_normal, row_by_mu;
    std::vector<int> coordinates;
    SlipOnLine::Partials slip_by;
    std::vector<std::pair<int, double>> of_mu;  // mu by parameters
  };
  /// Of slip i alone, as subtract_turns() and take_turns() are of all.
  void subtract_turn(std::size_t i, const Eigen::MatrixXd& turns, const double* lambda, bool parameters,
                     Eigen::Ref<Eigen::MatrixXd> right) const;
  void take_turn(std::size_t i, const double* s2, const double* lambda, Eigen::VectorXd& bars, double* gradient) const;
  Slip look_at(const Assembly& assembly, const Assembly::SlidingRow& row, const StateView& s, const StepCoefficients* c,
               bool partials) const;
  void look(const Assembly& assembly, const StateView& s, const StepCoefficients* c, bool partials);

  bool possible_;
  int np_;
  std::vector<Slip> slips_;
  std::vector<double> directions_;
  std::vector<Kind> pairs_, linearized_;
  std::vector<std::pair<int, Eigen::Vector2d>> held_;  // sigma by the contact's first row
  int begun_ = -1;                                     // likewise the row
  Eigen::Vector2d begun_friction_;
};

}  // namespace costate
