#include "costate/assembly/rolling_rows.h"

#include <fmt/format.h>

#include "costate/base/error.h"
#include "costate/element/switched_rows.h"

namespace costate {

namespace {
/// Calls visit(constraint, its rows' switches, first row) for what has rows without a place.
template <class Visit>
void for_each_without_place(const Assembly& assembly, const Visit& visit) {
  const Mechanism& mech = assembly.mechanism();
  for (const std::size_t c : assembly.constraints_without_place())
    visit(*mech.constraints()[c], dynamic_cast<const SwitchedRows&>(*mech.constraints()[c]), mech.row_offsets()[c]);
}

template <class Which>
std::vector<int> rows_that(const Assembly& assembly, const Which& which) {
  std::vector<int> rows;
  for_each_without_place(assembly, [&](const Constraint& e, const SwitchedRows& switched, int first) {
    for (int i = 0; i < e.rows(); ++i)
      if (which(switched, i) && assembly.is_there(first + i)) rows.push_back(first + i);
  });
  return rows;
}
}  // namespace

std::vector<int> rolling_rows(const Assembly& assembly) {
  return rows_that(assembly, [](const SwitchedRows& switched, int i) { return !switched.is_integrable(i); });
}

std::vector<int> rows_without_place(const Assembly& assembly) {
  return rows_that(assembly, [](const SwitchedRows& switched, int i) { return !switched.has_place(i); });
}

void refuse_rolling(const Assembly& assembly, const std::string& what) {
  const std::vector<int> rows = rolling_rows(assembly);
  if (rows.empty()) return;
  throw CapabilityError(fmt::format(
      "{} knows no rows of velocities alone, as '{}' of a sphere that rolls is one: its places depend on the way. Let "
      "it start open or sliding, or take kind = \"compliant\".",
      what, assembly.mechanism().row_names()[static_cast<std::size_t>(rows.front())]));
}

void add_rolling_rates(Assembly& assembly, const StateView& s, std::vector<double>& r2_v) {
  const SparsePattern& pattern = assembly.jacobian();
  for_each_without_place(assembly, [&](const Constraint& e, const SwitchedRows& switched, int first) {
    bool rolls = false;  // what sticks wherever it is has no twist
    for (int i = 0; i < e.rows(); ++i) rolls = rolls || !switched.is_integrable(i);
    if (!rolls) return;
    const auto& q = e.coordinates();
    Eigen::MatrixXd twist = Eigen::MatrixXd::Zero(e.rows(), static_cast<Eigen::Index>(q.size()));
    LocalMatrix of(twist.data(), twist.rows(), twist.cols());
    switched.calc_twist(assembly.gather(e, 0, s), of);
    for (int i = 0; i < e.rows(); ++i)
      for (std::size_t j = 0; j < q.size(); ++j)
        if (!switched.is_integrable(i) && assembly.is_there(first + i))
          r2_v[static_cast<std::size_t>(pattern.find(first + i, q[j]))] += twist(i, static_cast<Eigen::Index>(j));
  });
}

std::vector<double> rolling_twist(Assembly& assembly, const StateView& s) {
  if (rolling_rows(assembly).empty()) return {};
  std::vector<double> twist(assembly.jacobian().row.size(), 0);
  add_rolling_rates(assembly, s, twist);
  return twist;
}

}  // namespace costate
