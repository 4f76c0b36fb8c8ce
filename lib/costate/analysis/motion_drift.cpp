// How far the constraints are torn along a motion, and what the watch has to say in the end.
#include <fmt/format.h>

#include <cmath>
#include <set>
#include <sstream>

#include "costate/analysis/motion_watch.h"
#include "costate/base/error.h"

namespace costate {

void MotionWatch::look_at_drift(double t, const double* v) {
  for (int i = 0; i < assembly_.n(); ++i) speed_ = std::max(speed_, std::abs(v[i]) / (metric_[i] ? length_ : 1.0));
  std::vector<double>& phid = phid_;
  phid.assign(assembly_.phi_t.begin(), assembly_.phi_t.end());
  add_product(assembly_.jacobian(), assembly_.phi_q.data(), 1, v, phid.data());
  for (int i = 0; i < assembly_.m(); ++i) {
    const double l = row_length_[i], size = std::sqrt(length_part_[i] * l * l + angle_part_[i]);
    if (!(size > 0)) continue;
    const double off = std::abs(assembly_.phi[i]) / size, rate = std::abs(phid[i]) / size;
    if (!std::isfinite(off) || !std::isfinite(rate))
      throw SolverError(fmt::format("Constraint row '{}' is not finite at t = {:.9g} s.", rows_[i], t));
    const double unit = metric_row_[i] ? l : 1.0;
    if (off > worst_position_.relative) worst_position_ = {t, off, off * unit, i};
    if (rate > worst_velocity_.relative) {
      worst_velocity_ = {t, rate, rate * unit, i};
      worst_speed_ = speed_;
    }
  }
  if (worst_position_.relative > drift_error_) torn(worst_position_);
}

namespace {
/// Those that hold their constraints, but for the one that does not here.
std::string that_hold(const std::string& running) {
  std::istringstream names("baumgarte index2 maggi");
  std::string all;
  for (std::string name; names >> name;)
    if (running != name) all += fmt::format("{}{}", all.empty() ? "" : " or ", name);
  return all;
}
}  // namespace

void MotionWatch::torn(const Drift& d) const {
  throw SolverError(fmt::format(
      "The constraints no longer hold at t = {:.9g} s: row '{}' is off by {}, {:.2g} % of its own length, by "
      "formulation '{}' at "
      "rtol {:g}; {:.1g} % is the most that is let pass. {}",
      d.t, rows_[d.row], with_unit(d.row, d.length), 100 * d.relative, settings_.formulation, settings_.rtol,
      100 * drift_error_,
      settings_.weighted
          ? "The mechanism locks there, or its weights are too small: see the same run by baumgarte or maggi."
          : "Take a smaller rtol, or a formulation that holds its constraints: " + that_hold(settings_.formulation) +
                "."));
}

std::optional<std::string> MotionWatch::without_derivative() const {
  if (const auto met = lines_.met())
    return *met +
           ". The instant at which it does is in no derivative. Let the spring's natural length be zero, or its ends "
           "pass "
           "each other at a distance; the method 'differences' tells what psi does.";
  if (auto met = jumps_.met()) return met;
  if (auto met = formulas_.met()) return met;
  return travelled_.met(assembly_);
}

std::vector<std::string> MotionWatch::warnings() const {
  std::vector<std::string> out = near_dependent_;
  out.insert(out.end(), jumps_.told().begin(), jumps_.told().end());
  if (const auto text = jump())
    out.push_back(*text +
                  ". Steps that pass it are less accurate, and derivatives do not exist there. Let the spring's "
                  "natural length be zero, or its ends pass each other at a distance.");
  if (!events_.empty()) {
    std::set<std::string> rows;
    std::vector<double> times;
    double nearest = 1;
    for (const RankEvent& e : events_) {
      rows.insert(rows_[e.row]);
      nearest = std::min(nearest, e.distance);
      if (times.empty() || e.t - times.back() > 1e-3 * std::abs(e.t)) times.push_back(e.t);
    }
    std::string when, which;
    for (std::size_t k = 0; k < std::min<std::size_t>(3, times.size()); ++k)
      when += fmt::format("{}{:.6g}", k ? ", " : "", times[k]);
    if (times.size() > 3) when += fmt::format(" and {} times more, until {:.6g}", times.size() - 3, times.back());
    std::size_t k = 0;
    for (const std::string& r : rows)
      if (k++ < 3) which += (which.empty() ? "" : ", ") + r;
    if (rows.size() > 3) which += fmt::format(" and {} more", rows.size() - 3);
    out.push_back(
        fmt::format("The mechanism passes a singular position at t = {} s: there row {} depends on the other "
                    "constraints (to within {:.1e} "
                    "of 1). Behind it the motion may go on along more than one branch, which the equations do not "
                    "choose: psi and its gradient "
                    "hold only if the run took the branch that is meant. Compare formulations (costate check), or take "
                    "the singularity "
                    "out of the scene.",
                    when, which, nearest));
  }
  if (told_drift() > 0)
    out.push_back(
        fmt::format("The constraints drift: row '{}' is off by {} at t = {:.9g} s, {:.2g} of its own length, where "
                    "rtol is {:g}; psi and its gradient "
                    "are no better than that. Take a smaller rtol, or a formulation that holds them: {} (of redundant "
                    "rows maggi or augmented-lagrangian).",
                    rows_[worst_position_.row], with_unit(worst_position_.row, worst_position_.length),
                    worst_position_.t, worst_position_.relative, settings_.rtol, that_hold(settings_.formulation)));
  return out;
}

}  // namespace costate
