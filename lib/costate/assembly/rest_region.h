// Where a force rests: a region about one look at it, in which it and all its derivatives vanish. Within the region
// nothing of the force is evaluated, and a step that stays there needs no look at its gaps: a contact out of reach
// costs the comparison of a few coordinates.
#pragma once

#include <cmath>
#include <vector>

#include "costate/element/element.h"

namespace costate {

class RestRegion {
 public:
  /// `first_state`: of the force, among all.
  RestRegion(const Force& force, int first_state);
  /// Forgets what it knows: for other numbers.
  void clear() { distance_ = 0; }

  /// Whether the force rests at (q, z), as far as is known.
  bool holds(const double* q, const double* z) const {
    if (!(distance_ > 0)) return false;
    for (const int k : awake_)
      if (z[k] > 0) return false;
    return way(q) < distance_;
  }
  /// Whether to look anew: of a force that acts, at one evaluation of several.
  bool is_due() { return patience_ == 0 || --patience_ == 0; }
  /// Looks anew, about a state of the force; whether it rests there.
  bool find(const LocalState& s);

  /// How far from the centre q is: the gap has changed by no more.
  double way(const double* q) const {
    double sum = 0;
    for (const Along& x : along_) sum += x.slope * std::abs(q[x.coordinate] - x.centre);
    return sum;
  }
  double distance() const { return distance_; }
  /// How fast the gap changes at most.
  double speed(const double* v) const {
    double sum = 0;
    for (const Along& x : along_) sum += x.slope * std::abs(v[x.coordinate]);
    return sum;
  }

 private:
  struct Along {
    int coordinate;
    double slope, centre;
  };
  const Force& force_;
  std::vector<int> awake_;  // states with which it acts
  std::vector<Along> along_;
  double distance_ = 0;  // 0: not known
  int patience_ = 0;
};

}  // namespace costate
