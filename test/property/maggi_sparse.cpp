// Maggi's equations of many freedoms are solved by sparse factors in place of full matrices: the same numbers.
//
// Tolerance: two exact routes to one number, apart by rounding (kSolve, systems.h), and by the condition of My and of
// Newton's matrix, some 1e3 here.
#include <catch2/catch.hpp>

#include "costate/analysis/start.h"
#include "costate/level/maggi_choice.h"
#include "costate/level/maggi_newton.h"
#include "costate/level/maggi_ratio.h"
#include "costate/level/maggi_sparse_newton.h"
#include "costate/sensitivity/method.h"
#include "gradient_compare.h"
#include "systems.h"

using namespace costate;
using namespace costate::test;

namespace {

constexpr double kRoutes = 1e3 * kSolve;

double apart(const VectorXd& a, const VectorXd& b) {
  return a.size() == 0 ? 0 : (a - b).cwiseAbs().maxCoeff() / std::max(1e-300, b.cwiseAbs().maxCoeff());
}

std::vector<TestModel> models() { return {kitchen_sink(), five_bar(), chain(12, 1), free_flight()}; }

}  // namespace

TEST_CASE("maggi sparse: masses and null spaces are those of full matrices") {
  Random random(7);
  for (const TestModel& model : models()) {
    Assembly assembly(model.mechanism, model.all_parameters());
    assembly.set_parameters(model.all_parameters().values().data());
    MaggiPositions positions(assembly);
    const Start start = find_start(assembly, 0, false);
    positions.start(start.state(0));
    const int n = assembly.n(), f = positions.freedoms();
    VectorXd y(f);
    for (int i = 0; i < f; ++i) y[i] = start.q[positions.chart().independent()[static_cast<std::size_t>(i)]];
    positions.solve(0, y.data());
    StateView s;
    s.q = positions.q();
    s.v = start.v.data();
    s.z = start.z.data();
    assembly.calc_dynamics(s);
    MaggiMass full(assembly, positions), sparse(assembly, positions, 0);
    CAPTURE(model.name, f);
    REQUIRE_FALSE(full.sparse());
    REQUIRE(sparse.sparse());
    const VectorXd x = random.vector(n), g = random.vector(f);
    VectorXd a(f), b(f), u(n), w(n);
    full.project(x.data(), a.data());
    sparse.project(x.data(), b.data());
    CHECK(apart(b, a) < kRoutes);
    full.expand(g.data(), u.data());
    sparse.expand(g.data(), w.data());
    CHECK(apart(w, u) < kRoutes);
    a = b = g;
    full.solve(0, a.data());
    sparse.solve(0, b.data());
    CHECK(apart(b, a) < kRoutes);
    CHECK(std::abs(sparse.chart_ratio() / full.chart_ratio() - 1) < kRoutes);
  }
}

TEST_CASE("maggi sparse: Newton's matrix and its transpose") {
  Random random(8);
  for (const TestModel& model : models()) {
    Assembly assembly(model.mechanism, model.all_parameters());
    assembly.set_parameters(model.all_parameters().values().data());
    MaggiLevel level(assembly);
    const Start start = find_start(assembly, 0, false);
    level.start(start.state(0));
    const int f = level.freedoms(), nz = assembly.nz();
    VectorXd y(f), yd(f);
    for (int i = 0; i < f; ++i) {
      y[i] = start.q[level.independent()[static_cast<std::size_t>(i)]];
      yd[i] = start.v[level.independent()[static_cast<std::size_t>(i)]];
    }
    level.solve(0, y.data(), yd.data(), start.z.data());
    level.solve_accelerations();
    level.linearize();
    for (const double gamma : {1e-4, 0.02}) {
      MaggiNewton full(level);
      full.factor(gamma);
      MaggiSparseNewton sparse(assembly);
      REQUIRE(sparse.factor(assembly, level.independent(), gamma));
      CAPTURE(model.name, gamma);
      const VectorXd b_y = random.vector(f), b_yd = random.vector(f), b_w = random.vector(f), b_z = random.vector(nz);
      VectorXd p = b_y, q = b_yd, z = b_z, p2 = b_y, q2 = b_yd, z2 = b_z, w = b_w, w2 = b_w;
      full.solve(p.data(), q.data(), w.data(), z.data());
      sparse.solve(p2.data(), q2.data(), w2.data(), z2.data());
      CHECK(apart(p2, p) < kRoutes);
      CHECK(apart(q2, q) < kRoutes);
      CHECK(apart(z2, z) < kRoutes);
      CHECK(w == b_w);
      CHECK(w2 == b_w);
      p = p2 = b_y;
      q = q2 = b_yd;
      z = z2 = b_z;
      full.solve_transposed(p.data(), q.data(), w.data(), z.data());
      sparse.solve_transposed(p2.data(), q2.data(), w2.data(), z2.data());
      CHECK(apart(p2, p) < kRoutes);
      CHECK(apart(q2, q) < kRoutes);
      CHECK(apart(w2, w) < kRoutes);
      CHECK(apart(z2, z) < kRoutes);
    }
  }
}

