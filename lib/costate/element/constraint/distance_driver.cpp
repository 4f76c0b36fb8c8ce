#include "costate/element/constraint/distance_driver.h"

namespace costate {

template class DistanceDriver<PlanarVector>;
template class DistanceDriver<SpatialVector>;

}  // namespace costate
