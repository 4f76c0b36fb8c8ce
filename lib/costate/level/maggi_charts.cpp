// Which charts there are, and which one is in force: of the coordinates that are best, and of the rows that are there.
#include <fmt/format.h>

#include <algorithm>

#include "costate/base/error.h"
#include "costate/level/maggi_positions.h"

namespace costate {

std::vector<int> MaggiPositions::best_choice(const double* phi_q) const {
  int closed = 0;
  for (const int r : switched_) closed += assembly_.is_there(r) ? 1 : 0;
  return choose_independent(assembly_.jacobian(), phi_q, f_ - closed, weight_);
}

void MaggiPositions::add_chart(std::vector<int> independent, const std::vector<int>* of_reactions) {
  Choice c;
  if (!switched_.empty()) c.rows = rows_there(assembly_, switched_);
  const int places = static_cast<int>(c.rows.closed.size());
  c.rates = std::make_unique<MaggiChart>(assembly_.jacobian(), std::move(independent), c.rows.absent, places);
  if (!c.rows.slides.empty()) {
    calc_reaction_rows(assembly_, reactions_);
    c.forces = std::make_unique<MaggiChart>(assembly_.jacobian(),
                                            of_reactions ? *of_reactions : best_choice(reactions_.data()),
                                            c.rows.absent, places);
  }
  charts_.push_back(std::move(c));
}

void MaggiPositions::take_choice(std::vector<int> independent, const std::vector<int>* of_reactions) {
  MaggiRows rows;
  if (!switched_.empty()) rows = rows_there(assembly_, switched_);
  for (std::size_t c = 0; c < charts_.size(); ++c) {
    const Choice& made = charts_[c];
    if (made.rates->independent() != independent || !(made.rows == rows)) continue;
    if (of_reactions && made.forces && made.forces->independent() != *of_reactions) continue;
    chart_ = static_cast<int>(c);
    return;
  }
  add_chart(std::move(independent), of_reactions);
  chart_ = static_cast<int>(charts_.size()) - 1;
}

void MaggiPositions::change(double* R) {
  std::vector<int> choice = chart().independent();
  StateView s;
  s.t = last_.t;
  s.q = q_.data();
  if (R == nullptr || slides()) assembly_.calc_jacobian(s);
  if (R != nullptr) {
    improve_choice(choice, R, weight_);
    std::sort(choice.begin(), choice.end());
  } else {
    choice = best_choice(assembly_.phi_q.data());
  }
  if (!slides()) return take_choice(std::move(choice));
  calc_reaction_rows(assembly_, reactions_);
  const std::vector<int> of_reactions = best_choice(reactions_.data());
  take_choice(std::move(choice), &of_reactions);
}

void MaggiPositions::enter_rows(double t, const double* q, const double* z, int chart) {
  assembly_.switch_rows(z);
  if (chart >= 0) {
    chart_ = chart;
    return;
  }
  const MaggiRows wanted = rows_there(assembly_, switched_);
  if (rows() == wanted) return;
  StateView s;
  s.t = t;
  s.q = q;
  assembly_.calc_constraints(s);
  require_independent_rows(assembly_, wanted, t);
  std::vector<int> choice = best_choice(assembly_.phi_q.data());
  if (wanted.slides.empty()) return take_choice(std::move(choice));
  calc_reaction_rows(assembly_, reactions_);
  const std::vector<int> of_reactions = best_choice(reactions_.data());
  take_choice(std::move(choice), &of_reactions);
}

void MaggiPositions::require_rows() const {
  if (!switched_.empty() && !(rows_there(assembly_, switched_) == rows()))
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