// At rtol 1e-9 over some 1e3 steps both are good to 10 N rtol, as in maggi.cpp.
TEST_CASE("maggi sparse: gradients of a chain of many bars") {
  const TestModel model = chain(40, 0.2);
  const std::vector<std::string> parameters = {"m1", "m20", "m40"};
  const Problem other = model.problem("baumgarte", 1e-9, parameters);
  const GradientResult expected = gradient(other, "cvodes-adjoint", other.parameters.values());
  const auto check = [&](const std::string& formulation, const std::string& method) {
    CAPTURE(formulation, method);
    const Problem p = model.problem(formulation, 1e-9, parameters);
    const GradientResult r = gradient(p, method, p.parameters.values());
    CHECK(std::abs(r.psi - expected.psi) <= 1e-5 * std::abs(expected.psi));
    CHECK_BELOW(gradient_mismatch(r.gradient, expected.gradient, p.parameters), 1e-5);
  };
  check("maggi", "cvodes-adjoint");
  check("maggi", "cvodes-forward");
  check("maggi-implicit", "idas-adjoint");
  check("maggi-implicit", "idas-forward");
}

// The choice of the elimination is regular and as good as that of full matrices: none of its R is above 1, so that no
// exchange of two makes the volume larger.
TEST_CASE("maggi sparse: the coordinates chosen are as good as those of full matrices") {
  Random random(11);
  for (const TestModel& model : {five_bar(), chain(12, 1), chain(40, 1), free_flight()}) {
    Assembly assembly(model.mechanism, model.all_parameters());
    assembly.set_parameters(model.all_parameters().values().data());
    const Start start = find_start(assembly, 0, false);
    const int n = assembly.n(), f = degrees_of_freedom(assembly);
    REQUIRE(assembly.m() + f == n);
    for (int turn = 0; turn < 5; ++turn) {
      StateView s;
      s.q = start.q.data();
      assembly.calc_jacobian(s);
      // Rows as of other positions: the pattern's numbers changed by up to a half, coordinates of other sizes.
      std::vector<double> phi_q = assembly.phi_q, weight(static_cast<std::size_t>(n), 1);
      if (turn > 0)
        for (double& x : phi_q) x += 0.5 * random.vector(1)[0];
      if (turn > 2)
        for (double& x : weight) x = std::pow(10.0, random.vector(1)[0]);
      const auto ratio_of = [&](const std::vector<int>& chosen) {
        MaggiChart chart(assembly.jacobian(), chosen);
        REQUIRE(chart.factor(phi_q.data()));
        Eigen::MatrixXd R = Eigen::MatrixXd::Zero(n, f);
        R.bottomRows(f).setIdentity();
        chart.solve(R.data(), f);
        return worst_ratio(chosen, R.data(), weight);
      };
      const std::vector<int> sparse = choose_independent(assembly.jacobian(), phi_q.data(), f, weight, 0),
                             full = choose_independent(assembly.jacobian(), phi_q.data(), f, weight, n);
      CAPTURE(model.name, turn);
      REQUIRE(static_cast<int>(sparse.size()) == f);
      CHECK(ratio_of(full) <= 1 + 2e-6);
      CHECK(ratio_of(sparse) <= 1 + 2e-6);
    }
  }
}

