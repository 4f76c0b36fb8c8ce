// The return map P of a section, x -> P(x, rho): one run from the state x on the section to the next time that the
// motion meets it, with its derivatives by the forward sensitivities of that run, through every event on the way.
// Where an event ends the run, with h its guard and w what is read there (lib/README.md (17.5)),
//   dw = (w + kappa h)_x dx + (w + kappa h)_rho drho,   kappa = -w'/h'
#pragma once

#include <Eigen/Core>

#include "costate/cycle/section.h"

namespace costate {

/// P and what else a cycle gives, with derivatives by x and rho (rows; empty where none were asked for).
struct MapValue {
  Eigen::VectorXd next;  // P(x)
  Eigen::MatrixXd next_x, next_rho;
  double time = 0, travel = 0, psi = 0;  // s, m, cost
  Eigen::RowVectorXd time_x, travel_x, psi_x, time_rho, travel_rho, psi_rho;
  Eigen::VectorXd kappa;          // of the entries of next, of the time, of psi, where a cycle is one run
  std::vector<double> positions;  // where the next cycle begins
  std::vector<RunEvent> events;
  Counters counters;
  std::string integrator;
};

enum class MapDerivatives { none, state, all };

class ReturnMap {
 public:
  ReturnMap(const Problem& problem, const Section& section, std::vector<double> rho);

  /// x: as many as the section has coordinates; positions: of all coordinates, first guesses where x does not give
  /// them. Throws what runs throw.
  MapValue evaluate(const Eigen::VectorXd& x, const std::vector<double>& positions, MapDerivatives derivatives) const;
  /// x moved onto the section along the coordinate that takes it there soonest; with a period as it is.
  void onto_section(Eigen::VectorXd& x, const std::vector<double>& positions) const;
  /// The consistent start at x: q, v and z of the mechanism.
  struct State {
    std::vector<double> q, v, z;
  };
  State state(const Eigen::VectorXd& x, const std::vector<double>& positions) const;
  /// Throws ModelError where forces or constraints at this state do not repeat themselves after the period (none: where
  /// they depend on time at all), or change by a parameter as they do not repeat.
  void require_periodic(const Eigen::VectorXd& x, const std::vector<double>& positions) const;

  /// psi + l^T P by one run of its own, for gradients by any method: the problem that begins at x and ends at the time
  /// of `value`, with l^T P in its terminal cost; its first parameters are those of rho. `more` is what the gradient
  /// has besides, of the way's angle. Of cycles that are one run.
  Problem linear_problem(const Eigen::VectorXd& x, const std::vector<double>& positions, const MapValue& value,
                         const Eigen::VectorXd& l, std::vector<double>& values, Eigen::VectorXd& more) const;

  const Problem& problem() const { return problem_; }
  const Section& section() const { return section_; }
  const std::vector<double>& rho() const { return rho_; }
  void set_tolerance(double rtol, double atol);

 private:
  MapValue once(const Eigen::VectorXd& x, const std::vector<double>& positions, MapDerivatives derivatives,
                bool last) const;
  /// The problem that begins at x: its start numbers are parameters, then those of rho (if varied), then one that holds
  /// all other numbers.
  Problem problem_at(const Eigen::VectorXd& x, const std::vector<double>& positions, bool vary_x, bool vary_rho,
                     std::vector<double>& values) const;

  Problem problem_;
  const Section& section_;
  std::vector<double> rho_;
};

}  // namespace costate
