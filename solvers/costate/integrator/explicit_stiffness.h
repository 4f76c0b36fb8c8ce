// Steps of an explicit scheme at the border of its stability: a run that goes on by them would take far more than its
// error asks for.
#pragma once

#include <fmt/format.h>

#include "costate/base/error.h"
#include "costate/integrator/stiffness_watch.h"

namespace costate {

class ExplicitStiffness {
 public:
  /// After each step over h to t: |h lambda| of the fastest decay that it has seen, and where the scheme's stability
  /// ends. Throws StiffError.
  void look(double h_lambda, double stability, double t, double h, double left, long steps, const std::string& scheme) {
    if (h_lambda > stability) {
      not_stiff_ = 0;
      ++stiff_;
    } else if (++not_stiff_ >= kNotStiff) {
      stiff_ = 0;
    }
    if (stiff_ < kStiff || !(left > kFew * h)) return;
    throw StiffError(
        fmt::format("The motion is stiff at t = {:.6g} s: after {} steps the explicit scheme '{}' still takes steps of "
                    "{:.3g} s, the size at which it is stable; about {:.2g} more would follow. Take an implicit "
                    "integrator (--integrator radau5; where the method is not a discrete one also idas, or cvodes with "
                    "--cvodes-method bdf).",
                    t, steps, scheme, h, left / h));
  }

 private:
  // So many of them in a row make a run stiff, as many that are not are to forget them, and how many steps may as well
  // be taken.
  static constexpr long kStiff = 15, kNotStiff = 6;
  static constexpr double kFew = 2e5;

  long stiff_ = 0, not_stiff_ = 0;
};

}  // namespace costate
