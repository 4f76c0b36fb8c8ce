// What a gradient is worth that is small against the adjoint it is made of, under a penalty's weight, or by fixed steps
// that psi has chosen: right, or said to be not.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/notice.h"
#include "costate/problem/scene_problem.h"
#include "costate/sensitivity/error_estimate.h"
#include "costate/sensitivity/method.h"
#include "support/paths.h"

using namespace costate;
using Catch::Detail::Approx;

namespace {
Problem problem_of(const std::string& file, const std::vector<std::string>& changes = {}) {
  return make_problem(Scene::load(fmt::format("{}/{}", COSTATE_SOURCE_DIR, file), changes));
}

std::string notices() {
  std::string text;
  for (const auto& sentence : take_notices()) text += sentence + "\n";
  return text;
}
}  // namespace

TEST_CASE("a derivative that is small against the adjoint has its digits", "[resolved]") {
  // The derivative is 3e-3 of psi, what an adjoint of the size 100 leaves: 0.00325427 by forward sensitivities at rtol
  // 1e-10. At its own rtol the adjoint's errors were 2e-3 of it.
  Problem p = problem_of("test/cases/small_gradient.toml");
  for (const char* formulation : {"maggi", "penalty", "index1"}) {
    INFO(formulation);
    p.formulation = formulation;
    take_notices();
    const GradientResult r = gradient(p, "cvodes-adjoint", p.parameters.values());
    CHECK(r.gradient[0] == Approx(0.003254276).epsilon(1e-4));
    CHECK(r.counters.simulations == 2);
    CHECK(notices() == "");
    // A caller that looks at errors itself gets one run, and no word of it.
    Problem once = p;
    once.solver.confirm = false;
    CHECK(gradient(once, "cvodes-adjoint", p.parameters.values()).counters.simulations == 2);
    once.solver.resolve = false;
    CHECK(gradient(once, "cvodes-adjoint", p.parameters.values()).counters.simulations == 1);
    CHECK(notices() == "");
  }
}

TEST_CASE("a gradient of ordinary size is computed once", "[resolved]") {
  Problem p = problem_of("models/five_bar/five_bar.toml");
  p.formulation = "baumgarte";
  for (const char* method : {"cvodes-adjoint", "idas-adjoint"})
    CHECK(gradient(p, method, p.parameters.values()).counters.simulations == 1);
}

TEST_CASE("what a penalty's weight does to psi and gradient is said", "[resolved]") {
  Problem p = problem_of("models/bricard/bricard.toml", {"run.t_end_s=1"});
  p.formulation = "penalty";
  const auto said = [&](double alpha) {
    p.formulation_options.set("penalty_alpha", alpha);
    take_notices();
    gradient(p, "cvodes-adjoint", p.parameters.values());
    return notices();
  };
  CHECK(said(0) == "");
  CHECK(said(1e3).find("its constraints are soft") != std::string::npos);
}

TEST_CASE("a penalty's gradient is looked at where parameters make more of forces than the motion does", "[resolved]") {
  // psi does not depend on the spring's natural length; soft rows make 1.4e-5 of psi of it while they drift by 1e-7.
  Problem p = problem_of("test/cases/spring_along_bar.toml");
  for (const char* formulation : {"penalty", "penalty-second-order"})
    for (const char* method : {"cvodes-adjoint", "cvodes-forward", "hand-tangent"}) {
      INFO(formulation << " by " << method);
      p.formulation = formulation;
      take_notices();
      const GradientResult r = gradient(p, method, p.parameters.values());
      CHECK(std::abs(r.gradient[0]) > 1e-6 * r.psi);
      CHECK(notices().find("its constraints are soft") != std::string::npos);
    }
  p.formulation = "baumgarte";
  CHECK(std::abs(gradient(p, "cvodes-adjoint", p.parameters.values()).gradient[0]) < 1e-9);
  CHECK(notices() == "");
}

TEST_CASE("a penalty's gradient is looked at where rates or parameters at the start make more of its rows",
          "[resolved]") {
  // The rate of a point that two bars pin is in the cost: it vibrates by the stiff spring's force, softly held. Rows
  // drift by 1.6e-9 to 3e-8 of their lengths, the gradient's second derivative by 1.7e-4 of its size.
  Problem p = problem_of("test/cases/truss_821063.toml");
  p.formulation = "penalty";
  for (const char* method : {"cvodes-forward", "discrete-adjoint", "discrete-tangent", "hand-tangent"}) {
    INFO(method);
    take_notices();
    CHECK(gradient(p, method, p.parameters.values()).gradient[1] == Approx(0.04154379).epsilon(2e-4));
    CHECK(notices().find("its constraints are soft") != std::string::npos);
  }
}

TEST_CASE("a penalty's gradient is looked at where it is small against psi", "[resolved]") {
  // psi does not depend on the spring along the bar; soft rows make 1e-5 of psi of its natural length.
  Problem p = problem_of("test/cases/truss_911013.toml");
  for (const char* formulation : {"penalty", "penalty-second-order"})
    for (const char* method : {"discrete-tangent", "discrete-adjoint", "hand-tangent"}) {
      INFO(formulation << " by " << method);
      p.formulation = formulation;
      take_notices();
      CHECK(std::abs(gradient(p, method, p.parameters.values()).gradient[1]) < 1e-5 * 0.0218);
      CHECK(notices().find("its constraints are soft") != std::string::npos);
    }
  p.formulation = "index1";
  CHECK(std::abs(gradient(p, "discrete-tangent", p.parameters.values()).gradient[1]) < 1e-9);
  CHECK(notices() == "");
}

// Steps at a tenth of the tolerance, or less, are more than the run's own: where they fail its result stands.
TEST_CASE("an estimate whose runs fail leaves the result, and says so", "[resolved]") {
  Problem p = problem_of("models/damped_pendulum/damped_pendulum.toml");
  p.solver.confirm = false;
  const auto rho = p.parameters.values();
  const GradientResult r = gradient(p, "cvodes-forward", rho);
  p.solver.max_steps = r.counters.steps + 2;
  take_notices();
  const auto none = estimate_or_tell([&] { return estimate_error(p, "cvodes-forward", rho, r); });
  CHECK_FALSE(none.has_value());
  CHECK_THAT(notices(), Catch::Contains("The error of the result is not known") && Catch::Contains("limit of steps"));
  CHECK(estimate_gradient_error(p, "cvodes-forward", rho, r).empty());
  take_notices();
  p.solver.max_steps = 1000000;
  CHECK(estimate_or_tell([&] { return estimate_error(p, "cvodes-forward", rho, r); }).has_value());
}
