// The example scene of every registered kind as a whole: what is assembled, the outputs' gradients and the
// start's derivatives equal differences.
#include "costate/objective/all_outputs.h"
#include "examples.h"

using namespace costate;
using namespace costate::test;

namespace {

/// M a + Phi_q^T lambda - Q, then phi, phid, phidd, zdot.
Vector equations(Assembly& assembly, const State& s) {
  assembly.calc_dynamics(s.view());
  const Matrix M = dense(assembly.square(), assembly.M.data()), J = dense(assembly.jacobian(), assembly.phi_q.data());
  Vector r(assembly.n() + 3 * assembly.m() + assembly.nz());
  r << M * s.a + J.transpose() * s.lambda - copy(assembly.Q), copy(assembly.phi), J * s.v + copy(assembly.phi_t),
      J * s.a + copy(assembly.bias), copy(assembly.zdot);
  return r;
}

void check_assembly(Assembly& assembly, const State& s) {
  const int n = assembly.n(), m = assembly.m(), nz = assembly.nz();
  const auto by = [&](Vector State::*member) {
    return differences(s.*member, [&](const Vector& x) {
      State changed = s;
      changed.*member = x;
      return equations(assembly, changed);
    });
  };
  const Matrix by_q = by(&State::q), by_v = by(&State::v), by_z = by(&State::z);
  const Vector rho = copy(assembly.rho());
  const Matrix by_rho = differences(rho, [&](const Vector& x) {
    assembly.set_parameters(x.data());
    return equations(assembly, s);
  });
  assembly.set_parameters(rho.data());
  assembly.calc_dynamics(s.view());
  assembly.calc_partials(s.view());
  constexpr double tolerance = kDifferenceTolerance;
  require_equal("K", dense(assembly.square(), assembly.K.data()), by_q.topRows(n), tolerance);
  require_equal("C", dense(assembly.square(), assembly.C.data()), by_v.topRows(n), tolerance);
  require_equal("Phi_q", dense(assembly.jacobian(), assembly.phi_q.data()), by_q.middleRows(n, m), tolerance);
  require_equal("Phid_q", dense(assembly.jacobian(), assembly.phid_q.data()), by_q.middleRows(n + m, m), tolerance);
  require_equal("Phidd_q", dense(assembly.jacobian(), assembly.phidd_q.data()), by_q.middleRows(n + 2 * m, m),
                tolerance);
  require_equal("Q_z", -dense(assembly.force_state(), assembly.Q_z.data()), by_z.topRows(n), tolerance);
  require_equal("f_q", dense(assembly.state_force(), assembly.f_q.data()), by_q.bottomRows(nz), tolerance);
  require_equal("f_v", dense(assembly.state_force(), assembly.f_v.data()), by_v.bottomRows(nz), tolerance);
  require_equal("f_z", dense(assembly.state_state(), assembly.f_z.data()), by_z.bottomRows(nz), tolerance);
  Assembly::ParameterColumns columns;
  assembly.calc_parameter_columns(s.view(), columns);
  require_equal("F_rho", columns.F, by_rho.topRows(n), tolerance);
  require_equal("phi_rho", columns.phi, by_rho.middleRows(n, m), tolerance);
  require_equal("phid_rho", columns.phid, by_rho.middleRows(n + m, m), tolerance);
  require_equal("phidd_rho", columns.phidd, by_rho.middleRows(n + 2 * m, m), tolerance);
  require_equal("f_rho", columns.f, by_rho.bottomRows(nz), tolerance);

  Random random(77);
  const Vector gamma = random.vector(m);
  std::vector<double> hessian;
  assembly.calc_hessian(s.view(), gamma.data(), hessian);
  const Matrix expected = differences(s.q, [&](const Vector& x) {
    State changed = s;
    changed.q = x;
    assembly.calc_constraints(changed.view());
    return Vector(dense(assembly.jacobian(), assembly.phi_q.data()).transpose() * gamma);
  });
  require_equal("hessian", dense(assembly.square(), hessian.data()), expected, tolerance);
}

void check_output(const Output& output, Assembly& assembly, const State& s) {
  ScalarGradient g;
  g.resize(assembly);
  g.set_zero();
  try {
    output.add_gradient(s.view(), assembly, 1.5, g);
  } catch (const CapabilityError&) {
    return;  // energy.potential and energy.total, which are for reports
  }
  const auto by = [&](Vector State::*member) {
    return differences(s.*member, [&](const Vector& x) {
      State changed = s;
      changed.*member = x;
      return Vector::Constant(1, 1.5 * output.value(changed.view(), assembly));
    });
  };
  constexpr double tolerance = kDifferenceTolerance;
  require_equal("q", g.q.transpose(), by(&State::q), tolerance);
  require_equal("v", g.v.transpose(), by(&State::v), tolerance);
  require_equal("a", g.a.transpose(), by(&State::a), tolerance);
  require_equal("lambda", g.lambda.transpose(), by(&State::lambda), tolerance);
  require_equal("z", g.z.transpose(), by(&State::z), tolerance);
  const Vector rho = copy(assembly.rho());
  const Matrix by_rho = differences(rho, [&](const Vector& x) {
    assembly.set_parameters(x.data());
    return Vector::Constant(1, 1.5 * output.value(s.view(), assembly));
  });
  assembly.set_parameters(rho.data());
  require_equal("rho", g.rho.transpose(), by_rho, tolerance);
  if (!output.needs_accelerations()) {
    REQUIRE(size(g.a) == 0);
    REQUIRE(size(g.lambda) == 0);
  }
}

}  // namespace

TEST_CASE("every example's assembled blocks equal differences of the equations of motion") {
  for_each_example([](const Scene&, Assembly& assembly, const State& s) { check_assembly(assembly, s); });
}

TEST_CASE("every output's gradient equals differences of its value") {
  for_each_example([](const Scene& scene, Assembly& assembly, const State& s) {
    const auto names = output_names(*scene.mechanism());
    const auto all = make_all_outputs(*scene.mechanism());
    REQUIRE(all.size() == names.size());
    for (std::size_t i = 0; i < names.size(); ++i) {
      INFO("output " << names[i]);
      const auto output = make_output(*scene.mechanism(), names[i]);
      REQUIRE(output->name() == names[i]);
      REQUIRE(all[i]->name() == names[i]);
      REQUIRE(all[i]->unit() == output->unit());
      check_output(*output, assembly, s);
    }
  });
}

TEST_CASE("every example's start depends on the parameters as differences say") {
  for (const SceneKind& kind : scene_kinds()) {
    INFO("example of [" << kind.name << ".NAME]");
    const Scene scene = Scene::parse(kind.example, "example of " + kind.name);
    Assembly assembly(scene.mechanism(), scene.mechanism()->select(free_numbers(*scene.mechanism())));
    const Start start = find_start(assembly, 0, true);
    const Vector rho = copy(assembly.rho());
    const Matrix expected = differences(rho, [&](const Vector& x) {
      assembly.set_parameters(x.data());
      const Start s = find_start(assembly, 0, false);
      Vector r(2 * assembly.n() + assembly.nz());
      r << s.q, s.v, s.z;
      return r;
    });
    Matrix found(expected.rows(), expected.cols());
    found << start.q_rho, start.v_rho, start.z_rho;
    require_equal("start", found, expected, 1e-8);
  }
}
