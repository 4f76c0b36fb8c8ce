// Contacts with friction in space that hold a body more than once: two that stick on one body hold the line between
// them twice, four that are closed press on it in ways that three determine. What each of them bears is then decided
// by how they give, and they are taken to give alike: R2_i - epsilon lambda_i in place of R2_i, with 1/epsilon 1e10
// times the mass of the body, of rows along the ground that stick and, of four contacts or more, of gaps.
#pragma once

#include <vector>

#include "costate/assembly/assembly.h"

namespace costate {

class GivingContacts {
 public:
  explicit GivingContacts(const Assembly& assembly);
  /// At the rows that are there, with Phi_q and M; whether they depend on each other is looked at where they change.
  void update(const Assembly& assembly);
  /// epsilon of a row.
  double of(int row) const { return by_row_.empty() ? 0 : by_row_[static_cast<std::size_t>(row)]; }

 private:
  struct SpatialContact {
    int normal;  // its first row; two more along the ground
    int part;    // of the mechanism
  };
  bool is_redundant(const Assembly& assembly, int part) const;

  std::vector<SpatialContact> contacts_;
  std::vector<int> parts_;  // of coordinates
  std::vector<char> there_;
  std::vector<double> by_row_;
};

}  // namespace costate
