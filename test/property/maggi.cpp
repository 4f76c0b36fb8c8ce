// Maggi's formulations: changes of the independent coordinates on the way, redundant rows, and the
// hand-derived tangent and adjoint equations, which have none of their linearisation in common with the
// integrators' systems.
//
// Tolerances. As in gradients.cpp the errors of N = 1e3 steps add up to N rtol, and differences bring their
// own estimate. Here the motion adds to that: an error of a crank's speed, made anywhere on the way, becomes
// one of its angle that grows with the way turned from there on, which is up to 10 rad in these runs. So psi
// and the gradient, against its largest entry in the parameters' scales, are good to 10 N rtol where a crank
// turns freely.
#include <support/models.h>
#include <support/sweep.h>
#include <support/variants.h>

#include <catch2/catch.hpp>

#include "costate/base/error.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/sensitivity/hand_run.h"
#include "gradient_compare.h"
#include "support/paths.h"
#include "turning.h"

using namespace costate;
using namespace costate::test;

namespace {

constexpr double kSteps = 1e3, kTurn = 10;
const std::vector<std::string> kMaggi = {"maggi", "maggi-implicit", "maggi-second-order"};

std::vector<std::string> methods_of(const std::string& formulation) {
  std::vector<std::string> r = integrator_methods(formulation);
  r.insert(r.end(), {"hand-tangent", "hand-adjoint"});
  return r;
}

/// The second-order adjoint refuses running costs on accelerations and reactions, and says which formulation
/// to use.
bool refused(const Problem& p, const std::string& method) {
  return p.formulation == "maggi-second-order" && method == "hand-adjoint" && p.objective.running_needs_accelerations();
}

/// Every method of every Maggi formulation against differences of whole runs.
void check_against_differences(const TestModel& model, double rtol, double growth, long least_jumps,
                               const std::vector<std::string>& formulations = kMaggi) {
  for (const std::string& formulation : formulations) {
    Problem p = model.problem(formulation, rtol);
    const std::vector<double> rho = p.parameters.values();
    const GradientResult oracle = gradient(p, "differences", rho);
    double error = 0;
    for (std::size_t j = 0; j < rho.size(); ++j)
      error = std::max(error, oracle.gradient_error[j] * p.parameters.parameters[j].scale);
    error /= size_of(oracle.gradient, p.parameters);
    CAPTURE(model.name, formulation, error);
    const double tolerance = growth * kSteps * rtol;
    REQUIRE(error < tolerance);
    for (const std::string& method : methods_of(formulation)) {
      CAPTURE(method);
      if (refused(p, method)) continue;
      const GradientResult r = gradient(p, method, rho);
      CHECK(r.counters.jumps >= least_jumps);
      CHECK(std::abs(r.psi - oracle.psi) <= tolerance * std::abs(oracle.psi));
      CHECK_BELOW(gradient_mismatch(r.gradient, oracle.gradient, p.parameters), tolerance + 10 * error);
    }
  }
}

/// The slider-crank with everything in the running and the terminal cost.
TestModel slider_crank_of_everything(double t_end) {
  TestModel m = slider_crank(t_end);
  EverythingCost::Factors f;
  f.a = 0.01;
  f.lambda = 0.01;
  const auto cost = std::make_shared<EverythingCost>(*m.mechanism, "cost.weight", "cost.end", f);
  m.objective.running.push_back(cost);
  m.objective.terminal.push_back(cost);
  return m;
}

/// The slider-crank with a running cost whose velocity gradient varies, as the second-order adjoint needs it,
/// and a terminal cost of everything.
TestModel slider_crank_of_rates(double t_end) {
  TestModel m = slider_crank_of_everything(t_end);
  m.objective.running = {output_term(*m.mechanism, "Q.x", 2, "cost.weight"),
                         output_term(*m.mechanism, "P.y_dot", 2, "cost.end"),
                         output_term(*m.mechanism, "S.force", 2, "cost.end"),
                         output_term(*m.mechanism, "relaxation.force", 2, "cost.end")};
  return m;
}

/// The kitchen sink with those of its running costs that the second-order adjoint carries, and its terminal
/// cost of everything.
TestModel kitchen_sink_of_rates() {
  TestModel m = kitchen_sink();
  m.name = "kitchen sink of rates";
  m.objective.running = {output_term(*m.mechanism, "hole.x", 2, "cost.track"),
                         output_term(*m.mechanism, "S1.force", 2, "cost.force"),
                         output_term(*m.mechanism, "relaxation.force", 2, "cost.force"),
                         output_term(*m.mechanism, "energy.kinetic", 2, "cost.energy"),
                         output_difference(*m.mechanism, "eye.y", "boom_eye.x_dot", "cost.difference")};
  return m;
}

/// A force with a state that follows the velocity, unlike those of any kind: f_v and its rate count.
struct Wake final : ForceOf<Wake> {
  Wake(const PlanarPoint& point, const std::vector<int>& numbers) : ForceOf("force", "wake") {
    append_coordinates(point.coordinates());
    append_numbers(numbers);
  }
  int states() const override { return 1; }
  int initial_state_number(int) const override { return 1; }
  template <class S>
  void physics(const S&, const S* q, const S* v, const S* z, const S* p, S* Q, S* zdot) const {
    zdot[0] = p[0] * (q[0] * v[1] + S(0.1) * v[0] * v[0] - z[0]);
    Q[0] = S(-0.3) * z[0] * v[0];
    Q[1] = S(-1.0) * z[0];
  }
};

/// A pendulum in a wake.
TestModel pendulum_in_a_wake() {
  Sketch s;
  s.builder.set_gravity(0, -9.81);
  s.ground("O", 0, 0);
  s.point("P", 0, -1, 5, 0);
  s.bar("rod", "O", "P", 2);
  const std::vector<int> numbers = s.numbers("wake", {{"rate", 3}, {"start", 0.2}});
  s.builder.add(std::make_unique<Wake>(s.builder.point("P"), numbers));
  s.give({"P.x"});
  s.numbers("cost", {{"weight", 1}});
  s.parameter("rate", "wake.rate");
  s.parameter("start", "wake.start");
  s.parameter("speed", "point.P.vx_m_per_s");
  s.parameter("length", "bar.rod.length_m");
  s.builder.set_default_parameters({"rate", "start", "speed", "length"});
  TestModel m{"pendulum in a wake", s.builder.build(), {}, 0.6};
  m.objective.running = {output_term(*m.mechanism, "P.x_dot", 2, "cost.weight"),
                         output_term(*m.mechanism, "P.y", 2, "cost.weight")};
  m.objective.terminal = {output_term(*m.mechanism, "P.y_ddot", 2, "cost.weight")};
  return m;
}

/// A bar whose middle is held by a pin and, once more, by a slot along the bar: which of them says nothing
/// new turns with the bar, and so does the least norm of the reactions, which the cost holds.
TestModel pin_and_slot() {
  Sketch s;
  s.builder.set_gravity(0, -9.81);
  s.ground("O", 0, 0);
  s.point("P", 0.8, -0.6, 1.5, 2);
  s.bar("rod", "O", "P", 2);
  s.attach("M", "rod", 0.5, 0);
  s.point("N", 0.4, -0.3, 0.75, 1);
  s.mass("N", 1);
  s.revolute("pin", "M", "N");
  s.slot("guide", "O", "P", "N");
  s.give({"P.x"});
  s.numbers("cost", {{"weight", 0.01}});
  s.parameter("speed", "point.P.vx_m_per_s");
  s.parameter("mass", "mass.N.mass_kg");
  s.parameter("g", {{"gravity.y_m_per_s2", -1.0}});
  s.builder.set_default_parameters({"speed", "mass", "g"});
  TestModel m{"pin and slot", s.builder.build(), {}, 0.6};
  m.objective.running = {output_term(*m.mechanism, "pin.reaction_x", 2, "cost.weight"),
                         output_term(*m.mechanism, "pin.reaction_y", 2, "cost.weight")};
  m.objective.terminal = {output_term(*m.mechanism, "pin.reaction_x", 2, "cost.weight")};
  return m;
}

/// A crank that a law of time turns, and nothing else: no freedom is left.
TestModel driven_crank() {
  Sketch s;
  s.builder.set_gravity(0, -9.81);
  s.ground("O", 0, 0);
  s.point("P", 1, 0.1);
  s.bar("crank", "O", "P", 2);
  s.angle("turn", "O", "P", 0.1);
  s.driver("motor", {{"turn", 1.0}}, sine(0.1, 0.7, 3, 0));
  s.numbers("cost", {{"weight", 0.01}});
  s.parameter("length", "bar.crank.length_m");
  s.parameter("mass", "bar.crank.mass_kg");
  s.builder.set_default_parameters({"length", "mass"});
  TestModel m{"driven crank", s.builder.build(), {}, 1};
  m.objective.running = {output_term(*m.mechanism, "P.y", 2, "cost.weight"),
                         output_term(*m.mechanism, "crank.tension", 2, "cost.weight")};
  m.objective.terminal = {output_term(*m.mechanism, "P.x_ddot", 2, "cost.weight")};
  return m;
}

}  // namespace

