// Looks at a motion while it is computed, at the steps that an integrator accepts: whether the constraints still hold,
// in position and velocity, and whether their rows keep their rank (lib/README.md (16)). It knows no formulation: what
// an integrator makes of the equations is judged by (t, q, v) alone, with an assembly of its own.
//
// Drift: row i is off by |Phi_i| / |Phi_q,i|, the least move of the coordinates that would satisfy it. Against the
// length of the row's own element this is what the mechanism has been torn by.
//
// Rank: the rows of Phi_q, scaled to length 1, one after the other: the distance of each from the span of those before
// it, by an LDL^T of Phi_q Phi_q^T (its pivots are the squares). Where rows become dependent one of these distances
// falls to zero like |t - t*|, and rises again behind it: a minimum between samples is looked for where samples have
// one. A row that is dependent from the start to the end is redundant, and no event.
#pragma once

#include <Eigen/SparseCholesky>
#include <string>
#include <vector>

#include "costate/analysis/formula_jump_watch.h"
#include "costate/analysis/jump_watch.h"
#include "costate/analysis/line_watch.h"
#include "costate/analysis/travelled_laws.h"
#include "costate/assembly/assembly.h"
#include "costate/linear/row_products.h"

namespace costate {

struct WatchSettings {
  double rtol = 1e-8;
  bool carries_redundancy = false;  // of the formulation: whether dependent rows are no error
  std::string formulation;
  bool weighted = false;       // a weight holds the constraints
  bool fixed_steps = false;    // no error test makes steps short where it matters
  Objective objective = {};    // whose formulas are watched, too
  bool chosen_weight = false;  // a penalty whose weight is the user's choice, and may be soft on purpose
};

class MotionWatch {
 public:
  /// rho: one value a parameter of the selection.
  MotionWatch(std::shared_ptr<const Mechanism> mechanism, const ParameterSelection& parameters, const double* rho,
              WatchSettings settings);

  /// The start, each accepted step in order of time, the end (which may be a step that has been seen). Throw
  /// SolverError where the constraints are torn, where rows depend on each other from the start and the formulation
  /// cannot carry that, and for what is not finite.
  void begin(double t, const double* q, const double* v);
  void step(double t, const double* q, const double* v);
  void finish(double t, const double* q, const double* v);

  /// Of a force that jumps as its ends pass through each other: a sentence without its advice.
  std::optional<std::string> jump() const { return lines_.met(); }
  /// Why no derivative of the run knows all of what it does, with an advice: of a force that jumps in it.
  std::optional<std::string> without_derivative() const;
  /// Whole sentences; complete after finish().
  std::vector<std::string> warnings() const;

  /// The largest drift met, as a part of the row's own length, and that of rates, in such parts a second.
  double largest_drift() const { return worst_position_.relative; }
  double largest_rate_drift() const { return worst_velocity_.relative; }
  /// The drift that a warning tells of, or 0.
  double told_drift() const { return worst_position_.relative > drift_warning_ ? worst_position_.relative : 0; }
  /// Whether rows depended on others from the start.
  bool began_redundant() const { return began_redundant_; }

 private:
  /// A row that lost its independence, between samples.
  struct RankEvent {
    double t;
    int row;
    double distance;  // from the span of the others, of 1
  };
  struct Drift {
    double t = 0, relative = 0, length = 0;
    int row = -1;
  };
  struct Point {
    double t = 0;
    std::vector<double> q, v;
  };
  struct Sample {
    double t = 0;
    std::vector<double> distance;  // of each row
  };
  void look_for_jumps(double t, const double* q, const double* v);
  void sample(double t, const double* q, const double* v);
  void look_at_drift(double t, const double* v);
  void calc_distances(std::vector<double>& out);
  void look_for_minima(bool at_end);
  void keep_those_that_may_vanish(std::vector<int>& rows, double from, double to);
  void refine(int row, double from, double to);
  void calc_distances_at(double t);
  double distance_at(int row, double t);
  void refuse_dependent_rows(double t);
  /// Of the rows as they were last scaled to 1, largest first.
  Eigen::VectorXd singular_values() const;
  static int rank_of(const Eigen::VectorXd& singular);
  int first_rank();
  /// Whether rows that began redundant have another rank than at the start; of very many rows it is taken to be so.
  bool rank_has_risen(double t);
  /// Whether the rank that the rows have beside a place is lost, or nearly, there; likewise.
  bool rank_falls(double from, double at, double to);
  void require_finite(double t, const double* q, const double* v) const;
  [[noreturn]] void torn(const Drift& drift) const;
  std::string with_unit(int row, double length) const;

  Assembly assembly_;
  WatchSettings settings_;
  std::vector<std::string> rows_;
  std::vector<char> metric_;        // of coordinates: whether they are lengths
  std::vector<char> metric_row_;    // of rows: whether they move lengths
  std::vector<double> row_length_;  // m
  double length_ = 1;               // of the mechanism, m
  double rank_limit_, drift_warning_, drift_error_;
  std::vector<char> redundant_;  // rows that depend on others at the start
  bool began_redundant_ = false;
  std::vector<double> row_size_, length_part_, angle_part_;
  std::vector<double> scaled_;  // Phi_q with rows of length 1
  RowProducts products_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> ldlt_;
  bool analyzed_ = false;
  Point first_;                  // the start, where rows are redundant there
  int first_rank_ = -1;          // their rank, once it is asked for
  std::vector<Point> ring_;      // of the last steps
  std::size_t points_ = 0;       // ever put into it
  std::vector<Sample> samples_;  // the last three, oldest first
  std::vector<double> q_, v_, distances_;
  std::vector<double> farthest_;  // the largest distances so far
  std::vector<double> phid_;
  Drift worst_position_, worst_velocity_;
  double worst_speed_ = 0, speed_ = 0;
  std::vector<RankEvent> events_;
  std::vector<std::string> near_dependent_;
  long steps_ = 0;
  LineWatch lines_;
  JumpWatch jumps_;
  FormulaJumpWatch formulas_;
  TravelledLaws travelled_;
};

}  // namespace costate
