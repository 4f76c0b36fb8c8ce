// A user's elements against their own values: derivatives that dual numbers lose, bodies that are no M a - Q, outputs
// that end a run, constraints that jump at times that they do not declare; and arguments that cannot be.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/event/end_event.h"
#include "costate/integrator/simulate.h"
#include "costate/kind/body/mass.h"
#include "costate/kind/body/point.h"
#include "costate/mechanism/builder.h"
#include "costate/objective/constant_costs.h"
#include "costate/sensitivity/method.h"

using namespace costate;
using Catch::Contains;

namespace {

/// -p0 x - p1 v, of which one argument may have lost its type.
class Damper final : public ForceOf<Damper> {
 public:
  Damper(int x, const std::vector<int>& numbers, std::string lost) : ForceOf("damper", "own"), lost_(std::move(lost)) {
    append_coordinates({x});
    append_numbers(numbers);
  }
  template <class S>
  void physics(const S&, const S* q, const S* v, const S*, const S* p, S* Q, S*) const {
    const S x = lost_ == "x" ? S(value_of(q[0])) : q[0], y = lost_ == "v" ? S(value_of(v[0])) : v[0];
    Q[0] = -p[0] * x - (lost_ == "c" ? S(value_of(p[1])) : p[1]) * y;
  }

 private:
  std::string lost_;
};

/// x^2 + y^2 - L^2, L as the case says.
class Rope final : public ConstraintOf<Rope> {
 public:
  enum class Case { still, lost, jerks, declared };
  Rope(const std::vector<int>& xy, const std::vector<int>& numbers, Case which)
      : ConstraintOf("rope", "own"), which_(which) {
    append_coordinates(xy);
    append_numbers(numbers);
  }
  int rows() const override { return 1; }
  std::string row_name(int) const override { return "length"; }
  bool rheonomic() const override { return which_ >= Case::jerks; }
  void add_kinks(const double* p, std::vector<double>& times) const override {
    if (which_ == Case::declared) times.push_back(p[1]);
  }
  template <class S>
  void physics(const S& t, const S* q, const S* p, S* phi) const {
    S length = which_ == Case::lost ? S(value_of(p[0])) : p[0];
    if (rheonomic() && value_of(t) > value_of(p[1])) length += S(0.5) * (t - p[1]);
    phi[0] = q[0] * q[0] + q[1] * q[1] - length * length;
  }

 private:
  Case which_;
};

/// M a with M = p0, p0 (1 + v^2), an unsymmetric one, or p0 a + a^2.
class Lump final : public BodyOf<Lump> {
 public:
  Lump(const std::vector<int>& xy, int mass, std::string kind) : BodyOf("lump", "own"), kind_(std::move(kind)) {
    append_coordinates(xy);
    append_numbers({mass});
  }
  template <class S>
  void physics(const S*, const S* v, const S* a, const S* p, S* r) const {
    r[0] = p[0] * a[0];
    r[1] = p[0] * a[1];
    if (kind_ == "by speed") r[0] += p[0] * v[0] * v[0] * a[0];
    if (kind_ == "unsymmetric") r[0] += S(0.3) * p[0] * a[1];
    if (kind_ == "square") r[1] += a[1] * a[1];
  }

 private:
  std::string kind_;
};

/// The place x, with derivatives that are `wrong`.
class Place final : public Output {
 public:
  Place(int x, double wrong) : Output("place", "m"), x_(x), wrong_(wrong) {}
  double value(const StateView& s, Assembly&) const override { return s.q[x_]; }
  void add_gradient(const StateView&, Assembly&, double factor, ScalarGradient& g) const override {
    g.q[x_] += factor * wrong_;
  }
  double change(const StateView&, Assembly&, const Variation& d) const override { return d.q[x_]; }

 private:
  int x_;
  double wrong_;
};

/// So many rows x = 0.
class Many final : public ConstraintOf<Many> {
 public:
  Many(int x, int rows) : ConstraintOf("many", "own"), rows_(rows) { append_coordinates({x}); }
  int rows() const override { return rows_; }
  std::string row_name(int i) const override { return "r" + std::to_string(i); }
  template <class S>
  void physics(const S&, const S* q, const S*, S* phi) const {
    for (int i = 0; i < rows_; ++i) phi[i] = q[0];
  }

 private:
  int rows_;
};

struct Scene2 {
  MechanismBuilder builder;
  std::vector<int> xy;
  int k, c;
  Scene2() {
    add_free_point(builder, "P", {1, 0, 0, 0});
    xy = {builder.coordinate("P.x"), builder.coordinate("P.y")};
    k = builder.add_number("k", 10);
    c = builder.add_number("c", 0.5);
  }
  Problem problem(const std::vector<std::string>& parameters) {
    Problem p;
    p.mechanism = builder.build();
    p.parameters = p.mechanism->select(parameters);
    p.solver.t_end = 1;
    p.objective.terminal.push_back(value_cost(*p.mechanism, "P.x"));
    return p;
  }
};

Problem pulled() {
  Scene2 s;
  add_mass(s.builder, "m", "P", 2);
  s.builder.add(std::make_unique<Damper>(s.xy[0], std::vector<int>{s.k, s.c}, ""));
  return s.problem({"k", "c"});
}

}  // namespace

