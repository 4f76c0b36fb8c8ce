// Contacts that rest along the ground in space, and may begin to slide where they are: in the direction of the
// acceleration that friction against it leaves them (lib/README.md (19.9), of forces and accelerations).
#pragma once

#include <cmath>
#include <vector>

#include "costate/event/contact_gap.h"
#include "costate/event/impact.h"
#include "costate/event/slip_search.h"
#include "costate/event/spatial_slip.h"

namespace costate {

/// At s, where all contacts are open and accelerations are a. `from_rest`: those that rest; of others in space that
/// slide the direction is that of w, with the states z. Impact serves for the response of their rows.
template <class Contact>
SlipSearch search_from_rest(Impact& impact, const Assembly& assembly, const StateView& s, const double* a,
                            const double* z, const std::vector<const Contact*>& closed,
                            const std::vector<char>& from_rest) {
  std::vector<ImpactRow> rows;
  std::vector<SlidingContact> contacts;
  std::vector<double> rates;
  for (std::size_t c = 0; c < closed.size(); ++c) {
    const Contact& of = *closed[c];
    SlidingContact at;
    at.friction = contact_number(of, of.contact->friction_number(), assembly);
    double w[2] = {};
    for (int r = 0; r < of.contact->row_count(); ++r) {
      at.rows.push_back(static_cast<int>(rows.size()));
      rows.push_back({of.force, of.contact, r, false, false});
      const Taylor2 row = row_of(*of.force, *of.contact, r, s, assembly, a);
      rates.push_back(row.c2);
      (r == 0 ? at.normal : at.along[r - 1]) = -row.c2;
      if (r > 0 && slides_in_space(of)) w[r - 1] = row.c1 + z[of.sliding_state + r];
    }
    if (slides_in_space(of) && !from_rest[c])
      if (const double size = std::hypot(w[0], w[1]); size > 0) at.slip = {w[0] / size, w[1] / size};
    contacts.push_back(std::move(at));
  }
  impact.prepare(s, rows);
  return {impact.response(), Eigen::Map<const Eigen::VectorXd>(rates.data(), static_cast<Eigen::Index>(rates.size())),
          std::move(contacts)};
}

}  // namespace costate
