// What forces, constraints and costs of one's own do by time alone: a pulse of less than a thousandth of a run that is
// at rest before. No error of an integrator tells of it, so that it would be stepped over by all methods alike.
#include <catch2/catch.hpp>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>

#include "costate/integrator/simulate.h"
#include "costate/kind/body/mass.h"
#include "costate/kind/body/point.h"
#include "costate/kind/lookup.h"
#include "costate/mechanism/builder.h"
#include "costate/sensitivity/method.h"

using namespace costate;

namespace {

constexpr double kMass = 2, kForce = 3, kBegin = 6.1234, kWidth = 5e-3, kEnd = 10;

/// sin(pi (t - begin)/width)^power within the width, and nothing beside it.
template <class S>
S pulse(const S& t, const S& begin, const S& width, int power) {
  using std::pow;
  using std::sin;
  const S part = (t - begin) / width;
  if (value_of(part) < 0 || value_of(part) > 1) return S(0.0);
  return pow(sin(part * S(std::numbers::pi)), power);
}

/// p0 times the pulse, and, if it is held, times the way from p3, where the motion begins.
class Kick final : public ForceOf<Kick> {
 public:
  Kick(int coordinate, std::vector<int> numbers, bool held) : ForceOf("kick", "own"), held_(held) {
    append_coordinates({coordinate});
    append_numbers(numbers);
  }
  template <class S>
  void physics(const S& t, const S* q, const S*, const S*, const S* p, S* Q, S*) const {
    Q[0] = p[0] * pulse(t, p[1], p[2], 2);
    if (held_) Q[0] *= q[0] - p[3];
  }

 private:
  bool held_;
};

class Lift final : public ConstraintOf<Lift> {
 public:
  Lift(int coordinate, std::vector<int> numbers) : ConstraintOf("lift", "own") {
    append_coordinates({coordinate});
    append_numbers(numbers);
  }
  int rows() const override { return 1; }
  std::string row_name(int) const override { return "x"; }
  bool rheonomic() const override { return true; }
  template <class S>
  void physics(const S& t, const S* q, const S* p, S* phi) const {
    phi[0] = q[0] - p[0] * pulse(t, p[1], p[2], 4);
  }
};

/// A push of p0 from p1 to p1 + p2, at once.
class Push final : public ForceOf<Push> {
 public:
  Push(int coordinate, std::vector<int> numbers) : ForceOf("push", "own") {
    append_coordinates({coordinate});
    append_numbers(numbers);
  }
  template <class S>
  void physics(const S& t, const S*, const S*, const S*, const S* p, S* Q, S*) const {
    const double since = value_of(t) - value_of(p[1]);
    Q[0] = since > 0 && since < value_of(p[2]) ? p[0] : S(0.0);
  }
};

/// A spring, shaken as little as makes no difference to the steps, or not at all.
class Pull final : public ForceOf<Pull> {
 public:
  Pull(int coordinate, std::vector<int> numbers, bool shaken) : ForceOf("pull", "own"), shaken_(shaken) {
    append_coordinates({coordinate});
    append_numbers(numbers);
  }
  template <class S>
  void physics(const S& t, const S* q, const S*, const S*, const S* p, S* Q, S*) const {
    using std::sin;
    Q[0] = S(-1e-3) * p[0] * q[0];
    if (shaken_) Q[0] += S(1e-9) * sin(S(10.0) * t);
  }

 private:
  bool shaken_;
};

/// number 0 of three times the pulse times x.
class Look final : public DualCostTerm<Look> {
 public:
  Look(int x, std::vector<int> numbers) : x_(x), numbers_(std::move(numbers)) {}
  template <class S>
  S physics(const CostArguments<S>& at) const {
    return at.numbers[numbers_[0]] * pulse(at.t, at.numbers[numbers_[1]], at.numbers[numbers_[2]], 2) * at.q[x_];
  }
  bool needs_accelerations() const override { return false; }

 private:
  int x_;
  std::vector<int> numbers_;
};

/// A mass on a line, whose velocity is that of the start until something happens.
struct Line {
  Problem problem;
  int x = 0;
  std::vector<int> numbers;
  template <class Add>
  Line(double velocity, const Add& add) {
    MechanismBuilder b;
    add_ground_point(b, "O", 0, 0);
    add_free_point(b, "P", {0, 0, velocity, 0});
    add_mass(b, "m", "P", kMass);
    x = b.coordinate("P.x");
    numbers = {b.add_number("force", kForce), b.add_number("begin", kBegin), b.add_number("width", kWidth),
               b.add_number("from", 0)};
    add(b, *this);
    problem.mechanism = b.build();
    problem.parameters = problem.mechanism->select({"force", "begin", "width"});
    problem.solver.t_end = kEnd;
    problem.solver.rtol = 1e-8;
    problem.solver.atol = 1e-12;
  }
  std::shared_ptr<const Output> output(const std::string& name) { return make_output(*problem.mechanism, name); }
};

const char* const methods[] = {"idas-adjoint", "cvodes-forward", "cvodes-adjoint", "hand-adjoint", "discrete-adjoint"};

/// psi = force f(begin, width) against its closed form: what steps over the pulse would miss is all of it. To a
/// thousandth, as its few steps and absolute tolerances of motions that are this small leave it; of what moves it in
/// time the two sides of the pulse cancel, each of which is psi over the width.
void check(const Problem& problem, double psi, double by_begin, double by_width) {
  constexpr double kWithin = 1e-3;
  for (const char* method : methods) {
    CAPTURE(method);
    const GradientResult g = gradient(problem, method, problem.parameters.values());
    CHECK(g.psi == Approx(psi).epsilon(kWithin));
    CHECK(g.gradient[0] == Approx(psi / kForce).epsilon(kWithin));
    CHECK(g.gradient[1] == Approx(by_begin).margin(kWithin * psi / kWidth));
    CHECK(g.gradient[2] == Approx(by_width).epsilon(kWithin));
  }
}

}  // namespace