TEST_CASE("own values: derivatives that dual numbers lose") {
  const auto build = [](const std::string& lost, Rope::Case rope) {
    Scene2 s;
    add_mass(s.builder, "m", "P", 2);
    s.builder.add(std::make_unique<Damper>(s.xy[0], std::vector<int>{s.k, s.c}, lost));
    s.builder.add(std::make_unique<Rope>(s.xy, std::vector<int>{s.k, s.c}, rope));
    s.builder.build();
  };
  CHECK_NOTHROW(build("", Rope::Case::still));
  CHECK_THROWS_WITH(build("x", Rope::Case::still), Contains("damper.own") && Contains("by positions"));
  CHECK_THROWS_WITH(build("v", Rope::Case::still), Contains("damper.own") && Contains("by velocities"));
  CHECK_THROWS_WITH(build("c", Rope::Case::still), Contains("damper.own") && Contains("by 'c' dual numbers have 0,"));
  CHECK_THROWS_WITH(build("", Rope::Case::lost), Contains("rope.own") && Contains("by 'k'"));
}

TEST_CASE("own values: a body's residual is M a - Q") {
  const auto build = [](const std::string& kind) {
    Scene2 s;
    s.builder.add(std::make_unique<Lump>(s.xy, s.k, kind));
    s.builder.build();
  };
  CHECK_NOTHROW(build("right"));
  CHECK_THROWS_WITH(build("by speed"), Contains("lump.own") && Contains("changes with velocities"));
  CHECK_THROWS_WITH(build("unsymmetric"), Contains("lump.own") && Contains("is not symmetric"));
  CHECK_THROWS_WITH(build("square"), Contains("lump.own"));
}

// x'' = -5 x - 0.25 v falls through 0.5 m near 0.47 s.
TEST_CASE("own values: an output that ends a run") {
  for (const double wrong : {1.0, 1.01}) {
    Problem p = pulled();
    EndEvent end;
    end.output = std::make_shared<Place>(0, wrong);
    end.above = false;
    end.level = 0.5;
    p.ends_when = std::make_shared<EndEvent>(end);
    if (wrong == 1)
      // Terminal costs of the library have the change that this asks for.
      CHECK(std::abs(gradient(p, "idas-adjoint", p.parameters.values()).gradient[0]) < 1e-7);
    else
      CHECK_THROWS_WITH(gradient(p, "idas-adjoint", p.parameters.values()),
                        Contains("The output that ends the run") && Contains("add_gradient"));
  }
  Problem none = pulled();
  none.ends_when = std::make_shared<EndEvent>();
  CHECK_THROWS_WITH(simulate(none, none.parameters.values()), Contains("has no output"));
}

// At 0.5 s the rope is let out at 0.5 m/s from one instant to the next.
TEST_CASE("own values: a constraint whose rate jumps says when") {
  for (const auto which : {Rope::Case::jerks, Rope::Case::declared}) {
    MechanismBuilder b;
    add_free_point(b, "P", {1, 0, 0, 1});
    add_mass(b, "m", "P", 2);
    const std::vector<int> xy{b.coordinate("P.x"), b.coordinate("P.y")};
    b.add(std::make_unique<Rope>(xy, std::vector<int>{b.add_number("L", 1), b.add_number("t0", 0.5)}, which));
    b.give_position("P.y");
    b.give_velocity("P.y");
    Problem p;
    p.mechanism = b.build();
    p.parameters = p.mechanism->select({"L"});
    p.formulation = "maggi";
    p.solver.t_end = 1;
    p.objective.terminal.push_back(value_cost(*p.mechanism, "P.x"));
    take_notices();
    simulate(p, p.parameters.values());
    bool told = false;
    for (const std::string& text : take_notices())
      told = told || (text.find("rope.own") != std::string::npos && text.find("no impulse") != std::string::npos);
    CHECK(told == (which == Rope::Case::jerks));
    if (which == Rope::Case::jerks)
      CHECK_THROWS_WITH(gradient(p, "cvodes-forward", p.parameters.values()),
                        Contains("rope.own") && Contains("add_kinks"));
    else
      CHECK(gradient(p, "cvodes-forward", p.parameters.values()).gradient.size() == 1);
    take_notices();
  }
}

TEST_CASE("own values: selections and times that cannot be") {
  const Problem good = pulled();
  const std::vector<double> rho = good.parameters.values();
  const auto wrong = [&](const std::function<void(ParameterSelection&)>& change, const char* what) {
    Problem p = good;
    change(p.parameters);
    CHECK_THROWS_WITH(gradient(p, "idas-adjoint", rho), Contains(what));
  };
  for (const int number : {-1, 9999})
    wrong([&](auto& s) { s.parameters[0].bindings[0].first = number; }, "is bound to number");
  wrong([](auto& s) { s.parameters[1].bindings = s.parameters[0].bindings; }, "vary the same number");
  for (const double scale : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()})
    wrong([&](auto& s) { s.parameters[0].scale = scale; }, "expected a number above 0");
  const auto sink = [](const MechanismState&, System&) {};
  for (const char* integrator : {"idas", "cvodes", "dop853", "radau5", "fixed"}) {
    Problem p = good;
    p.formulation = std::string(integrator) == "fixed" ? "index3" : "index1";
    p.solver.integrator = integrator;
    for (const std::vector<double>& times :
         {std::vector<double>{1, 0.5}, {-0.3}, {1.7}, {0.5, std::numeric_limits<double>::quiet_NaN(), 1}})
      CHECK_THROWS_WITH(simulate(p, rho, times, sink), Contains("in order"));
    CHECK_NOTHROW(simulate(p, rho, {0, 0.5, 0.5, 1}, sink));
  }
}

TEST_CASE("own values: more rows or states than kernels hold") {
  for (const int rows : {-1, 0, 40}) {
    Scene2 s;
    CHECK_THROWS_WITH(s.builder.add(std::make_unique<Many>(s.xy[0], rows)),
                      Contains("many.own") && Contains("between 1 and 32"));
  }
}
