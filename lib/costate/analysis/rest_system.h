// The equations of rest (equilibrium.h, (0.10)) at one point and their linearization on the null space of
// X = [Phi_q; B]: the balance N^T Q = 0 with the columns of N a basis of the directions that X leaves free,
// and the multipliers those of least squares and least norm, so that Q - X^T lambda = N N^T Q. Dense in each
// part of the mechanism that no element connects with another, so that many vehicles cost as much each as
// one.
#pragma once

#include <Eigen/Dense>
#include <string>
#include <vector>

#include "costate/analysis/equilibrium.h"
#include "costate/analysis/row_space.h"
#include "costate/assembly/assembly.h"

namespace costate {

struct RestStep {
  Eigen::VectorXd q, z;  // n, nz
};

class RestSystem {
 public:
  RestSystem(Assembly& assembly, double t, const std::vector<HeldPosition>& held);

  /// Evaluates everything but derivatives.
  void move_to(const Eigen::VectorXd& q, const Eigen::VectorXd& z);
  /// Derivatives, null space and reduced matrices here.
  void linearize();

  const Eigen::VectorXd& q() const { return q_; }
  const Eigen::VectorXd& z() const { return z_; }
  const Eigen::VectorXd& multipliers() const { return multipliers_; }  // of the constraints, then of the held positions
  const Eigen::VectorXd& gap() const { return gap_; }                  // [Phi; B q - b]
  const Eigen::VectorXd& unbalanced() const { return unbalanced_; }    // n
  StateView state() const;
  /// Largest entry of Phi_q, at least 1.
  double row_scale() const;

  /// The shortest step that closes the constraints here to first order.
  Eigen::VectorXd closing_step() const;
  /// Newton's step for the residual here with the matrices of the last linearize(), sigma M added to the
  /// stiffness.
  RestStep newton(double sigma) const;
  /// In positions, and in force states relative to the largest that was met.
  double step_size(const RestStep& step) const;

  // Of the last linearize().
  int freedom() const { return freedom_; }
  double lowest_stiffness() const { return lowest_; }
  double highest_stiffness() const { return highest_; }
  /// Coordinates and force states that no stiffness holds, one for each direction of that kind.
  std::vector<std::string> undetermined() const;
  /// Held positions (by their place among them) that constraints and those before fix already: what holds them would
  /// be shared among the two in no determined way.
  std::vector<int> held_twice() const;

  /// dX/drho of all unknowns, n, nz, m and (number of held positions) x np.
  void differentiate(Eigen::MatrixXd& q_rho, Eigen::MatrixXd& z_rho, Eigen::MatrixXd& lambda_rho,
                     Eigen::MatrixXd& held_rho);
  /// See equilibrium_adjoint; of the last linearize().
  void solve_adjoint(const Eigen::VectorXd& weight_q, const Eigen::VectorXd& weight_z, Eigen::VectorXd& s,
                     Eigen::VectorXd& w, Eigen::VectorXd& x) const;

 private:
  /// A connected part: its coordinates, constraint rows, force states and held positions, by their global
  /// numbers.
  struct Part {
    std::vector<int> q, rows, states, held;
    RowSpace here, linear;                        // X at the point, and at that of the last linearize()
    std::vector<int> free;                        // of `states`, by their place there: neither held nor indifferent
    Eigen::MatrixXd M, K, Q_z, f_q, f_z;          // Q_z, f_z of all its states; f_q, f_z rows of the free ones
    Eigen::MatrixXd N, NQ_z, f_qN, f_zz, Mr, Kr;  // reduced, of the free states
    Eigen::MatrixXd Kz;                           // Kr with the free states eliminated where they can be
    bool eliminated = true;
    /// [Kr + sigma Mr, -N^T Q_z; f_q N, f_z] for the free directions and states
    Eigen::MatrixXd reduced(double sigma) const;
  };
  void find_parts();
  void linearize(Part& p);
  void measure_stiffness(const Part& p);
  Eigen::MatrixXd calc_rows(const Part& p) const;
  /// Rows of the global unknowns' numbering that belong to a part: of the constraints, then of its held
  /// positions.
  std::vector<int> row_numbers(const Part& p) const;
  Eigen::MatrixXd part_of(const SparsePattern& pattern, const std::vector<double>& values,
                          const std::vector<int>& columns, const std::vector<int>& local_row,
                          std::size_t row_count) const;
  Eigen::MatrixXd lambda_off_range(const Eigen::MatrixXd& q_rho);

  Assembly& assembly_;
  const std::vector<HeldPosition>& held_;
  const int n_, m_, nz_;
  const double t_;
  std::vector<double> rest_;
  std::vector<Part> parts_;
  std::vector<int> local_q_, local_row_, local_state_;  // place within the part
  Eigen::VectorXd q_, z_, multipliers_, gap_, unbalanced_, rate_, largest_z_;
  int freedom_ = 0;
  double lowest_ = 0, highest_ = 0;
};

}  // namespace costate
