// Which chart is in force: of the coordinates that are best, and of the rows that are there.
#include <fmt/format.h>

#include <algorithm>

#include "costate/base/error.h"
#include "costate/level/maggi_positions.h"

namespace costate {

void MaggiPositions::change(double* R) {
  StateView s;
  s.t = last_.t;
  s.q = q_.data();
  if (R == nullptr || slides()) assembly_.calc_jacobian(s);
  if (R == nullptr) {
    chart_ = charts_.find_best(rows(), weight_);
    return;
  }
  std::vector<int> choice = chart().independent();
  improve_choice(choice, R, weight_);
  std::sort(choice.begin(), choice.end());
  chart_ = charts_.find_beside(rows(), choice, weight_);
}

void MaggiPositions::enter_rows(const StateView& s, int chart) {
  assembly_.switch_rows(s.z);
  if (s.t > kept_t_.back()) {
    // Behind it what sticks does so here, and first guesses of another place are far away.
    kept_t_.push_back(s.t);
    kept_q_.insert(kept_q_.end(), s.q, s.q + n_);
  }
  if (chart >= 0) {
    chart_ = chart;
    return;
  }
  MaggiRows wanted = rows_there(assembly_, switched_);
  if (rows().same_modes(wanted)) return;
  assembly_.calc_jacobian(s);
  find_dependent_rows(assembly_, switched_, wanted);
  chart_ = charts_.find_best(wanted, weight_);
}

void MaggiPositions::require_rows() const {
  if (!switched_.empty() && !rows_there(assembly_, switched_).same_modes(rows()))
    throw Error("MaggiPositions: a chart of other rows.");
}

void MaggiPositions::factor_reactions() {
  if (!slides()) return;
  calc_reaction_rows(assembly_, reactions_);
  if (!reaction_chart().factor(reactions_.data()))
    throw StepError(fmt::format("At t = {:.9g} s no coordinates are independent beside friction.", last_.t));
}

void MaggiPositions::add_places(const double* y, double* x) const {
  const MaggiCharts::Chart& c = charts_[chart_];
  const double* places = y + c.rates->independent().size();
  for (std::size_t k = 0; k < c.rows.closed.size(); ++k)
    if (!assembly_.holds_position(c.rows.closed[k])) x[c.rows.closed[k]] += places[k];
}

}  // namespace costate
