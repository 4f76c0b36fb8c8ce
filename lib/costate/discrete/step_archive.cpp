#include "costate/discrete/step_archive.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace costate {

namespace {
/// Fetches numbers that the next step back will read: hardware follows forward streams better.
void fetch(const double* from, std::size_t count) {
  for (std::size_t i = 0; i < count; i += 8) __builtin_prefetch(from + i);
}
/// Left uninitialized, so that memory is only claimed as it is used.
std::unique_ptr<double[]> numbers(std::size_t count) { return std::unique_ptr<double[]>(new double[count]); }
// Pivot orders change seldom; a run that changes them more often has its factors made again.
constexpr int kPivotOrders = 32;
}  // namespace

StepArchive::StepArchive(DiscreteScheme& scheme, long steps, double bytes, long segment_steps)
    : scheme_(scheme), steps_(std::max(1L, steps)), record_size_(scheme.record_size()) {
  const double record = static_cast<double>(record_size_ * sizeof(double));
  const double n = static_cast<double>(steps_);
  if (segment_steps > 0) {
    segment_ = std::min(segment_steps, steps_);
  } else if ((n + 1) * record <= bytes) {
    segment_ = steps_;
  } else {
    // The largest K with (n / K + K) records in the budget, or the least memory, K = sqrt(n).
    const double affordable = bytes / record, half = affordable / 2;
    const double longest = half + std::sqrt(std::max(0.0, half * half - n));
    segment_ = std::min(steps_, std::max(static_cast<long>(std::sqrt(n)) + 1, static_cast<long>(longest) - 1));
  }
  const auto slots = static_cast<std::size_t>(segment_), kept = static_cast<std::size_t>(checkpoints());
  for (std::size_t i = 0; i < kept; ++i) checkpoints_.push_back(numbers(record_size_));
  records_ = numbers(slots * record_size_);
  factors_.resize(slots);
  // A tenth more than the present factors take: pivot orders change.
  const double left = std::max(0.0, bytes / sizeof(double) - static_cast<double>((kept + slots) * record_size_));
  arena_size_ = static_cast<std::size_t>(
      std::min(left, 1.1 * static_cast<double>(slots) * static_cast<double>(scheme.matrices().saved_size())));
  arena_ = numbers(arena_size_);
  scheme.matrices().keep_pivot_orders(kPivotOrders);
}

double StepArchive::bytes() const {
  return static_cast<double>((static_cast<std::size_t>(checkpoints() + segment_) * record_size_ + arena_size_) *
                             sizeof(double));
}

void StepArchive::keep() {
  const long k = scheme_.index();
  last_ = std::max(last_, k);
  if (k % segment_ == 0 && k < steps_) scheme_.save(checkpoints_[static_cast<std::size_t>(k / segment_)].get());
  if (k == 0) return;
  if (const auto c = static_cast<std::size_t>((k - 1) / segment_); c == checkpoints_.size()) {
    checkpoints_.push_back(numbers(record_size_));
    scheme_.save_beginning(checkpoints_.back().get());
  }
  const double h = scheme_.regular_length();
  const long grid = std::lround((scheme_.time() - scheme_.start_time()) / h);
  if (scheme_.length() != h || scheme_.time() != scheme_.start_time() + static_cast<double>(grid) * h)
    lengths_[k] = {scheme_.length(), scheme_.time()};
  else if (k - grid != ahead_before(k))
    ahead_[k] = k - grid;
  first_ = (k - 1) / segment_ * segment_;
  if (k == first_ + 1) arena_used_ = 0;
  scheme_.save(slot(k));
  Factors& f = factors_[static_cast<std::size_t>(k - 1 - first_)];
  const std::size_t size = scheme_.matrices().saved_size();
  f.kept = arena_used_ + size <= arena_size_;
  if (!f.kept) return;
  f.offset = arena_used_;
  arena_used_ += size;
  f.saved = scheme_.matrices().save(arena_.get() + f.offset);
}

void StepArchive::keep_behind_cut() {
  std::vector<double>& record = behind_[scheme_.index()];
  record.resize(record_size_);
  scheme_.save(record.data());
}

long StepArchive::ahead_before(long k) const {
  const auto at = ahead_.upper_bound(k);
  return at == ahead_.begin() ? 0 : std::prev(at)->second;
}

void StepArchive::step_again(long k) {
  if (const auto cut = behind_.find(k - 1); cut != behind_.end()) {
    scheme_.load(k - 1, cut->second.data());
    scheme_.factor_here();
  }
  const auto own = lengths_.find(k);
  const double h = scheme_.regular_length();
  if (own == lengths_.end())
    scheme_.step(h, scheme_.start_time() + static_cast<double>(k - ahead_before(k)) * h);
  else
    scheme_.step(own->second.h, own->second.t_end);
  keep();
}

bool StepArchive::bring_back(long k) {
  if (k == 0) {
    scheme_.load(0, checkpoints_[0].get());
    return false;
  }
  const long first = (k - 1) / segment_ * segment_;
  if (first != first_) {
    scheme_.load(first, checkpoints_[static_cast<std::size_t>(first / segment_)].get());
    scheme_.factor_here();
    for (const long until = std::min(first + segment_, last_); scheme_.index() < until;)
      step_again(scheme_.index() + 1);
  }
  scheme_.load(k, slot(k));
  if (k > first_ + 1) {
    const Factors& next = factors_[static_cast<std::size_t>(k - 2 - first_)];
    fetch(slot(k - 1), record_size_);
    if (next.kept) fetch(arena_.get() + next.offset, scheme_.matrices().saved_size());
  }
  const Factors& f = factors_[static_cast<std::size_t>(k - 1 - first_)];
  return f.kept && scheme_.matrices().restore(f.saved, arena_.get() + f.offset);
}

}  // namespace costate
