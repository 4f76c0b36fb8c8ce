// Jumps that no derivative knew of, on which all exact methods agreed: laws of time that are switched at a parameter,
// bristles at a touch, tyres and formulas that jump. Each was found by a program of its own (scipy: Dormand and Prince
// of order 8, split at the events, derivatives by differences of whole motions) or has a closed form; the numbers are
// those.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/sensitivity/hessian.h"
#include "costate/sensitivity/method.h"
#include "property/hessian_compare.h"
#include "support/cases.h"

using namespace costate;
using Catch::Matchers::Contains;

namespace {

struct Way {
  const char *formulation, *method;
};
const std::vector<Way> kWays = {{"index1", "idas-adjoint"},        {"index1", "idas-forward"},
                                {"baumgarte", "cvodes-adjoint"},   {"index2", "idas-forward"},
                                {"maggi", "cvodes-forward"},       {"maggi", "hand-adjoint"},
                                {"penalty", "hand-tangent"},       {"maggi", "discrete-adjoint"},
                                {"baumgarte", "discrete-tangent"}, {"index2", "discrete-adjoint"},
                                {"index3", "idas-adjoint"},        {"maggi-implicit", "idas-forward"},
                                {"index1", "discrete-tangent"},    {"maggi-second-order", "hand-adjoint"}};

/// By all of `ways`: derivatives by the named parameters, to 20,000 rtol of their size (errors of adjoints are some
/// hundreds of rtol in these scenes, those by a penalty a part of 1e-5).
void require_gradients(const std::string& name, const std::string& parameters, const std::vector<double>& right,
                       const std::vector<Way>& ways = kWays) {
  for (const Way& way : ways) {
    INFO(name << " by " << way.formulation << " and " << way.method);
    Problem p = problem_of_case(name, {"run.rtol=1e-9", "run.parameters=[" + parameters + "]"});
    p.formulation = way.formulation;
    const GradientResult r = gradient(p, way.method, p.parameters.values());
    take_notices();
    REQUIRE(r.gradient.size() == right.size());
    double size = 0;
    for (const double x : right) size = std::max(size, std::abs(x));
    for (std::size_t j = 0; j < right.size(); ++j) {
      CAPTURE(j, r.gradient[j], right[j]);
      CHECK(std::abs(r.gradient[j] - right[j]) <= 2e-5 * size);
    }
  }
}

std::string said(const std::string& name, const std::vector<std::string>& overrides, const std::string& formulation,
                 const std::string& method) {
  take_notices();
  try {
    Problem p = problem_of_case(name, overrides);
    if (!formulation.empty()) p.formulation = formulation;
    if (method.empty())
      simulate(p, p.parameters.values());
    else
      gradient(p, method, p.parameters.values());
  } catch (const Error& e) {
    take_notices();
    return std::string("error: ") + e.what();
  }
  return fmt::format("{}", fmt::join(take_notices(), "\n"));
}

}  // namespace

TEST_CASE("unseen jumps: forces that are switched at times that parameters move") {
  require_gradients("switching_time", R"("b0", "b1")", {-0.153245, 0.2300837});
}

TEST_CASE("unseen jumps: actuators, couples of laws, costs that are switched") {
  require_gradients("switched_actuator", R"("b0")", {0.0873186});
  require_gradients("switched_product", R"("b0")", {-0.2117183},
                    {{"index1", "idas-adjoint"}, {"maggi", "hand-adjoint"}});
  require_gradients("switched_weight", R"("br", "k")", {-2.9218363, 0.0085133});
  require_gradients("switched_target", R"("br")", {-0.9237352});
}

TEST_CASE("unseen jumps: Hessians by a time at which a force is switched") {
  test::check_by_differences(problem_of_case("switching_time"), 1e-5, {"index1"});
}

TEST_CASE("unseen jumps: discrete steps end on the left side of a bend") {
  // Unit masses: the integrals of (0.3 - s)(7 - 6 s) over 0 to 0.3, and of (1 - s) s over 0 to 0.4.
  const std::vector<Way> discrete = {{"maggi", "discrete-adjoint"},
                                     {"baumgarte", "discrete-tangent"},
                                     {"index1", "discrete-adjoint"},
                                     {"index1", "idas-adjoint"}};
  require_gradients("continued_force", R"("force.f.x_N.breaks[1]")", {0.288}, discrete);
  require_gradients("joined_force", R"("force.f.x_N.coefficients[0][1]")", {0.4 * 0.4 * (1 - 0.8 / 3) / 2}, discrete);
}

