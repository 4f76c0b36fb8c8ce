#include "costate/assembly/rest_region.h"

namespace costate {

namespace {
// Where a force was found to act, it is not asked as many times.
constexpr int kPatience = 8;
}  // namespace

RestRegion::RestRegion(const Force& force, int first_state) : force_(force) {
  for (const int k : force.states_that_wake()) awake_.push_back(first_state + k);
}

bool RestRegion::find(const LocalState& s) {
  double slopes[kMaxLocal] = {};
  distance_ = force_.calc_rest(s, slopes);
  if (!(distance_ > 0)) {
    patience_ = kPatience;
    return false;
  }
  along_.clear();
  const auto& c = force_.coordinates();
  for (std::size_t i = 0; i < c.size(); ++i)
    if (slopes[i] > 0) along_.push_back({c[i], slopes[i], s.q[i]});
  return true;
}

}  // namespace costate
