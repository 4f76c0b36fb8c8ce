// What a discrete step says when it fails: where, by how much, which coordinates and which joints.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "costate/analysis/not_finite.h"
#include "costate/base/error.h"
#include "costate/discrete/discrete_scheme.h"

namespace costate {

namespace {

/// "P2.x (1.2e-03), P3.y (4e-04)": the largest three.
std::string worst(std::vector<std::pair<double, std::string>> entries) {
  std::sort(entries.begin(), entries.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::string text;
  for (std::size_t i = 0; i < std::min<std::size_t>(3, entries.size()); ++i)
    text += fmt::format("{}{} ({:.2g})", i > 0 ? ", " : "", entries[i].second, entries[i].first);
  return text;
}

/// NaN counts as the worst.
double size_of(double x) { return std::isfinite(x) ? std::abs(x) : HUGE_VAL; }

}  // namespace

void DiscreteScheme::check(int bad, const char* what) {
  if (bad >= 0) fail_singular(what, bad);
}

void DiscreteScheme::fail_newton(int iterations, double size) {
  const Mechanism& mech = assembly_.mechanism();
  const auto finite = [](const double* x, int count) {
    return std::all_of(x, x + count, [](double e) { return std::isfinite(e); });
  };
  if (!std::isfinite(size) && finite(r_.q, n_) && finite(v_star_.data(), n_) && finite(r_.z, nz_)) try {
      StateView s = state();
      s.v = v_star_.data();
      require_finite(assembly_, s);
    } catch (const NotFinite& e) {
      throw RunNotFinite(e, {});
    }
  std::vector<std::pair<double, std::string>> corrections, rows;
  for (int i = 0; i < n_; ++i) corrections.emplace_back(size_of(c_.B * rhs_[i]), mech.coordinates()[i].name);
  const auto states = mech.state_names();
  for (int i = 0; i < nz_; ++i) corrections.emplace_back(size_of(c_.G_z * rhs_[n_ + i]), states[i]);
  const auto names = mech.row_names();
  for (int i = 0; i < m_; ++i) rows.emplace_back(size_of(assembly_.phi[i]), names[i]);
  throw SolverError(fmt::format(
      "Newton's iteration of step {} (to t = {:.9g} s, h = {:.4g} s) did not converge: after {} iterations its "
      "corrections are {:.2g} of the coordinates' size, largest in {}{}. A smaller step helps where the motion is "
      "fast; "
      "near singular positions the constraints do not determine it.",
      index_, time(), c_.h, iterations, size, worst(std::move(corrections)),
      m_ > 0 ? "; farthest from closed: " + worst(std::move(rows)) : std::string()));
}

void DiscreteScheme::fail_singular(const std::string& what, int column) {
  const Mechanism& mech = assembly_.mechanism();
  const auto names = mech.row_names();
  const std::string where = index_ == 0 ? fmt::format("{} (t = {:.9g} s)", what, time())
                                        : fmt::format("{} (step {}, t = {:.9g} s)", what, index_, time());
  const ConstraintRank rank = constraint_rank(assembly_, time(), r_.q);
  if (!rank.dependent_rows.empty()) {
    std::vector<std::string> dependent;
    for (const int i : rank.dependent_rows) dependent.push_back(names[i]);
    throw SolverError(
        fmt::format("The equations of index 3 are singular {}: {} of {} constraint rows depend on the "
                    "others ({}). The mechanism has redundant joints or passes a singular position: penalty "
                    "and augmented-lagrangian carry both, maggi the former.",
                    where, dependent.size(), names.size(), fmt::join(dependent, ", ")));
  }
  const auto states = mech.state_names();
  const std::string name = column < 0          ? std::string("?")
                           : column < n_       ? mech.coordinates()[column].name
                           : column < n_ + nz_ ? states[column - n_]
                                               : names[column - n_ - nz_];
  throw SolverError(
      fmt::format("The equations of index 3 are singular {}, at '{}': either nothing holds it, neither "
                  "inertia nor a constraint, or the mechanism passes a singular position.",
                  where, name));
}

}  // namespace costate
