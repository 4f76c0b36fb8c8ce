// A project of its own on the installed package: a scene that came with it, a mechanism built by hand, an optimization.
#include <costate/base/version.h>
#include <costate/kind/body/bar.h>
#include <costate/kind/body/point.h>
#include <costate/objective/constant_costs.h>
#include <costate/optimize/optimizer.h>
#include <costate/problem/scene_problem.h>
#include <costate/scene/scene.h>
#include <costate/sensitivity/method.h>

#include <cmath>
#include <exception>
#include <iostream>

namespace {

bool good = true;

void require_close(const char* what, double found, double expected, double relative) {
  const bool close = std::abs(found - expected) <= relative * std::abs(expected);
  std::cout << (close ? "  " : "WRONG: ") << what << " = " << found << ", expected " << expected << '\n';
  good = good && close;
}

/// The five-bar of the installed models, with the numbers of an independent program.
void five_bar() {
  using namespace costate;
  const Scene scene = Scene::load(COSTATE_MODELS_DIR "/five_bar/five_bar.toml");
  Problem problem = make_problem(scene);
  problem.solver.rtol = 1e-10;
  for (const char* method : {"idas-adjoint", "cvodes-forward"}) {
    const GradientResult r = gradient(problem, method, problem.parameters.values());
    std::cout << method << '\n';
    require_close("psi", r.psi, 0.7268774613130, 1e-7);
    require_close("d(psi)/d(L01)", r.gradient.at(0), -4.2288108552406, 1e-6);
    require_close("d(psi)/d(L02)", r.gradient.at(1), 3.2116041029870, 1e-6);
  }
  const OptimizerResult result = optimize(problem, "idas-adjoint", {}, {}, {}, {});
  require_close("optimal L01", result.evaluations[result.best].rho.at(0), 2.4319235745746, 1e-6);
}

/// A bar that falls from the horizontal: the angular acceleration is 3 g / (2 L) at first.
void falling_bar() {
  using namespace costate;
  MechanismBuilder b;
  b.set_gravity(0, -9.81);
  add_ground_point(b, "O", 0, 0);
  add_free_point(b, "P", {.x_m = 2});
  BarOptions bar;
  bar.mass_kg = 3;
  add_bar(b, "bar", "O", "P", bar);
  b.give("P.y");
  Problem problem;
  problem.mechanism = b.build();
  // psi = y_P at t = 0.01 s = -(3 g / 4) t^2 but for terms of order t^6; a uniform bar's mass does not matter.
  problem.objective.terminal = {value_cost(*problem.mechanism, "P.y")};
  problem.parameters = problem.mechanism->select({"gravity.y_m_per_s2", "bar.bar.mass_kg"});
  problem.solver.t_end = 0.01;
  problem.solver.rtol = 1e-11;
  const GradientResult r = gradient(problem, "idas-adjoint", problem.parameters.values());
  std::cout << "falling bar\n";
  require_close("height", r.psi, -0.75 * 9.81 * 1e-4, 1e-6);
  require_close("d(height)/d(g)", r.gradient.at(0), 0.75e-4, 1e-6);
  require_close("1 + d(height)/d(mass)", 1 + r.gradient.at(1), 1, 1e-10);
}

}  // namespace

int main() try {
  std::cout << "costate " << costate::version << '\n';
  five_bar();
  falling_bar();
  return good ? 0 : 1;
} catch (const std::exception& e) {
  std::cerr << e.what() << '\n';
  return 1;
}
