// What no cost and no output needs is not built for gradients and optimizations, and what is left gives the same psi
// and gradient.
#include <catch2/catch.hpp>
#include <cmath>
#include <tuple>

#include "process.h"

using Catch::Matchers::Contains;
using costate::test::costate_json;
using costate::test::file_text;
using costate::test::run_costate;
using costate::test::WorkingDirectory;
using costate::test::write_text;
using Json = nlohmann::json;

namespace {

// Two pendulums on one pivot; the cost is of one of them, which a spring holds. With `more` of the scene.
std::string pendulums(const std::string& more = "", const std::string& run = "") {
  return R"(title = "Two"

[gravity]
y_m_per_s2 = -9.81

[point.O]
ground = true
x_m = 0
y_m = 0

[point.R]
x_m = -0.6
y_m = -0.8

[bar.unasked]
from = "O"
to = "R"
mass_kg = 1
length_m = 1

[point.Q]
on = "unasked"
x_m = 0.5
y_m = 0

[point.P]
x_m = 0.6
y_m = -0.8

[bar.asked]
from = "O"
to = "P"
mass_kg = 2
length_m = 1

[point.G]
ground = true
x_m = 1
y_m = 0

[spring.hold]
from = "G"
to = "P"
stiffness_N_per_m = 10
natural_length_m = 0.5

[output.far]
formula = "R.x + 2*Q.y"
unit = "m"

[start]
given = ["R.x", "P.x"]

[[cost.running]]
kind = "square"
output = "P.x"

[parameter.other_mass]
number = "bar.unasked.mass_kg"
lower = 0.1
upper = 5

[parameter.mass]
number = "bar.asked.mass_kg"
lower = 0.1
upper = 5

[parameter.gravity]
number = "gravity.y_m_per_s2"

[parameter.other_start]
number = "point.R.x_m"

[parameter.start]
number = "point.P.x_m"

)" + more +
         R"(
[run]
t_end_s = 0.5
rtol = 1e-8
parameters = ["other_mass", "mass", "gravity", "other_start", "start"]
)" + run;
}

Json gradient_of(const WorkingDirectory& here, const std::string& file, std::vector<std::string> more = {}) {
  more.insert(more.begin(), {"gradient", file, "--no-files"});
  return costate_json(more, here.path());
}

}  // namespace

TEST_CASE("left out: gradients are those of everything, by every kind of formulation") {
  const WorkingDirectory here;
  write_text(here / "two.toml", pendulums());
  using Case = std::tuple<const char*, const char*, double>;
  // Two runs at rtol = 1e-8, whose steps differ since the norm of errors is over fewer unknowns: each is right to some
  // ten to hundred times its tolerance. The fixed steps' size is of one choice for both: rounding alone is left there.
  const auto [formulation, method, tolerance] =
      GENERATE(Case{"index1", "idas-adjoint", 2e-6}, Case{"index1", "idas-forward", 2e-6},
               Case{"baumgarte", "cvodes-adjoint", 2e-6}, Case{"penalty", "hand-adjoint", 2e-6},
               Case{"maggi", "cvodes-adjoint", 2e-6}, Case{"index3", "discrete-adjoint", 1e-9});
  CAPTURE(formulation, method);
  std::vector<std::string> options = {"--formulation", formulation, "--method", method};
  if (std::string(method) == "discrete-adjoint") options.insert(options.end(), {"--step", "1e-3"});
  const Json part = gradient_of(here, "two.toml", options);
  options.insert(options.end(), {"--set", "run.everything=true"});
  const Json whole = gradient_of(here, "two.toml", options);
  CHECK_FALSE(whole.contains("left_out"));
  CHECK(part.at("left_out").at("coordinates") == Json({"R.x", "R.y"}));
  CHECK(part.at("left_out").at("elements") == Json({"bar.unasked", "output.far"}));
  const double psi = whole.at("psi").get<double>();
  CHECK(part.at("psi").get<double>() == Approx(psi).epsilon(tolerance));
  for (const char* name : {"mass", "gravity", "start"}) {
    CAPTURE(name);
    // Against psi's own size: no entry here is much smaller.
    CHECK(part.at("gradient").at(name).get<double>() ==
          Approx(whole.at("gradient").at(name).get<double>()).epsilon(10 * tolerance).margin(tolerance * psi));
  }
  for (const char* name : {"other_mass", "other_start"}) CHECK(part.at("gradient").at(name).get<double>() == 0.0);
}