TEST_CASE("maggi: a pendulum goes over the top", "[maggi]") {
  // Its two coordinates change roles four times a turn.
  check_against_differences(spinning_pendulum(9, 1), 1e-10, kTurn, 4);
}

TEST_CASE("maggi: a crank turns all the way round", "[maggi]") {
  check_against_differences(crank_rocker(0.4), 1e-10, kTurn, 4);
  check_against_differences(slider_crank_of_everything(0.6), 1e-10, kTurn, 4);
  check_against_differences(slider_crank_of_rates(0.6), 1e-10, kTurn, 4);
}

TEST_CASE("maggi: the gradient across changes of coordinates is that of other formulations", "[maggi]") {
  for (const TestModel& model : {crank_rocker(0.4), slider_crank_of_rates(0.6)}) {
    const Problem other = model.problem("baumgarte", 1e-11);
    const GradientResult expected = gradient(other, "cvodes-adjoint", other.parameters.values());
    for (const std::string& formulation : kMaggi) {
      const Problem p = model.problem(formulation, 1e-11);
      for (const std::string& method : methods_of(formulation)) {
        if (refused(p, method)) continue;
        CAPTURE(model.name, formulation, method);
        const GradientResult r = gradient(p, method, p.parameters.values());
        CHECK(std::abs(r.psi / expected.psi - 1) <= kTurn * kSteps * 1e-11);
        CHECK_BELOW(gradient_mismatch(r.gradient, expected.gradient, p.parameters), kTurn * kSteps * 1e-11);
      }
    }
  }
}

