// Steps of Radau's scheme of order 9 of a motion with its tangents by all states and parameters, and their changes
// along directions if that is asked for, along a stretch on which a slip in space is slow: the stages' matrix of the
// motion serves all columns. Steps follow |w|, whose direction is known to the rounding of what w is the sum of, over
// |w|.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/discrete/radau_scheme.h"

namespace costate {

/// A motion x (N states) with the tangents S by its states and np parameters, N x M.
class SlipSystem {
 public:
  virtual ~SlipSystem() = default;
  virtual const Assembly& assembly() const = 0;
  virtual int state_size() const = 0;
  /// x' and (f_x, f_rho).
  virtual void rates(double t, const double* x, Eigen::VectorXd& f, Eigen::MatrixXd& A) = 0;
  /// (f_x, f_rho; g_x, g_rho), with psi's running part g, and its changes as x changes by S's part along the
  /// directions: (N + 1) x M each.
  virtual void changes(double t, const double* x, const Eigen::MatrixXd& S, std::vector<Eigen::MatrixXd>& all) = 0;
  /// The slowest |w|; and what w is the sum of where rates() were evaluated last, which was at x.
  virtual double slip(double t, const double* x) = 0;
  virtual double parts_of_slips(const double* x) const = 0;
  /// S along the directions, N x k.
  virtual Eigen::MatrixXd along(const Eigen::MatrixXd& S) const { return S.topLeftCorner(S.rows(), 0); }
};

class SlipSteps {
 public:
  using Tangents = std::vector<Eigen::MatrixXd>;

  /// `directions`: of the parameters (np x k), along which changes of the tangents are asked for.
  SlipSteps(SlipSystem& system, double rtol, const Eigen::MatrixXd& directions);

  /// From t to `end`: x, and S with its changes, of which psi's are the last row. `last`: x at the end, about. Of a
  /// slip that stops there the end is also where its own |w| is nothing any more: a motion of other steps stops a
  /// little earlier or later. Returns the end, or where as many steps come to.
  double run(double t, double end, Eigen::VectorXd& x, Tangents& tangents, const Eigen::VectorXd& last, int most = 600);
  long steps() const { return steps_; }
  long factorizations() const { return factorizations_; }

 private:
  /// A point of the way: x', the equations' blocks (SlipSystem::changes()), and the tangents' rates.
  struct Point {
    Eigen::VectorXd f;
    Tangents of, rates;
  };
  /// Of positions, velocities, states and psi: first rows.
  struct Blocks {
    int first[5];
  };
  void evaluate(double t, const Eigen::VectorXd& x, const Tangents& tangents, Point& at);
  /// x and the tangents behind the step of h; its error in tolerances, infinite where it has no solution.
  double attempt(double t, double h, const Eigen::VectorXd& x, const Tangents& tangents);
  double error(double h, const Eigen::VectorXd& x, const Tangents& tangents, const std::vector<Eigen::VectorXd>& f,
               const std::vector<Tangents>& rates) const;
  /// In tolerances: of positions, of velocities by what the slip has, of states.
  double measure(const Eigen::VectorXd& e, const Eigen::VectorXd& x) const;
  /// What the rounding of the slip's direction makes: of velocities a part, and in psi's columns.
  struct Rounding {
    double velocities;
    Eigen::RowVectorXd psi;
  };
  /// Of the k-th change of S (0: S itself), each column by its own blocks, in units of its size.
  double measure_tangents(const Eigen::MatrixXd& e, const Eigen::MatrixXd& from, const Eigen::MatrixXd& to,
                          std::size_t k, const Rounding& rounding) const;
  void set_least_sizes(double span, const Eigen::VectorXd& x, const Eigen::VectorXd& last, double end);

  SlipSystem& system_;
  const RadauScheme& scheme_;
  const double rtol_;
  const int N_;
  const Blocks blocks_;
  const Eigen::MatrixXd directions_;
  long steps_ = 0, factorizations_ = 0;
  double speed_ = 0, parts_ = 0;  // |w| where the step begins, and what it is the sum of
  Point begin_, end_;             // of the step
  Eigen::VectorXd x_after_;
  Tangents after_;
  std::vector<Eigen::MatrixXd>
      least_;  // of S and its changes: sizes of the blocks (4 x M) that have no digits of their own
};

}  // namespace costate
