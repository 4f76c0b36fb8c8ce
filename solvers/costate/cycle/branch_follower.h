// The walk along a branch of cycles (cycle/branch.h), step by step, and what is crossed within a step.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "costate/cycle/branch.h"
#include "costate/cycle/cycle_start.h"

namespace costate {

/// How many multipliers of a kind are outside a circle about the unit circle.
struct OutsideCircle {
  int above = 0, below = 0, pairs = 0;

  static OutsideCircle of(const std::vector<std::complex<double>>& multipliers, double radius);
  /// Of a point; of what is undecided there what it was `before`.
  static OutsideCircle of(const BranchPoint& point, const OutsideCircle& before);
};

/// What errors of runs at rtol make of a multiplier, and of the parameter where it crosses, at least: of a branch that
/// conserves, moduli were off by 0.2 to 15 rtol.
inline constexpr double kBranchRuns = 100;

class BranchFollower {
 public:
  BranchFollower(const Problem& problem, const CycleSettings& settings, const std::vector<double>& rho,
                 const BranchOptions& options);
  Branch run();

 private:
  /// A cycle and the branch's direction there.
  struct Node {
    BranchPoint point;
    Eigen::VectorXd u, tangent;
    std::vector<double> positions;
    OutsideCircle counted;
  };

  const Section& section() const { return start_.section(); }
  Eigen::VectorXd x_of(const Eigen::VectorXd& u) const;
  /// The return from u: fills the node's point and what the residual is, and gives d(x - P)/du, scaled.
  Eigen::MatrixXd evaluate(Node& node);
  Eigen::VectorXd tangent_of(const Eigen::MatrixXd& A) const;
  /// From a node along its tangent by `step`; none where no cycle is found there.
  std::optional<Node> advance(const Node& from, double step, int* corrections);
  /// Whether the branch has come to an equilibrium, which a section is met by as well.
  bool is_rest(const Node& node) const;
  /// Until the parameter leaves its range; returns why it ended.
  std::string walk(int direction, std::vector<Node>& nodes, std::vector<Bifurcation>& found);

  // In branch_bifurcations.cpp.
  /// The two ends of the shortest part of a step within which `beyond` becomes true, by bisection.
  using Beyond = std::function<bool(const Node& node)>;
  std::pair<Node, Node> locate(const Node& from, const Node& to, double step, const Beyond& beyond);
  /// The node at another tolerance, and A there.
  std::optional<Node> solved_anew(const Node& node, double part, Eigen::MatrixXd& A);
  /// How far a multiplier is from where it crosses.
  using Critical = std::function<double(const std::complex<double>& m)>;
  double error_of_crossing(const Node& found, const std::complex<double>& m, double step, const Critical& critical);
  /// What is crossed from a to b.
  void look_for_bifurcations(const Node& a, const Node& b, double step, std::vector<Bifurcation>& found);
  /// Where the parameter turns though no multiplier crosses: it has touched 1.
  void look_for_turn(const Node& a, const Node& b, double step, std::vector<Bifurcation>& found);

  Problem problem_;
  const BranchOptions& options_;
  bool may_rest_;  // over a period given an equilibrium repeats itself as well
  CycleStart start_;
  Branch branch_;
  Eigen::Index k_ = 0;
  double undecided_ = 0;
  Eigen::VectorXd scale_, whole_, residual_;
  Node first_;
  std::string why_;
};

}  // namespace costate
