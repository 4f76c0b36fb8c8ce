#include "costate/analysis/line_watch.h"

#include <fmt/format.h>

#include <cmath>

#include "costate/base/error.h"
#include "costate/base/golden_section.h"

namespace costate {

namespace {

// Of the way from look to look: nearer than that to zero the ends meet. A line that passes at a larger distance turns
// over a time that integrators resolve.
constexpr double kMeets = 1e-4;
constexpr int kGoldenSections = 60;
// Of the force along the line: a smaller jump is rounding.
constexpr double kNoJump = 1e-9;

double dot(const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

}  // namespace

LineWatch::LineWatch(const Mechanism& mechanism) {
  for (const auto& force : mechanism.forces())
    if (const auto* ends = dynamic_cast<const MeetingEnds*>(force.get())) lines_.push_back({force.get(), ends});
}

void LineWatch::look(const StateView& s, const Assembly& assembly) {
  if (first_) return;
  for (Line& line : lines_) {
    const LocalState local = gathered_.of(*line.force, s, assembly.numbers());
    double d[3], rate[3];
    line.ends->ends_apart(local, d, rate);
    const double h = s.t - line.t;
    if (line.seen && h > 0 && dot(d, line.d) < 0) {
      const auto at = [&](double x, int i) {
        const double y = 1 - x;
        return y * y * (1 + 2 * x) * line.d[i] + x * y * y * h * line.rate[i] + x * x * (3 - 2 * x) * d[i] -
               x * x * y * h * rate[i];
      };
      const auto square = [&](double x) {
        const double a[3] = {at(x, 0), at(x, 1), at(x, 2)};
        return dot(a, a);
      };
      const double nearest =
          golden_section(
              0.0, 1.0, kGoldenSections, [&](double x) { return -square(x); }, [](const auto&) { return true; })
              .best();
      const double way[3] = {d[0] - line.d[0], d[1] - line.d[1], d[2] - line.d[2]};
      if (square(nearest) <= kMeets * kMeets * dot(way, way)) {
        const double speed = std::sqrt(dot(way, way)) / h;
        double jump = HUGE_VAL, size = 0;
        try {
          jump = std::abs(line.ends->jump_where_ends_meet(local, speed));
          size = std::abs(line.ends->jump_where_ends_meet(local, 0));
        } catch (const Error&) {  // a law that goes no further down
        }
        if (jump > kNoJump * size) first_ = Meeting{line.t + nearest * h, jump, line.force->path()};
      }
    }
    line.t = s.t;
    std::copy(d, d + 3, line.d);
    std::copy(rate, rate + 3, line.rate);
    line.seen = true;
  }
}

std::optional<std::string> LineWatch::met() const {
  if (!first_) return {};
  return fmt::format(
      "Near t = {:.6g} s the ends of '{}' pass through each other: the line between them turns round at "
      "once, and with it a force{}",
      first_->t, first_->force,
      std::isfinite(first_->jump) ? fmt::format(", which jumps by {:.3g} N", first_->jump) : "");
}

}  // namespace costate
