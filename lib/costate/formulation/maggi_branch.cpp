#include "costate/formulation/maggi_branch.h"

#include <fmt/format.h>

#include "costate/base/error.h"
#include "costate/level/maggi_names.h"

namespace costate {

namespace {
// The part of its velocity by which a coordinate may be turned by no acceleration: over a step that can be shortened,
// and over one that is taken.
constexpr double kTurnedStep = 0.5, kTurnedAtAll = 0.8;
// A step that ends farther from the best chart than this is tried again, shorter: an error of an independent velocity
// is as many times as large in the others, one of a coordinate the third power of it, and no estimate sees that. At 6,
// with charts changed at 2, gradients of a pendulum by dop853 were off by ten times as much, in 2 % more steps.
constexpr double kFarMaggiRatio = 2.5;

void require_branch(MaggiLevel& level) {
  if (!level.accelerated()) return;
  const int i = level.turned(level.remembered(), kTurnedAtAll);
  if (i < 0) return;
  throw SolverError(fmt::format(
      "Between t = {:.9g} s and t = {:.9g} s the motion has left its branch: the velocity of '{}' turned round without "
      "an acceleration, because the step went past a place where the independent coordinates turn back and the others "
      "go through. Take a smaller rtol, or bound the steps (run.max_step_s), or take a formulation without independent "
      "coordinates (index1).",
      level.remembered(), level.state().t,
      level.assembly().mechanism().coordinates()[static_cast<std::size_t>(i)].name));
}
}  // namespace

bool keeps_branch(MaggiLevel& level, double from) {
  return level.turned(from, kTurnedStep) < 0 && level.chart_ratio() <= kFarMaggiRatio;
}

bool wants_other_chart(MaggiLevel& level, double t) {
  // The step's last evaluation serves: another one here would be missing where the run is repeated from a checkpoint. A
  // step that ended without one is judged after the next.
  if (!level.solved_at(t)) return false;
  require_branch(level);
  level.remember();
  return level.chart_ratio() > kWorstMaggiRatio;
}

}  // namespace costate
