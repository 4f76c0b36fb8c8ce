// The right-hand sides of all formulations; tolerances: systems.h.
#include <catch2/catch.hpp>

#include "systems.h"

using namespace costate;
using namespace costate::test;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

struct OdePoint {
  std::string label;
  double t = 0;
  VectorXd y;
};

std::vector<OdePoint> ode_points(OdeSystem& system) {
  OdePoint start{"start", 0, VectorXd(system.size())};
  system.start(0, start.y.data(), nullptr);
  std::vector<OdePoint> points = {start};
  for (const std::uint32_t seed : {1u, 2u})
    points.push_back(
        {"random state " + std::to_string(seed), 0.37, start.y + 0.15 * Random(seed).vector(system.size())});
  return points;
}

/// f_y, column by column from tangent().
MatrixXd tangent_matrix(OdeSystem& s, const OdePoint& p) {
  const int n = s.size();
  const MatrixXd in = MatrixXd::Identity(n, n);
  MatrixXd out = MatrixXd::Constant(n, n, 1e30);
  std::vector<const double*> from;
  std::vector<double*> to;
  for (int j = 0; j < n; ++j) {
    from.push_back(in.col(j).data());
    to.push_back(out.col(j).data());
  }
  s.tangent(p.t, p.y.data(), from.data(), to.data(), n, false);
  return out;
}

/// f_rho from tangent() along zero columns.
MatrixXd parameter_tangent(OdeSystem& s, const OdePoint& p) {
  const int n = s.size(), np = s.parameter_count();
  const VectorXd zero = VectorXd::Zero(n);
  MatrixXd out = MatrixXd::Constant(n, np, 1e30);
  std::vector<const double*> from(static_cast<std::size_t>(np), zero.data());
  std::vector<double*> to;
  for (int j = 0; j < np; ++j) to.push_back(out.col(j).data());
  s.tangent(p.t, p.y.data(), from.data(), to.data(), np, true);
  return out;
}

}  // namespace

TEST_CASE("ODE: accelerations solve the residual form", "[systems]") {
  for_each_case(false, [](const Case& c) {
    if (!find_formulation(c.variant.formulation).make_dae) return;
    const auto s = c.ode();
    const auto dae = c.dae();
    const int n = s->assembly().n(), m = s->assembly().m(), nz = s->assembly().nz();
    for (const auto& p : ode_points(*s)) {
      CAPTURE(p.label);
      VectorXd f(s->size());
      s->rhs(p.t, p.y.data(), f.data());
      const MechanismState state = s->mechanism_state(p.t, p.y.data());
      DaePoint d{"", p.t, VectorXd(dae->size()), VectorXd::Zero(dae->size())};
      d.y << p.y, Eigen::Map<const VectorXd>(state.a, n), Eigen::Map<const VectorXd>(state.lambda, m);
      d.yp.head(2 * n + nz) = f;
      VectorXd r(dae->size());
      dae->residual(p.t, d.y.data(), d.yp.data(), r.data());
      const VectorXd size = dense_jacobian(*dae, d, 0).cwiseAbs() * d.y.cwiseAbs() + d.yp.cwiseAbs();
      CHECK_ROWS_CLOSE_ABOVE(r, VectorXd::Zero(r.size()).eval(), kSame, size.cwiseMax(1).eval());
    }
  });
}

