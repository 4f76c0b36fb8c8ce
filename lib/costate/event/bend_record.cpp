#include "costate/event/bend_record.h"

#include <algorithm>
#include <cmath>

namespace costate {

namespace {
constexpr double kAtOnce = 1e-12;
// Of a step: what is nearer to its beginning was met at the end of the last one.
constexpr double kOfStepBefore = 1e-3;
}  // namespace

BendRecord::BendRecord(Assembly& assembly, const Objective& objective, double rtol, double atol)
    : watch_(assembly, objective, rtol, atol, false) {}

void BendRecord::add_step(double from, double to, const GapTrace::States& at) {
  // Seen in a step that was taken anew since, or behind an event that has ended it; one at the end of the last step is
  // told a little behind that.
  const double seen = from + kOfStepBefore * (to - from);
  for (auto& of : met_)
    while (!of.empty() && of.back().t > seen) of.pop_back();
  watch_.each_passage(from, to, at, [&](const BendWatch::Passage& p) {
    if (met_.size() <= p.place) met_.resize(p.place + 1);
    std::vector<BendWatch::Passage>& of = met_[p.place];
    if (of.empty() || of.back().beyond != p.beyond) of.push_back(p);
  });
}

std::vector<double> BendRecord::passages() const {
  std::vector<double> times;
  for (const auto& of : met_)
    for (const BendWatch::Passage& p : of) times.push_back(p.t);
  std::sort(times.begin(), times.end());
  const auto same = [](double a, double b) { return b - a <= kAtOnce * std::abs(b); };
  times.erase(std::unique(times.begin(), times.end(), same), times.end());
  return times;
}

}  // namespace costate
