// Forces and costs of one's own that jump along a motion: dual numbers do not see what the instant depends on, and all
// methods would agree on a gradient without it. What has a kink, is steep or is switched at a given time is let be.
#include <catch2/catch.hpp>
#include <cmath>
#include <memory>
#include <string>

#include "costate/base/error.h"
#include "costate/base/library_class.h"
#include "costate/element/force/axial_force.h"
#include "costate/integrator/simulate.h"
#include "costate/kind/body/mass.h"
#include "costate/kind/body/point.h"
#include "costate/kind/lookup.h"
#include "costate/mechanism/builder.h"
#include "costate/sensitivity/method.h"

using namespace costate;
using Catch::Contains;

namespace {

enum class Brake { jumps, small_jump, bends, steep, at_time, at_number, smooth };

/// p0 times what the kind says at x = p1, against x.
class Brakes final : public ForceOf<Brakes> {
 public:
  Brakes(int coordinate, std::vector<int> numbers, Brake kind) : ForceOf("brakes", "own"), kind_(kind) {
    append_coordinates({coordinate});
    append_numbers(numbers);
  }
  template <class S>
  void physics(const S& t, const S* q, const S*, const S*, const S* p, S* Q, S*) const {
    using std::tanh;
    const S x = q[0] - p[1];
    const bool beyond = value_of(x) > 0;
    switch (kind_) {
      case Brake::jumps:
        Q[0] = beyond ? -p[0] : S(0.0);
        break;
      case Brake::small_jump:
        Q[0] = -q[0] * q[0] * p[0] - (beyond ? S(1e-3) * p[0] : S(0.0));
        break;
      case Brake::bends:
        Q[0] = beyond ? -p[0] * x : S(0.0);
        break;
      case Brake::steep:
        Q[0] = -p[0] * tanh(x * S(1e3));
        break;
      case Brake::at_time:
        Q[0] = value_of(t) > 0.4321 ? -p[0] : S(0.0);
        break;
      case Brake::at_number:
        Q[0] = value_of(t - p[1]) > 0 ? -p[0] : S(0.0);
        break;
      case Brake::smooth:
        Q[0] = -p[0] * x;
        break;
    }
  }

 private:
  Brake kind_;
};

/// -k (x - x0), and 0 of what is shorter.
struct RopeLaw {
  static constexpr int states = 0;
  bool jumps;
  template <class S, class P>
  void operator()(const S&, const S& x, const S&, const S*, const P* p, S& force, S*) const {
    const S e = x - S(p[1]);
    force = value_of(e) < 0 ? S(0.0) : jumps ? S(p[0]) : S(p[0]) * e;
  }
  double potential_energy(double, const double*) const { return 0; }
};

/// 1 beyond x = 0.5.
class Beyond final : public DualCostTerm<Beyond> {
 public:
  Beyond(int x, bool jumps) : x_(x), jumps_(jumps) {}
  template <class S>
  S physics(const CostArguments<S>& at) const {
    const S x = at.q[x_] - S(0.5);
    return value_of(x) < 0 ? S(0.0) : jumps_ ? S(1.0) : x;
  }
  bool needs_accelerations() const override { return false; }

 private:
  int x_;
  bool jumps_;
};

/// A mass of 2 kg that moves along x at 1 m/s for a second; w is where something happens.
struct Sliding {
  Problem problem;
  int x = 0;
  template <class Add>
  explicit Sliding(const Add& add) {
    MechanismBuilder b;
    add_ground_point(b, "O", 0, 0);
    add_free_point(b, "P", {0.01, 0, 1, 0});
    add_mass(b, "m", "P", 2);
    x = b.coordinate("P.x");
    add(b, x, std::vector<int>{b.add_number("k", 1.5), b.add_number("w", 0.4)});
    problem.mechanism = b.build();
    problem.parameters = problem.mechanism->select({"k", "w"});
    problem.solver.t_end = 1;
  }
};

const char* const methods[] = {"idas-adjoint", "cvodes-forward", "hand-adjoint", "discrete-adjoint"};

}  // namespace

TEST_CASE("own jumps: a force that jumps as the motion comes to a place has no gradient in silence") {
  const auto with = [](Brake kind) {
    return Sliding([kind](MechanismBuilder& b, int x, const std::vector<int>& numbers) {
      b.add(std::make_unique<Brakes>(x, numbers, kind));
    });
  };
  for (const Brake kind : {Brake::jumps, Brake::small_jump, Brake::at_number}) {
    CAPTURE(static_cast<int>(kind));
    Sliding s = with(kind);
    s.problem.objective.running.push_back(std::make_shared<Beyond>(s.x, false));
    const auto rho = s.problem.parameters.values();
    CHECK_NOTHROW(simulate(s.problem, rho));
    for (const char* method : methods)
      CHECK_THROWS_WITH(gradient(s.problem, method, rho),
                        Contains("The force of 'brakes.own' jumps") && Contains("differences"));
    if (kind == Brake::jumps) continue;  // of which a fixed step has no solution
    s.problem.formulation = "index3";
    s.problem.solver.integrator = "fixed";
    s.problem.solver.step_s = 1e-3;
    CHECK_THROWS_WITH(gradient(s.problem, "discrete-adjoint", rho), Contains("The force of 'brakes.own' jumps"));
  }
  for (const Brake kind : {Brake::bends, Brake::steep, Brake::at_time, Brake::smooth}) {
    CAPTURE(static_cast<int>(kind));
    Sliding s = with(kind);
    s.problem.objective.running.push_back(std::make_shared<Beyond>(s.x, false));
    for (const char* method : methods) CHECK_NOTHROW(gradient(s.problem, method, s.problem.parameters.values()));
  }
}

TEST_CASE("own jumps: a law of one's own in an element of the library") {
  CHECK_FALSE(is_wholly_of_library(typeid(AxialForce<RopeLaw>)));
  CHECK(is_wholly_of_library(typeid(OutputTerm)));
  for (const bool jumps : {true, false}) {
    Sliding s([jumps](MechanismBuilder& b, int, const std::vector<int>& numbers) {
      b.add(std::make_unique<AxialForce<RopeLaw>>("rope", "own", RopeLaw{jumps}, numbers,
                                                  find_line(b, "rope.own", "O", "P")));
    });
    s.problem.objective.running.push_back(std::make_shared<Beyond>(s.x, false));
    for (const char* method : methods) {
      if (jumps)
        CHECK_THROWS_WITH(gradient(s.problem, method, s.problem.parameters.values()), Contains("'rope.own' jumps"));
      else
        CHECK_NOTHROW(gradient(s.problem, method, s.problem.parameters.values()));
    }
  }
}

TEST_CASE("own jumps: a running cost that jumps") {
  for (const bool jumps : {true, false}) {
    Sliding s([](MechanismBuilder& b, int x, const std::vector<int>& numbers) {
      b.add(std::make_unique<Brakes>(x, numbers, Brake::smooth));
    });
    s.problem.objective.running.push_back(std::make_shared<Beyond>(s.x, jumps));
    for (const char* method : methods) {
      if (jumps)
        CHECK_THROWS_WITH(gradient(s.problem, method, s.problem.parameters.values()),
                          Contains("The running cost's term 0 jumps"));
      else
        CHECK_NOTHROW(gradient(s.problem, method, s.problem.parameters.values()));
    }
  }
}
