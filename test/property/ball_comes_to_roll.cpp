// A ball that is thrown with spin slides until it rolls: as the slip, which nothing but the throw has begun, comes to
// its end, its direction turns with 1/|w|. Gradients against an independent program's.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <string>

#include "costate/base/notice.h"
#include "costate/sensitivity/hessian.h"
#include "costate/sensitivity/method.h"
#include "support/cases.h"

using namespace costate;

namespace {

struct Thrown {
  double friction, psi, gradient[3];
};
// Newton and Euler's equations in the ball's velocities, by DOP853 of scipy 1.10 at rtol 1e-13 with the stop as an
// event, the gradient by extrapolated differences: to the digits that steps of 1e-3 and 5e-4 agree to.
const Thrown kThrown[] = {{0.3, 1.6239207343615, {-0.44165675, -0.00471621, -1.84033899}},
                          {0.30045, 1.6237230018092, {-0.43715865, -0.00469739, -1.83869467}},
                          {0.3032, 1.6225580993286, {-0.41019081, -0.00458456, -1.82883000}},
                          {0.3063, 1.6213322973989, {-0.38082830, -0.00446173, -1.81807668}}};

Problem thrown(double friction) {
  return problem_of_case("ball_comes_to_roll", {fmt::format("contact.floor.friction_coefficient={}", friction)});
}

}  // namespace

// Gradients were 4 times as large, or of the other sign, and up to 7 times farther off than they said.
TEST_CASE("ball that comes to roll: gradients by all ways back, with the errors that they state", "[events]") {
  struct Way {
    const char *formulation, *method, *integrator;
  };
  for (const Way& way : {Way{"index1", "cvodes-adjoint", ""}, Way{"baumgarte", "cvodes-adjoint", ""},
                         Way{"baumgarte", "idas-adjoint", ""}, Way{"baumgarte", "hand-adjoint", ""},
                         Way{"baumgarte", "discrete-tangent", "dop853"}, Way{"baumgarte", "discrete-adjoint", "dop853"},
                         Way{"index2", "discrete-adjoint", "radau5"}})
    for (const Thrown& right : kThrown) {
      Problem p = thrown(right.friction);
      p.formulation = way.formulation;
      p.solver.integrator = way.integrator;
      p.solver.confirm = true;
      CAPTURE(way.formulation, way.method, right.friction);
      const GradientResult r = gradient(p, way.method, p.parameters.values());
      REQUIRE(r.known_error);
      CHECK(std::abs(r.psi - right.psi) <= 1e3 * p.solver.rtol);
      for (std::size_t j = 0; j < 3; ++j) {
        CAPTURE(j);
        const double off = std::abs(r.gradient[j] - right.gradient[j]);
        CHECK(off <= 3 * r.known_error->gradient[j] + 1e-8);  // the oracle's last digit
        // Explicit steps are up to 5e-5 off, as they say.
        CHECK(off <= (way.integrator == std::string("dop853") ? 1e-4 : 5e-6) * std::abs(right.gradient[j]) + 1e-8);
      }
      take_notices();
    }
}

// 1.2e-4 of its entries were what a direction known to rtol |v|/|w| made of the stop, all of one sign, the products as
// symmetric as any.
TEST_CASE("ball that comes to roll: the Hessian, through the last of the slip", "[events]") {
  // The same program's, by extrapolated differences of such gradients: to some 2e-6.
  const Eigen::Matrix3d right = (Eigen::Matrix3d() << 10.0228321, 0.0419302237, 3.66360764,  //
                                 0.0419302237, 4.18863230e-4, 0.0258284492,                  //
                                 3.66360764, 0.0258284492, 1.85749980)
                                    .finished();
  for (const char* formulation : {"index1", "baumgarte"}) {
    Problem p = thrown(0.3);
    p.formulation = formulation;
    p.solver.integrator.clear();
    p.solver.confirm = false;
    CAPTURE(formulation);
    const Hessian h = hessian(p, p.parameters.values());
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        CAPTURE(i, j, h.matrix(i, j));
        CHECK(std::abs(h.matrix(i, j) - right(i, j)) <= 1e-5 * std::abs(right(i, j)));
      }
    take_notices();
  }
}
