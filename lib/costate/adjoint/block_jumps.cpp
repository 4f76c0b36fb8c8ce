#include "costate/adjoint/block_jumps.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace costate {

namespace {

/// Of an entry's largest value along the motion, and of the largest entry of its block.
constexpr double kJump = 1e-6, kNoise = 1e-9;
/// Of what rounding makes of an entry, which is all that there is of some at rest: fourth differences hold it 16 times,
/// and it was seen at one place a step.
constexpr double kOfRounding = 64;
/// Of a step: where rounding is looked at, and over how much: coordinates change by some of
/// their last digits, and what is smooth by less than counts.
constexpr double kRoundingAt = 0.381966, kRoundingOver = 1e-8;
/// Of a step: from here on the motion is that of the step, and no longer of the one before.
constexpr double kWithinStep = 1e-9;
/// Evaluations: some a step and some a hundred a jump are enough. Where blocks are rough everywhere (rounding of large
/// terms that cancel) the search would find no end.
constexpr long kEvaluationsPerStep = 50, kEvaluations = 20000;

using Values = std::vector<double>;

struct Rough {
  double t;
};

class Search {
 public:
  Search(const BlocksAt& blocks, const JumpSearch& search) : blocks_(blocks), search_(search) {}

  std::vector<BlockJump> run(const std::vector<double>& times) {
    find_sizes(times);
    left_ = kEvaluations + kEvaluationsPerStep * static_cast<long>(times.size());
    smallest_ = search_.resolution * (times.back() - times.front());
    for (std::size_t i = 0; i + 1 < times.size(); ++i) {
      const double begin = times[i], end = times[i + 1], within = begin + kWithinStep * (end - begin);
      const Values at = blocks(begin), start = blocks(within);
      if (jumps(at, start)) look(begin, within, at, start);
      look(within, end, start, blocks(end));
    }
    return sides(times.front(), times.back());
  }

 private:
  std::vector<BlockJump> sides(double begin, double end) const {
    const double apart = search_.sides * (end - begin);
    std::vector<BlockJump> all;
    for (const auto& [from, to] : found_) {
      // At rest a force may be on one side of its kink, and right behind the start on the other: then the start itself
      // is the one side. The same at the end.
      BlockJump k{std::max(from - apart, begin), std::min(to + apart, end), from, to};
      // One that has its sides on its neighbour's is one with it.
      if (!all.empty() && k.before - all.back().after < apart) {
        k.before = all.back().before;
        k.last_before = all.back().last_before;
        all.pop_back();
      }
      all.push_back(k);
    }
    return all;
  }

  Values blocks(double t) {
    if (left_-- == 0) throw Rough{t};
    Values x;
    ends_.clear();
    blocks_(t, x, ends_);
    return x;
  }

  void find_sizes(const std::vector<double>& times) {
    const Values rounding = find_rounding(times);
    for (const double t : times) {
      const Values x = blocks(t);
      allowed_.resize(x.size(), 0);
      for (std::size_t k = 0; k < x.size(); ++k) allowed_[k] = std::max(allowed_[k], std::abs(x[k]));
    }
    auto begin = allowed_.begin();
    for (const std::size_t last : ends_) {
      const auto end = allowed_.begin() + static_cast<std::ptrdiff_t>(last);
      const double largest = begin == end ? 0 : *std::max_element(begin, end);
      for (; begin != end; ++begin) *begin = kJump * *begin + kNoise * largest;
    }
    for (std::size_t k = 0; k < allowed_.size(); ++k) allowed_[k] += kOfRounding * rounding[k];
  }

  /// What entries change by over next to nothing; but for the largest, as one place may be astride a jump.
  Values find_rounding(const std::vector<double>& times) {
    Values largest, second;
    for (std::size_t i = 0; i + 1 < times.size(); ++i) {
      const double h = times[i + 1] - times[i], at = times[i] + kRoundingAt * h;
      const double over = std::max(kRoundingOver * h, 8 * std::numeric_limits<double>::epsilon() * std::abs(at));
      const Values a = blocks(at), b = blocks(at + over);
      largest.resize(a.size(), 0);
      second.resize(a.size(), 0);
      for (std::size_t k = 0; k < a.size(); ++k) {
        const double change = std::abs(b[k] - a[k]);
        second[k] = std::max(second[k], std::min(change, largest[k]));
        largest[k] = std::max(largest[k], change);
      }
    }
    return second;
  }

  bool jumps(const Values& a, const Values& b) const {
    for (std::size_t k = 0; k < a.size(); ++k)
      if (std::abs(b[k] - a[k]) > allowed_[k]) return true;
    return false;
  }

  // Of five values at equal distances the fourth difference is that of a smooth function to (h/4)^4, and at least the
  // jump of one that jumps between any two of them.
  void look(double begin, double end, const Values& first, const Values& last) {
    const double h = end - begin, middle = begin + h / 2;
    if (h <= smallest_ || !(begin < middle && middle < end)) {
      if (jumps(first, last)) found_.push_back({begin, end});
      return;
    }
    const Values a = blocks(begin + h / 4), b = blocks(middle), c = blocks(begin + 3 * h / 4);
    bool smooth = true;
    for (std::size_t k = 0; smooth && k < first.size(); ++k)
      smooth = std::abs(first[k] - 4 * a[k] + 6 * b[k] - 4 * c[k] + last[k]) <= allowed_[k];
    if (smooth) return;
    look(begin, middle, first, b);
    look(middle, end, b, last);
  }

  const BlocksAt& blocks_;
  JumpSearch search_;
  Values allowed_;
  std::vector<std::size_t> ends_;
  double smallest_ = 0;
  long left_ = std::numeric_limits<long>::max();
  std::vector<std::pair<double, double>> found_;
};

}  // namespace

BlockJumps find_block_jumps(const std::vector<double>& times, const BlocksAt& blocks, const JumpSearch& search) {
  try {
    return {Search(blocks, search).run(times), {}};
  } catch (const Rough& rough) {
    return {{}, rough.t};
  }
}

}  // namespace costate