TEST_CASE("ODE: the tangent is that of the right-hand side", "[systems]") {
  for_each_case(false, [](const Case& c) {
    const auto s = c.ode();
    for (const auto& p : ode_points(*s)) {
      CAPTURE(p.label);
      const auto rhs = [&](const VectorXd& y) {
        VectorXd f(s->size());
        s->rhs(p.t, y.data(), f.data());
        return f;
      };
      const MatrixXd f_y = tangent_matrix(*s, p);
      CHECK_ROWS_CLOSE_ABOVE(f_y, difference_jacobian(rhs, p.y), kDifference, rhs(p.y).cwiseAbs().cwiseMax(1).eval());
      const MatrixXd f_rho = parameter_tangent(*s, p);
      CHECK_ROWS_CLOSE_ABOVE(MatrixXd(f_rho * scales(*s).asDiagonal()),
                             parameter_differences(*s, [&] { return rhs(p.y); }), kDifference,
                             rhs(p.y).cwiseAbs().cwiseMax(1).eval());
      // Both at once, along columns of their own: out_j = f_y s_j + f_rho e_j.
      const int np = s->parameter_count();
      MatrixXd in(s->size(), np), out(s->size(), np);
      std::vector<const double*> from;
      std::vector<double*> to;
      Random random(2);
      for (int j = 0; j < np; ++j) {
        in.col(j) = random.vector(s->size());
        from.push_back(in.col(j).data());
        to.push_back(out.col(j).data());
      }
      s->tangent(p.t, p.y.data(), from.data(), to.data(), np, true);
      const VectorXd size = f_y.cwiseAbs().rowwise().sum();
      CHECK_ROWS_CLOSE_ABOVE(out, MatrixXd(f_y * in + f_rho), kSame, size.cwiseMax(1).eval());
    }
  });
}

TEST_CASE("ODE: Newton solves invert I - gamma f_y", "[systems]") {
  for_each_case(false, [](const Case& c) {
    const auto s = c.ode();
    const int n = s->size();
    Random random(3);
    for (const auto& p : ode_points(*s)) {
      const MatrixXd f_y = tangent_matrix(*s, p);
      for (const double gamma : {1e-12, 1e-6, 1e-2, -1e-2, 0.3, -0.3, 10.0}) {
        CAPTURE(p.label, gamma);
        const double tolerance = kSolve * std::max(1.0, gamma * gamma);  // as for the DAE with cj = 1 / gamma
        const MatrixXd A = MatrixXd::Identity(n, n) - gamma * f_y;
        const VectorXd b = random.vector(n);
        s->factor(p.t, p.y.data(), gamma);
        VectorXd x = b;
        s->solve(x.data());
        CHECK_BELOW(backward_error(A, x, b, VectorXd::Zero(n)), tolerance);
        x = b;
        s->solve_transposed(x.data());
        CHECK_BELOW(backward_error(A.transpose(), x, b, VectorXd::Zero(n)), tolerance);
      }
    }
  });
}

TEST_CASE("ODE: the adjoint is the transpose of the tangent", "[systems]") {
  for_each_case(false, [](const Case& c) {
    const auto s = c.ode();
    const int n = s->size(), np = s->parameter_count();
    Random random(13);
    for (const auto& p : ode_points(*s)) {
      CAPTURE(p.label);
      const MatrixXd f_y = tangent_matrix(*s, p), f_rho = parameter_tangent(*s, p);
      const auto cost = [&](const VectorXd& y) { return VectorXd::Constant(1, s->running_cost(p.t, y.data())); };
      // g_y = -mu' at mu = 0, accelerations and multipliers eliminated.
      VectorXd zero = VectorXd::Zero(n), mup(n), g_rho(np), integrand(np);
      s->adjoint_rhs(p.t, p.y.data(), zero.data(), mup.data());
      const VectorXd g_y = -mup;
      CHECK_ROWS_CLOSE_ABOVE(MatrixXd(g_y.transpose()), difference_jacobian(cost, p.y), kDifference, VectorXd::Ones(1));
      s->adjoint_integrand(p.t, p.y.data(), zero.data(), g_rho.data());
      const MatrixXd expected = parameter_differences(*s, [&] { return cost(p.y); });
      CHECK_ROWS_CLOSE_ABOVE(MatrixXd(g_rho.cwiseProduct(scales(*s)).transpose()), expected, kDifference,
                             VectorXd::Ones(1));
      // mu' = -f_y^T mu - g_y, integrand = g_rho + f_rho^T mu.
      const VectorXd mu = random.vector(n);
      s->adjoint_rhs(p.t, p.y.data(), mu.data(), mup.data());
      const VectorXd expected_mup = -(f_y.transpose() * mu) - g_y;
      const VectorXd size = f_y.cwiseAbs().transpose() * mu.cwiseAbs() + g_y.cwiseAbs();
      CHECK_ROWS_CLOSE_ABOVE(mup, expected_mup, kSame, size.cwiseMax(1).eval());
      s->adjoint_integrand(p.t, p.y.data(), mu.data(), integrand.data());
      const VectorXd expected_integrand = g_rho + f_rho.transpose() * mu;
      const VectorXd size_rho = g_rho.cwiseAbs() + f_rho.cwiseAbs().transpose() * mu.cwiseAbs();
      CHECK_ROWS_CLOSE_ABOVE(integrand, expected_integrand, kSame, size_rho.cwiseMax(1).eval());
    }
  });
}

