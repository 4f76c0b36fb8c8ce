// Contacts that hold bodies which joints link more often than it takes: two bodies welded to each other on four feet, a
// trolley of two axles, a robot with both soles on the ground. Which of their rows depend on others is seen where
// contacts are as they are for the first time, by the rank of the part's rows there. Rows that one contact shares with
// joints alone stay as they are: a foot beside a rail bears what nothing tells, and such a matrix is singular.
#pragma once

#include <map>
#include <vector>

#include "costate/assembly/assembly.h"

namespace costate {

class DependentContacts {
 public:
  DependentContacts() = default;
  explicit DependentContacts(const Mechanism& mechanism);

  /// Whether row i is of such a part, a contact's or a joint's.
  bool is_of_part(int i) const { return part_of(i) >= 0; }
  /// Whether row i, a contact's, depends on others, with the assembly's Phi_q, as contacts are.
  bool depends(int i, const Assembly& assembly) const;

 private:
  struct Part {
    std::vector<int> rows = {}, coordinates = {};
    std::vector<std::vector<int>> contacts = {};        // of each its rows, by their places in `rows`
    mutable std::vector<char> there = {}, depend = {};  // of `rows`, at the last look
    mutable std::map<std::vector<char>, std::vector<char>> known = {};
  };
  struct Place {
    int part = -1, at = -1;  // at: among the part's rows
  };
  int part_of(int i) const { return places_.empty() ? -1 : places_[static_cast<std::size_t>(i)].part; }
  static std::vector<char> find(const Part& part, const Assembly& assembly);

  std::vector<Part> parts_;
  std::vector<Place> places_;  // of all rows; empty where there are no such parts
};

}  // namespace costate