TEST_CASE("unseen jumps: bristles begin to move at the touch") {
  const std::vector<Way> ways = {{"index1", "idas-forward"},      {"index1", "idas-adjoint"},
                                 {"baumgarte", "cvodes-adjoint"}, {"maggi", "hand-adjoint"},
                                 {"maggi", "discrete-adjoint"},   {"index2", "hand-tangent"}};
  require_gradients("bristles_at_touch", R"("R", "slope", "m")", {3.353828, -4.0344692, 0.5289021}, ways);
  require_gradients("bristles_in_space",
                    R"("contact.floor.radius_m", "contact.floor.ground_height_m", "rigid_body.b.z_m")",
                    {-0.67611, -0.69480, 0.69480}, ways);
}

TEST_CASE("unseen jumps: places at which tyres jump are named, motions told") {
  for (const auto& [formulation, method] : {std::pair{"index1", "idas-forward"},
                                            {"baumgarte", "cvodes-adjoint"},
                                            {"maggi", "discrete-adjoint"},
                                            {"index1", "hand-adjoint"}}) {
    INFO(formulation << " by " << method);
    CHECK_THAT(said("tyre_without_ramp", {R"(run.parameters=["speed"])"}, formulation, method),
               Contains("error: ") && Contains("'tyre.T' touches, and its damping sets in at once"));
    CHECK_THAT(said("calspan_branches", {}, formulation, method), Contains("error: ") && Contains("A_omega"));
  }
  CHECK_THAT(said("slip_cut", {}, "", "idas-forward"), Contains("error: ") && Contains("slip_speed_m_per_s = 0"));
  // A ramp that is resolved has its gradient (1.08363), and branches that meet have theirs.
  CHECK(
      said("tyre_without_ramp", {R"(run.parameters=["speed"])", "tyre.T.damping_ramp_m=1e-3"}, "index1", "idas-forward")
          .find("error") == std::string::npos);
  CHECK(said("calspan_branches", {"tyre.T.calspan.A_omega=1"}, "index1", "idas-forward").find("error") ==
        std::string::npos);
  CHECK_THAT(said("linear_tyre_in_the_air", {}, "", ""), Contains("'tyre.T' is off the ground"));
}

TEST_CASE("unseen jumps: a damper's ramp that a fixed step passes is one of them") {
  // The step chosen and half of it pass it alike: 8 % off, and agreed.
  CHECK_THAT(said("ramp_within_a_step", {}, "index3", "discrete-adjoint"),
             Contains("error: ") && Contains("'tyre.T' touches, and its damping sets in within one fixed step"));
  // A program's of its own (Dormand and Prince, split at the touch and at the ramp's end).
  require_gradients("ramp_within_a_step", R"("z0")", {2.382616},
                    {{"index1", "idas-adjoint"}, {"maggi", "hand-adjoint"}, {"maggi-second-order", "hand-adjoint"}});
}

TEST_CASE("unseen jumps: formulas that jump are named, in forces and in costs") {
  for (const auto& [formulation, method] : {std::pair{"index1", "idas-forward"},
                                            {"maggi", "hand-adjoint"},
                                            {"baumgarte", "cvodes-adjoint"},
                                            {"maggi", "discrete-adjoint"}}) {
    INFO(formulation << " by " << method);
    // Steps that end at the place itself meet 0/0 there, which is refused with the same name.
    CHECK_THAT(said("sign_of_place", {}, formulation, method),
               Contains("error: ") && (Contains("the formula of 'force.f' jumps from") ||
                                       Contains("force.f: Its force is not a finite number at t = 0.4 s")));
    CHECK_THAT(said("sign_in_cost", {"output.beyond.a=0.41234"}, formulation, method),
               Contains("error: ") && Contains("jumps from"));
  }
  CHECK(said("sign_of_place", {}, "", "").empty());
  const Problem p = problem_of_case("sign_of_place");
  const GradientResult r = gradient(p, "differences", p.parameters.values());
  // psi = v - k (1 - a/v)^2 with v = 1, a = 0.4, k = 0.5.
  CHECK(r.gradient[0] == Catch::Detail::Approx(0.76).epsilon(1e-6));
  CHECK(r.gradient[1] == Catch::Detail::Approx(0.6).epsilon(1e-6));
  CHECK(r.gradient[2] == Catch::Detail::Approx(-0.36).epsilon(1e-6));
}

