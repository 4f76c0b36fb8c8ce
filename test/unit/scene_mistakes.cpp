// Every class of mistake in a scene file, with the place and the words of the complaint.
#include <catch2/catch.hpp>

#include "costate/analysis/start.h"
#include "costate/kind/law/law_table.h"
#include "costate/scene/cost_kind.h"
#include "costate/scene/scene_kind.h"
#include "scene_texts.h"

using namespace costate;
using namespace costate::test;

namespace {

struct Mistake {
  const char *place, *by, *complaint;
};

void require_complaints(const std::vector<Mistake>& mistakes) {
  for (const auto& m : mistakes) {
    INFO("'" << m.place << "' replaced by '" << m.by << "'");
    REQUIRE(complaint(replaced(pendulum, m.place, m.by)) == std::string("s.toml:") + m.complaint);
  }
}

/// What finding the start of a scene that loads says.
std::string start_complaint(const std::string& text) {
  const Scene scene = Scene::parse(text, "s.toml");
  Assembly assembly(scene.mechanism(), scene.mechanism()->select({}));
  try {
    find_start(assembly, scene.run.t_start_s, false);
  } catch (const ModelError& e) {
    return scene.located(e).what();
  }
  return "no error";
}

}  // namespace

TEST_CASE("scene mistakes: the scene that they are made in is right") {
  REQUIRE(complaint(pendulum) == "no error");
  REQUIRE(start_complaint(pendulum) == "no error");
}

TEST_CASE("scene mistakes: unknown and missing keys, with near ones") {
  require_complaints({
      {"length_m = 1", "length_m = 1\ndampling_N_s_per_m = 2",
       "25:1: Unknown key 'dampling_N_s_per_m' in [spring.S1]. Did you mean 'damping_N_s_per_m'? Known here: "
       "from, to, "
       "stiffness_N_per_m, spring_law, natural_length_m, damping_N_s_per_m, preload_N, damper_law."},
      {"length_m = 1", "length_m = 1\ncolour = \"red\"",
       "25:1: Unknown key 'colour' in [spring.S1]. Known here: from, to, stiffness_N_per_m, spring_law, "
       "natural_length_m, damping_N_s_per_m, preload_N, damper_law."},
      {"mass_kg = 2", "mas_kg = 2", "18:1: Unknown key 'mas_kg' in [bar.arm]. Did you mean 'mass_kg'?"},
      {"mass_kg = 2", "mass = 2", "18:1: Unknown key 'mass' in [bar.arm]. Did you mean 'mass_kg'?"},
      {"natural_length_m", "natural_lenght_m",
       "24:1: Unknown key 'natural_lenght_m' in [spring.S1]. Did you mean 'natural_length_m'?"},
      {"mass_kg = 2\n", "\n",
       "15:1: [bar.arm] needs 'mass_kg' (a number), which is missing. Each [bar.NAME] needs from, to, mass_kg."},
      {"from = \"A\"\nto = \"P\"\nmass", "to = \"P\"\nmass",
       "15:1: [bar.arm] needs 'from' (a string), which is missing. Each [bar.NAME] needs from, to, mass_kg."},
      {"y_m = -0.8", "vy_m_per_s = -0.8",
       "11:1: [point.P] needs 'y_m' (a number), which is missing. Each [point.NAME] needs x_m, y_m."},
      {"ground = true", "ground = true\nvx_m_per_s = 1",
       "8:1: Unknown key 'vx_m_per_s' in [point.A]. Known here: on, ground, z_m, x_m, y_m."},
      {"y_m_per_s2 = -9.81", "y_m_per_s = -9.81",
       "4:1: Unknown key 'y_m_per_s' in [gravity]. Did you mean 'y_m_per_s2'? Known here: x_m_per_s2, "
       "y_m_per_s2, z_m_per_s2."},
      {"lower = 1\n", "lower = 1\nlow = 2\n",
       "32:1: Unknown key 'low' in [parameter.k]. Did you mean 'lower'? Known here: numbers, number, "
       "factors, lower, "
       "upper, scale."},
      {"target = 0.5", "wieght = 2",
       "37:1: Unknown key 'wieght' in [cost.running[0]]. Did you mean 'weight'? Known here: kind, output, "
       "weight, "
       "target_output, target."},
      {"[[cost.running]]", "[[cost.runing]]",
       "34:8: Unknown key 'runing' in [cost]. Did you mean 'running'? Known here: running, terminal, samples."},
      {"t_end_s = 1\n", "\n", "39:1: [run] needs 't_end_s' (a number), which is missing."},
  });
}

