// Positions of a mechanism from its independent coordinates: q with Phi(q, t) = 0 and B q = y, by Newton's method from
// the last positions, down to rounding; and the charts (choices of B) that a run has needed.
//
// Of several configurations with the same independent coordinates the one near the first guess is meant. First
// guesses: the last positions, continued along their velocities; or, for a time far from the last, positions that
// remember() has kept (an adjoint's run through stored segments jumps in time). When Newton's method fails from there,
// the way from the guess to the wanted state is gone in small steps; and where drivers move the mechanism far in the
// time between, it is gone at once: of a mechanism that they move alone no error of integration keeps steps short, and
// behind a place where its links come in line there may be positions again that it cannot reach.
#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/level/maggi_charts.h"
#include "costate/level/maggi_choice.h"

namespace costate {

class MaggiPositions {
 public:
  explicit MaggiPositions(Assembly& assembly);

  int freedoms() const { return f_; }
  bool redundant() const { return redundant_; }

  /// Forgets all charts and guesses and chooses the best chart at consistent positions, of the rows that z has.
  void start(const StateView& s);
  bool started() const { return chart_ >= 0; }
  /// In the chart of others that are started, near their last positions, without what they keep. Whether the chart is
  /// another than before.
  bool begin_as(const MaggiPositions& other);
  /// q as solve() finds it, and v of rates yd of y (n, with room for m + f), by the factors of others that begin_as()
  /// was of; false where these are from positions too far away.
  bool solve_by_factors_of(const MaggiPositions& other, double t, const double* y, const double* yd,
                           std::vector<double>& v);
  /// Finds q at a time between what was remembered and the last positions, with the rates at both as the guide, as
  /// solve() does; false where these lead to no positions near by.
  bool solve_between(double t, const double* y);
  int chart_index() const { return chart_; }
  void use_chart(int chart) { chart_ = chart; }
  MaggiChart& chart() { return *charts_[chart_].rates; }
  const MaggiChart& chart() const { return *charts_[chart_].rates; }
  /// That of Phi_r where contacts slide (maggi_rows.h), else the same; factored by factor_reactions().
  MaggiChart& reaction_chart() { return charts_[chart_].reactions(); }
  bool slides() const { return charts_[chart_].forces != nullptr; }
  /// Where contacts slide, at the rows that the assembly has evaluated. Throws StepError where they are singular.
  void factor_reactions();
  /// The rows of the chart in force that come and go.
  const MaggiRows& rows() const { return charts_[chart_].rows; }
  /// x += the places of y at their rows.
  void add_places(const double* y, double* x) const;
  /// The chart in force is one of the rows that z has: this chart, or that in force, or one that has been made before,
  /// or the best one at these positions.
  void enter_rows(const StateView& s, int chart = -1);
  /// Throws Error where the assembly has other rows than the chart.
  void require_rows() const;
  /// How far the chart is from the best one, given `count` columns of its R from `first` on: 1 is best, infinite is
  /// singular.
  double ratio(const double* R, int first, int count) const {
    const int last = std::min(first + count, static_cast<int>(chart().independent().size()));
    return worst_ratio({chart().independent().data() + first, static_cast<std::size_t>(std::max(0, last - first))}, R,
                       weight_);
  }
  /// Of the reactions' chart, given all of its R.
  double reaction_ratio(const double* R) const {
    return worst_ratio(charts_[chart_].forces->independent(), R, weight_);
  }
  /// Makes a chart for the choice that is best for the R of the chart in force (overwritten), unless there is one, and
  /// uses it. Null: for the choice made anew at the last solved positions.
  void change(double* R);

  /// Finds q; afterwards the chart is factored there, and phi_t of the assembly is evaluated. Throws StepError when the
  /// positions cannot be reached.
  void solve(double t, const double* y);
  const double* q() const { return q_.data(); }
  /// Velocities and (or null) accelerations at the last solved positions, for the next first guess.
  void set_rates(const double* v, const double* a);
  /// Keeps the last solved positions as a first guess for times nearby. To be called in order of time.
  void remember();
  /// What was solved since then was a step that is not taken: first guesses are not of its positions, which may be
  /// those of another branch.
  void go_back() {
    if (!kept_t_.empty()) last_ = remembered_;
  }
  /// The next solve() uses nothing but the first guess, and that again when it is repeated for the same time.
  void forget_history();

  /// What each coordinate moves by where it moves by the mechanism's size.
  const std::vector<double>& sizes() const { return sizes_; }

  long iterations() const { return iterations_; }
  long factorizations() const;

 private:
  // In sizes of the mechanism: a factorization serves for steps from positions as near as this; a guess is continued
  // along its velocities no farther than that.
  static constexpr double kNear = 0.05, kFar = 0.2;
  void take_solved(double t);
  /// `choice`: of the first chart, or null where the best one is to be found.
  void begin(const StateView& s, const MaggiCharts::Chart* choice);
  /// The first guess for time t in q_; returns the time that it belongs to. `far`: no extrapolation.
  double guess(double t, bool from_kept, bool far);
  double repeated_guess(double t, bool& far);
  std::size_t nearest_kept(double t) const;
  const double* kept(std::size_t k) const { return kept_q_.data() + k * static_cast<std::size_t>(n_); }
  bool newton(double t, const double* y);
  /// Into how many parts the way from the guess to y is to be divided at least.
  int parts_to(double t, const double* y);
  /// y_from_ := y of the guess in q_, at its time, with the places that it has; y is where it is to go.
  void read_from(double t, const double* y);
  bool follow(double t_guess, double t, const double* y, int parts);
  /// How far drivers alone move the mechanism in dt, by its rates at the last positions; 0 where these are not known.
  double driven_way(double dt);
  /// Whether drivers move anything where phi_t was evaluated last.
  bool driven() const;
  double moved_since(const std::vector<double>& q) const;
  /// From q_ at t_from, in steps along the rates that move nothing far.
  bool walk(double t_from, double t, const double* y);
  /// The largest entry of changes x of the coordinates that constraints have, in m: angles count with the mechanism's
  /// size where it is small, else as they are.
  double largest(const double* x) const;
  double measure(std::size_t i) const { return std::min(1.0, weight_[i]); }
  /// The same of the difference of all coordinates.
  double distance_between(const std::vector<double>& a, const std::vector<double>& b) const;

  Assembly& assembly_;
  int n_, m_, f_;
  std::vector<int> switched_;  // rows that come and go
  bool redundant_;
  MaggiCharts charts_;
  int chart_ = -1;
  long dropped_factorizations_ = 0, iterations_ = 0;
  std::vector<double> weight_;     // of coordinates, for the choice
  std::vector<char> constrained_;  // whether any constraint has it: others go any way in one step
  bool branches_ = true;           // whether positions may have others beside them; contacts alone have no others
  double scale_ = 1;               // size of the mechanism, m
  std::vector<double> sizes_;      // of each coordinate: scale_ or, of an angle, 1
  std::vector<double> q_, step_, y_from_, y_part_, factored_at_, walked_, guessed_, rate_, reactions_;
  int factored_chart_ = -1;
  struct Last {
    double t = 0;
    std::vector<double> q, v, a;
    bool accelerated = false;  // a is known
  } last_, remembered_;
  std::vector<double> kept_t_, kept_q_;
  struct Repeated {  // the first guess of a solve() after forget_history()
    double t, from;
    int chart;
    bool far;
    std::vector<double> q;
  };
  std::vector<Repeated> repeated_;
  bool forgotten_ = false;
};

}  // namespace costate