TEST_CASE("maggi: the hand-derived tangent and adjoint agree to 1e-9 at rtol 1e-11", "[maggi]") {
  // Both go along the same stored motion with the same changes of coordinates. The forms of first order are
  // exactly dual; each pass chooses its steps by itself, with an error of some ten rtol, so 1e-9 is ten times
  // what is left. That of second order holds as far as the stored motion satisfies
  // its equations, from which it takes the rates of its matrices: N rtol.
  for (const TestModel& model : {five_bar(), kitchen_sink(), kitchen_sink_of_rates(), spinning_pendulum(9, 1),
                                 crank_rocker(0.4), slider_crank_of_everything(0.6), slider_crank_of_rates(0.6),
                                 parallelogram(true, true, 0.3), parallelogram(true, false, 0.3)}) {
    for (const std::string& formulation : kMaggi) {
      CAPTURE(model.name, formulation);
      Problem p = model.problem(formulation, 1e-11);
      if (model.mechanism->state_count() > 1) p.parameters = model.all_parameters();
      if (refused(p, "hand-adjoint")) continue;
      const GradientResult tangent = gradient(p, "hand-tangent", p.parameters.values());
      const GradientResult adjoint = gradient(p, "hand-adjoint", p.parameters.values());
      CHECK(tangent.psi == adjoint.psi);
      const bool second_order = formulation == "maggi-second-order";
      CHECK_BELOW(gradient_mismatch(adjoint.gradient, tangent.gradient, p.parameters),
                  second_order ? kSteps * 1e-11 : 1e-9);
    }
  }
}