TEST_CASE("own courses: a pulse of a force by time is met by steps") {
  Line line(0, [](MechanismBuilder& b, const Line& l) { b.add(std::make_unique<Kick>(l.x, l.numbers, false)); });
  line.problem.objective.terminal.push_back(
      std::make_shared<OutputTerm>(line.output("P.x"), 1, -1, OutputTerm::Target{}));
  // v = F w/(2 m) behind it, as if all of it came at its middle.
  const double v = kForce * kWidth / (2 * kMass), way = kEnd - kBegin - kWidth / 2;
  check(line.problem, v * way, -v, v * way / kWidth - v / 2);
}

TEST_CASE("own courses: a pulse that the start holds at zero") {
  const auto make = [](double most) {
    Line line(0.1, [](MechanismBuilder& b, const Line& l) { b.add(std::make_unique<Kick>(l.x, l.numbers, true)); });
    line.problem.objective.terminal.push_back(
        std::make_shared<OutputTerm>(line.output("P.x"), 1, -1, OutputTerm::Target{}));
    line.problem.solver.max_step_s = most;
    return line.problem;
  };
  const Problem free = make(0), short_steps = make(kWidth / 10);
  const double psi = simulate(short_steps, short_steps.parameters.values()).psi;
  CHECK(psi > 1.002);  // 1 without it
  CHECK(simulate(free, free.parameters.values()).psi == Approx(psi).epsilon(1e-7));
}

TEST_CASE("own courses: a pulse of a constraint and one of a running cost") {
  Line lift(0, [](MechanismBuilder& b, const Line& l) { b.add(std::make_unique<Lift>(l.x, l.numbers)); });
  lift.problem.objective.running.push_back(
      std::make_shared<OutputTerm>(lift.output("P.x"), 1, -1, OutputTerm::Target{}));
  const double lifted = 3 * kForce * kWidth / 8;
  check(lift.problem, lifted, 0, lifted / kWidth);

  Line look(0.1, [](MechanismBuilder&, const Line&) {});
  look.problem.objective.running.push_back(std::make_shared<Look>(look.x, look.numbers));
  const double seen = kForce * kWidth / 2, at = 0.1 * (kBegin + kWidth / 2);
  check(look.problem, seen * at, 0.1 * seen, seen * at / kWidth + 0.05 * seen);
}

TEST_CASE("own courses: a push that begins and ends at once") {
  Line line(0, [](MechanismBuilder& b, const Line& l) { b.add(std::make_unique<Push>(l.x, l.numbers)); });
  line.problem.objective.terminal.push_back(
      std::make_shared<OutputTerm>(line.output("P.x"), 1, -1, OutputTerm::Target{}));
  const auto rho = line.problem.parameters.values();
  const double psi = kForce * kWidth / kMass * (kEnd - kBegin - kWidth / 2);
  for (const char* formulation : {"index1", "baumgarte", "maggi", "index3"}) {
    CAPTURE(formulation);
    line.problem.formulation = formulation;
    CHECK(simulate(line.problem, rho).psi == Approx(psi).epsilon(1e-3));
  }
  // Fixed steps that are longer pass over it and are refused; of one that begins and stays they are as good as long.
  line.problem.formulation = "index3";
  line.problem.solver.integrator = "fixed";
  line.problem.solver.step_s = 0.01;
  CHECK_THROWS_WITH(simulate(line.problem, rho),
                    Catch::Contains("passes over what begins") && Catch::Contains("'own'"));
  std::vector<double> stays = rho;
  stays[2] = 20;
  const double way = kEnd - kBegin;
  CHECK(simulate(line.problem, stays).psi == Approx(kForce * way * way / (2 * kMass)).epsilon(0.01 / way));
}

TEST_CASE("own courses: steps are as long as before where time is not asked for") {
  const auto steps = [](bool held) {
    Line line(0.1, [held](MechanismBuilder& b, const Line& l) { b.add(std::make_unique<Pull>(l.x, l.numbers, held)); });
    return simulate(line.problem, line.problem.parameters.values()).counters.steps;
  };
  CHECK(steps(false) < 100);
  CHECK(steps(true) > 2.3 * 10 * kEnd / (2 * std::numbers::pi));  // some steps in each wave of its 10 rad/s
}
