// The residual forms of all formulations; tolerances: systems.h.
#include <catch2/catch.hpp>

#include "systems.h"

using namespace costate;
using namespace costate::test;
using Eigen::MatrixXd;
using Eigen::VectorXd;

TEST_CASE("DAE: the Jacobian is that of the residual", "[systems]") {
  for_each_case(true, [](const Case& c) {
    const auto s = c.dae();
    for (const auto& p : dae_points(*s, true))
      for (const double cj : {0.0, 1.0, -7.0, 40.0}) {
        CAPTURE(p.label, cj);
        const MatrixXd expected = difference_jacobian(
            [&](const VectorXd& x) {
              const VectorXd y = p.y + x, yp = p.yp + cj * x;
              VectorXd r(s->size());
              s->residual(p.t, y.data(), yp.data(), r.data());
              return r;
            },
            VectorXd::Zero(s->size()));
        CHECK_ROWS_CLOSE(dense_jacobian(*s, p, cj), expected, kDifference);
      }
  });
}

TEST_CASE("DAE: products agree with the Jacobian", "[systems]") {
  for_each_case(true, [](const Case& c) {
    const auto s = c.dae();
    Random random(7);
    for (const auto& p : dae_points(*s, true)) {
      CAPTURE(p.label);
      const MatrixXd F_y = dense_jacobian(*s, p, 0);
      s->linearize(p.t, p.y.data(), p.yp.data());
      const int n = s->size();
      MatrixXd forward(n, n), transposed(n, n), start = MatrixXd::Random(n, n);
      for (int j = 0; j < n; ++j) {
        const VectorXd e = VectorXd::Unit(n, j);
        VectorXd out = start.col(j);
        s->add_product(-0.7, e.data(), out.data());
        forward.col(j) = (out - start.col(j)) / -0.7;
        out = start.col(j);
        s->add_transposed_product(1.3, e.data(), out.data());
        transposed.row(j) = (out - start.col(j)).transpose() / 1.3;
      }
      const VectorXd one = VectorXd::Ones(n);
      CHECK_ROWS_CLOSE_ABOVE(forward, F_y, kSame, one);
      CHECK_ROWS_CLOSE_ABOVE(transposed, F_y, kSame, one);
      // The differential flags are the rows where y' appears.
      const MatrixXd E = dense_jacobian(*s, p, 1) - F_y;
      VectorXd id(n);
      for (int i = 0; i < n; ++i) id[i] = s->unknowns()[i].differential ? 1 : 0;
      CHECK_ROWS_CLOSE_ABOVE(E, MatrixXd(id.asDiagonal()), kSame, F_y.cwiseAbs().rowwise().maxCoeff());
    }
  });
}

TEST_CASE("DAE: Newton solves invert the Jacobian", "[systems]") {
  // Right-hand sides as Newton's method meets them: differential rows carry cj times a correction. Algebraic unknowns
  // come out as differences of terms of that size, so their own size in a row is no measure. For slow steps the reduced
  // matrix M + C/cj + K/cj^2 holds M only to eps/cj^2, the price of eliminating unknowns.
  for_each_case(true, [](const Case& c) {
    const auto s = c.dae();
    const int n = s->size();
    Random random(3);
    for (const auto& p : dae_points(*s, true))
      for (const double cj : {1e-3, 1.0, -1.0, 50.0, -1e4, 1e8, 1e12, -1e12, 1e15}) {
        CAPTURE(p.label, cj);
        const MatrixXd J = dense_jacobian(*s, p, cj);
        const double tolerance = kSolve * std::max(1.0, 1 / (cj * cj));
        s->factor(p.t, p.y.data(), p.yp.data(), cj);
        VectorXd b = random.vector(n), differential(n);
        for (int i = 0; i < n; ++i) {
          differential[i] = s->unknowns()[i].differential ? 1 : 0;
          if (differential[i] == 1) b[i] *= std::max(1.0, std::abs(cj));
        }
        VectorXd x = b;
        s->solve(x.data());
        const double largest = (J * x.cwiseProduct(differential)).cwiseProduct(differential).cwiseAbs().maxCoeff();
        CHECK_BELOW(backward_error(J, x, b, largest * (VectorXd::Ones(n) - differential)), tolerance);
        // The transposed system has no such differences: its differential unknowns all have the size of b / cj.
        x = b;
        s->solve_transposed(x.data());
        CHECK_BELOW(backward_error(J.transpose(), x, b, VectorXd::Zero(n)), tolerance);
      }
  });
}