TEST_CASE("scene mistakes: unknown tables") {
  std::string known = "title, description, gravity, start, parameter, cost, run, formulation, optimize, cycle, case";
  for (const auto& kind : scene_kinds()) known += ", " + kind.name;
  REQUIRE(complaint(replaced(pendulum, "[spring.S1]", "[sprnig.S1]")) ==
          "s.toml:20:2: Unknown table 'sprnig' at the top of the scene. Did you mean 'spring'? Known here: " + known +
              ".");
  REQUIRE(complaint("tilte = \"x\"\n") ==
          "s.toml:1:1: Unknown key 'tilte' at the top of the scene. Did you mean 'title'? Known here: " + known + ".");
  require_complaints({
      {"[spring.S1]", "[spring]",
       "21:8: 'from' in [spring] must be a table: give the spring a name, [spring.NAME], and its keys "
       "below."},
      {"[spring.S1]", "[spring.\"S 1\"]",
       "20:1: 'S 1' cannot be a name: it must not be empty nor hold dots, slashes, brackets, quotes, '=' or blanks, "
       "because "
       "paths such as spring.S1.preload_N, in files /outputs/S1.force, are made of names."},
      {"[[cost.running]]", "[cost.running]",
       "34:1: 'running' in [cost] must be an array of tables, each with the header [[cost.running]], found a "
       "table."},
  });
}

TEST_CASE("scene mistakes: wrong types") {
  require_complaints({
      {"mass_kg = 2", "mass_kg = \"heavy\"",
       "18:11: 'mass_kg' in [bar.arm] must be a number, found the string \"heavy\"."},
      {"mass_kg = 2", "mass_kg = [2]", "18:11: 'mass_kg' in [bar.arm] must be a number, found an array of 1."},
      {"mass_kg = 2", "mass_kg = 1979-05-27", "18:11: 'mass_kg' in [bar.arm] must be a number, found a date or time."},
      {"ground = true", "ground = 1", "7:10: 'ground' in [point.A] must be true or false, found the number 1."},
      {"title = \"Pendulum\"", "title = 3", "1:9: 'title' in the scene must be a string, found the number 3."},
      {"given = [\"P.x\"]", "given = \"P.x\"",
       "27:9: 'given' in [start] must be an array of strings, found the string \"P.x\"."},
      {"given = [\"P.x\"]", "given = [\"P.x\", 3]",
       "27:17: 'given[1]' in [start] must be a string, found the number 3."},
      {"[optimize]", "[optimize]\nmax_evaluations = 2.5",
       "44:19: 'max_evaluations' in [optimize] must be a whole number, found the number 2.5."},
      {"[run]", "[revolute.R]\npoints = [\"A\"]\n[run]",
       "40:10: 'points' in [revolute.R] must hold two names, found 1."},
      {"[run]", "[force.F]\npoint = \"P\"\nx_N = \"3\"\n[run]",
       "41:7: 'x_N' in [force.F] must be a number or a law like { kind = \"sine\", ... }, found the string "
       "\"3\"."},
      {"target = 0.5", "target = \"P.y\"",
       "37:10: 'target' in [cost.running[0]] must be a number, a law of time, or the string \"output:NAME\", "
       "found the "
       "string \"P.y\"."},
  });
}

TEST_CASE("scene mistakes: numbers out of range") {
  require_complaints({
      {"mass_kg = 2", "mass_kg = -1", "18:11: bar.arm.mass_kg: must not be negative, found -1."},
      {"mass_kg = 2", "mass_kg = nan", "18:11: 'mass_kg' in [bar.arm] must be finite, found nan."},
      {"mass_kg = 2", "mass_kg = 2\nlength_m = 0", "19:12: bar.arm.length_m: must be positive, found 0."},
      {"x_m = 0.6\ny_m = -0.8", "x_m = 0\ny_m = 0", "15:1: bar.arm.length_m: must be positive, found 0."},
      {"stiffness_N_per_m = 100", "stiffness_N_per_m = -100",
       "23:21: 'stiffness_N_per_m' in [spring.S1] must not be negative, found -100."},
      {"t_end_s = 1", "t_end_s = 0", "40:11: 't_end_s' in [run] must be after t_start_s = 0, found 0."},
      {"t_end_s = 1", "t_end_s = 1\nrtol = 0", "41:8: 'rtol' in [run] must be positive, found 0."},
      {"lower = 1\n", "lower = 150\n", "31:9: 'lower' in [parameter.k] is 150, above the start value 100."},
      {"upper = 200", "upper = 50", "32:9: 'upper' in [parameter.k] is 50, below the start value 100."},
      {"lower = 1\n", "lower = 300\n", "31:9: 'lower' in [parameter.k] is 300, above 'upper' = 200."},
      {"lower = 1\n", "scale = 0\n", "31:9: 'scale' in [parameter.k] must be positive, found 0."},
  });
}

