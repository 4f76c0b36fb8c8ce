// Tutorial 1: a mechanism without a scene file.
//
// A motor turns the crank of a slider-crank; a spring and damper pull the slider back. We build it in C++, simulate it,
// and ask how the cost depends on four of its numbers, by three methods that share as little as possible.
//
//            A
//          /   \_ rod
//   crank /       \_
//        O - - - - - B ~~~~ spring ~~~~ W        (the slider B stays on the line O-W)
//
// The program checks its own result and returns 1 when something is wrong.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "costate/base/error.h"
#include "costate/integrator/simulate.h"
#include "costate/kind/body/bar.h"
#include "costate/kind/body/mass.h"
#include "costate/kind/body/point.h"
#include "costate/kind/force/force.h"
#include "costate/kind/force/spring.h"
#include "costate/kind/joint/angle.h"
#include "costate/kind/joint/two_lines.h"
#include "costate/objective/constant_costs.h"
#include "costate/sensitivity/method.h"

namespace {

using namespace costate;

std::shared_ptr<const Mechanism> slider_crank() {
  MechanismBuilder b;
  b.set_gravity(0, -9.81);  // before bodies are added

  // Points in natural coordinates. Those of a free point are first guesses: the start solves for them.
  add_ground_point(b, "O", 0, 0);
  add_ground_point(b, "W", 1, 0);
  add_free_point(b, "A", {.x_m = 0.12, .y_m = 0.16});
  add_free_point(b, "B", {.x_m = 0.7, .y_m = 0});

  // A bar brings its inertia and the constraint of its length. Without a length it takes the distance of its points.
  add_bar(b, "crank", "O", "A", {.mass_kg = 1, .length_m = 0.2});
  add_bar(b, "rod", "A", "B", {.mass_kg = 1.5, .length_m = 0.6});
  add_mass(b, "slider", "B", 2);
  add_slot(b, "guide", "B", {"O", "W"});

  // A bar knows its angle only if somebody wants it: here the motor and the start do.
  add_bar_angle(b, "crank", "crank", {});
  add_couple(b, "motor", {"crank"}, 2.0);  // N m; a law of time would do, too: sine_law(2, 1, 10, 0)
  add_spring(
      b, "return", "B", "W",
      {.stiffness_N_per_m = 80, .natural_length_m = 0.3, .damping_N_s_per_m = 4, .spring_law = {}, .damper_law = {}});

  // One degree of freedom: the crank's angle and its rate are given, everything else follows from them.
  b.give("crank.angle");
  return b.build();  // checks names, from now on the mechanism is immutable
}

}  // namespace

int main() try {
  // What is run: a mechanism, what varies, what it costs, the equations, the time and the accuracy.
  Problem problem;
  problem.mechanism = slider_crank();
  // Every number of the mechanism has a path and can be a parameter. Mind the crank's length: it moves the start, and
  // the gradients below contain that.
  problem.parameters = problem.mechanism->select(
      {"bar.crank.length_m", "bar.rod.mass_kg", "spring.return.stiffness_N_per_m", "couple.motor.torque_N_m"});
  // psi = integral of (x_B - 0.7)^2 + 0.01 (angular velocity of the crank)^2
  problem.objective.running = {square_cost(*problem.mechanism, "B.x", 0.7),
                               square_cost(*problem.mechanism, "crank.angle_dot", 0, 0.01)};
  problem.formulation = "index1";
  problem.solver.t_end = 1;
  problem.solver.rtol = 1e-10;

  // rho: the values of the parameters. A gradient can be asked for anywhere, not only at the mechanism's own values.
  const std::vector<double> rho = problem.parameters.values();

  // A simulation, with samples of the motion on the way.
  const auto output = make_output(*problem.mechanism, "crank.angle");
  fmt::print("  t [s]   crank [rad]   slider [m]\n");
  const int slider = problem.mechanism->coordinate("B.x");
  double off_the_line = 0;
  const Simulation motion =
      simulate(problem, rho, {0, 0.25, 0.5, 0.75, 1}, [&](const MechanismState& s, System& system) {
        fmt::print("  {:5.2f}   {:11.6f}   {:10.6f}\n", s.t, output->value(s, system.assembly()), s.q[slider]);
        off_the_line = std::max(off_the_line, std::abs(s.q[slider + 1]));  // B.y
      });
  fmt::print("psi = {:.12g}, {} steps\n\n", motion.psi, motion.counters.steps);

  // The gradient: backwards through IDAS, forwards through CVODES, and by differences of whole simulations, which use
  // none of the derivatives that the other two are made of.
  const std::vector<std::string> methods = {"idas-adjoint", "cvodes-forward", "differences"};
  std::vector<GradientResult> results;
  for (const auto& method : methods) results.push_back(gradient(problem, method, rho));

  fmt::print("{:<34}", "d(psi) / d(...)");
  for (const auto& method : methods) fmt::print("{:>20}", method);
  double apart = 0;
  for (std::size_t j = 0; j < rho.size(); ++j) {
    fmt::print("\n{:<34}", problem.parameters.names()[j]);
    for (const auto& r : results) {
      fmt::print("{:>20.12g}", r.gradient[j]);
      const double reference = results.back().gradient[j];
      apart = std::max(apart, std::abs(r.gradient[j] - reference) / std::abs(reference));
    }
  }
  fmt::print("\n\nThe three agree to {:.1e}, the slider is {:.1e} m off its line.\n", apart, off_the_line);

  const bool good = apart < 1e-6 && off_the_line < 1e-6 && std::abs(motion.psi - results[0].psi) < 1e-7 * motion.psi;
  if (!good) fmt::print(stderr, "This is not what it should be.\n");
  return good ? 0 : 1;
} catch (const costate::Error& e) {
  fmt::print(stderr, "{}\n", e.what());
  return 1;
}
