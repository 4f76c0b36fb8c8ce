// Which charts there are, and which one is in force: of the coordinates that are best, and of the rows that are there.
#include <fmt/format.h>

#include <algorithm>

#include "costate/base/error.h"
#include "costate/level/maggi_positions.h"

namespace costate {

std::vector<int> MaggiPositions::best_choice(const MaggiRows& rows, const double* phi_q) const {
  return choose_independent(assembly_.jacobian(), phi_q, f_ - static_cast<int>(rows.closed.size()), weight_);
}

void MaggiPositions::add_chart(MaggiRows rows, std::vector<int> independent, const std::vector<int>* of_reactions) {
  Choice c;
  const int places = static_cast<int>(rows.closed.size());
  c.rates = std::make_unique<MaggiChart>(assembly_.jacobian(), std::move(independent), rows.absent, places);
  if (of_reactions) c.forces = std::make_unique<MaggiChart>(assembly_.jacobian(), *of_reactions, rows.absent, places);
  c.rows = std::move(rows);
  charts_.push_back(std::move(c));
}

void MaggiPositions::take_choice(const MaggiRows& rows, std::vector<int> independent,
                                 const std::vector<int>* of_reactions) {
  for (std::size_t c = 0; c < charts_.size(); ++c) {
    const Choice& made = charts_[c];
    if (made.rates->independent() != independent || !made.rows.same_modes(rows) || made.rows.closed != rows.closed)
      continue;
    if (of_reactions && made.forces->independent() != *of_reactions) continue;
    chart_ = static_cast<int>(c);
    return;
  }
  add_chart(rows, std::move(independent), of_reactions);
  chart_ = static_cast<int>(charts_.size()) - 1;
}

void MaggiPositions::take_best(const MaggiRows& rows) {
  std::vector<int> choice = best_choice(rows, assembly_.phi_q.data());
  if (rows.slides.empty()) return take_choice(rows, std::move(choice), nullptr);
  calc_reaction_rows(assembly_, reactions_);
  const std::vector<int> of_reactions = best_choice(rows, reactions_.data());
  take_choice(rows, std::move(choice), &of_reactions);
}

void MaggiPositions::change(double* R) {
  StateView s;
  s.t = last_.t;
  s.q = q_.data();
  const MaggiRows rows = this->rows();
  if (R == nullptr || slides()) assembly_.calc_jacobian(s);
  if (R == nullptr) return take_best(rows);
  std::vector<int> choice = chart().independent();
  improve_choice(choice, R, weight_);
  std::sort(choice.begin(), choice.end());
  if (!slides()) return take_choice(rows, std::move(choice), nullptr);
  calc_reaction_rows(assembly_, reactions_);
  const std::vector<int> of_reactions = best_choice(rows, reactions_.data());
  take_choice(rows, std::move(choice), &of_reactions);
}

void MaggiPositions::enter_rows(double t, const double* q, const double* z, int chart) {
  assembly_.switch_rows(z);
  if (t > kept_t_.back()) {
    // Behind it what sticks does so here, and first guesses of another place are far away.
    kept_t_.push_back(t);
    kept_q_.insert(kept_q_.end(), q, q + n_);
  }
  if (chart >= 0) {
    chart_ = chart;
    return;
  }
  MaggiRows wanted = rows_there(assembly_, switched_);
  if (rows().same_modes(wanted)) return;
  StateView s;
  s.t = t;
  s.q = q;
  assembly_.calc_constraints(s);
  find_dependent_rows(assembly_, switched_, wanted);
  take_best(wanted);
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
  const Choice& c = charts_[static_cast<std::size_t>(chart_)];
  const double* places = y + c.rates->independent().size();
  for (std::size_t k = 0; k < c.rows.closed.size(); ++k)
    if (!assembly_.holds_position(c.rows.closed[k])) x[c.rows.closed[k]] += places[k];
}

}  // namespace costate
