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
  Eigen::VectorXd next;    // P(x)
  Eigen::VectorXd turned;  // whole turns that were taken off its entries, rad
  Eigen::MatrixXd next_x, next_rho;
  double time = 0, travel = 0, psi = 0;  // s, m, cost
  Eigen::RowVectorXd time_x, travel_x, psi_x, time_rho, travel_rho, psi_rho;
  Eigen::VectorXd kappa;  // of the entries of next, of what is carried, of the time, of psi, where a cycle is one run
  std::vector<double> positions;  // where the next cycle begins
  std::vector<double> modes;      // of rigid contacts there
  std::vector<RunEvent> events;
  Counters counters;
  std::string integrator;
};

/// By nothing, by x, by x and the problem's last parameters (those that ReturnMap was told), by x and all of them.
enum class MapDerivatives { none, state, last, all };

/// A functional of one cycle: psi + next^T P + time T + travel s.
struct CycleWeights {
  Eigen::VectorXd next;
  double time = 0, travel = 0;
};

class ReturnMap {
 public:
  /// `last`: how many of the parameters are those of MapDerivatives::last.
  ReturnMap(const Problem& problem, const Section& section, std::vector<double> rho, int last = 0);

  /// x: as many as the section has coordinates; positions: of all coordinates, first guesses where x does not give
  /// them. Throws what runs throw.
  MapValue evaluate(const Eigen::VectorXd& x, const std::vector<double>& positions, MapDerivatives derivatives) const;
  /// x moved onto the section along the coordinate that takes it there soonest; with a period as it is.
  void onto_section(Eigen::VectorXd& x, const std::vector<double>& positions) const;
  // Of a cycle that was found. In periodicity.cpp.
  /// Throws SolverError where a contact is not again what it was at the start.
  void require_same_modes(const MapValue& value) const;
  /// Throws ModelError where a contact that sticks at a place of its own, which x does not hold, is elsewhere then.
  void require_same_place(const Eigen::VectorXd& x, const std::vector<double>& positions, const MapValue& value) const;
  /// Throws ModelError where the cycle that begins a period later (none: at another time) ends later or elsewhere than
  /// that from x, by more than sqrt(rtol) of it.
  void require_same_later(const Eigen::VectorXd& x, const std::vector<double>& positions, const MapValue& value) const;
  /// The same where what goes round does not begin anew a whole turn on, or many turns on.
  void require_whole_turns(const Eigen::VectorXd& x, const std::vector<double>& positions, const MapValue& value) const;
  /// The consistent start at x: q, v and z of the mechanism.
  struct State {
    std::vector<double> q, v, z;
  };
  State state(const Eigen::VectorXd& x, const std::vector<double>& positions) const;
  /// Before one is looked for: throws ModelError where forces or constraints at this state do not repeat themselves
  /// after the period (none: where they depend on time at all), or change by a parameter as they do not repeat. In
  /// periodicity.cpp.
  void require_periodic(const Eigen::VectorXd& x, const std::vector<double>& positions) const;

  /// The functional by one run of its own, for gradients by any method: the problem that begins at x and ends at the
  /// time of `value`, with the rest in its terminal cost; its first parameters are those of rho. `more` is what the
  /// gradient has besides, of the way's angle and of where the cycle begins. Of cycles that are one run. In
  /// linear_problem.cpp.
  Problem linear_problem(const Eigen::VectorXd& x, const std::vector<double>& positions, const MapValue& value,
                         const CycleWeights& weights, std::vector<double>& values, Eigen::VectorXd& more) const;
  /// The derivatives along each column of w (of all entries of x) of (u^T P)_x and (u^T P)_rho, below one another, for
  /// each column of u, by exact second derivatives (in map_curvature.cpp). Throws CapabilityError where they are not
  /// carried along, and what runs throw.
  std::vector<Eigen::MatrixXd> curvature(const Eigen::VectorXd& x, const std::vector<double>& positions,
                                         const Eigen::MatrixXd& u, const Eigen::MatrixXd& w, Counters& counters) const;
  /// Products with columns `along` (of x and the map's parameters) of the second derivatives of psi + u^T P + w T + l
  /// s, of cycles that are one run. Throws as curvature() does.
  Eigen::MatrixXd second_products(const Eigen::VectorXd& x, const std::vector<double>& positions, const MapValue& value,
                                  const CycleWeights& of, const Eigen::MatrixXd& along, Counters& counters) const;
  /// Whose motion that is: the problem's own formulation, or one that has second derivatives.
  std::string curvature_formulation() const;
  /// The motion that begins at x, as long as the problem's own: its first parameters are those of rho.
  Problem motion_from(const Eigen::VectorXd& x, const std::vector<double>& positions,
                      std::vector<double>& values) const;

