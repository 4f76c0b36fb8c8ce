// Every registered formulation as a system of equations: its Jacobian, products, Newton solves, parameter columns,
// start, costs, tangent and adjoint against differences and against each other, on a mechanism that has one of
// everything and on the five-bar, at consistent and at random states.
//
// Tolerances. kDifference: the residual's terms reach 1e3 times the largest entry of their Jacobian row (row scale), so
// differences with h = 1e-3 are good to 10 eps / h x 1e3 = 2e-9 of the row; truncation is of order h^6. kSame: two
// exact routes to the same number, apart by accumulated rounding: 1e5 eps, for sums of about 100 terms that cancel to
// 1e-3 of their size. kSolve: a sparse solve is backward stable up to the growth of pivots (pivots are at
// least 0.1 of their column: 1e3 over a few eliminations) and the length of sums (1e2).
#pragma once

#include <support/compare.h>
#include <support/differences.h>
#include <support/models.h>
#include <support/random.h>
#include <support/variants.h>

#include <functional>

namespace costate::test {

using Eigen::MatrixXd;
using Eigen::VectorXd;

inline constexpr double kEps = 2.2e-16;
inline constexpr double kDifference = 1e-8;
inline constexpr double kSame = 1e5 * kEps;
inline constexpr double kSolve = 1e5 * kEps;

struct Case {
  TestModel model;
  Variant variant;
  std::string label() const { return model.name + ", " + variant.label; }

  std::unique_ptr<DaeSystem> dae() const {
    return find_formulation(variant.formulation)
        .make_dae(model.mechanism, model.all_parameters(), model.objective, variant.options);
  }
  std::unique_ptr<OdeSystem> ode() const {
    return find_formulation(variant.formulation)
        .make_ode(model.mechanism, model.all_parameters(), model.objective, variant.options);
  }
};

inline void for_each_case(bool dae, const std::function<void(const Case&)>& f) {
  int visited = 0;
  for (const auto& model : {kitchen_sink(), five_bar()})
    for (const auto& v : variants()) {
      const Formulation& formulation = find_formulation(v.formulation);
      if (dae ? !formulation.make_dae : !formulation.make_ode) continue;
      const Case c{model, v};
      INFO(c.label());
      ++visited;
      f(c);
    }
  // index1, baumgarte, penalty twice, and index2 as a DAE, on two models.
  REQUIRE(visited >= (dae ? 10 : 8));
}

/// Whether the unknowns hold every coordinate of the mechanism, not only independent ones.
inline bool has_all_coordinates(const System& s) {
  int positions = 0;
  for (const Unknown& u : s.unknowns()) positions += u.role == Unknown::Role::position;
  return positions == s.assembly().n();
}

inline VectorXd values(const System& s) {
  const auto v = s.parameters().values();
  return Eigen::Map<const VectorXd>(v.data(), static_cast<Eigen::Index>(v.size()));
}
inline VectorXd scales(const System& s) {
  VectorXd r(s.parameter_count());
  for (int j = 0; j < s.parameter_count(); ++j) r[j] = s.parameters().parameters[j].scale;
  return r;
}

/// Columns d f / d rho_j times the parameter's scale, by differences over set_parameters.
template <class SystemType, class Function>
inline MatrixXd parameter_differences(SystemType& system, Function&& f) {
  const VectorXd rho = values(system), scale = scales(system);
  const MatrixXd J = difference_jacobian(
      [&](const VectorXd& x) {
        const VectorXd r = rho + scale.cwiseProduct(x);
        system.set_parameters(r.data());
        return VectorXd(f());
      },
      VectorXd::Zero(rho.size()));
  system.set_parameters(rho.data());
  return J;
}

struct DaePoint {
  std::string label;
  double t = 0;
  VectorXd y, yp;
};

/// The consistent start, and random states around it; `stabilized` leaves index 2's extra multipliers nonzero.
inline std::vector<DaePoint> dae_points(DaeSystem& system, bool stabilized) {
  DaePoint start{"start", 0, VectorXd(system.size()), VectorXd(system.size())};
  system.start(0, start.y.data(), start.yp.data(), nullptr, nullptr);
  std::vector<DaePoint> points = {start};
  for (const std::uint32_t seed : {1u, 2u}) {
    Random random(seed);
    DaePoint p{"random state " + std::to_string(seed), 0.37, start.y + 0.15 * random.vector(system.size()),
               start.yp + random.vector(system.size())};
    for (int i = 0; i < system.size(); ++i)
      if (system.unknowns()[i].role == Unknown::Role::stabilizer && !stabilized) p.y[i] = 0;
    points.push_back(p);
  }
  return points;
}

inline MatrixXd dense_jacobian(DaeSystem& s, const DaePoint& p, double cj) {
  std::vector<double> v(s.jacobian_pattern().row.size());
  s.jacobian(p.t, p.y.data(), p.yp.data(), cj, v.data());
  return dense(s.jacobian_pattern(), v.data());
}

/// |J x - b| against the terms in each row, unknowns counting at least with `size_of_x`.
inline Mismatch backward_error(const MatrixXd& J, const VectorXd& x, const VectorXd& b, const VectorXd& size_of_x) {
  const VectorXd size = J.cwiseAbs() * x.cwiseAbs().cwiseMax(size_of_x) + b.cwiseAbs();
  return mismatch_by_rows(J * x, b, size);
}

}  // namespace costate::test
