// The consistent start and what it says when it cannot be found; the builder's own complaints.
#include "costate/analysis/start.h"

#include <support/models.h>
#include <support/sketch.h>

#include <catch2/catch.hpp>

#include "costate/base/error.h"

using namespace costate;
using namespace costate::test;
using Catch::Matchers::Contains;

namespace {

Start start_of(const std::shared_ptr<const Mechanism>& m) {
  Assembly assembly(m, ParameterSelection{});
  return find_start(assembly, 0, false);
}

/// A crank O-P of 1 m and a rod P-R of 2 m, R guided along y = 0.
Sketch slider_crank() {
  Sketch s;
  s.ground("O", 0, 0);
  s.point("P", 0.6, 0.8);
  s.point("R", 2.3, 0.1);
  s.mass("R", 1);
  s.bar("crank", "O", "P", 1);
  s.bar("rod", "P", "R", 1);
  s.driver("guide", {{"R.y", 1.0}}, polynomial({0}));
  return s;
}

}  // namespace

TEST_CASE("start: positions and velocities from the given ones", "[start]") {
  Sketch s = slider_crank();
  s.give({"P.x"});
  const auto m = s.builder.build();
  const Start start = start_of(m);
  // The first guess of R is off its guide; the rod's length is that of the guess.
  const double rod = std::hypot(2.3 - 0.6, 0.1 - 0.8);
  CHECK(start.q[0] == 0.6);
  CHECK(start.q[1] == Approx(0.8).epsilon(1e-14));
  CHECK(start.q[2] == Approx(0.6 + std::sqrt(rod * rod - 0.64)).epsilon(1e-14));
  CHECK(start.q[3] == Approx(0).margin(1e-14));
  CHECK(start.v.cwiseAbs().maxCoeff() < 1e-14);
  CHECK(start.iterations < 10);
}

TEST_CASE("start: too few, too many, and dependent given coordinates", "[start]") {
  {
    Sketch s = slider_crank();
    CHECK_THROWS_WITH(start_of(s.builder.build()), Contains("Too few given positions") &&
                                                       Contains("1 degree of freedom") &&
                                                       Contains("so 1 must be given, found 0"));
  }
  {
    Sketch s = slider_crank();
    s.give({"P.x", "R.x"});
    CHECK_THROWS_WITH(start_of(s.builder.build()),
                      Contains("Too many given positions") && Contains("found 2 (P.x, R.x)"));
  }
  {
    Sketch s = slider_crank();
    s.builder.give_position("P.x");
    CHECK_THROWS_WITH(start_of(s.builder.build()), Contains("Too few given velocities"));
  }
  {
    // R.y is what the guide says already: it does not determine the crank.
    Sketch s = slider_crank();
    s.point("Q", 5, 5);
    s.mass("Q", 1);
    s.give({"R.y", "Q.x", "Q.y"});
    CHECK_THROWS_AS(start_of(s.builder.build()), ModelError);
  }
}

TEST_CASE("start: a configuration that cannot be closed names the worst constraints", "[start]") {
  Sketch s;
  s.ground("O", 0, 0);
  s.ground("W", 5, 0);
  s.point("P", 1, 0.1);
  s.bar("left", "O", "P", 1);  // lengths of about 1 and 4 m, shortened below
  s.bar("right", "P", "W", 1);
  const auto m = s.builder.build();
  ParameterSelection shorter = m->select({"bar.right.length_m"});
  shorter.parameters[0].value = 2;
  Assembly assembly(m, shorter);
  CHECK_THROWS_WITH(find_start(assembly, 0, false),
                    Contains("cannot be reached") && Contains("bar.left.length") && Contains("bar.right.length"));
}

TEST_CASE("start: redundant constraints are allowed", "[start]") {
  // A parallelogram with three posts: one bar says nothing new as long as the posts stay parallel.
  Sketch s;
  for (int i = 0; i < 3; ++i) {
    const std::string k = std::to_string(i);
    s.ground("A" + k, i, 0);
    s.point("B" + k, i, 1);
    s.mass("B" + k, 1);
  }
  for (int i = 0; i < 3; ++i) s.bar("post" + std::to_string(i), "A" + std::to_string(i), "B" + std::to_string(i), 1);
  s.bar("top0", "B0", "B1", 1);
  s.bar("top1", "B1", "B2", 1);
  s.bar("top2", "B0", "B2", 1);  // along the same line: dependent where it is straight
  s.give({"B0.x"});
  const auto m = s.builder.build();
  Assembly assembly(m, ParameterSelection{});
  const Start start = find_start(assembly, 0, false);
  const ConstraintRank rank = constraint_rank(assembly, 0, start.q.data());
  CHECK(rank.rank == 5);
  CHECK(rank.dependent_rows.size() == 1);
}

