#include "costate/level/branch_watch.h"

#include <algorithm>
#include <cmath>

namespace costate {

namespace {
// Of a coordinate's largest speed so far: where it is slower, it turns round at rest.
constexpr double kSlow = 1e-3;
// Of the mechanism's size: what moves by less over the step does not come past where it turns back.
constexpr double kStill = 1e-6;
}  // namespace

void BranchWatch::keep(const StateView& s, int n) {
  const auto count = static_cast<std::size_t>(n);
  if (!(s.t >= t_)) largest_.assign(count, 0);
  t_ = s.t;
  v_.assign(s.v, s.v + n);
  a_.assign(s.a, s.a + n);
  for (std::size_t i = 0; i < count; ++i) largest_[i] = std::max(largest_[i], std::abs(v_[i]));
}

bool BranchWatch::turns_round(const StateView& s, std::size_t i, const std::vector<double>& sizes) const {
  const double before = v_[i], after = s.v[i];
  return before * after < 0 && (s.t - t_) * (std::abs(before) + std::abs(after)) >= kStill * sizes[i] &&
         std::min(std::abs(before), std::abs(after)) >= kSlow * largest_[i];
}

int BranchWatch::turned(const StateView& s, double part, const std::vector<double>& sizes,
                        const std::vector<int>& independent) const {
  if (!(s.t > t_)) return -1;
  const double h = s.t - t_;
  if (std::none_of(independent.begin(), independent.end(),
                   [&](int i) { return turns_round(s, static_cast<std::size_t>(i), sizes); }))
    return -1;
  for (std::size_t i = 0; i < v_.size(); ++i) {
    if (!turns_round(s, i, sizes)) continue;
    const double before = v_[i], after = s.v[i], by_accelerations = 0.5 * h * (a_[i] + s.a[i]);
    if (std::abs(after - before - by_accelerations) > part * (std::abs(before) + std::abs(after)))
      return static_cast<int>(i);
  }
  return -1;
}

}  // namespace costate