TEST_CASE("scene mistakes: dangling names") {
  require_complaints({
      {"to = \"P\"\nmass", "to = \"P1\"\nmass", "17:6: bar.arm.to: There is no point 'P1'. Did you mean 'P'?"},
      {"to = \"P\"\nmass", "to = \"Q\"\nmass",
       "17:6: bar.arm.to: There is no point 'Q'. Known: A, P. A bar joins free points and points on the ground. What "
       "leads to a point on a body is a [distance] (without mass), or a [body] with a [revolute] at each end."},
      {"given = [\"P.x\"]", "given = [\"P.x\", \"P.z\"]",
       "27:17: start.given[1]: There is no coordinate 'P.z'. Did you mean 'P.x'?"},
      {"spring.S1.stiffness", "spring.S2.stiffness",
       "30:10: parameter.k.number: There is no number 'spring.S2.stiffness_N_per_m'. Did you mean "
       "'spring.S1.stiffness_N_per_m'?"},
      {"parameters = [\"k\"]", "parameters = [\"k\", \"k1\"]",
       "41:20: run.parameters[1]: There is no parameter 'k1'. Did you mean 'k'?"},
      {"output = \"P.x\"", "output = \"P.xx\"",
       "36:10: cost.running[0].output: There is no output 'P.xx'. Did you mean 'P.x'?"},
      {"target = 0.5", "target = \"output:S1.lenght\"",
       "37:10: cost.running[0].target: There is no output 'S1.lenght'. Did you mean 'S1.length'?"},
      {"[run]", "[run]\noutputs = [\"P.x\", \"S2.force\"]",
       "40:19: run.outputs[1]: There is no output 'S2.force'. Did you mean 'S1.force'?"},
      {"\"mma\"", "\"bfgs\"",
       "44:13: 'algorithm' in [optimize] must be one of lbfgs, mma, slsqp, found \"bfgs\". Did you mean "
       "'lbfgs'?"},
      {"[run]", "[point.T]\non = \"amr\"\nx_m = 1\ny_m = 2\n[run]",
       "40:6: point.T.on: There is no body or bar 'amr'. Did you mean 'arm'?"},
      {"[run]", "[torsion_spring.T]\nangle = \"crank\"\n[run]",
       "40:9: torsion_spring.T.angle: There is no body or angle 'crank'. Give a bar an angle coordinate with "
       "[angle.NAME]."},
  });
  const auto names = [](const auto& kinds) {
    std::string list;
    for (const auto& k : kinds) list += (list.empty() ? "" : ", ") + k.name;
    return list;
  };
  REQUIRE(complaint(replaced(pendulum, "kind = \"square\"", "kind = \"sqare\"")) ==
          "s.toml:35:8: 'kind' in [cost.running[0]] must be one of " + names(cost_kinds()) +
              ", found \"sqare\". Did you mean 'square'?");
  REQUIRE(complaint(replaced(pendulum, "[run]", "[run]\nformulation = \"indx2\"")) ==
          "s.toml:40:15: 'formulation' in [run] must be one of " + names(formulations()) +
              ", found \"indx2\". Did you mean 'index2'?");
}

