// The start's derivative applied from the left, as adjoint methods take it: the same as by its columns, and without
// them, so that a gradient's memory is that of the mechanism plus that of the parameters, not of their product.
//
// Tolerance: two exact routes through the same factors, 1e-10 of the sum of the terms' sizes (condition numbers of the
// start's systems here are below 1e4).
#include <fmt/format.h>
#include <support/models.h>
#include <support/random.h>
#include <support/variants.h>

#include <catch2/catch.hpp>

#include "costate/analysis/given_system.h"
#include "costate/analysis/start.h"
#include "costate/integrator/fixed_run.h"
#include "costate/scene/scene.h"
#include "examples.h"

using namespace costate;
using namespace costate::test;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kSame = 1e-10;

void check_same(const VectorXd& found, const VectorXd& expected, const VectorXd& sizes) {
  REQUIRE(found.size() == expected.size());
  for (Eigen::Index j = 0; j < found.size(); ++j) {
    CAPTURE(j, found[j], expected[j]);
    CHECK(std::abs(found[j] - expected[j]) <= kSame * std::max(1.0, sizes[j]));
  }
}

/// A row of bars that hang from the ground, one end given each; with `twice`, the first of them stands there two times,
/// so that rows are redundant.
Scene row_of_bars(int bars, bool twice) {
  std::string text = "[gravity]\ny_m_per_s2 = -9.81\n[point.P0]\nground = true\nx_m = 0\ny_m = 0\n";
  std::string given;
  for (int i = 1; i <= bars; ++i) {
    text += fmt::format("[point.P{}]\nx_m = {}\ny_m = {}\n", i, 0.06 * i, -0.08 * i);
    text += fmt::format("[bar.b{}]\nfrom = \"P{}\"\nto = \"P{}\"\nmass_kg = {}\n", i, i - 1, i, 1 + 0.01 * i);
    given += fmt::format("{}\"P{}.x\"", i > 1 ? ", " : "", i);
  }
  if (twice) text += "[distance.again]\nfrom = \"P0\"\nto = \"P1\"\n";
  return Scene::parse(text + "[start]\ngiven = [" + given + "]\n", "row of bars");
}

}  // namespace

TEST_CASE("start adjoint: as by the columns, for every example of a kind") {
  int checked = 0;
  for (const SceneKind& kind : scene_kinds()) {
    INFO("example of [" << kind.name << ".NAME]");
    const Scene scene = Scene::parse(kind.example, "example of " + kind.name);
    Assembly a(scene.mechanism(), scene.mechanism()->select(free_numbers(*scene.mechanism())));
    if (a.np() == 0) continue;
    const Start columns = find_start(a, 0.1, true);
    const bool balanced = scene.mechanism()->starts_at_equilibrium();
    const Start without = find_start(a, 0.1, needs_start_columns(a, StartDerivative::adjoint));
    CHECK((without.q_rho.size() > 0) == balanced);
    Random random(5);
    const VectorXd wq = random.vector(a.n()), wv = random.vector(a.n()), wz = random.vector(a.nz());
    VectorXd found = VectorXd::Zero(a.np());
    add_start_gradient(a, 0.1, without, wq.data(), wv.data(), wz.data(), found.data());
    const auto times = [&](const auto& f) -> VectorXd {
      return f(columns.q_rho).transpose() * f(wq) + f(columns.v_rho).transpose() * f(wv) +
             f(columns.z_rho).transpose() * f(wz);
    };
    check_same(found, times([](const auto& x) { return MatrixXd(x); }),
               times([](const auto& x) { return MatrixXd(x.cwiseAbs()); }));
    ++checked;
  }
  CHECK(checked > 20);
}

TEST_CASE("start adjoint: as by the columns, for every formulation") {
  for (const TestModel& model : {kitchen_sink(), five_bar()})
    for (const Variant& v : variants()) {
      INFO(model.name << ", " << v.label);
      const Formulation& f = find_formulation(v.formulation);
      std::unique_ptr<DaeSystem> dae;
      std::unique_ptr<OdeSystem> ode;
      MatrixXd y_rho, yp_rho;
      if (f.make_dae) {
        dae = f.make_dae(model.mechanism, model.all_parameters(), model.objective, v.options);
        VectorXd y(dae->size()), yp(dae->size());
        dae->start(0.3, y.data(), yp.data(), &y_rho, &yp_rho);
      } else if (f.make_ode) {
        ode = f.make_ode(model.mechanism, model.all_parameters(), model.objective, v.options);
        VectorXd y(ode->size());
        ode->start(0.3, y.data(), &y_rho);
      } else {
        continue;
      }
      System& s = dae ? static_cast<System&>(*dae) : *ode;
      Random random(7);
      VectorXd mu = random.vector(s.size()), found = VectorXd::Zero(s.parameter_count()), weighted = mu;
      for (int i = 0; i < s.size(); ++i)
        if (!s.unknowns()[static_cast<std::size_t>(i)].differential) weighted[i] = 0;
      s.add_start_gradient(0.3, mu.data(), found.data());
      check_same(found, y_rho.transpose() * weighted, y_rho.cwiseAbs().transpose() * weighted.cwiseAbs());
    }
}

TEST_CASE("start adjoint: transposed solutions of dense, sparse square and sparse rectangular systems") {
  for (const auto& [bars, twice] : {std::pair{20, false}, {20, true}, {300, false}, {300, true}}) {
    INFO(bars << " bars" << (twice ? ", one row twice" : ""));
    const Scene scene = row_of_bars(bars, twice);
    Assembly a(scene.mechanism(), scene.mechanism()->select({}));
    const Start s = find_start(a, 0, false);
    StateView x;
    x.q = s.q.data();
    a.calc_constraints(x);
    GivenSystem system(a, scene.mechanism()->given_positions(), GivenSystem::Of::positions);
    system.factor(s.q.data());
    Random random(3);
    const VectorXd w = random.vector(a.n()), b = random.vector(system.rows());
    const VectorXd y = system.solve_transposed(w), solved = system.solve(b);
    REQUIRE(y.size() == system.rows());
    CHECK(std::abs(w.dot(solved) - y.dot(b)) <=
          kSame * (w.cwiseAbs().dot(solved.cwiseAbs()) + y.cwiseAbs().dot(b.cwiseAbs())));
  }
}

TEST_CASE("start adjoint: discrete adjoints start without columns") {
  Problem p = five_bar().problem("index3", 1e-6);
  p.solver.t_end = 0.1;
  CHECK(FixedRun(p, p.parameters.values(), 10, StartDerivative::adjoint).scheme().start_state().q_rho.size() == 0);
  CHECK(FixedRun(p, p.parameters.values(), 10, StartDerivative::columns).scheme().start_state().q_rho.size() > 0);
}
