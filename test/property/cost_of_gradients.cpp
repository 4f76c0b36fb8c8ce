// What gradients cost, in callbacks: an adjoint costs the same for 2 parameters and for 200, forward sensitivities cost
// more with each parameter.
#include <support/models.h>
#include <support/variants.h>

#include <catch2/catch.hpp>

using namespace costate;
using namespace costate::test;

namespace {

constexpr int kBars = 200;

Counters run(const TestModel& model, const std::string& formulation, const std::string& method, int parameters) {
  std::vector<std::string> names;
  for (int i = 0; i < parameters; ++i) names.push_back("m" + std::to_string(1 + i * (kBars / parameters)));
  const Problem p = model.problem(formulation, 1e-4, names);
  const GradientResult r = gradient(p, method, p.parameters.values());
  REQUIRE(r.gradient.size() == static_cast<std::size_t>(parameters));
  return r.counters;
}

}  // namespace

TEST_CASE("cost: an adjoint gradient with 2 and with 200 parameters", "[cost]") {
  const TestModel model = chain(kBars, 0.05);
  REQUIRE(model.mechanism->default_parameters().size() == kBars);
  for (const auto& [formulation, method] :
       {std::pair{"index1", "idas-adjoint"}, {"baumgarte", "cvodes-adjoint"}, {"index2", "idas-adjoint"}}) {
    INFO(formulation << ", " << method);
    const Counters few = run(model, formulation, method, 2), many = run(model, formulation, method, 200);
    const auto same = [](long a, long b) {
      return static_cast<double>(b) == Approx(static_cast<double>(a)).epsilon(0.3);
    };
    // The forward run does not know of parameters at all.
    CHECK(few.steps == many.steps);
    CHECK(few.residuals == many.residuals);
    CHECK(same(few.backward_steps, many.backward_steps));
    CHECK(same(few.backward_residuals, many.backward_residuals));
    CHECK(same(few.backward_jacobians, many.backward_jacobians));
    CHECK(same(few.factorizations, many.factorizations));
    CHECK(few.backward_steps > 0);
  }
}

TEST_CASE("cost: forward sensitivities grow with the number of parameters", "[cost]") {
  // Each parameter brings a linear system of the size of the mechanism and step; what is counted is the right-hand
  // sides of all of them, so the number of columns times the number of evaluations.
  const TestModel model = chain(20, 0.05);
  std::vector<std::string> two = {"m1", "m11"};
  for (const auto& [formulation, method] : {std::pair{"index1", "idas-forward"}, {"baumgarte", "cvodes-forward"}}) {
    INFO(formulation << ", " << method);
    const Problem few = model.problem(formulation, 1e-4, two), many = model.problem(formulation, 1e-4);
    const Counters a = gradient(few, method, few.parameters.values()).counters;
    const Counters b = gradient(many, method, many.parameters.values()).counters;
    CHECK(a.backward_steps == 0);
    CHECK(a.sensitivity_residuals > 0);
    CHECK(20 * b.sensitivity_residuals > 3 * 2 * a.sensitivity_residuals);
  }
}
