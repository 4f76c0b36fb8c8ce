// What a system says of a point does not depend on what else its assembly was asked in between: what is known is kept
// with the identity of its point (assembly/evaluation_point.h). Tolerance kSame of systems.h: the same evaluations in
// the same order give the same bits, but positions that Newton's method finds again begin from another guess.
#include <catch2/catch.hpp>

#include "costate/analysis/start.h"
#include "costate/assembly/evaluation_point.h"
#include "costate/event/end_event.h"
#include "costate/formulation/solved_state.h"
#include "systems.h"

using namespace costate;
using namespace costate::test;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// Another state of the same mechanism, for the assembly alone.
class Elsewhere {
 public:
  explicit Elsewhere(const Assembly& assembly) {
    Assembly own(assembly.mechanism_ptr(), assembly.parameters());
    const Start start = find_start(own, 0, false);
    Random random(7);
    q_ = start.q + 0.1 * random.vector(assembly.n());
    v_ = start.v + random.vector(assembly.n());
    a_ = random.vector(assembly.n());
    lambda_ = random.vector(assembly.m());
    z_ = start.z + 0.3 * random.vector(assembly.nz());
  }
  StateView state() const { return {1.7, q_.data(), v_.data(), a_.data(), lambda_.data(), z_.data()}; }
  void evaluate(Assembly& assembly) const {
    assembly.calc_dynamics(state());
    assembly.calc_partials(state());
  }

 private:
  VectorXd q_, v_, a_, lambda_, z_;
};

void check_same(const std::vector<VectorXd>& a, const std::vector<VectorXd>& b) {
  REQUIRE(a.size() == b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    CAPTURE(i);
    CHECK_ROWS_CLOSE_ABOVE(a[i], b[i], kSame, VectorXd::Constant(a[i].size(), a[i].cwiseAbs().maxCoeff()).eval());
  }
}

/// All that an integrator asks of a DAE at a point, each behind a call of `between`.
template <class Between>
std::vector<VectorXd> asked(DaeSystem& s, const DaePoint& p, const Between& between) {
  const int n = s.size(), np = s.parameter_count();
  const VectorXd x = VectorXd::LinSpaced(n, -1, 2);
  std::vector<VectorXd> r;
  const auto linearize = [&] {
    s.linearize(p.t, p.y.data(), p.yp.data());
    between();
    s.linearize(p.t, p.y.data(), p.yp.data());
  };
  r.emplace_back(n);
  s.residual(p.t, p.y.data(), p.yp.data(), r.back().data());
  linearize();
  r.push_back(VectorXd::Zero(n));
  s.add_product(1, x.data(), r.back().data());
  linearize();
  r.push_back(VectorXd::Zero(n));
  s.add_transposed_product(1, x.data(), r.back().data());
  linearize();
  r.push_back(VectorXd::Zero(np));
  s.add_parameter_gradient(1, x.data(), r.back().data());
  s.factor(p.t, p.y.data(), p.yp.data(), 3);
  between();
  s.factor(p.t, p.y.data(), p.yp.data(), 3);
  r.push_back(x);
  s.solve(r.back().data());
  between();
  const MechanismState state = solved_state(s, p.t, p.y.data());
  r.push_back(Eigen::Map<const VectorXd>(state.a, s.assembly().n()));
  between();
  r.push_back(VectorXd::Constant(1, s.running_cost(p.t, p.y.data())));
  return r;
}

/// Of an ODE.
template <class Between>
std::vector<VectorXd> asked(OdeSystem& s, double t, const VectorXd& y, const Between& between) {
  const int n = s.size(), np = s.parameter_count();
  const VectorXd x = VectorXd::LinSpaced(n, -1, 2);
  const double* in = x.data();
  std::vector<VectorXd> r;
  r.emplace_back(n);
  s.rhs(t, y.data(), r.back().data());
  between();
  r.emplace_back(n);
  double* out = r.back().data();
  s.tangent(t, y.data(), &in, &out, 1, true);
  between();
  r.emplace_back(n);
  s.adjoint_rhs(t, y.data(), x.data(), r.back().data());
  between();
  r.emplace_back(np);
  s.adjoint_integrand(t, y.data(), x.data(), r.back().data());
  between();
  s.factor(t, y.data(), 0.1);
  r.push_back(x);
  s.solve(r.back().data());
  between();
  r.push_back(VectorXd::Constant(1, s.running_cost(t, y.data())));
  return r;
}

}  // namespace

