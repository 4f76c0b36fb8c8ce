#include "costate/level/giving_rows.h"

#include <cmath>
#include <map>
#include <set>

#include "costate/element/switched_rows.h"
#include "costate/level/penalty_weight.h"

namespace costate {

namespace {
// Of what the penalty gives: a body that rests creeps by some 1e-11 of what its weight would do to it, and shares of
// friction are known to 1e-5.
constexpr double kGives = 1e-2;
}  // namespace

GivingRows::GivingRows(const Assembly& assembly) {
  const Mechanism& mech = assembly.mechanism();
  const auto& constraints = mech.constraints();
  if (std::count_if(constraints.begin(), constraints.end(), [](const auto& c) { return has_switched_rows(*c); }) < 2)
    return;
  std::map<std::vector<int>, std::vector<std::size_t>> on_body;
  for (std::size_t c = 0; c < constraints.size(); ++c)
    if (has_switched_rows(*constraints[c])) on_body[constraints[c]->coordinates()].push_back(c);
  dependent_ = DependentContacts(mech);

  std::vector<Row> rows(static_cast<std::size_t>(assembly.m()));
  const auto row_of = [&](std::size_t c, int i) -> Row& {
    return rows[static_cast<std::size_t>(mech.row_offsets()[c] + i)];
  };
  std::set<int> held;  // by rows that may give
  for (const auto& [body, contacts] : on_body)
    for (const std::size_t c : contacts)
      for (int i = 0; i < constraints[c]->rows(); ++i) {
        Row& row = row_of(c, i);
        for (const std::size_t other : contacts)
          if (other != c && i < constraints[other]->rows()) row.others.push_back(mech.row_offsets()[other] + i);
        const int determine = i > 0 ? 1 : body.size() > 3 ? 3 : 2;
        if (static_cast<int>(row.others.size()) >= determine) row.too_many = determine;
        if (row.too_many > 0 || dependent_.is_of_part(mech.row_offsets()[c] + i)) held.insert(body.begin(), body.end());
      }
  if (held.empty()) return;
  Assembly first(assembly.mechanism_ptr(), ParameterSelection{});
  const std::vector<double> q = mech.first_positions();
  StateView s;
  s.q = s.v = q.data();
  first.calc_mass(s);
  // By the body's own mass: rows of Euler parameters, whose inertias are of another unit, have no say.
  for (const auto& [body, contacts] : on_body) {
    double mass = 0;
    for (const int j : body)
      if (const auto at = first.square().find(j, j);
          at >= 0 && mech.coordinates()[static_cast<std::size_t>(j)].unit == "m")
        mass = std::max(mass, std::abs(first.M[static_cast<std::size_t>(at)]));
    const double weight = mass > 0 ? kPenaltyStiffness * mass : default_penalty_weight(assembly.mechanism_ptr());
    for (const std::size_t c : contacts)
      for (int i = 0; i < constraints[c]->rows(); ++i) row_of(c, i).inverse_alpha = kGives / weight;
  }
  for (std::size_t c = 0; c < constraints.size(); ++c) {
    const std::vector<int>& own = constraints[c]->coordinates();
    if (std::any_of(own.begin(), own.end(), [&](int j) { return held.contains(j); }))
      for (int i = 0; i < constraints[c]->rows(); ++i) row_of(c, i).beside = true;
  }
  rows_ = std::move(rows);
}

}  // namespace costate