TEST_CASE("left out: what is asked for, or acts on it, is built") {
  const WorkingDirectory here;
  const auto builds_all = [&](const std::string& more, const std::string& run = "") {
    write_text(here / "scene.toml", pendulums(more, run));
    return !gradient_of(here, "scene.toml").contains("left_out");
  };
  CHECK_FALSE(builds_all("", "outputs = [\"P.y\"]\n"));
  // Asked for: by name, through a formula, as part of an energy, as where the run ends, as the target of a cost.
  CHECK(builds_all("", "outputs = [\"R.x\"]\n"));
  CHECK(builds_all("", "outputs = [\"lambda.bar.unasked.length\"]\n"));
  CHECK(builds_all("", "outputs = [\"far\"]\n"));
  CHECK(builds_all("", "outputs = [\"energy.total\"]\n"));
  CHECK(builds_all("", "ends_when = { output = \"R.x\", above = 0.0 }\n"));
  CHECK(builds_all("[[cost.running]]\nkind = \"square\"\noutput = \"P.y\"\ntarget = \"output:R.y\"\n"));
  // Acting: a spring that pulls nothing where the run starts, and one of no stiffness.
  CHECK(builds_all("[spring.link]\nfrom = \"P\"\nto = \"R\"\nstiffness_N_per_m = 0\nnatural_length_m = 1.2\n"));
  // Constraints of an optimization are built with all, which is said.
  const std::string constraint =
      "[[optimize.constraint]]\nname = \"low\"\nupper = 1\n\n[[optimize.constraint.terminal]]\nkind = "
      "\"value\"\noutput = \"P.y\"\n";
  CHECK(builds_all(constraint));
  CHECK_THAT(run_costate({"explain", "scene.toml", "--no-files"}, here.path()).out,
             Contains("[[optimize.constraint]]"));
}

TEST_CASE("left out: explain and the run tell it, and the summary") {
  const WorkingDirectory here;
  write_text(here / "two.toml", pendulums());
  const Json j = costate_json({"explain", "two.toml", "--no-files"}, here.path());
  CHECK(j.at("left_out").at("coordinates") == Json({"R.x", "R.y"}));
  CHECK(j.at("kept_because").is_null());
  CHECK(j.at("coordinates") == 4);  // explain looks at all of it
  CHECK_THAT(run_costate({"gradient", "two.toml", "--no-files"}, here.path()).out,
             Contains("left out") && Contains("R.x, R.y") && Contains("bar.unasked") && Contains("run.everything"));
  const Json kept = costate_json({"explain", "two.toml", "--no-files", "--set", "run.everything=true"}, here.path());
  CHECK(kept.at("left_out").is_null());
  CHECK_THAT(kept.at("kept_because").get<std::string>(), Contains("everything"));
}

TEST_CASE("left out: an optimization comes to the same end, and its files hold the whole scene") {
  const WorkingDirectory here;
  const auto optimized = [&](const std::string& directory, std::vector<std::string> more) {
    more.insert(more.begin(), {"optimize", "two.toml", "--output", directory, "--parameters", "other_mass,mass",
                               "--max-evaluations", "12"});
    return costate_json(more, here.path());
  };
  write_text(here / "two.toml", pendulums());
  const Json part = optimized("part", {}), whole = optimized("whole", {"--set", "run.everything=true"});
  CHECK(part.at("left_out").at("coordinates") == Json({"R.x", "R.y"}));
  // Of runs at rtol = 1e-8; of a minimum that is flat to second order the place is known to the root of that.
  CHECK(part.at("psi").get<double>() == Approx(whole.at("psi").get<double>()).epsilon(2e-6));
  CHECK(part.at("parameters").at("mass").get<double>() ==
        Approx(whole.at("parameters").at("mass").get<double>()).epsilon(2e-3));
  CHECK(part.at("parameters").at("other_mass") == 1.0);
  // The scene that is written has the values at their places, and the motions are those of everything.
  const std::string scene = file_text(here / "part/optimized.toml");
  CHECK_THAT(scene, Contains("bar.unasked"));
  const Json again = costate_json({"gradient", "part/optimized.toml", "--no-files"}, here.path());
  CHECK(again.at("parameters").at("mass").get<double>() == part.at("parameters").at("mass").get<double>());
  CHECK(again.at("psi").get<double>() == Approx(part.at("psi").get<double>()).epsilon(2e-6));
  CHECK_THAT(file_text(here / "part/after.csv"), Contains("R.x"));
}
