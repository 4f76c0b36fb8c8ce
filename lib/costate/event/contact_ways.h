// What a rigid contact does behind an event, and all ways that several contacts have to do it: there are few, and they
// are gone through (event/impact_ways.cpp, event/contact_modes.cpp).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

namespace costate {

// Impulses, speeds, forces and accelerations of this part of the largest ones in play are rounding.
inline constexpr double kContactRounding = 1e-9;
// Two solutions whose velocities, or accelerations, differ by less are one.
inline constexpr double kSameMotion = 1e-6;
// What leaves more slowly than this part of the largest speed so far lifts too little for infinitely many bounces to be
// followed further.
inline constexpr double kHardlyLifts = 3e-5;
// More ways are not gone through.
inline constexpr std::size_t kMostWays = 1 << 16;

/// Open; closed, which with friction is to stick; closed and sliding. In the expansion of Poisson's law the same with
/// the impulse that is given back and no more, while the gap opens.
enum ContactWay { kOpen, kSticks, kForward, kBackward, kGivenSticks, kGivenForward, kGivenBackward };

inline bool is_given(int way) { return way >= kGivenSticks; }
/// The direction of sliding, or 0.
inline int slides(int way) {
  const int w = is_given(way) ? way - kGivenSticks + kSticks : way;
  return w == kForward ? 1 : w == kBackward ? -1 : 0;
}

/// The largest of two motions, and of what they are apart by: velocities or accelerations, those of `a` first in `b`,
/// of angles at their levers.
struct MotionsApart {
  double size = 0, apart = 0;
};
inline MotionsApart apart_of(const std::vector<double>& a, const double* b, const std::vector<double>& levers) {
  MotionsApart r;
  for (std::size_t i = 0; i < a.size(); ++i) {
    r.size = std::max({r.size, levers[i] * std::abs(a[i]), levers[i] * std::abs(b[i])});
    r.apart = std::max(r.apart, levers[i] * std::abs(a[i] - b[i]));
  }
  return r;
}
/// Whether two such solutions are one; what differs by `rounding` does not differ.
inline bool are_one_motion(const std::vector<double>& a, const double* b, const std::vector<double>& levers,
                           double rounding) {
  const auto [size, apart] = apart_of(a, b, levers);
  return apart <= std::max(kSameMotion * size, rounding);
}

/// How many contacts of a body of so many coordinates determine who bears how much of its weight: two in the plane,
/// three in space.
inline std::size_t determining_contacts(std::size_t coordinates) { return coordinates > 3 ? 3 : 2; }

/// Of contacts that hold one body, more than determine who bears how much of its weight, and slide with different
/// friction, so that its motion is not determined: how many they are, else 0.
template <class Contact, class Friction>
std::size_t sharing_unlike(const std::vector<const Contact*>& closed, const std::vector<int>& ways,
                           const Friction& friction) {
  for (std::size_t c = 0; c < closed.size(); ++c) {
    std::size_t count = 0;
    bool any_slides = false, alike = true;
    const auto& body = closed[c]->force->coordinates();
    for (std::size_t k = 0; k < closed.size(); ++k) {
      if (ways[k] == kOpen || closed[k]->force->coordinates() != body) continue;
      ++count;
      any_slides = any_slides || slides(ways[k]) != 0;
      const double own = friction(*closed[c]), other = friction(*closed[k]);
      alike = alike && std::abs(own - other) <= 1e-12 * (own + other);
    }
    if (ways[c] != kOpen && any_slides && !alike && count > determining_contacts(body.size())) return count;
  }
  return 0;
}

/// Of two solutions whether contacts whose friction falls as sliding begins stick in the first one where they slide in
/// the second, and none the other way round.
template <class Contact, class Falls>
bool rests_more(const std::vector<const Contact*>& closed, const std::vector<int>& ways, const std::vector<int>& other,
                const Falls& falls) {
  bool more = false;
  for (std::size_t c = 0; c < closed.size(); ++c) {
    if (!falls(*closed[c])) continue;
    if (other[c] == kSticks && slides(ways[c]) != 0) return false;
    more = more || (ways[c] == kSticks && slides(other[c]) != 0);
  }
  return more;
}

/// Calls visit(the way of each) for all combinations, those first in which the first options are taken; the last
/// contact changes fastest. False where there are more than kMostWays.
template <class Visit>
bool for_all_ways(const std::vector<std::vector<int>>& options, const Visit& visit) {
  std::size_t count = 1;
  for (const auto& o : options) {
    count *= o.size();
    if (count > kMostWays) return false;
  }
  std::vector<int> ways(options.size());
  for (std::size_t i = 0; i < count; ++i) {
    std::size_t rest = i;
    for (std::size_t c = options.size(); c-- > 0;) {
      ways[c] = options[c][rest % options[c].size()];
      rest /= options[c].size();
    }
    visit(ways);
  }
  return true;
}

}  // namespace costate
