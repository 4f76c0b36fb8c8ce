// Rows of contacts that give, as the penalty's do, where formulations of exact constraints hold bodies more often than
// it takes. Two contacts that stick on one body hold it twice along the ground; of three gaps in the plane, or four in
// space, normal forces are not determined either. Of bodies that joints link: level/dependent_contacts.h.
#pragma once

#include <algorithm>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/level/dependent_contacts.h"

namespace costate {

class GivingRows {
 public:
  GivingRows() = default;
  /// By the mechanism's own numbers and first positions.
  explicit GivingRows(const Assembly& assembly);

  /// Whether row i holds coordinates that rows which may give hold, too: roundings of their multipliers go into its
  /// own.
  bool beside(int i) const { return !rows_.empty() && (row(i).beside || dependent_.is_of_part(i)); }
  /// Whether row i does as contacts are in the assembly.
  bool gives(int i, const Assembly& assembly) const {
    return !rows_.empty() && (on_one_body(i, assembly) || dependent_.depends(i, assembly));
  }
  /// 1/alpha of one that may.
  double inverse_alpha(int i) const { return row(i).inverse_alpha; }

 private:
  /// The same row of other contacts of the body, of which so many determine what this row does; 0: it never gives.
  struct Row {
    std::vector<int> others = {};
    int too_many = 0;
    double inverse_alpha = 0;
    bool beside = false;
  };
  bool on_one_body(int i, const Assembly& assembly) const {
    return row(i).too_many > 0 && std::count_if(row(i).others.begin(), row(i).others.end(),
                                                [&](int r) { return assembly.is_there(r); }) >= row(i).too_many;
  }
  const Row& row(int i) const { return rows_[static_cast<std::size_t>(i)]; }
  std::vector<Row> rows_;  // none where none may give
  DependentContacts dependent_;
};

}  // namespace costate