TEST_CASE("DAE: a factorization serves until the next one", "[systems]") {
  // Integrators keep an old Newton matrix while they evaluate residuals elsewhere.
  for_each_case(true, [](const Case& c) {
    const auto s = c.dae();
    const auto points = dae_points(*s, true);
    const DaePoint &p = points[0], &other = points[1];
    const VectorXd b = Random(5).vector(s->size());
    s->factor(p.t, p.y.data(), p.yp.data(), 20);
    VectorXd before = b, before_t = b, after = b, after_t = b, r(s->size());
    s->solve(before.data());
    s->solve_transposed(before_t.data());
    s->residual(other.t, other.y.data(), other.yp.data(), r.data());
    s->linearize(other.t, other.y.data(), other.yp.data());
    s->running_cost(other.t, other.y.data());
    s->solve(after.data());
    s->solve_transposed(after_t.data());
    CHECK((before - after).cwiseAbs().maxCoeff() == 0);
    CHECK((before_t - after_t).cwiseAbs().maxCoeff() == 0);
  });
}

TEST_CASE("DAE: derivatives with respect to parameters", "[systems]") {
  for_each_case(true, [](const Case& c) {
    const auto s = c.dae();
    Random random(11);
    // On the solution the stabilizing multipliers of index 2 are zero, and so is what they multiply.
    for (const auto& p : dae_points(*s, false)) {
      CAPTURE(p.label);
      const MatrixXd expected = parameter_differences(*s, [&] {
        VectorXd r(s->size());
        s->residual(p.t, p.y.data(), p.yp.data(), r.data());
        return r;
      });
      s->linearize(p.t, p.y.data(), p.yp.data());
      MatrixXd F_rho;
      s->parameter_columns(F_rho);
      CHECK_ROWS_CLOSE_ABOVE(MatrixXd(F_rho * scales(*s).asDiagonal()), expected, kDifference,
                             VectorXd::Ones(s->size()));
      const VectorXd mu = random.vector(s->size()), start = random.vector(s->parameter_count());
      VectorXd gradient = start;
      s->add_parameter_gradient(-0.8, mu.data(), gradient.data());
      const VectorXd sizes = F_rho.cwiseAbs().transpose() * mu.cwiseAbs();
      CHECK_ROWS_CLOSE_ABOVE((gradient - start).eval(), (-0.8 * F_rho.transpose() * mu).eval(), kSame,
                             sizes.cwiseMax(1).eval());
    }
  });
}

TEST_CASE("DAE: the start is consistent and its derivative exact", "[systems]") {
  for_each_case(true, [](const Case& c) {
    const auto s = c.dae();
    for (const double t : {0.0, 0.3}) {
      CAPTURE(t);
      DaePoint p{"", t, VectorXd(s->size()), VectorXd(s->size())};
      MatrixXd y_rho, yp_rho;
      s->start(t, p.y.data(), p.yp.data(), &y_rho, &yp_rho);
      VectorXd r(s->size());
      s->residual(t, p.y.data(), p.yp.data(), r.data());
      const VectorXd size = dense_jacobian(*s, p, 0).cwiseAbs() * p.y.cwiseAbs() + p.yp.cwiseAbs();
      CHECK_ROWS_CLOSE_ABOVE(r, VectorXd::Zero(r.size()).eval(), kSame, size.cwiseMax(1).eval());
      const MatrixXd expected = parameter_differences(*s, [&] {
        VectorXd both(2 * s->size());
        s->start(t, both.data(), both.data() + s->size(), nullptr, nullptr);
        return both;
      });
      MatrixXd found(2 * s->size(), s->parameter_count());
      found << y_rho, yp_rho;
      CHECK_ROWS_CLOSE_ABOVE(MatrixXd(found * scales(*s).asDiagonal()), expected, kDifference,
                             VectorXd::Ones(2 * s->size()));
      // A bar's length moves the start (of all coordinates; independent ones may be the given ones).
      if (!has_all_coordinates(*s)) continue;
      const auto names = s->parameters().names();
      const auto at = std::find_if(names.begin(), names.end(),
                                   [](const std::string& name) { return name == "rod_length" || name == "A1_length"; });
      REQUIRE(at != names.end());
      CHECK(y_rho.col(at - names.begin()).head(s->assembly().n()).norm() > 0.1);
    }
  });
}

