#include "costate/level/maggi_charts.h"

#include "costate/level/maggi_choice.h"

namespace costate {

bool MaggiCharts::Chart::is(const MaggiRows& wanted, const std::vector<int>& independent,
                            const std::vector<int>* of_reactions) const {
  return rates->independent() == independent && rows.same_modes(wanted) && rows.closed == wanted.closed &&
         (!of_reactions || forces->independent() == *of_reactions);
}

int MaggiCharts::find(const MaggiRows& rows, const std::vector<int>& independent,
                      const std::vector<int>* of_reactions) {
  for (std::size_t c = 0; c < charts_.size(); ++c)
    if (charts_[c].is(rows, independent, of_reactions)) return static_cast<int>(c);
  Chart c;
  const int places = static_cast<int>(rows.closed.size());
  c.rows = rows;
  c.rates = std::make_unique<MaggiChart>(assembly_.jacobian(), independent, rows.absent, places);
  if (of_reactions) c.forces = std::make_unique<MaggiChart>(assembly_.jacobian(), *of_reactions, rows.absent, places);
  charts_.push_back(std::move(c));
  return static_cast<int>(charts_.size()) - 1;
}

std::vector<int> MaggiCharts::best(const MaggiRows& rows, const double* phi_q,
                                   const std::vector<double>& weight) const {
  return choose_independent(assembly_.jacobian(), phi_q, freedoms_ - static_cast<int>(rows.closed.size()), weight);
}

int MaggiCharts::find_best(const MaggiRows& rows, const std::vector<double>& weight) {
  return find_beside(rows, best(rows, assembly_.phi_q.data(), weight), weight);
}

int MaggiCharts::find_beside(const MaggiRows& rows, const std::vector<int>& independent,
                             const std::vector<double>& weight) {
  if (rows.slides.empty()) return find(rows, independent, nullptr);
  calc_reaction_rows(assembly_, reactions_);
  const std::vector<int> of_reactions = best(rows, reactions_.data(), weight);
  return find(rows, independent, &of_reactions);
}

void MaggiCharts::forget_history() {
  for (const Chart& c : charts_) {
    c.rates->forget_history();
    if (c.forces) c.forces->forget_history();
  }
}

long MaggiCharts::factorizations() const {
  long sum = 0;
  for (const Chart& c : charts_) sum += c.rates->factorizations() + (c.forces ? c.forces->factorizations() : 0);
  return sum;
}

}  // namespace costate
