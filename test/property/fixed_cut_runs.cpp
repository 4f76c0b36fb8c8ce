// Runs by fixed steps that are cut: of second order, over cuts in the grid's own times and in one instant, and back
// from checkpoints.
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "property/fixed_scenes.h"

using namespace costate;
using namespace costate::test;
using Catch::Contains;

// Events in the times of the grid, in one instant, at the start.
TEST_CASE("fixed cuts: events in the grid's own times and in one instant", "[events][discrete]") {
  // Two balls, let go at rest, touch at t = 0.5 s, but for rounding; one of them next to it.
  const auto balls = [](double second) {
    const double h = 0.5 * 9.81 * 0.25;
    std::string text = "[gravity]\ny_m_per_s2 = -9.81\n";
    std::string given;
    for (const auto& [name, height] : {std::pair("a", h), std::pair("b", h * second)}) {
      text += fmt::format(
          "[point.{0}]\nx_m = {2}\ny_m = {1:.17g}\n[mass.{0}]\npoint = \"{0}\"\nmass_kg = 1\n[contact.{0}]\nkind = "
          "\"rigid\"\npoint = \"{0}\"\nrestitution = 0.7\nclosing_speed_m_per_s = 0\n[[cost.terminal]]\nkind = "
          "\"square\"\noutput = \"{0}.y\"\n[[cost.running]]\nkind = \"square\"\noutput = \"{0}.y_dot\"\n",
          name, height, name[0] - 'a');
      given += fmt::format("{}\"{}.x\", \"{}.y\"", given.empty() ? "" : ", ", name, name);
    }
    return text + fmt::format("[start]\ngiven = [{}]\n[run]\nt_end_s = 0.9\n", given);
  };
  for (const double step : {0.1, 0.05, 0.03}) {
    CAPTURE(step);
    // Where both depend on parameters of their own, the other's event moves nothing of the one.
    const Problem together = fixed_problem(balls(1), {"point.a.y_m", "point.b.y_m", "contact.a.restitution"}, step),
                  apart = fixed_problem(balls(1.3), {"point.a.y_m", "point.b.y_m", "contact.a.restitution"}, step);
    const GradientResult t = gradient(together, "discrete-tangent", together.parameters.values()),
                         a = gradient(together, "discrete-adjoint", together.parameters.values()),
                         other = gradient(apart, "discrete-adjoint", apart.parameters.values());
    CHECK(t.events.size() == 2);
    CHECK(gradient_mismatch(a.gradient, t.gradient, together.parameters).error <= kSums);
    // Between impacts the motion is a parabola, which the steps meet; psi's running part is by the trapezoidal rule.
    CHECK(t.gradient[0] == Approx(other.gradient[0]).epsilon(3 * step * step));
    CHECK(t.gradient[2] == Approx(other.gradient[2]).epsilon(3 * step * step));
  }
}

// Of second order: a sixteenth of the step divides the error by 256, or by less where the events happen to lie better
// within the longer steps. The force of a gap that closes is one of its first power here: that of d^1.5 has no second
// derivative at the touch, which takes half an order from the gradient.
TEST_CASE("fixed cuts: psi and its gradient are of second order across cuts", "[events][discrete]") {
  struct Case {
    std::string scene;
    std::vector<std::string> numbers;
    double step;
  };
  for (const Case& c : {Case{falling_arm(kRigid), arm_numbers({"restitution"}), 0.02},
                        Case{falling_arm(kLinear), arm_numbers({"stiffness_N_per_m_n"}), 0.001},
                        Case{kLifted, {"force.F.a", "point.P.y_m", "mass.m.mass_kg"}, 0.02}}) {
    Problem reference = make_problem(Scene::parse(c.scene, "scene.toml"), c.numbers);
    reference.formulation = "index1";
    reference.solver.rtol = 1e-11;
    reference.solver.confirm = false;
    const auto rho = reference.parameters.values();
    const GradientResult exact = gradient(reference, "cvodes-forward", rho);
    for (const char* scheme : {"newmark", "generalized-alpha"}) {
      std::vector<double> psi, slopes;
      for (const double part : {1.0, 1.0 / 4, 1.0 / 16}) {
        const Problem p = fixed_problem(c.scene, c.numbers, c.step * part, scheme);
        const GradientResult r = gradient(p, "discrete-adjoint", rho);
        CHECK(r.events.size() == exact.events.size());
        psi.push_back(std::abs(r.psi / exact.psi - 1));
        slopes.push_back(gradient_mismatch(r.gradient, exact.gradient, p.parameters).error);
      }
      CAPTURE(c.scene, scheme, psi, slopes);
      CHECK(psi.front() / psi.back() >= 100);
      CHECK(slopes.front() / slopes.back() >= 25);
      CHECK(psi.back() <= 1e-4);
    }
  }
}

TEST_CASE("fixed cuts: an adjoint goes back over cuts from checkpoints", "[events][discrete]") {
  for (const std::string& scene : {falling_arm(kSoft), falling_arm(kRigid)}) {
    Problem p = fixed_problem(scene, kArm, 0.0031);
    const auto rho = p.parameters.values();
    const GradientResult whole = gradient(p, "discrete-adjoint", rho);
    for (const long segment : {1L, 7L, 40L}) {
      CAPTURE(segment);
      p.solver.checkpoint_steps = segment;
      const GradientResult r = gradient(p, "discrete-adjoint", rho);
      CHECK(r.counters.checkpoints > 1);
      CHECK(r.psi == whole.psi);
      // Steps that are taken again begin Newton's iteration elsewhere.
      CHECK(gradient_mismatch(r.gradient, whole.gradient, p.parameters).error <= 1e-9);
    }
  }
}