TEST_CASE("unseen jumps: formulas are looked at beside the place, in time and in place") {
  const auto by = [](const std::string& formula, const std::string& parameter = "force.f.a") {
    return said("sign_of_place", {"force.f.formula_x_N=\"" + formula + "\"", "run.parameters=[\"" + parameter + "\"]"},
                "index1", "idas-forward");
  };
  const std::string jumps = "the formula of 'force.f' jumps from";
  CHECK_THAT(by("-k*max(0, abs(P.x-a)/(P.x-a))"), Contains(jumps));
  // 0/0 at the place, and nothing jumps beside it; a bend is none either.
  CHECK(by("-k*(P.x-a)^2/(P.x-a)").find(jumps) == std::string::npos);
  CHECK(by("-k*max(0, P.x-a)").find(jumps) == std::string::npos);
  // An instant is known, unless a parameter moves it.
  CHECK_THAT(by("-k*(1 + abs(t-a)/(t-a))"), Contains("'force.f.a' moves the time t = 0.4 s"));
  CHECK(by("-k*(1 + abs(t-a)/(t-a))", "force.f.k").find(jumps) == std::string::npos);
}

TEST_CASE("unseen jumps: formulas of accelerations in costs") {
  // psi = the time that a = 2 - 3 t is positive, 2/3 s: d psi/d(force) = 1/3.
  for (const auto& [formulation, method] : {std::pair{"index1", "idas-forward"},
                                            {"index1", "idas-adjoint"},
                                            {"baumgarte", "cvodes-adjoint"},
                                            {"maggi", "hand-adjoint"},
                                            {"maggi", "discrete-adjoint"},
                                            {"penalty", "discrete-tangent"}}) {
    INFO(formulation << " by " << method);
    CHECK_THAT(said("sign_of_acceleration", {}, formulation, method),
               Contains("error: ") && Contains("the formula of 'the cost's ahead' jumps from"));
    CHECK(said("sign_of_acceleration", {R"~(output.ahead.formula="max(0, P.x_ddot)")~"}, formulation, method)
              .find("jumps") == std::string::npos);
  }
}

TEST_CASE("unseen jumps: what coincides with a jump that a parameter moves") {
  const std::string second = R"({kind="piecewise",breaks=[0.7],coefficients=[[0],[-3]],joins="none"})";
  for (const char* method : {"idas-forward", "cvodes-adjoint"}) {
    INFO(method);
    CHECK_THAT(said("switching_time", {R"(force.h={point="P"})", "force.h.x_N=" + second}, "index1", method),
               Contains("coincide") && Contains("'b0'"));
    CHECK(said("switching_time", {R"(force.h={point="P"})", "force.h.x_N=" + second, R"(run.parameters=["k"])"},
               "index1", method)
              .find("coincide") == std::string::npos);
  }
}

TEST_CASE("unseen jumps: steep forces in equations of second order") {
  // By differences and a program's own (Dormand and Prince): -5.56345. Terms of second order are a billion times as
  // large here and cancel: nothing is left of the gradient, and that is said.
  require_gradients("steep_friction", R"("force.D.c")", {-5.56345}, {{"index1", "idas-forward"}});
  for (const char* formulation : {"penalty-second-order", "maggi-second-order"})
    CHECK_THAT(said("steep_friction", {R"(run.parameters=["c"])"}, formulation, "hand-adjoint"),
               Contains("makes much of small errors"));
}

TEST_CASE("unseen jumps: a force that is nothing at rest is asked where it moves") {
  CHECK(said("sign_of_velocity", {}, "", "").empty());
  // It turns at 0.39 s.
  CHECK_THAT(said("sign_of_velocity", {"run.t_end_s=0.6"}, "index1", "idas-forward"), Contains("jumps from"));
}

TEST_CASE("unseen jumps: differences tell of two slopes") {
  const std::string text = said("two_slopes", {}, "index1", "differences");
  CHECK_THAT(text, Contains("another slope on either side of parameter 'tc': -2.39") && Contains("-1.264"));
  CHECK_THAT(text, Contains("parameter 'td'"));
  CHECK(text.find("'ta'") == std::string::npos);
  CHECK(text.find("'I'") == std::string::npos);
}

TEST_CASE("unseen jumps: breaks nearer to each other than they are probed by") {
  CHECK(said("short_pulse", {}, "index1", "idas-forward").find("error") == std::string::npos);
}

TEST_CASE("unseen jumps: a run by a penalty that ends by an event is judged by one that does") {
  CHECK(said("penalty_free_end", {}, "penalty", "idas-adjoint").find("weight") == std::string::npos);
}

