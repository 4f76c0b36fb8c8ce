#include "costate/element/constraint/distance_driver.h"

namespace costate {

DistanceDriver::DistanceDriver(std::string kind, std::string name, PlanarVector d,
                               std::shared_ptr<const ScalarLaw> law, const std::vector<int>& law_numbers)
    : ConstraintOf(std::move(kind), std::move(name)), d_(std::move(d)), law_(std::move(law)) {
  append_coordinates(d_.coordinates());
  append_numbers(d_.numbers());
  append_numbers(law_numbers);
}

}  // namespace costate
