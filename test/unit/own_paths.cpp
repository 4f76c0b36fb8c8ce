// What forces and costs of one's own do along the motion, at places, at times that the state decides, for a thousandth
// of the run: met by steps of every integrator, as runs of steps that are short throughout have it.
#include <catch2/catch.hpp>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/kind/body/mass.h"
#include "costate/kind/body/point.h"
#include "costate/kind/lookup.h"
#include "costate/mechanism/builder.h"
#include "costate/sensitivity/method.h"

using namespace costate;

namespace {

constexpr double kEnd = 10;

enum class Acts { behind_a_place, at_a_place, as_it_comes, by_a_clock, none };

template <class S>
S cube_above(const S& x) {
  return value_of(x) > 0 ? x * x * x : S(0.0);
}
template <class S>
S bell(const S& t, const S& at, double width) {
  const S u = (t - at) / S(width);
  return exp(-u * u);
}

/// Numbers: how much, when or where, how much more.
class Acting final : public ForceOf<Acting> {
 public:
  Acting(int coordinate, std::vector<int> numbers, Acts acts) : ForceOf("acting", "own"), acts_(acts) {
    append_coordinates({coordinate});
    append_numbers(numbers);
  }
  int states() const override { return acts_ == Acts::by_a_clock ? 1 : 0; }
  template <class S>
  void physics(const S& t, const S* q, const S*, const S* z, const S* p, S* Q, S* zdot) const {
    Q[0] = S(0.0);
    switch (acts_) {
      case Acts::behind_a_place:
        Q[0] = p[0] * bell(t, p[1], 5e-3) * cube_above(q[0] - S(2.0));
        break;
      case Acts::at_a_place:
        Q[0] = p[0] * bell(q[0], p[1], 2e-3);
        break;
      case Acts::as_it_comes:
        Q[0] = p[0] * bell(t, p[1] + S(0.5) * q[0], 5e-3);
        break;
      case Acts::by_a_clock:
        zdot[0] = S(1.0);
        Q[0] = p[0] * bell(z[0], p[1], 5e-3);
        break;
      case Acts::none:
        break;
    }
  }

 private:
  Acts acts_;
};

/// The square of x, and much more of it for an instant behind x = 2.
class Look final : public DualCostTerm<Look> {
 public:
  Look(int x, int much, int when) : x_(x), much_(much), when_(when) {}
  template <class S>
  S physics(const CostArguments<S>& at) const {
    const S &x = at.q[x_], more = at.numbers[much_] * bell(at.t, at.numbers[when_], 5e-3);
    return x * x + more * cube_above(x - S(2.0));
  }
  bool needs_accelerations() const override { return false; }

 private:
  int x_, much_, when_;
};

Problem moving(Acts acts, double much, double when, bool cost = false) {
  MechanismBuilder b;
  add_ground_point(b, "O", 0, 0);
  add_free_point(b, "P", {0, 0, 0.5, 0});
  add_mass(b, "m", "P", 2);
  const int x = b.coordinate("P.x");
  const std::vector<int> numbers = {b.add_number("much", much), b.add_number("when", when)};
  b.add(std::make_unique<Acting>(x, numbers, acts));
  Problem p;
  p.mechanism = b.build();
  p.parameters = p.mechanism->select({"much", "when"});
  p.solver.t_end = kEnd;
  if (cost)
    p.objective.running.push_back(std::make_shared<Look>(x, numbers[0], numbers[1]));
  else
    p.objective.terminal.push_back(
        std::make_shared<OutputTerm>(make_output(*p.mechanism, "P.x"), 1, -1, OutputTerm::Target{}));
  return p;
}

/// Against a run of steps of a fifth of what acts, in which nothing is passed: to a thousandth of what it does.
void check(const Problem& problem, double without) {
  Problem short_steps = problem;
  short_steps.solver.max_step_s = 1e-3;
  short_steps.formulation = "index1";
  const auto rho = problem.parameters.values();
  const GradientResult right = gradient(short_steps, "cvodes-forward", rho);
  const double does = std::abs(right.psi - without);
  REQUIRE(does > 1e-2 * std::abs(without));
  for (const auto& [formulation, method] :
       {std::pair("index1", "idas-adjoint"), std::pair("baumgarte", "cvodes-adjoint"),
        std::pair("maggi", "cvodes-forward"), std::pair("index2", "hand-adjoint"),
        std::pair("index1", "discrete-adjoint")}) {
    CAPTURE(formulation, method);
    Problem p = problem;
    p.formulation = formulation;
    const GradientResult g = gradient(p, method, rho);
    CHECK(std::abs(g.psi - right.psi) <= 1e-3 * does);
    for (std::size_t j = 0; j < rho.size(); ++j)
      CHECK(std::abs(g.gradient[j] - right.gradient[j]) <= 1e-3 * (std::abs(right.gradient[j]) + does / rho[j]));
  }
}

/// 100 ((1 + cos(pi u))/2)^2 for |u| < 1, u the time from `when` in half widths.
class Bump final : public ForceOf<Bump> {
 public:
  Bump(int x, double when, double width) : ForceOf("bump", "own"), when_(when), width_(width) {
    append_coordinates({x});
  }
  template <class S>
  void physics(const S& t, const S*, const S*, const S*, const S*, S* Q, S*) const {
    const S u = (t - S(when_)) / S(width_), half = S(0.5) * (S(1.0) + cos(S(std::numbers::pi) * u));
    Q[0] = std::abs(value_of(u)) < 1 ? S(100.0) * half * half : S(0.0);
  }