TEST_CASE("points: an identity stands for all values, to the bit") {
  const TestModel model = five_bar();
  Assembly assembly(model.mechanism, model.all_parameters());
  EvaluationPoint point(assembly);
  std::vector<double> a = {1, 2}, b = {3};
  const long first = point.move_to(0, {a, b});
  CHECK(first != 0);
  CHECK(point.move_to(0, {a, b}) == first);
  CHECK(point.move_to(0, {std::vector<double>{1, 2, 3}}) == first);
  long last = first;
  const auto is_new = [&](long id) {
    const bool is = id > last;
    last = id;
    return is;
  };
  b[0] = 4;
  CHECK(is_new(point.move_to(0, {a, b})));
  CHECK(is_new(point.move_to(-0.0, {a, b})));
  CHECK(is_new(point.move_to(1, {a, b})));
  CHECK(point.values()[2] == 4);
  point.forget();
  CHECK(is_new(point.move_to(1, {a, b})));
  assembly.set_parameters(model.all_parameters().values().data());
  CHECK(is_new(point.move_to(1, {a, b})));
  // Results are those of the point that was named with them, until something else is evaluated.
  const Elsewhere elsewhere(assembly);
  assembly.calc_dynamics(elsewhere.state(), last);
  assembly.calc_partials(elsewhere.state(), last);
  CHECK((assembly.has_dynamics(last) && assembly.has_matrices(last) && assembly.has_partials(last)));
  const std::vector<double> M = assembly.M;
  VectorXd other = VectorXd::Random(assembly.n());
  assembly.kinetic_energy({0, other.data(), other.data(), nullptr, nullptr, nullptr});
  CHECK(assembly.M == M);
  CHECK(assembly.has_dynamics(last));
  assembly.calc_mass(elsewhere.state());
  CHECK_FALSE(assembly.has_dynamics(last));
  CHECK(assembly.has_partials(last));
}

TEST_CASE("points: a DAE's answers do not depend on what else is evaluated", "[systems]") {
  for_each_case(true, [](const Case& c) {
    const auto s = c.dae(), disturbed = c.dae();
    const Elsewhere elsewhere(s->assembly());
    for (const auto& p : dae_points(*s, true)) {
      CAPTURE(p.label);
      s->start(0, VectorXd(s->size()).data(), VectorXd(s->size()).data(), nullptr, nullptr);
      disturbed->start(0, VectorXd(s->size()).data(), VectorXd(s->size()).data(), nullptr, nullptr);
      check_same(asked(*disturbed, p, [&] { elsewhere.evaluate(disturbed->assembly()); }), asked(*s, p, [] {}));
    }
  });
}

TEST_CASE("points: an ODE's answers do not depend on what else is evaluated", "[systems]") {
  for_each_case(false, [](const Case& c) {
    const auto s = c.ode(), disturbed = c.ode();
    const Elsewhere elsewhere(s->assembly());
    VectorXd y(s->size());
    disturbed->start(0, y.data(), nullptr);
    s->start(0, y.data(), nullptr);
    for (const double by : {0.0, 0.1}) {
      CAPTURE(by);
      const VectorXd at = y + by * Random(3).vector(s->size());
      check_same(asked(*disturbed, 0.37, at, [&] { elsewhere.evaluate(disturbed->assembly()); }),
                 asked(*s, 0.37, at, [] {}));
    }
  });
}

TEST_CASE("points: rates of outputs are those of the state, whatever was assembled last", "[systems]") {
  const TestModel model = kitchen_sink();
  const Mechanism& mechanism = *model.mechanism;
  REQUIRE(mechanism.state_count() > 0);
  Assembly assembly(model.mechanism, model.all_parameters());
  const Elsewhere here(assembly);
  const StateView s = here.state();
  assembly.calc_dynamics(s);
  const std::vector<double> zdot = assembly.zdot;
  const VectorXd zero = VectorXd::Zero(std::max({assembly.n(), assembly.m(), assembly.nz()}));
  StateView other = s;
  other.v = other.z = zero.data();
  other.t = 0;
  for (int i = 0; i < mechanism.state_count(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const EndEvent end{make_output(mechanism, "z." + mechanism.state_names()[k]), true, -1, 0};
    assembly.calc_dynamics(other);
    CHECK(assembly.zdot[k] != zdot[k]);
    CHECK(end_rates(end, Objective{}, s, assembly, {}).h_rate == zdot[k]);
  }
}
