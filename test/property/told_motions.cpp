// Motions that equations carry and nobody means: told by name, and from when on.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "support/cases.h"

using namespace costate;
using Catch::Contains;

namespace {

std::string told(const Problem& p) {
  take_notices();
  simulate(p, p.parameters.values());
  std::string all;
  for (const std::string& text : take_notices()) all += text + "\n";
  return all;
}

}  // namespace

TEST_CASE("told motions: a driver who steers away from the path") {
  const std::string path = R"(path_driver.p.path={kind="smooth_step",from=1,to=9,before=0,after=1})";
  const auto by = [&](double angle, double gain) {
    return told(problem_of_case("path_over_knots", {path, fmt::format("rigid_body.b.angle_rad={}", angle),
                                                    fmt::format("path_driver.p.gain={}", gain)}));
  };
  const char* const away = "'path_driver.p' steers away from its path";
  CHECK_THAT(by(-0.1, 0.05), !Contains(away));
  CHECK_THAT(by(3.0, -0.05), !Contains(away));
  CHECK_THAT(by(3.0, 0), !Contains(away));
  CHECK_THAT(by(3.0, 0.05), Contains(away) && Contains("heads against x"));
  CHECK_THAT(by(-0.1, -0.05), Contains(away) && Contains("heads along x"));
  // Half a turn on the way: at pi/2 from 1.2 rad, which the vehicle turns by at 0.3 rad/s.
  const std::string later =
      told(problem_of_case("path_over_knots", {path, "rigid_body.b.angle_rad=1.2", "run.t_end_s=2"}));
  CHECK_THAT(later, Contains("From t = 1.") && Contains(away));
}

TEST_CASE("told motions: a tyre that is pressed in by more than its radius") {
  const auto at = [](double z) {
    return told(problem_of_case("leaning_wheel", {fmt::format("rigid_body.b.z_m={}", z), "run.t_end_s=0.05"}));
  };
  const char* const below = "'tyre.t' is pressed in by more than its radius";
  CHECK_THAT(at(0.32), !Contains(below));
  CHECK_THAT(at(-3), Contains("From t = 0 s on") && Contains(below));
}

TEST_CASE("told motions: drift that the formulation that runs does not hold") {
  // 1e4 rad/s in Euler parameters, by steps of an integrator that is asked for 1e-8.
  const auto by = [](const char* formulation) {
    Problem p = problem_of_case("leaning_wheel", {"rigid_body.b.omega_y_rad_per_s=1e4"});
    p.formulation = formulation;
    return told(p);
  };
  CHECK_THAT(by("baumgarte"), Contains("The constraints drift") && Contains("a smaller rtol") &&
                                  Contains("index2 or maggi") && !Contains("baumgarte"));
  CHECK_THROWS_WITH(by("index1"), Contains("no longer hold") && Contains("baumgarte or index2 or maggi"));
}
