// The directions to slide for each of the ways of several contacts in space, as event/contact_impact.cpp and
// event/contact_modes.cpp go through them.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "costate/event/contact_ways.h"
#include "costate/event/slips_together.h"

namespace costate {

// Of more contacts with friction in space not all ways are gone through.
inline constexpr int kMostInSpace = 5;

class SlipSearch {
 public:
  /// The contacts' ways are those of take().
  SlipSearch(Eigen::MatrixXd response, Eigen::VectorXd rates, std::vector<SlidingContact> contacts)
      : response_(std::move(response)), rates_(std::move(rates)), contacts_(std::move(contacts)) {
    proven_ = has_one_solution(response_, contacts_);
    asked_ = contacts_;
  }

  /// Contact c goes this way; the impulse of its gap is given, or by how much its rate changes.
  void take(std::size_t c, int way, bool given, double normal) {
    SlidingContact& at = contacts_[c];
    at.way = way == kOpen       ? SlidingContact::Way::open
             : slides(way) != 0 ? SlidingContact::Way::slides
                                : SlidingContact::Way::sticks;
    at.given = given;
    at.normal = normal;
    if (at.rows.size() == 2) at.slip = {slides(way), 0};
    if (at.rows.size() == 3 && at.slip.norm() == 0) at.unknown = at.way == SlidingContact::Way::slides;
  }
  std::vector<Slips> slips() {
    const auto looked_for = [](const SlidingContact& c) { return c.unknown; };
    if (guesses_.empty() && std::any_of(contacts_.begin(), contacts_.end(), looked_for)) project();
    SlipsTogether together = slips_together(response_, rates_, contacts_, guesses_);
    starts_ = std::max(starts_, together.starts);
    return std::move(together.found);
  }

  const SlidingContact& contact(std::size_t c) const { return contacts_[c]; }
  /// Whether projections have led to these rates (of all rows, to this tolerance): impulses within all cones that make
  /// them are known then, where those of the rows in force are some of many.
  template <class RateOf>
  bool has_impulses_for(const RateOf& rate_of, double tolerance) {
    project();
    if (projected_.size() == 0) return false;
    for (Eigen::Index i = 0; i < projected_.size(); ++i)
      if (!(std::abs(rate_of(static_cast<int>(i)) - projected_[i]) <= tolerance)) return false;
    return true;
  }
  /// Whether there is one solution and no more.
  bool proven() const { return proven_; }
  /// From how many starts directions of several were looked for, at most; 0 where all are found.
  int starts() const { return starts_; }
  std::string told() const {
    return starts_ == 0 ? "" : fmt::format(" (in directions looked for from {} starts)", starts_);
  }

 private:
  /// Takes its time, and is done where it is asked for.
  void project() {
    if (contacts_.size() < 2 || projected_.size() > 0) return;
    projected_ = rates_by_projection(response_, rates_, asked_);
    for (const Eigen::VectorXd& v : {projected_, rates_}) {
      Slips guess;
      for (const SlidingContact& c : contacts_)
        guess.push_back(c.rows.size() > 2 ? Eigen::Vector2d(v[c.rows[1]], v[c.rows[2]]) : Eigen::Vector2d(0, 0));
      guesses_.push_back(std::move(guess));
    }
  }

  Eigen::MatrixXd response_;
  Eigen::VectorXd rates_;
  std::vector<SlidingContact> contacts_, asked_;  // with the ways that are taken, and as they were given
  std::vector<Slips> guesses_;
  Eigen::VectorXd projected_;
  bool proven_ = false;
  int starts_ = 0;
};

}  // namespace costate