TEST_CASE("scene mistakes: duplicates and contradictions") {
  require_complaints({
      {"[start]", "[spring.S1]\n[start]",
       "26:1: No valid TOML (table header): cannot redefine existing table 'spring.S1'."},
      {"x_m = 0.6", "x_m = 0.6\nx_m = 0.7",
       "13:7: No valid TOML (key-value pair): cannot redefine existing floating-point 'x_m'."},
      {"x_m = 0.6", "x_m = 0.6.7",
       "12:10: No valid TOML (floating-point): expected decimal digit or exponent, found '.'."},
      {"[run]", "[body.P]\nmass_kg = 1\ninertia_kg_m2 = 1\nx_m = 0\ny_m = 0\n[run]",
       "39:1: body.P: Coordinate 'P.x' exists already; points, bodies and angles share one set of names."},
      {"given = [\"P.x\"]", "given = [\"P.x\", \"P.x\"]", "27:17: start.given[1]: Coordinate 'P.x' is given twice."},
      {"given = [\"P.x\"]", "given = [\"P.x\"]\ngiven_velocities = [\"P.x\", \"P.x\"]",
       "28:28: start.given_velocities[1]: Velocity 'P.x' is given twice."},
      {"parameters = [\"k\"]", "parameters = [\"k\", \"k\"]",
       "41:20: run.parameters[1]: Parameter 'k' is listed twice."},
      {"parameters = [\"k\"]", "parameters = [\"k\", \"spring.S1.stiffness_N_per_m\"]",
       "41:20: run.parameters[1]: 'spring.S1.stiffness_N_per_m' is already varied by parameter 'k'."},
      {"to = \"P\"\nmass", "to = \"A\"\nmass", "17:6: bar.arm.to: The two points must differ, both are 'A'."},
      {"[run]", "[distance.D]\nfrom = \"A\"\nto = \"B\"\n[point.B]\nground = true\nx_m = 1\ny_m = 1\n[run]",
       "39:1: distance.D: This constraint touches no coordinate (both ends are on the ground)."},
      {"number = \"spring", "numbers = [\"spring.S1.preload_N\"]\nnumber = \"spring",
       "31:10: 'number' in [parameter.k] contradicts 'numbers': give one of them."},
      {"mass_kg = 2", "mass_kg = 2\ncenter_m = 0.3",
       "15:1: bar.arm: A bar that is not uniform needs both 'center_m' and 'inertia_kg_m2'."},
      {"[run]", "[mass.M]\npoint = \"A\"\nmass_kg = 1\n[run]",
       "40:9: mass.M.point: A mass sits on a free point or on a body, but 'A' is on the ground or on a bar. Join a "
       "free point to it with [revolute.*], or put the mass into the bar."},
      {"[run]", "[driver.D]\ncoordinates = [\"P.x\", \"P.y\"]\nweights = [1]\nlaw = 1\n[run]",
       "41:11: driver.D.weights: There must be one weight a coordinate, found 1 for 2."},
      {"[run]", "[driver.D]\ncoordinates = [\"P.x\", \"P.y\"]\nweights = [0, 0]\nlaw = 1\n[run]",
       "41:11: driver.D.weights: All weights are zero, and the driver moves nothing."},
      {"[run]", "[driver.D]\ncoordinates = [\"P.x\", \"P.x\"]\nweights = [1, 1]\nlaw = 1\n[run]",
       "40:23: driver.D.coordinates[1]: 'P.x' is listed twice; give it one weight, the sum."},
      {"[run]", "[prismatic.R]\npoints = [\"A\", \"P\"]\naxis_angle_rad = 1\n[run]",
       "39:1: prismatic.R: A prismatic joint needs points on bodies or on the ground, but 'P' is neither. "
       "For points on "
       "bars there are [slot.*] and [parallel.*]."},
      {"[optimize]", "[[optimize.constraint]]\nname = \"c\"\nupper = 1\n[optimize]",
       "43:1: [optimize.constraint[0]] needs at least one term: [[optimize.constraint.running]] or "
       "[[optimize.constraint.terminal]]."},
  });
  REQUIRE(complaint("") == "s.toml: The mechanism has no coordinate: add a free point or a body.");
}

TEST_CASE("scene mistakes: laws") {
  const auto law = [](const std::string& text) {
    return complaint(replaced(pendulum, "target = 0.5", "target = " + text));
  };
  std::string kinds;
  for (const auto& kind : law_kinds()) kinds += kind.name + ", ";
  REQUIRE(law("{ kind = \"sinus\", amplitude = 1 }") ==
          "s.toml:37:19: 'kind' in [cost.running[0].target] must be one of " + kinds +
              "found \"sinus\". Did you mean 'sine'?");
  REQUIRE(law("{ kind = \"sine\", amplitude = 1 }") ==
          "s.toml:37:10: [cost.running[0].target] needs 'angular_frequency_rad_per_s' (a number), which is "
          "missing.");
  REQUIRE(law("{ kind = \"table\", x = [0, 1], y = [1] }") ==
          "s.toml:37:10: cost.running[0].target: 'x' and 'y' must have the same length, found 2 and 1.");
  REQUIRE(law("{ kind = \"table\", x = [0, 0], y = [1, 2] }") ==
          "s.toml:37:10: cost.running[0].target: A table's abscissae must increase: entry 2 is 0 after 0.");
  REQUIRE(law("{ kind = \"polynomial\", coefficients = [] }") ==
          "s.toml:37:10: cost.running[0].target: A polynomial needs at least one coefficient.");
  REQUIRE(law("{ kind = \"polynomial\", coefficients = [1, \"x\"] }") ==
          "s.toml:37:52: 'coefficients[1]' in [cost.running[0].target] must be a number, found the string "
          "\"x\".");
  REQUIRE(law("{ kind = \"constant\", value = 1, extra = 2 }") ==
          "s.toml:37:42: Unknown key 'extra' in [cost.running[0].target]. Known here: kind, value.");
  REQUIRE(law("{ kind = \"smooth_step\", from = 1, to = 1, before = 0, after = 1 }") ==
          "s.toml:37:10: cost.running[0].target: 'to' must be greater than 'from', found 1 after 1.");
}

