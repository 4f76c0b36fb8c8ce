// What a user of the library puts together and cannot be: costs without what they are of, formulations of a name that
// there is.
#include <catch2/catch.hpp>
#include <memory>
#include <string>

#include "costate/base/error.h"
#include "costate/element/law/scalar_law.h"
#include "costate/formulation/formulation.h"
#include "costate/kind/body/mass.h"
#include "costate/kind/body/point.h"
#include "costate/mechanism/builder.h"
#include "costate/objective/objective.h"

using namespace costate;
using Catch::Contains;

TEST_CASE("own problems: costs that cannot be") {
  MechanismBuilder builder;
  add_free_point(builder, "P", {1, 0, 0, 0});
  add_mass(builder, "m", "P", 2);
  const auto mechanism = builder.build();
  std::shared_ptr<const Output> x = make_output(*mechanism, "P.x");
  CHECK_THROWS_WITH(OutputTerm(nullptr, 1, -1, {}), Contains("no output"));
  CHECK_THROWS_WITH(OutputTerm(x, 3, -1, {}), Contains("the power 3"));
  CHECK_THROWS_WITH(OutputTerm(x, 1, -1, OutputTerm::Target{std::make_shared<PolynomialLaw>(2), {0}, nullptr}),
                    Contains("a law of 2 numbers, and 1 are given"));
}

TEST_CASE("own formulations: a name that there is") {
  Formulation f;
  f.name = "index1";
  CHECK_THROWS_WITH(RegisterFormulation(f), Contains("'index1' already"));
}
