#include "costate/adjoint/force_kinks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "costate/base/error.h"
#include "costate/element/guarded_force.h"

namespace costate {

namespace {

/// Of an entry's largest value along the motion, and of the largest entry of its block.
constexpr double kJump = 1e-6, kNoise = 1e-9;
/// Of the span: to this a kink's time is known.
constexpr double kResolution = 1e-12;
/// Of a step: from here on the motion is that of the step, and no longer of the one before.
constexpr double kWithinStep = 1e-9;
/// Of the span: what the two sides of a kink are apart, so that both can stand in a grid. What a block changes over it
/// by itself is as small.
constexpr double kSides = 2e-9;
/// Evaluations: some a step and some a hundred a kink are enough. Where blocks are rough everywhere (rounding of large
/// terms that cancel) the search would find no end.
constexpr long kEvaluationsPerStep = 50, kEvaluations = 20000;

using Values = std::vector<double>;

class Search {
 public:
  Search(Assembly& assembly, const Objective& objective, const std::function<void(double, double*)>& motion,
         const std::vector<MotionJump>& jumps)
      : assembly_(assembly), objective_(objective), motion_(motion), jumps_(jumps) {
    point_.assign(static_cast<std::size_t>(2 * assembly.n() + assembly.nz()), 0);
    rest_.assign(static_cast<std::size_t>(std::max(assembly.n(), assembly.m())), 0);
    gradient_.resize(assembly);
  }

  std::vector<ForceKink> run(const std::vector<double>& times) {
    find_sizes(times);
    smallest_ = kResolution * (times.back() - times.front());
    left_ = kEvaluations + kEvaluationsPerStep * static_cast<long>(times.size());
    for (std::size_t i = 0; i + 1 < times.size(); ++i) {
      const double begin = times[i], end = times[i + 1], within = begin + kWithinStep * (end - begin);
      const Values at = blocks(begin), start = blocks(within);
      if (jumps(at, start)) kinks_.push_back({begin, within});
      look(within, end, start, blocks(end));
    }
    return sides(times);
  }

 private:
  std::vector<ForceKink> sides(const std::vector<double>& times) {
    const double begin = times.front(), end = times.back(), apart = kSides * (end - begin);
    std::vector<ForceKink> kinks;
    for (const auto& [from, to] : kinks_) {
      if (std::any_of(jumps_.begin(), jumps_.end(),
                      [&](const MotionJump& j) { return from - apart <= j.after && j.before <= to + apart; }))
        continue;
      ForceKink k{from - apart, to + apart, point_, point_};
      // At rest a force may be on one side of its kink, and right behind the start on the other: then the start itself
      // is the one side. The same at the end.
      k.before = std::max(k.before, begin);
      k.after = std::min(k.after, end);
      // One that has its sides on its neighbour's is one with it.
      if (!kinks.empty() && k.before - kinks.back().after < apart) {
        k.before = kinks.back().before;
        kinks.pop_back();
      }
      motion_(k.before, k.state_before.data());
      motion_(k.after, k.state_after.data());
      kinks.push_back(std::move(k));
    }
    return kinks;
  }

  Values blocks(double t) {
    if (left_-- == 0)
      throw SolverError(
          fmt::format("The equations of second order need the times at which derivatives of forces jump, and these are "
                      "rough near t = {:.9g} s: "
                      "more kinks than can be told from rounding. Take the adjoint of first order: hand-adjoint of "
                      "'penalty' or 'maggi'.",
                      t));
    motion_(t, point_.data());
    StateView s;
    s.t = t;
    s.q = point_.data();
    s.v = s.q + assembly_.n();
    s.z = s.v + assembly_.n();
    s.a = s.lambda = rest_.data();
    assembly_.calc_partials(s);
    gradient_.set_zero();
    objective_.add_running_gradient(s, assembly_, gradient_);
    Values x = assembly_.C;
    x.insert(x.end(), assembly_.f_v.begin(), assembly_.f_v.end());
    x.insert(x.end(), gradient_.v.data(), gradient_.v.data() + gradient_.v.size());
    return x;
  }

  void find_sizes(const std::vector<double>& times) {
    for (const double t : times) {
      const Values x = blocks(t);
      allowed_.resize(x.size(), 0);
      for (std::size_t k = 0; k < x.size(); ++k) allowed_[k] = std::max(allowed_[k], std::abs(x[k]));
    }
    const std::size_t first[4] = {0, assembly_.C.size(), assembly_.C.size() + assembly_.f_v.size(), allowed_.size()};
    for (int block = 0; block < 3; ++block) {
      const auto begin = allowed_.begin() + static_cast<std::ptrdiff_t>(first[block]),
                 end = allowed_.begin() + static_cast<std::ptrdiff_t>(first[block + 1]);
      const double largest = begin == end ? 0 : *std::max_element(begin, end);
      for (auto x = begin; x != end; ++x) *x = kJump * *x + kNoise * largest;
    }
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
      if (jumps(first, last)) kinks_.push_back({begin, end});
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

  Assembly& assembly_;
  const Objective& objective_;
  const std::function<void(double, double*)>& motion_;
  const std::vector<MotionJump>& jumps_;
  Values point_, rest_, allowed_;
  ScalarGradient gradient_;
  double smallest_ = 0;
  long left_ = std::numeric_limits<long>::max();
  std::vector<std::pair<double, double>> kinks_;
};

}  // namespace

namespace {
/// Bristles turn round within a millionth of their transition velocity: a kink to the derivatives of forces, but a
/// smooth one, whose ends lie outside what is taken for it.
void require_no_bristles(const Mechanism& mechanism) {
  for (const auto& f : mechanism.forces()) {
    if (!dynamic_cast<const GuardedForce*>(f.get())) continue;
    for (int i = 0; i < f->states(); ++i)
      if (f->state_name(i).rfind("bristle", 0) == 0)
        throw CapabilityError(
            fmt::format("'{}' has bristles, whose rates turn round too sharply for a second-order adjoint, which holds "
                        "the derivatives of forces by time. Take the first-order adjoint of this formulation (penalty, "
                        "maggi), or a friction without bristles.",
                        f->path()));
  }
}
}  // namespace

std::vector<ForceKink> find_force_kinks(Assembly& assembly, const Objective& objective,
                                        const std::vector<double>& times,
                                        const std::function<void(double t, double* qvz)>& motion,
                                        const std::vector<MotionJump>& jumps) {
  require_no_bristles(assembly.mechanism());
  if (times.size() < 2) return {};
  return Search(assembly, objective, motion, jumps).run(times);
}

const ForceKink* kink_before(const std::vector<ForceKink>& kinks, double t) {
  for (const ForceKink& k : kinks)
    if (std::abs(t - k.after) < 0.25 * (k.after - k.before)) return &k;
  return nullptr;
}

void append_times(const std::vector<ForceKink>& kinks, std::vector<double>& times) {
  for (const ForceKink& k : kinks) times.insert(times.end(), {k.before, k.after});
}

}  // namespace costate