TEST_CASE("ODE: costs along tangent columns", "[systems]") {
  for_each_case(false, [](const Case& c) {
    const auto s = c.ode();
    const int n = s->size(), np = s->parameter_count();
    for (const auto& p : ode_points(*s)) {
      CAPTURE(p.label);
      MatrixXd in(n, np);
      std::vector<const double*> from;
      Random random(17);
      for (int j = 0; j < np; ++j) {
        in.col(j) = random.vector(n);
        from.push_back(in.col(j).data());
      }
      VectorXd out(np), g_rho(np), mup(n);
      const VectorXd zero = VectorXd::Zero(n);
      s->tangent_running_cost(p.t, p.y.data(), from.data(), out.data(), np);
      s->adjoint_rhs(p.t, p.y.data(), zero.data(), mup.data());
      s->adjoint_integrand(p.t, p.y.data(), zero.data(), g_rho.data());
      VectorXd expected = g_rho - in.transpose() * mup;
      VectorXd size = g_rho.cwiseAbs() + in.cwiseAbs().transpose() * mup.cwiseAbs();
      CHECK_ROWS_CLOSE_ABOVE(out, expected, kSame, size.cwiseMax(1).eval());

      s->tangent_terminal_cost(p.t, p.y.data(), from.data(), out.data(), np);
      VectorXd mu(n), w_rho = VectorXd::Zero(np);
      s->terminal_adjoint(p.t, p.y.data(), mu.data(), w_rho.data());
      expected = w_rho + in.transpose() * mu;
      size = w_rho.cwiseAbs() + in.cwiseAbs().transpose() * mu.cwiseAbs();
      CHECK_ROWS_CLOSE_ABOVE(out, expected, kSame, size.cwiseMax(1).eval());
      const auto cost = [&](const VectorXd& y) { return VectorXd::Constant(1, s->terminal_cost(p.t, y.data())); };
      CHECK_ROWS_CLOSE_ABOVE(MatrixXd(mu.transpose()), difference_jacobian(cost, p.y), kDifference, VectorXd::Ones(1));
      CHECK_ROWS_CLOSE_ABOVE(MatrixXd(w_rho.cwiseProduct(scales(*s)).transpose()),
                             parameter_differences(*s, [&] { return cost(p.y); }), kDifference, VectorXd::Ones(1));
    }
  });
}

TEST_CASE("ODE: the start is that of the DAE", "[systems]") {
  for_each_case(false, [](const Case& c) {
    if (!find_formulation(c.variant.formulation).make_dae) return;
    const auto s = c.ode();
    const auto dae = c.dae();
    VectorXd y(s->size()), full(dae->size()), fullp(dae->size());
    MatrixXd y_rho, full_rho, fullp_rho;
    s->start(0.3, y.data(), &y_rho);
    dae->start(0.3, full.data(), fullp.data(), &full_rho, &fullp_rho);
    CHECK((y - full.head(s->size())).cwiseAbs().maxCoeff() == 0);
    CHECK((y_rho - full_rho.topRows(s->size())).cwiseAbs().maxCoeff() == 0);
  });
}