TEST_CASE("maggi: the second-order adjoint refuses costs whose rates it would need", "[maggi]") {
  const Problem p = crank_rocker(0.4).problem("maggi-second-order", 1e-8);
  CHECK_THROWS_AS(gradient(p, "hand-adjoint", p.parameters.values()), CapabilityError);
  CHECK_THROWS_WITH(gradient(p, "hand-adjoint", p.parameters.values()), Catch::Contains("use formulation 'maggi'"));
}

TEST_CASE("maggi: hand-derived equations of the kitchen sink against differences", "[maggi]") {
  std::size_t turn = 0;
  for (const TestModel& model : {kitchen_sink(), kitchen_sink_of_rates()}) {
    Problem p = model.problem("maggi", 1e-9);
    p.parameters = some_of(model.all_parameters(), turn++);
    const std::vector<double> rho = p.parameters.values();
    const GradientResult oracle = gradient(p, "differences", rho);
    for (const std::string& formulation : kMaggi) {
      p.formulation = formulation;
      for (const char* method : {"hand-tangent", "hand-adjoint"}) {
        if (refused(p, method)) continue;
        CAPTURE(model.name, formulation, method);
        CHECK_BELOW(gradient_mismatch(gradient(p, method, rho).gradient, oracle.gradient, p.parameters), kSteps * 1e-9);
      }
    }
  }
}

TEST_CASE("maggi: redundant rows", "[maggi]") {
  // With the force of the middle post, whose least norm moves with the posts.
  check_against_differences(parallelogram(true, false, 0.3), 1e-10, 1, 1);
  check_against_differences(parallelogram(true, true, 0.3), 1e-10, 1, 1);
}

TEST_CASE("maggi: redundant rows whose least norm turns with the motion", "[maggi]") {
  check_against_differences(pin_and_slot(), 1e-10, 1, 0);
}

TEST_CASE("maggi: a force state that follows the velocity", "[maggi]") {
  check_against_differences(pendulum_in_a_wake(), 1e-10, 1, 0);
}

TEST_CASE("maggi: a redundant row changes neither the motion nor its gradient", "[maggi]") {
  const Problem without = parallelogram(false, false, 0.3).problem("index1", 1e-11);
  const GradientResult expected = gradient(without, "cvodes-adjoint", without.parameters.values());
  for (const std::string& formulation : kMaggi) {
    const Problem p = parallelogram(true, false, 0.3).problem(formulation, 1e-11);
    for (const std::string& method : methods_of(formulation)) {
      CAPTURE(formulation, method);
      const GradientResult r = gradient(p, method, p.parameters.values());
      CHECK(std::abs(r.psi / expected.psi - 1) <= kSteps * 1e-11);
      CHECK_BELOW(gradient_mismatch(r.gradient, expected.gradient, p.parameters), kSteps * 1e-11);
    }
  }
}

TEST_CASE("maggi: a mechanism without freedom", "[maggi]") {
  check_against_differences(driven_crank(), 1e-10, 1, 0, {"maggi", "maggi-second-order"});
  // Nothing but the cost is left to integrate, which IDAS does at order 1 only: at a tolerance that this
  // reaches.
  const Problem exact = driven_crank().problem("maggi", 1e-10), p = driven_crank().problem("maggi-implicit", 1e-6);
  const std::vector<double> rho = p.parameters.values();
  const GradientResult expected = gradient(exact, "cvodes-adjoint", rho);
  for (const std::string& method : methods_of("maggi-implicit")) {
    CAPTURE(method);
    const GradientResult r = gradient(p, method, rho);
    CHECK(std::abs(r.psi / expected.psi - 1) <= kSteps * 1e-6);
    CHECK_BELOW(gradient_mismatch(r.gradient, expected.gradient, p.parameters), kSteps * 1e-6);
  }
}

