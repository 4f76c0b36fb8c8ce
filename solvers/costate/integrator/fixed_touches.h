// Of fixed steps: that none of them passes over a touch that is no event, by the positions and velocities at its ends.
// A single bend within a step leaves schemes of order two their order.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "costate/base/error.h"
#include "costate/event/touch_watch.h"
#include "costate/problem/problem.h"

namespace costate {

class FixedTouches {
 public:
  FixedTouches(Assembly& assembly, const Objective& objective, const SolverOptions& options)
      : n_(static_cast<std::size_t>(assembly.n())),
        nz_(static_cast<std::size_t>(assembly.nz())),
        // What users wrote may jump, and is as good as steps are long.
        touches_(assembly, objective, options.rtol, options.absolute(), 0, LeftBends::all) {}
  void step(const StateView& s) {
    if (touches_.empty()) return;
    std::swap(before_, after_);
    set_after(s);
    if (before_.q.empty()) return;
    const auto look = touches_.look(before_.t, after_.t, [this](double t) { return between(t); });
    if (look)
      throw SolverError(fmt::format(
          "A fixed step of {:.6g} s from t = {:.6g} s passes over a touch: {} {} from {:.9g} to "
          "{:.9g} s. Choose steps of {:.3g} s or less (--step, run.step_s).",
          after_.t - before_.t, before_.t, look->element->path(), look->does, look->from, look->to, look->step));
  }
  /// Behind a cut the next step begins at this state.
  void begin_anew(const StateView& s) {
    if (touches_.empty()) return;
    set_after(s);
    touches_.begin_segment();
  }

 private:
  struct State {
    double t = 0;
    std::vector<double> q, v, z;
  };
  void set_after(const StateView& s) {
    after_.t = s.t;
    after_.q.assign(s.q, s.q + n_);
    after_.v.assign(s.v, s.v + n_);
    after_.z.assign(s.z, s.z + nz_);
  }
  /// Hermite's cubic of q, and its rate.
  StateView between(double t) {
    const State &a = before_, &b = after_;
    const double h = b.t - a.t, x = t >= b.t ? 1 : t <= a.t ? 0 : (t - a.t) / h, y = 1 - x;
    here_.q.resize(n_);
    here_.v.resize(n_);
    for (std::size_t i = 0; i < n_; ++i) {
      here_.q[i] = y * y * (1 + 2 * x) * a.q[i] + x * x * (1 + 2 * y) * b.q[i] + h * x * y * (y * a.v[i] - x * b.v[i]);
      here_.v[i] = 6 * x * y * (b.q[i] - a.q[i]) / h + y * (1 - 3 * x) * a.v[i] + x * (1 - 3 * y) * b.v[i];
    }
    StateView s;
    s.t = t;
    s.q = here_.q.data();
    s.v = here_.v.data();
    s.z = x < 1 ? a.z.data() : b.z.data();
    return s;
  }
  std::size_t n_, nz_;
  TouchWatch touches_;
  State before_, after_, here_;
};

}  // namespace costate