 private:
  double when_, width_;
};

/// -k (q1 - q0 - l) between two coordinates, linear throughout.
class OwnSpring final : public ForceOf<OwnSpring> {
 public:
  OwnSpring(std::string name, std::vector<int> coordinates, std::vector<int> numbers)
      : ForceOf("own_spring", std::move(name)) {
    append_coordinates(coordinates);
    append_numbers(numbers);
  }
  template <class S>
  void physics(const S&, const S* q, const S*, const S*, const S* p, S* Q, S*) const {
    const S force = p[0] * (q[1] - q[0] - p[1]);
    Q[0] = force;
    Q[1] = -force;
  }
};

}  // namespace

TEST_CASE("own paths: what acts for an instant that the state decides is met") {
  check(moving(Acts::behind_a_place, 200, 7.1234), 5);
  check(moving(Acts::at_a_place, 50, 3.3), 5);
  check(moving(Acts::as_it_comes, 50, 3.3), 5);
  check(moving(Acts::by_a_clock, 50, 6.1234), 5);
}

TEST_CASE("own paths: what a cost looks at for an instant is met") {
  check(moving(Acts::none, 5000, 7.1234, true), 0.25 * kEnd * kEnd * kEnd / 3);
}

TEST_CASE("own paths: the flanks of something short are no kinks") {
  // Where each of two neighbouring cells had seen one of them, as two lines; 17 of 2500 places had been passed over.
  for (const double when : {5.077937, 1.777345, 1.679698, 4.394492}) {
    const auto at_rest = [&](double width) {
      MechanismBuilder b;
      add_ground_point(b, "O", 0, 0);
      add_free_point(b, "P", {0, 0, 0, 0});
      add_mass(b, "m", "P", 1);
      b.add(std::make_unique<Bump>(b.coordinate("P.x"), when, width));
      Problem q;
      q.mechanism = b.build();
      q.solver.t_end = kEnd;
      q.objective.terminal.push_back(
          std::make_shared<OutputTerm>(make_output(*q.mechanism, "P.x"), 1, -1, OutputTerm::Target{}));
      return simulate(q, {}).psi;
    };
    CAPTURE(when);
    // The mean of ((1 + cos)/2)^2 is 3/8.
    for (const double width : {1.45e-3, 1.73e-3, 2.5e-3})
      CHECK(at_rest(width) == Approx(100 * 2 * width * 0.375 * (kEnd - when)).epsilon(1e-3));
  }
}

TEST_CASE("own paths: what rounding leaves of a spring at its natural length is no jump") {
  for (const double velocity : {0.0, 1e-3, 1.0})
    for (const double from : {0.0, 0.1, 0.7, 1.3}) {
      MechanismBuilder b;
      add_ground_point(b, "O", 0, 0);
      add_free_point(b, "A", {from, 0, 0, 0});
      add_free_point(b, "B", {from + 0.3, 0, velocity, 0});
      add_mass(b, "a", "A", 1);
      add_mass(b, "b", "B", 1);
      const std::vector<int> numbers = {b.add_number("k", 1000), b.add_number("l", 0.3)};
      b.add(std::make_unique<OwnSpring>("s", std::vector<int>{b.coordinate("A.x"), b.coordinate("B.x")}, numbers));
      Problem p;
      p.mechanism = b.build();
      p.parameters = p.mechanism->select({"k"});
      p.solver.t_end = 2;
      p.objective.terminal.push_back(
          std::make_shared<OutputTerm>(make_output(*p.mechanism, "B.x"), 1, -1, OutputTerm::Target{}));
      CAPTURE(velocity, from);
      for (const char* method : {"idas-adjoint", "cvodes-forward", "discrete-adjoint"})
        CHECK_NOTHROW(gradient(p, method, p.parameters.values()));
    }
}

TEST_CASE("own paths: nothing is invariant beside a pulse in time") {
  Problem p = moving(Acts::as_it_comes, 50, 3.3);
  take_notices();
  gradient(p, "idas-adjoint", p.parameters.values());
  for (const std::string& text : take_notices()) CHECK_THAT(text, !Catch::Contains("invariant"));
}