TEST_CASE("maggi: the recorded motion is that of the run", "[maggi]") {
  // Fitted polynomials in (q, v), two orders above the integrator's: between their points they keep the
  // constraints as well as the integrator keeps the independent coordinates, to a few steps' errors. Another
  // run, which stops for samples, differs by the errors of both.
  constexpr double rtol = 1e-9;
  for (const TestModel& model : {crank_rocker(0.4), slider_crank(0.6), parallelogram(true, false, 0.3)})
    for (const std::string& formulation : kMaggi) {
      CAPTURE(model.name, formulation);
      const Problem p = model.problem(formulation, rtol);
      const std::vector<double> rho = p.parameters.values();
      const ForwardMotion motion = record_motion(p, rho);
      CHECK(motion.trajectory.t_begin() == 0);
      CHECK(motion.trajectory.t_end() == model.t_end);
      Assembly assembly(p.mechanism, p.parameters);
      assembly.set_parameters(rho.data());
      const int n = assembly.n(), m = assembly.m(), nz = assembly.nz();
      std::vector<double> times, y(static_cast<std::size_t>(2 * n + nz));
      for (int i = 0; i <= 500; ++i) times.push_back(model.t_end * i / 500);
      double largest = 0, off = 0;
      for (const double t : times) {
        motion.trajectory.evaluate(t, y.data());
        StateView s;
        s.t = t;
        s.q = y.data();
        s.v = y.data() + n;
        s.z = s.v + n;
        assembly.calc_dynamics(s);
        std::vector<double> phid = assembly.phi_t;
        add_product(assembly.jacobian(), assembly.phi_q.data(), 1, s.v, phid.data());
        for (int i = 0; i < m; ++i) largest = std::max({largest, std::abs(assembly.phi[i]), std::abs(phid[i])});
      }
      CHECK(largest < 1e2 * rtol);
      const Simulation run = simulate(p, rho, times, [&](const MechanismState& s, System&) {
        motion.trajectory.evaluate(s.t, y.data());
        for (int i = 0; i < n; ++i) off = std::max({off, std::abs(y[i] - s.q[i]), std::abs(y[n + i] - s.v[i]) / 10});
      });
      CHECK(run.psi == Approx(motion.psi).epsilon(kSteps * rtol));
      CHECK(off < kSteps * rtol);
    }
}

TEST_CASE("maggi: velocities keep the rates of the constraints to rounding", "[maggi]") {
  // v = R w with R by the factors of the last step of Newton's iteration for the positions. Behind a step on old
  // factors that one may be of 1e-10, and e.e' grew to 2.5e-11 within 0.4 s: amplified by this motion, omega was 4e-6
  // off at rtol 2e-13, a hundred times what it is at 1e-12.
  Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/rigid_body/dzhanibekov.toml"));
  p.formulation = "maggi";
  p.solver.integrator = "dop853";
  double psi = 0;
  for (const double rtol : {1e-12, 2e-13, 5e-14}) {
    p.solver.rtol = p.solver.atol = rtol;
    std::vector<double> times;
    for (int k = 1; k <= 100; ++k) times.push_back(0.0999 * k);
    double off = 0;
    const int first = p.mechanism->coordinate("body.e0");
    const Simulation r = simulate(p, p.parameters.values(), times, [&](const MechanismState& s, System&) {
      double rate = 0, size = 0;
      for (int i = first; i < first + 4; ++i) {
        rate += s.q[i] * s.v[i];
        size = std::max(size, std::abs(s.v[i]));
      }
      off = std::max(off, std::abs(rate) / size);
    });
    CAPTURE(rtol, off, r.psi);
    // Some ten roundings, of a chart whose condition is below ten.
    CHECK(off < 1e-14);
    // By index 1, baumgarte and cvodes at 3e-14: 34.65384923584; the motion makes 5e4 of an error.
    CHECK(std::abs(r.psi - 34.65384923584) < 1e5 * 34.65 * rtol);
    psi = r.psi;
  }
  CHECK(std::abs(psi - 34.65384923584) < 1e-9);
}
