#include "costate/analysis/point_kink.h"

#include <algorithm>
#include <cmath>

#include "costate/analysis/mechanism_size.h"
#include "costate/analysis/row_space.h"
#include "costate/linear/to_dense.h"

namespace costate {

namespace {

constexpr double kBeside = 1e-8, kNearer = 0.1, kJump = 1e-5;
constexpr int kDirections = 3, kMostDense = 500;

struct Blocks {
  std::vector<double> M, K, C;
};

Blocks blocks_at(Assembly& assembly, StateView s, const Eigen::VectorXd& q, const Eigen::VectorXd& v) {
  s.q = q.data();
  s.v = v.data();
  assembly.calc_dynamics(s);
  assembly.calc_partials(s);
  return {assembly.M, assembly.K, assembly.C};
}

}  // namespace

// A direction that is nobody's own crosses every kink that goes through the point.
std::optional<PointKink> find_point_kink(Assembly& assembly, const StateView& point, double rate) {
  const Eigen::Index n = assembly.n();
  const Eigen::VectorXd q = Eigen::Map<const Eigen::VectorXd>(point.q, n),
                        v = Eigen::Map<const Eigen::VectorXd>(point.v, n);
  const double length = extent_of(assembly, q).value_or(1);
  Eigen::VectorXd size(n);
  for (Eigen::Index i = 0; i < n; ++i)
    size[i] = assembly.mechanism().coordinates()[static_cast<std::size_t>(i)].unit == "m" ? length : 1;
  RowSpace rows;
  if (n <= kMostDense) {
    assembly.calc_jacobian(point);
    rows.compute(to_dense(assembly.jacobian(), assembly.phi_q.data()) * size.asDiagonal());
  }
  const auto direction = [&](int k) {
    Eigen::VectorXd x(n);
    for (Eigen::Index i = 0; i < n; ++i) x[i] = std::cos(1 + 2.3 * k + (1.7 + 0.3 * k) * static_cast<double>(i));
    if (n <= kMostDense) x -= rows.solve(rows.matrix() * x);
    return Eigen::VectorXd(kBeside * size.cwiseProduct(x));
  };
  const SparsePattern& pattern = assembly.square();
  std::optional<PointKink> worst;
  double most = kJump;
  for (int k = 0; k < kDirections; ++k) {
    const Eigen::VectorXd dq = direction(2 * k), dv = rate * direction(2 * k + 1);
    const Blocks one = blocks_at(assembly, point, q - dq, v - dv), other = blocks_at(assembly, point, q + dq, v + dv);
    // What bends is as far apart a tenth as far away; what is steep there is not.
    const Blocks one_near = blocks_at(assembly, point, q - kNearer * dq, v - kNearer * dv),
                 other_near = blocks_at(assembly, point, q + kNearer * dq, v + kNearer * dv);
    const auto stays = [](double far, double near) { return std::abs(near) > 0.5 * std::abs(far); };
    Eigen::VectorXd row = Eigen::VectorXd::Zero(n), column = Eigen::VectorXd::Zero(n);
    const auto for_each = [&](const auto& visit) {
      for (int j = 0; j < n; ++j)
        for (auto e = pattern.column_start[static_cast<std::size_t>(j)];
             e < pattern.column_start[static_cast<std::size_t>(j) + 1]; ++e)
          visit(pattern.row[static_cast<std::size_t>(e)], j, static_cast<std::size_t>(e));
    };
    for_each([&](int i, int j, std::size_t e) {
      for (const Blocks* b : {&one, &other}) {
        const double entry =
            (std::abs(b->K[e]) + rate * (std::abs(b->C[e]) + rate * std::abs(b->M[e]))) * size[i] * size[j];
        row[i] = std::max(row[i], entry);
        column[j] = std::max(column[j], entry);
      }
    });
    for_each([&](int i, int j, std::size_t e) {
      const double scale = std::sqrt(row[i] * column[j]);
      if (!(scale > 0)) return;
      const double of_K = std::abs(other.K[e] - one.K[e]) * size[i] * size[j] / scale,
                   of_C = rate * std::abs(other.C[e] - one.C[e]) * size[i] * size[j] / scale;
      if (!(std::max(of_K, of_C) > most)) return;
      const bool velocity = of_C > of_K;
      if (velocity ? !stays(other.C[e] - one.C[e], other_near.C[e] - one_near.C[e])
                   : !stays(other.K[e] - one.K[e], other_near.K[e] - one_near.K[e]))
        return;
      most = std::max(of_K, of_C);
      worst = PointKink{velocity, i, j, velocity ? one.C[e] : one.K[e], velocity ? other.C[e] : other.K[e]};
    });
  }
  return worst;
}

}  // namespace costate
