#include "costate/assembly/sliding_terms.h"

#include <Eigen/Dense>

#include "costate/assembly/slip_on_line.h"
#include "costate/assembly/slip_turn.h"

namespace costate {

namespace {

using Eigen::Vector2d;

SlipTurn turn_of(const SlipOnLine& slip) { return {slip.w.normalized(), slip.w.norm()}; }

/// visit(first row, whether it slides in space) for every contact that slides.
template <class Visit>
void for_each_slide(const Assembly& assembly, const Visit& visit) {
  for (std::size_t i = 0; i < assembly.sliding_rows().size(); ++i) {
    const bool in_space = slips_in_space(assembly, i);
    visit(assembly.sliding_rows()[i], in_space);
    if (in_space) ++i;
  }
}

}  // namespace

void add_sliding_gradient_change(const Assembly& assembly, const StateView& s, const Variation& d, const double* s2,
                                 const GradientTarget& out) {
  for_each_slide(assembly, [&](const Assembly::SlidingRow& r, bool in_space) {
    const double mu = assembly.numbers()[static_cast<std::size_t>(r.number)], dmu = d.numbers[r.number],
                 N = s.lambda[r.normal], dN = d.lambda[r.normal];
    if (!in_space) {
      const double weight = s2[r.along] * r.direction;
      out.lambda[r.normal] += weight * dmu;
      return add_number(assembly, r.number, weight * dN, out.rho);
    }
    SlipOnLine slip(assembly, s, d, r.normal);
    const SlipTurn at = turn_of(slip);
    const Vector2d weight(s2[r.along], s2[r.along + 1]);
    const double along = weight.dot(at.sigma), turn = weight.dot(at.T * slip.dw);
    out.lambda[r.normal] += along * dmu + turn * mu;
    add_number(assembly, r.number, along * dN + turn * N, out.rho);
    // The weights of w, mu N T s2, and their change.
    const Vector2d g = mu * N * (at.T * weight),
                   dg = (dmu * N + mu * dN) * (at.T * weight) + mu * N * (at.change(slip.dw) * weight);
    for (std::size_t i = 0; i < slip.coordinates().size(); ++i) {
      out.q[slip.coordinates()[i]] += slip.by_coordinate(i, g, dg);
      out.v[slip.coordinates()[i]] += slip.by_velocity(i, g, dg);
    }
    for (std::size_t i = 0; i < slip.numbers().size(); ++i)
      if (varies(assembly, slip.numbers()[i]))
        add_number(assembly, slip.numbers()[i], slip.by_number(i, g, dg), out.rho);
  });
}

namespace {
/// visit(row, mu sigma') for every contact that slides in space, along the motion.
template <class Visit>
void for_each_turn(const Assembly& assembly, const StateView& s, const Visit& visit) {
  Variation motion;
  motion.q = s.v;
  motion.v = s.a;
  for_each_slide(assembly, [&](const Assembly::SlidingRow& r, bool in_space) {
    if (!in_space) return;
    const SlipOnLine slip(assembly, s, motion, r.normal);
    visit(r, Vector2d(assembly.numbers()[static_cast<std::size_t>(r.number)] * (turn_of(slip).T * slip.dw)));
  });
}
}  // namespace

void add_sliding_rates(const Assembly& assembly, const StateView& s, double* row) {
  for_each_turn(assembly, s, [&](const Assembly::SlidingRow& r, const Vector2d& turn) {
    for (int k = 0; k < 2; ++k) row[r.along + k] -= s.lambda[r.normal] * turn[k];
  });
}

std::vector<double> slip_corner_rates(const Assembly& assembly, const StateView& s, const SparsePattern& corner) {
  if (!slips_in_space(assembly)) return {};
  std::vector<double> rates(corner.row.size(), 0);
  for_each_turn(assembly, s, [&](const Assembly::SlidingRow& r, const Vector2d& turn) {
    for (int k = 0; k < 2; ++k) rates[static_cast<std::size_t>(corner.find(r.along + k, r.normal))] = -turn[k];
  });
  return rates;
}

void add_turning_friction(const Assembly& assembly, const StateView& s, std::vector<double>& rows) {
  const SparsePattern& pattern = assembly.jacobian();
  const std::vector<double>& J = assembly.reaction_jacobian();
  for_each_turn(assembly, s, [&](const Assembly::SlidingRow& r, const Vector2d& turn) {
    for (int k = 0; k < 2; ++k)
      for (int j = 0; j < pattern.cols; ++j)
        if (const auto e = pattern.find(r.along + k, j); e >= 0)
          rows[static_cast<std::size_t>(pattern.find(r.normal, j))] -= turn[k] * J[static_cast<std::size_t>(e)];
  });
}

}  // namespace costate
