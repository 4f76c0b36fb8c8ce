#include "costate/assembly/sliding_terms.h"

#include <Eigen/Dense>

#include "costate/assembly/slip_on_line.h"

namespace costate {

namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

/// sigma and T at w, and their changes along dw.
struct TurningOnLine {
  explicit TurningOnLine(const SlipOnLine& slip) {
    const double size = slip.w.norm();
    sigma = slip.w / size;
    T = (Matrix2d::Identity() - sigma * sigma.transpose()) / size;
    dsigma = T * slip.dw;
    dT = -(dsigma * sigma.transpose() + sigma * dsigma.transpose() + sigma.dot(slip.dw) * T) / size;
  }
  Vector2d sigma, dsigma;
  Matrix2d T, dT;
};

/// visit(first row, whether it slides in space) for every contact that slides.
template <class Visit>
void for_each_slide(const Assembly& assembly, const Visit& visit) {
  const auto& rows = assembly.sliding_rows();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const bool in_space = i + 1 < rows.size() && rows[i + 1].normal == rows[i].normal;
    visit(rows[i], in_space);
    if (in_space) ++i;
  }
}

}  // namespace

void add_sliding_gradient_change(const Assembly& assembly, const StateView& s, const Variation& d, const double* s2,
                                 const GradientTarget& out) {
  const auto add_number = [&](int number, double x) {
    for (const auto& [column, c] : assembly.number_columns()[static_cast<std::size_t>(number)])
      out.rho[column] += c * x;
  };
  for_each_slide(assembly, [&](const Assembly::SlidingRow& r, bool in_space) {
    const double mu = assembly.numbers()[static_cast<std::size_t>(r.number)], dmu = d.numbers[r.number],
                 N = s.lambda[r.normal], dN = d.lambda[r.normal];
    if (!in_space) {
      const double weight = s2[r.along] * r.direction;
      out.lambda[r.normal] += weight * dmu;
      return add_number(r.number, weight * dN);
    }
    SlipOnLine slip(assembly, s, d, r.normal);
    const TurningOnLine at(slip);
    const Vector2d weight(s2[r.along], s2[r.along + 1]);
    const double along = weight.dot(at.sigma), turn = weight.dot(at.dsigma);
    out.lambda[r.normal] += along * dmu + turn * mu;
    add_number(r.number, along * dN + turn * N);
    // The weights of w, mu N T s2, and their change.
    const Vector2d g = mu * N * (at.T * weight), dg = (dmu * N + mu * dN) * (at.T * weight) + mu * N * (at.dT * weight);
    for (std::size_t i = 0; i < slip.coordinates().size(); ++i) {
      out.q[slip.coordinates()[i]] += slip.by_coordinate(i, g, dg);
      out.v[slip.coordinates()[i]] += slip.by_velocity(i, g, dg);
    }
    for (std::size_t i = 0; i < slip.numbers().size(); ++i)
      if (!assembly.number_columns()[static_cast<std::size_t>(slip.numbers()[i])].empty())
        add_number(slip.numbers()[i], slip.by_number(i, g, dg));
  });
}

void add_sliding_rates(const Assembly& assembly, const StateView& s, double* row) {
  Variation motion;
  motion.q = s.v;
  motion.v = s.a;
  for_each_slide(assembly, [&](const Assembly::SlidingRow& r, bool in_space) {
    if (!in_space) return;
    const TurningOnLine at(SlipOnLine(assembly, s, motion, r.normal));
    for (int k = 0; k < 2; ++k)
      row[r.along + k] -= assembly.numbers()[static_cast<std::size_t>(r.number)] * s.lambda[r.normal] * at.dsigma[k];
  });
}

}  // namespace costate