TEST_CASE("scene mistakes: the start") {
  const auto given = [](const char* list) { return replaced(pendulum, "given = [\"P.x\"]", list); };
  REQUIRE(start_complaint(given("given = []"))
              .rfind("s.toml:26:1: start: Too few given positions: 2 coordinates less 1 "
                     "independent constraint rows leave 1 degree of freedom, so 1 must be "
                     "given, found 0",
                     0) == 0);
  REQUIRE(start_complaint(given("given = [\"P.x\", \"P.y\"]")) ==
          "s.toml:26:1: start: Too many given positions: 2 coordinates less 1 independent constraint rows leave "
          "1 degree "
          "of freedom, so 1 must be given, found 2 (P.x, P.y). Remove some; the constraints determine the rest.");
  REQUIRE(start_complaint(given("given = [\"P.x\"]\ngiven_velocities = []"))
              .rfind("s.toml:26:1: start: Too few given velocities:", 0) == 0);
  REQUIRE(start_complaint(replaced(pendulum, "mass_kg = 2", "mass_kg = 2\nlength_m = 0.3"))
              .rfind("s.toml:27:1: start: The start cannot be reached: Newton's iteration from the first "
                     "guesses does not "
                     "close the mechanism. Violated most: bar.arm.length by ",
                     0) == 0);
  // Without [start] there is no table to point at.
  REQUIRE(start_complaint(replaced(pendulum, "[start]\ngiven = [\"P.x\"]\n", "")).rfind("s.toml: start: Too few", 0) ==
          0);
}

TEST_CASE("scene mistakes: overrides") {
  const auto override_complaint = [](const std::string& o) { return complaint(pendulum, {o}); };
  REQUIRE(override_complaint("run") ==
          "override 'run': An override looks like path=value, for example run.rtol=1e-10.");
  REQUIRE(override_complaint("run.rtl=1e-9")
              .rfind("override 'run.rtl=1e-9': Unknown key 'rtl' in [run]. Did you mean 'rtol'?", 0) == 0);
  REQUIRE(override_complaint("run.rtol=tiny") ==
          "override 'run.rtol=tiny': 'rtol' in [run] must be a number, found the string \"tiny\".");
  REQUIRE(override_complaint("run.t_end_s=1 2").rfind("override 'run.t_end_s=1 2': '1 2' is not a value:", 0) == 0);
  REQUIRE(override_complaint("run.t_end_s=1\ny=2") ==
          "override 'run.t_end_s=1\ny=2': '1\ny=2' is not a value: more than "
          "one value.");
  REQUIRE(override_complaint("cost.running[3].weight=1") ==
          "override 'cost.running[3].weight=1': 'cost.running[3].weight' cannot be set: there is no item [3] "
          "in an array of "
          "1.");
  REQUIRE(
      override_complaint("run..rtol=1").rfind("override 'run..rtol=1': 'run..rtol' is not a path of the scene", 0) ==
      0);
  REQUIRE(override_complaint("point.P.x_m.deep=1") ==
          "override 'point.P.x_m.deep=1': 'point.P.x_m.deep' cannot be set: 'deep' is looked for in the "
          "number 0.6, not in "
          "a table.");
}

TEST_CASE("scene mistakes: a file that cannot be read") {
  REQUIRE_THROWS_WITH(Scene::load("/no/such/scene.toml"),
                      "/no/such/scene.toml: The scene file cannot be read: No such file or directory; check the path "
                      "and its permissions.");
}
