#include "costate/integrator/attempts_back.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "costate/base/notice.h"
#include "costate/problem/scaled_gradient.h"

namespace costate {

namespace {
// Error test failures that are nobody's fault: so many and one in so many steps, or so many times those forward.
constexpr long kUsual = 10, kUsualSteps = 100;
constexpr double kOfForward = 1.5;
// Two attempts agree within this, in rtol of the largest scaled derivative.
constexpr double kAgree = 300;
}  // namespace

double AttemptsBack::apart(const Way& a, const Way& b) const {
  const double size = std::max(largest_scaled(parameters_, b.gradient), std::numeric_limits<double>::min());
  return largest_scaled_change(parameters_, a.gradient, b.gradient) / size;
}

void AttemptsBack::failed() {
  if (++number_ >= most_ && !any_) throw;
}

void AttemptsBack::add(Way way, const Counters& before, const Counters& after) {
  ++number_;
  const long failures = after.backward_error_test_failures - before.backward_error_test_failures,
             steps = after.backward_steps - before.backward_steps;
  settled_ = failures <= kUsual + steps / kUsualSteps ||
             static_cast<double>(failures) <= kOfForward * static_cast<double>(before.error_test_failures);
  if (any_) {
    apart_ = apart(best_, way);
    settled_ = settled_ || apart_ <= kAgree * options_.rtol;
    if (!settled_ && failures >= failures_) return;
  }
  any_ = true;
  best_ = std::move(way);
  failures_ = failures;
  steps_ = steps;
}

bool AttemptsBack::again() {
  if (settled_ || most_ == 1) return false;
  if (number_ < most_) return true;
  notice(fmt::format(
      "The adjoint's steps fail their error test again and again ({} times in {} steps), and {}. A formulation of "
      "index 1 (index1, maggi, baumgarte, penalty) has no such steps.",
      failures_, steps_,
      apart_ > 0
          ? fmt::format("another run of them changes the gradient by {:.1g} of the largest scaled derivative", apart_)
          : std::string("other runs of them ended in an error")));
  return false;
}

}  // namespace costate
