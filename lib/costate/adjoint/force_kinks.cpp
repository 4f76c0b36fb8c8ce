#include "costate/adjoint/force_kinks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/adjoint/block_jumps.h"
#include "costate/assembly/packed_state.h"
#include "costate/assembly/slip_directions.h"
#include "costate/base/error.h"
#include "costate/element/guarded_force.h"

namespace costate {

namespace {
/// Of the span. Where a contact lets go at some thousand over a second, mu' is as large, and what passes between the
/// two sides of its kink is the product of both.
constexpr JumpSearch kKinkSearch{1e-15, 0};

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
  std::vector<double> point(static_cast<std::size_t>(2 * assembly.n() + assembly.nz()), 0),
      rest(static_cast<std::size_t>(std::max(assembly.n(), assembly.m())), 0);
  ScalarGradient gradient;
  gradient.resize(assembly);
  const BlockJumps found = find_block_jumps(
      times,
      [&](double t, std::vector<double>& values, std::vector<std::size_t>& ends) {
        motion(t, point.data());
        StateView s = packed_view(t, point.data(), assembly.n());
        s.a = s.lambda = rest.data();
        // Directions of slips are those of the Jacobian there.
        if (may_slide_in_space(assembly)) assembly.calc_jacobian(s);
        assembly.calc_partials(s);
        gradient.set_zero();
        objective.add_running_gradient(s, assembly, gradient);
        values.insert(values.end(), assembly.C.begin(), assembly.C.end());
        ends.push_back(values.size());
        values.insert(values.end(), assembly.f_v.begin(), assembly.f_v.end());
        ends.push_back(values.size());
        values.insert(values.end(), gradient.v.data(), gradient.v.data() + gradient.v.size());
        ends.push_back(values.size());
      },
      kKinkSearch);
  if (found.rough)
    throw SolverError(
        fmt::format("The equations of second order need the times at which derivatives of forces jump, and these are "
                    "rough near t = {:.9g} s: "
                    "more kinks than can be told from rounding. Take the adjoint of first order: hand-adjoint of "
                    "'penalty' or 'maggi'.",
                    *found.rough));
  std::vector<ForceKink> kinks;
  for (const BlockJump& at : found.all) {
    if (std::any_of(jumps.begin(), jumps.end(),
                    [&](const MotionJump& j) { return at.before <= j.after && j.before <= at.after; }))
      continue;
    ForceKink k{at.before, at.after, point, point};
    motion(k.before, k.state_before.data());
    motion(k.after, k.state_after.data());
    kinks.push_back(std::move(k));
  }
  return kinks;
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
