#include "costate/base/notice.h"

#include <algorithm>
#include <utility>

namespace costate {

namespace {
// An optimization may run for days: what it says more than this often is the same again at other times.
constexpr std::size_t kMost = 100;
thread_local std::vector<std::string> kept;
}  // namespace

void notice(const std::string& sentence) {
  if (kept.size() < kMost && std::find(kept.begin(), kept.end(), sentence) == kept.end()) kept.push_back(sentence);
}

std::vector<std::string> take_notices() { return std::exchange(kept, {}); }

}  // namespace costate
