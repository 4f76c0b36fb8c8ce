// Linked with the tool's own objects into a second program for the tests of `costate check`: gradient methods with
// mistakes of the kinds that happen, registered as any method is.
#include <limits>

#include "costate/base/error.h"
#include "costate/sensitivity/method.h"

namespace costate {
namespace {

/// idas-adjoint with a mistake made in its result.
template <class Mistake>
SensitivityMethod method(const char* name, Mistake mistake) {
  return {name, "idas-adjoint with a mistake, for tests", SensitivityMethod::Needs::dae,
          [mistake](const Problem& problem, const std::vector<double>& rho) {
            GradientResult r = gradient(problem, "idas-adjoint", rho);
            mistake(r);
            return r;
          }};
}

const RegisterSensitivityMethod wrong(
    method("wrong-adjoint", [](GradientResult& r) { r.gradient.back() *= 1.0002; }));
const RegisterSensitivityMethod wrong_cost(method("wrong-cost", [](GradientResult& r) { r.psi *= 1.001; }));
// In the first entry, so that a later good one must not hide it.
const RegisterSensitivityMethod not_a_number(method("nan-adjoint", [](GradientResult& r) {
  r.gradient.front() = std::numeric_limits<double>::quiet_NaN();
}));
const RegisterSensitivityMethod failing(method("failing-adjoint", [](GradientResult&) {
  throw SolverError("The backward run failed at t = 1.25 s, as this test wants.");
}));
const RegisterSensitivityMethod right(method("right-adjoint", [](GradientResult&) {}));

}  // namespace
}  // namespace costate