// By Richardson's differences of whole motions.
TEST_CASE("unseen jumps: of two coefficients of friction that of sliding counts in impacts of a rigid contact") {
  require_gradients("two_coefficients", R"("contact.floor.friction_coefficient", "contact.floor.static_coefficient")",
                    {4.7048652996, 0}, {{"index1", "cvodes-adjoint"}, {"baumgarte", "cvodes-forward"}});
}

TEST_CASE("unseen jumps: a static coefficient is a key of a rigid contact whatever a compliant one's friction has") {
  CHECK(said("two_coefficients", {R"(contact.floor.friction="coulomb")"}, "", "").find("nknown") == std::string::npos);
  CHECK_THAT(said("two_coefficients",
                  {R"(contact.floor.friction="coulomb")", R"(contact.floor.kind="compliant")",
                   "contact.floor.stiffness_N_per_m_n=1e6"},
                  "", ""),
             Contains("Unknown key 'static_coefficient'"));
}

TEST_CASE("unseen jumps: what starts at rest on the ground does not fall through it") {
  const std::string at = "is at the point of happening, from rest";
  CHECK_THAT(said("drop", {"point.ball.y_m=0"}, "", ""), Contains("error: ") && Contains(at) && Contains("closed"));
  CHECK_THAT(said("touching_ball", {}, "", ""), Contains(at) && Contains("approach_speed_m_per_s"));
  CHECK_THAT(said("touching_pair", {}, "", ""), Contains(at));
  CHECK_THAT(said("standing_block", {}, "", ""), Contains(at));
  // Nor what is pushed down later, and it may stay there until then.
  CHECK_THAT(said("drop",
                  {"point.ball.y_m=0", "gravity.y_m_per_s2=0", "point.ball.vx_m_per_s=0",
                   R"(force.late={point="ball",y_N={kind="steps",at=[0.5],values=[0,-5],width=0.1}})"},
                  "", ""),
             Contains("'contact.floor: touch' is past by") && Contains("begin a little away"));
  // What moves away from it may.
  CHECK(said("drop", {"point.ball.y_m=0", "gravity.y_m_per_s2=1"}, "", "").find("error") == std::string::npos);
  // A latch catches at once: -0.0002 rad where it was -5.0.
  const Problem caught = problem_of_case("caught_at_once", {"body.b.angular_velocity_rad_per_s=0"});
  CHECK(std::abs(simulate(caught, caught.parameters.values()).psi) < 1e-3);
}

TEST_CASE("unseen jumps: a touch that the jump of a post brings about has no derivative here") {
  // y_m 0.0827 where it is -0.0528, by every method.
  for (const auto& [formulation, method] :
       {std::pair{"index1", "idas-forward"}, {"baumgarte", "cvodes-adjoint"}, {"maggi", "hand-adjoint"}}) {
    INFO(formulation << " by " << method);
    CHECK_THAT(said("post_jumps_into_ball", {R"(run.parameters=["body.b.y_m"])"}, formulation, method),
               Contains("error: ") && Contains("brought about by the ground's law"));
  }
  // With the jump before the touch all is right.
  CHECK(said("post_jumps_into_ball", {R"(run.parameters=["body.b.y_m"])", "road.r.law.breaks=[0.199]"}, "index1",
             "idas-forward")
            .find("error") == std::string::npos);
}

TEST_CASE("unseen jumps: slips from rest have their gradients") {
  // Accelerations are zero on both sides: their jump was rounding compared with rounding.
  require_gradients("slip_from_rest", R"("mu", "A", "om", "m")", {-34.65952, 3.739247, -13.14607, -5.06905},
                    {{"index1", "idas-adjoint"}, {"index1", "cvodes-adjoint"}, {"baumgarte", "cvodes-forward"}});
}

// By the height of one psi falls by 10.659 a metre below and rises by 13.260 above, as one or the other comes first
// (one-sided differences of whole runs): what is told is one of both, and says so. Apart by a millimetre it does not.
TEST_CASE("unseen jumps: two impacts in one instant that one cost holds", "[events]") {
  const auto told = [](const std::vector<std::string>& overrides) {
    const Problem p = problem_of_case("two_in_one_cost", overrides);
    take_notices();
    gradient(p, "cvodes-adjoint", p.parameters.values());
    const std::vector<std::string> all = take_notices();
    return std::any_of(all.begin(), all.end(), [](const std::string& text) {
      return text.find("a running cost holds what both of them move") != std::string::npos;
    });
  };
  CHECK(told({}));
  CHECK_FALSE(told({"point.b.y_m=1.001"}));
}