TEST_CASE("DAE: gradients of the cost", "[systems]") {
  for_each_case(true, [](const Case& c) {
    const auto s = c.dae();
    for (const auto& p : dae_points(*s, true))
      for (const bool terminal : {false, true}) {
        CAPTURE(p.label, terminal);
        const auto cost = [&](const VectorXd& y) {
          return VectorXd::Constant(1, terminal ? s->terminal_cost(p.t, y.data()) : s->running_cost(p.t, y.data()));
        };
        VectorXd g_y(s->size()), gradient = VectorXd::Constant(s->parameter_count(), 2);
        if (terminal)
          s->terminal_cost_gradient(p.t, p.y.data(), g_y.data(), 0.5, gradient.data());
        else
          s->running_cost_gradient(p.t, p.y.data(), g_y.data(), 0.5, gradient.data());
        CHECK_ROWS_CLOSE_ABOVE(MatrixXd(g_y.transpose()), difference_jacobian(cost, p.y), kDifference,
                               VectorXd::Ones(1));
        const MatrixXd expected = parameter_differences(*s, [&] { return cost(p.y); });
        const VectorXd found = scales(*s).cwiseProduct(gradient - VectorXd::Constant(gradient.size(), 2)) / 0.5;
        CHECK_ROWS_CLOSE_ABOVE(MatrixXd(found.transpose()), expected, kDifference, VectorXd::Ones(1));
      }
  });
}

TEST_CASE("DAE: end values of the adjoint", "[systems]") {
  // The starts of neighbouring designs are neighbouring consistent states. Along them the change of the terminal cost
  // must equal what the adjoint's end values give: mu^T F_y' y_rho plus the terms that the gradient gains at the end.
  for_each_case(true, [](const Case& c) {
    const auto s = c.dae();
    const double t = 0.3;
    const int n = s->size(), np = s->parameter_count();
    DaePoint p{"", t, VectorXd(n), VectorXd(n)};
    MatrixXd y_rho, yp_rho;
    s->start(t, p.y.data(), p.yp.data(), &y_rho, &yp_rho);
    VectorXd w_y(n), direct = VectorXd::Zero(np), by_adjoint = VectorXd::Zero(np), mu(n), mup(n);
    s->terminal_cost_gradient(t, p.y.data(), w_y.data(), 1, direct.data());
    direct += y_rho.transpose() * w_y;
    s->terminal_adjoint(t, p.y.data(), p.yp.data(), mu.data(), mup.data(), by_adjoint.data());
    VectorXd weighted = mu;
    for (int i = 0; i < n; ++i)
      if (!s->unknowns()[i].differential) weighted[i] = 0;
    by_adjoint += y_rho.transpose() * weighted;
    const VectorXd scale = scales(*s);
    const MatrixXd a = direct.cwiseProduct(scale).transpose(), b = by_adjoint.cwiseProduct(scale).transpose();
    CHECK_ROWS_CLOSE_ABOVE(a, b, kSame, VectorXd::Ones(1));
    // mu and mu' solve the backward equations E mu' - F_y^T mu + g_y = 0: all of them at index 1; at index 2 the
    // two conditions without derivatives (the multipliers kappa and nu are found by the first step).
    s->linearize(t, p.y.data(), p.yp.data());
    VectorXd r(n), unused = VectorXd::Zero(np);
    s->running_cost_gradient(t, p.y.data(), r.data(), 0, unused.data());
    const VectorXd size =
        r.cwiseAbs() + dense_jacobian(*s, p, 0).cwiseAbs().transpose() * mu.cwiseAbs() + mup.cwiseAbs();
    for (int i = 0; i < n; ++i)
      if (s->unknowns()[i].differential) r[i] += mup[i];
    s->add_transposed_product(-1, mu.data(), r.data());
    for (int i = 0; i < n; ++i) {
      const auto role = s->unknowns()[i].role;
      const bool index2 = c.variant.formulation == "index2";
      if (index2 && role != Unknown::Role::multiplier && role != Unknown::Role::stabilizer) continue;
      CAPTURE(s->unknowns()[i].name);
      CHECK(std::abs(r[i]) <= kSame * std::max(1.0, size[i]));
    }
  });
}
