// Why a KKT matrix cannot be factored.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "costate/analysis/not_finite.h"
#include "costate/analysis/start.h"
#include "costate/base/error.h"
#include "costate/level/acceleration_level.h"

namespace costate {

namespace {
bool by_size(double a, double b) { return std::abs(a) < std::abs(b); }
}  // namespace

void AccelerationLevel::singular(int column) const {
  const Mechanism& mech = assembly_.mechanism();
  require_finite_partials(assembly_, point_.t());
  Assembly probe(assembly_.mechanism_ptr(), ParameterSelection{});
  probe.switch_rows(state().z);
  const ConstraintRank rank = constraint_rank(probe, point_.t(), point_.values());
  const auto rows = mech.row_names();
  if (!rank.dependent_rows.empty()) {
    std::vector<std::string> names;
    for (int i : rank.dependent_rows) names.push_back(rows[i]);
    if (stabilization_.inverse_alpha > 0)
      throw SolverError(fmt::format(
          "The accelerations at t = {:.9g} s are not determined: {} of {} constraint rows depend on the others ({}), "
          "and the weight that is to carry them (alpha = {:.2g}) is lost in rounding beside the masses. Give masses in "
          "a larger unit, or remove what is redundant{}.",
          point_.t(), names.size(), rows.size(), fmt::join(names, ", "), 1 / stabilization_.inverse_alpha,
          assembly_.has_switched_rows() ? "" : ", or take maggi"));
    throw SolverError(fmt::format(
        "The accelerations at t = {:.9g} s are not determined: {} of {} constraint rows depend on the others ({}). "
        "The mechanism has redundant joints or passes a singular configuration: penalty and augmented-lagrangian carry "
        "both, maggi the former.",
        point_.t(), names.size(), rows.size(), fmt::join(names, ", ")));
  }
  const std::string where = column < assembly_.n() ? mech.coordinates()[column].name : rows[column - assembly_.n()];
  if (const int c = column; c < assembly_.n())
    if (const auto k = assembly_.square().find(c, c); k >= 0 && assembly_.M[static_cast<std::size_t>(k)] > 0)
      throw SolverError(
          fmt::format("The accelerations at t = {:.9g} s are not determined: the inertia of '{}', {:.3g}, is lost in "
                      "rounding beside "
                      "the constraints' entries of {:.3g}. Give masses and lengths in smaller units (g, mm: forces in "
                      "their units), "
                      "or take maggi or penalty.",
                      point_.t(), where, assembly_.M[static_cast<std::size_t>(k)],
                      assembly_.phi_q.empty()
                          ? 0.0
                          : std::abs(*std::max_element(assembly_.phi_q.begin(), assembly_.phi_q.end(), by_size))));
  throw SolverError(
      fmt::format("The accelerations at t = {:.9g} s are not determined: '{}' has neither inertia nor a "
                  "constraint that fixes it. Give it mass, or constrain it.",
                  point_.t(), where));
}

}  // namespace costate
