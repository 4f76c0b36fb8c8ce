// Slips in space that begin from rest and stay slow: what the offset that they begin with leaves in results is told.
#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "costate/tradeoff/accurate_run.h"
#include "support/with_words.h"

using namespace costate;
using namespace costate::test;
using Catch::Contains;

namespace {

/// A mass in syrup: a pull that turns takes it from rest to 3e-5 m/s.
Problem crawling(const std::vector<std::pair<std::string, std::string>>& with = {}) {
  const std::string text = R"toml([point.P]
x_m = 0
y_m = 0
z_m = 0
[mass.P]
point = "P"
mass_kg = 1
[contact.floor]
kind = "rigid"
point = "P"
closed = true
along_m = 0
across_m = 0
friction = "coulomb"
friction_coefficient = 0.3
static_coefficient = 0.4
[force.pull]
point = "P"
a = 4
b = 1
c = 2e5
formula_x_N = "a*t - c*P.x_dot"
formula_y_N = "b*t^2 - c*P.y_dot"
[[cost.terminal]]
kind = "value"
output = "P.y"
weight = 1e5
[gravity]
z_m_per_s2 = -9.81
[start]
given = []
[parameter.mu]
number = "contact.floor.friction_coefficient"
[parameter.a]
number = "force.pull.a"
[run]
formulation = "FORM"
parameters = ["mu", "a"]
t_end_s = 2
rtol = 1e-9
)toml";
  return make_problem(Scene::parse(with_words(with_words(text, with), {{"FORM", "index2"}}), "crawling.toml"));
}

bool told(const std::vector<std::string>& notices) {
  for (const std::string& text : notices)
    if (text.find("contact.floor begins to slide from rest at t = 0.954224 s with an offset of 1e-09 m/s") == 0)
      return true;
  return false;
}

// scipy: DOP853 at 1e-12 from v = 1e-16 m/s along the acceleration that is left; derivatives by Richardson's
// differences.
constexpr double kPsi = 0.6589347320, kByMu = -1.76526367, kByA = 0.13956285;

}  // namespace

TEST_CASE("slow slips: what their offset leaves is told and known", "[events]") {
  for (const auto& [formulation, method] :
       std::vector<std::pair<std::string, std::string>>{{"index2", "idas-adjoint"},
                                                        {"index1", "cvodes-forward"},
                                                        {"baumgarte", "cvodes-adjoint"},
                                                        {"baumgarte", "hand-adjoint"},
                                                        {"maggi", "hand-tangent"},
                                                        {"index2", "discrete-adjoint"}}) {
    CAPTURE(formulation, method);
    take_notices();
    const Problem p = crawling({{"FORM", formulation}});
    const GradientResult r = gradient(p, method, p.parameters.values());
    CHECK(told(take_notices()));
    REQUIRE(r.known_error);
    CHECK(std::abs(r.psi - kPsi) <= r.known_error->psi);
    CHECK(std::abs(r.gradient[0] - kByMu) <= r.known_error->gradient[0]);
    CHECK(std::abs(r.gradient[1] - kByA) <= r.known_error->gradient[1]);
    CHECK(r.known_error->psi <= 1e-3 * kPsi);
  }
}

TEST_CASE("slow slips: --accuracy asks for no more than they hold", "[events]") {
  const Problem p = crawling();
  for (const double accuracy : {1e-3, 1e-4}) {
    AccuracyRequest request;
    request.accuracy = accuracy;
    request.gradient = true;
    const AccurateRun run = run_to_accuracy(p, p.parameters.values(), request);
    CHECK(run.met == (accuracy > 5e-4));
    CHECK(std::abs(run.result.psi - kPsi) <= run.psi_error);
    CHECK(run.psi_error >= 2e-4 * kPsi);
  }
  take_notices();
}

// At metres a second nothing is said; nor of a slip that goes straight, however slow.
TEST_CASE("slow slips: others are let be", "[events]") {
  for (const auto& with : std::vector<std::vector<std::pair<std::string, std::string>>>{
           {{"c = 2e5", "c = 2"}}, {{"b = 1", "b = 0"}, {"\"P.y\"", "\"P.x\""}}}) {
    take_notices();
    const Problem p = crawling(with);
    const GradientResult r = gradient(p, "idas-adjoint", p.parameters.values());
    CHECK(r.psi != 0);
    for (const std::string& text : take_notices()) CHECK_THAT(text, !Contains("offset"));
  }
}