TEST_CASE("start: rows and ranks of the kitchen sink", "[start]") {
  const TestModel model = kitchen_sink();
  Assembly assembly(model.mechanism, ParameterSelection{});
  const Start start = find_start(assembly, 0, false);
  const ConstraintRank rank = constraint_rank(assembly, 0, start.q.data());
  CHECK(rank.rank == assembly.m());
  CHECK(rank.dependent_rows.empty());
  CHECK(assembly.n() - assembly.m() == 4);
  // Force states start from their own numbers.
  CHECK(start.z.size() == 4);
  const auto states = model.mechanism->state_names();
  const std::vector<double> expected = {0.05, 1.5, 0.02, -0.1};  // in the order of the forces
  for (std::size_t i = 0; i < expected.size(); ++i) {
    CAPTURE(states[i]);
    CHECK(start.z[static_cast<Eigen::Index>(i)] == expected[i]);
  }
}

TEST_CASE("builder: mistakes are named", "[start]") {
  {
    MechanismBuilder b;
    b.add_number("a", 1);
    CHECK_THROWS_WITH(b.add_number("a", 2), Contains("defined twice"));
    CHECK_THROWS_WITH(b.add_number("mass", -1, NumberRule::positive), Contains("must be positive, found -1"));
    CHECK_THROWS_WITH(b.add_number("c", -1, NumberRule::non_negative), Contains("must not be negative"));
    CHECK_THROWS_WITH(b.add_number("d", std::nan("")), Contains("must be finite"));
    CHECK_THROWS_WITH(b.build(), Contains("no coordinate"));
  }
  Sketch s = slider_crank();
  s.builder.add_number("lonely", 2);
  CHECK_THROWS_WITH(s.point("P", 0, 0), Contains("point.P.x_m") && Contains("defined twice"));
  CHECK_THROWS_WITH(s.builder.point("Q"), Contains("no point 'Q'"));
  CHECK_THROWS_WITH(s.builder.coordinate("P.z"), Contains("no coordinate 'P.z'") && Contains("Did you mean 'P.x'?"));
  CHECK_THROWS_WITH(s.builder.angle("P"), Contains("no body or angle 'P'"));
  s.builder.give_position("P.x");
  CHECK_THROWS_WITH(s.builder.give_position("P.x"), Contains("given twice"));
  const int crank = s.builder.number("bar.crank.mass_kg"), rod = s.builder.number("bar.rod.mass_kg");
  CHECK_THROWS_WITH(s.builder.add_parameter({"p", {}}), Contains("at least one number"));
  CHECK_THROWS_WITH(s.builder.add_parameter({"p", {{crank, 0.0}}}), Contains("must not be zero") || Contains("zero"));
  CHECK_THROWS_WITH(s.builder.add_parameter({"p", {{crank, 1.0}, {rod, 2.0}}}),
                    Contains("bar.rod.mass_kg") && Contains("must agree at the start"));
  // A run may be looked at beyond an optimizer's bounds; the optimizer itself refuses to begin there.
  CHECK_NOTHROW(s.builder.add_parameter({"beyond", {{crank, 1.0}}, 0, 2, 3, 1}));
  CHECK_THROWS_WITH(s.builder.add_parameter({"p", {{crank, 1.0}}, 0, 0, 3, 0}), Contains("scale must be positive"));
  s.builder.add_parameter({"p", {{crank, 1.0}}, 0, 0, 3, 1});
  CHECK_THROWS_WITH(s.builder.add_parameter({"p", {{rod, 1.0}}, 0, 0, 3, 1}), Contains("exists already"));
  s.builder.set_default_parameters({"p"});
  s.builder.give_velocity("P.x");
  const auto m = s.builder.build();
  CHECK(m->select({}).names() == std::vector<std::string>{"p"});
  CHECK_THROWS_WITH(m->select({"q"}), Contains("no parameter 'q'"));
  CHECK_THROWS_WITH(m->select({"bar.rod.mas_kg"}), Contains("Did you mean 'bar.rod.mass_kg'?"));
  CHECK_THROWS_WITH(m->select({"p", "p"}), Contains("listed twice"));
  CHECK_THROWS_WITH(m->select({"p", "bar.crank.mass_kg"}), Contains("already varied by parameter 'p'"));
  CHECK_THROWS_WITH(m->select({"point.R.x_m"}), Contains("cannot vary") && Contains("first guess"));
  CHECK_THROWS_WITH(m->select({"point.R.vx_m_per_s"}), Contains("cannot vary") && Contains("velocity"));
  // Any free number can be a parameter under its path.
  const ParameterSelection any = m->select({"bar.rod.mass_kg"});
  CHECK(any.parameters[0].value == 1);
  CHECK_THROWS_WITH(make_output(*m, "R.force"), Contains("no output 'R.force'"));
}