// What is found is an entry of R, never above the largest, and the largest itself but for rare cases: then at least
// half of it: a chart lasts until its ratio is at most twice what it was to be, and steps are accurate to that
// (maggi_names.h).
TEST_CASE("maggi sparse: the largest entry of R is found without all of R") {
  Random random(12);
  int found = 0, all = 0;
  for (const TestModel& model : {five_bar(), chain(12, 1), chain(40, 1), free_flight()}) {
    Assembly assembly(model.mechanism, model.all_parameters());
    assembly.set_parameters(model.all_parameters().values().data());
    const Start start = find_start(assembly, 0, false);
    const int n = assembly.n(), f = degrees_of_freedom(assembly);
    StateView s;
    s.q = start.q.data();
    assembly.calc_jacobian(s);
    const std::vector<double> at_start = assembly.phi_q;
    std::vector<double> weight(static_cast<std::size_t>(n), 1);
    const std::vector<int> chosen = choose_independent(assembly.jacobian(), at_start.data(), f, weight, n);
    for (int turn = 0; turn < 20; ++turn) {
      std::vector<double> phi_q = at_start;
      for (double& x : phi_q) x += 0.5 * random.vector(1)[0];
      for (double& x : weight) x = std::pow(10.0, random.vector(1)[0]);
      MaggiChart chart(assembly.jacobian(), chosen);
      REQUIRE(chart.factor(phi_q.data()));
      Eigen::MatrixXd R = Eigen::MatrixXd::Zero(n, f);
      R.bottomRows(f).setIdentity();
      chart.solve(R.data(), f);
      const double exact = worst_ratio(chosen, R.data(), weight);
      const LargestRatio r = find_largest_ratio(chart, weight);
      CAPTURE(model.name, turn, exact);
      const double entry = std::abs(R(r.row, r.column)) * weight[static_cast<std::size_t>(r.row)] /
                           weight[static_cast<std::size_t>(chosen[static_cast<std::size_t>(r.column)])];
      CHECK(std::abs(r.ratio / entry - 1) < kRoutes);
      CHECK(r.ratio <= exact * (1 + kRoutes));
      CHECK(r.ratio >= 0.5 * exact);
      ++all;
      if (r.ratio > 0.999 * exact) ++found;
    }
  }
  CHECK(10 * found >= 9 * all);
}

// More freedoms than all of R is looked at for: the choice is the one of exchanges down to 1.2 (maggi_choice.cpp), of
// what the search finds; a half of the largest entry at least, as above.
TEST_CASE("maggi sparse: the coordinates of very many freedoms") {
  const TestModel model = chain(kMostExactFreedoms + 20, 1);
  Assembly assembly(model.mechanism, model.all_parameters());
  assembly.set_parameters(model.all_parameters().values().data());
  const Start start = find_start(assembly, 0, false);
  const int n = assembly.n(), f = degrees_of_freedom(assembly);
  REQUIRE(f > kMostExactFreedoms);
  StateView s;
  s.q = start.q.data();
  assembly.calc_jacobian(s);
  const std::vector<double> weight(static_cast<std::size_t>(n), 1);
  const std::vector<int> chosen = choose_independent(assembly.jacobian(), assembly.phi_q.data(), f, weight);
  REQUIRE(static_cast<int>(chosen.size()) == f);
  CHECK(std::is_sorted(chosen.begin(), chosen.end()));
  MaggiChart chart(assembly.jacobian(), chosen);
  REQUIRE(chart.factor(assembly.phi_q.data()));
  Eigen::MatrixXd R = Eigen::MatrixXd::Zero(n, f);
  R.bottomRows(f).setIdentity();
  chart.solve(R.data(), f);
  CHECK(worst_ratio(chosen, R.data(), weight) <= 2 * 1.2);
}