  const Problem& problem() const { return problem_; }
  const Section& section() const { return section_; }
  const std::vector<double>& rho() const { return rho_; }
  void set_tolerance(double rtol, double atol);

 private:
  /// What sticks at this state where a number of its own has it: "contact.foot", or nothing.
  std::string sticks_at_place(const State& state) const;
  /// Whether forces and constraints are the same with all positions moved by that; rows that say where something sticks
  /// apart.
  bool acts_alike(const Eigen::VectorXd& x, const std::vector<double>& positions, const State& begin,
                  const std::vector<double>& moved) const;
  /// How steep the way is, and its derivatives by the varied parameters.
  double angle(int varied, Eigen::RowVectorXd& angle_rho) const;
  /// What the cycle from x does otherwise than `value`, beyond whole turns that it begins further on; or nothing.
  std::string otherwise(const Eigen::VectorXd& x, const std::vector<double>& positions, const MapValue& value,
                        const Eigen::VectorXd& further) const;
  MapValue once(const Eigen::VectorXd& x, const std::vector<double>& positions, MapDerivatives derivatives,
                bool last) const;
  /// The problem that begins at x: its start numbers are parameters (if varied), then the last `varied` of rho, then
  /// one that holds all other numbers.
  Problem problem_at(const Eigen::VectorXd& x, const std::vector<double>& positions, bool vary_x, int varied,
                     std::vector<double>& values) const;
  /// u^T P + w T + l s as the terminal cost of the run to the time of `value`, beside psi or alone, its weights those
  /// of the problem's own outputs: u_i (V_i - s e_i) + l s with s = (V_c - x_c)/e_c. T stands there as the time itself.
  struct RunOfWeights {
    Problem problem;
    double by_travel = 0;  // l - sum of u_i e_i, of s
    double by_turn = 0;    // -sum of u_i de_i/dangle, of s
    double turn = 0;       // de_c/dangle / e_c
    double by_start = 0;   // of where what is carried along begins
    Eigen::RowVectorXd angle_rho = {};
  };
  RunOfWeights run_of_weights(const Eigen::VectorXd& x, const std::vector<double>& positions, bool vary_x,
                              bool with_psi, const MapValue& value, const CycleWeights& of,
                              std::vector<double>& values) const;
  /// Products with the columns of `along` of the second derivatives of that run's cost.
  Eigen::MatrixXd products_of_run(const RunOfWeights& of, const std::vector<double>& values, const MapValue& value,
                                  double by_travel, const Eigen::MatrixXd& along, Counters& counters) const;
  Eigen::MatrixXd curvature_once(const Eigen::VectorXd& x, const std::vector<double>& positions, const MapValue& value,
                                 const Eigen::VectorXd& u, const Eigen::MatrixXd& w, Counters& counters) const;
  /// Where what is carried along begins at x, by all of the parameters of such a problem.
  double carried_start(const Problem& problem, const std::vector<double>& values, Eigen::RowVectorXd* by) const;
  int parameters() const { return static_cast<int>(rho_.size()); }

  Problem problem_;
  const Section& section_;
  std::vector<double> rho_;
  int last_;
};

}  // namespace costate
