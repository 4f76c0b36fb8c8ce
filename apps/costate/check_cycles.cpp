#include "check_cycles.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/integrators.h"
#include "costate/record/interrupt.h"
#include "costate/sensitivity/error_estimate.h"

namespace costate::app {

namespace {

// The rule of apps/README.md: that of motions (check_motions.cpp).
constexpr double kOfSize = 1000, kOfReference = 100;
constexpr const char* kMultiplier = "multiplier";

bool is_multiplier(const std::string& name) { return name.rfind(kMultiplier, 0) == 0; }

}  // namespace

CycleCheck::CycleCheck(const Setup& setup, double patience)
    : problem_(setup.problem), settings_(*setup.scene.cycle), rho_(setup.rho), patience_(patience) {
  problem_.solver.confirm = false;  // the rows are compared with each other
  problem_.solver.step_s = 0;
  problem_.solver.integrator.clear();
  problem_ = watched(problem_, budget_);
}

CycleCheck::Quantities CycleCheck::find(const Problem& p) {
  budget_.begin(patience_ * seconds_);
  CycleOptions options;
  options.estimate = false;
  result_ = find_cycle(p, settings_, rho_, options);
  return quantities_of(result_);
}

CycleCheck::Quantities CycleCheck::quantities_of(const CycleResult& r) const {
  Quantities all;
  std::map<std::string, double> sizes;
  for (std::size_t i = 0; i < r.names.size(); ++i)
    sizes[r.units[i]] = std::max(sizes[r.units[i]], std::abs(r.x[static_cast<Eigen::Index>(i)]));
  for (std::size_t i = 0; i < r.names.size(); ++i)
    all.push_back({r.names[i], r.units[i], r.x[static_cast<Eigen::Index>(i)], sizes[r.units[i]]});
  const auto number = [&](const std::string& name, const std::string& unit, double value, const Eigen::VectorXd& by) {
    all.push_back({name, unit, value, std::abs(value)});
    const auto& parameters = problem_.parameters.parameters;
    double size = 0;
    for (Eigen::Index j = 0; j < by.size(); ++j)
      size = std::max(size, std::abs(by[j]) * parameters[static_cast<std::size_t>(j)].scale);
    for (Eigen::Index j = 0; j < by.size(); ++j) {
      const Parameter& p = parameters[static_cast<std::size_t>(j)];
      all.push_back({name + " by " + p.name, "", by[j], size / p.scale});
    }
  };
  // Nothing moves a period that is given.
  number("period", "s", r.period.value, settings_.period_s ? Eigen::VectorXd() : r.period_rho);
  if (!settings_.travel.empty()) number("travel", "m", r.travel.value, r.travel_rho);
  if (!problem_.objective.running.empty() || !problem_.objective.terminal.empty())
    number("psi", "", r.psi.value, r.psi_rho);
  for (std::size_t i = 0; i < r.multipliers.size(); ++i)
    for (const bool imaginary : {false, true})
      all.push_back({fmt::format("{} {}, {} part", kMultiplier, i + 1, imaginary ? "imaginary" : "real"), "",
                     imaginary ? r.multipliers[i].imag() : r.multipliers[i].real(),
                     std::max(1.0, std::abs(r.multipliers.front()))});
  return all;
}

double CycleCheck::apart(const Quantities& found, std::size_t i) const {
  const Quantity& q = reference_[i];
  if (!is_multiplier(q.name)) return std::abs(found[i].value - q.value);
  // Of a pair, and of some of one modulus, any may come first.
  const std::size_t first = static_cast<std::size_t>(
      std::find_if(reference_.begin(), reference_.end(), [](const Quantity& x) { return is_multiplier(x.name); }) -
      reference_.begin());
  const std::size_t own = i - (i - first) % 2;
  double nearest = std::numeric_limits<double>::infinity(), of_part = nearest;
  for (std::size_t k = first; k + 1 < found.size(); k += 2) {
    const double real = std::abs(found[k].value - reference_[own].value),
                 imaginary = std::abs(found[k + 1].value - reference_[own + 1].value), d = std::hypot(real, imaginary);
    if (d >= nearest) continue;
    nearest = d;
    of_part = i == own ? real : imaginary;
  }
  return of_part;
}

CycleCheck::Worst CycleCheck::worst(const Quantities& found, const std::vector<double>& more) const {
  Worst w;
  for (std::size_t i = 0; i < reference_.size(); ++i) {
    const double e = apart(found, i), allowed = allowed_[i] + more[i], beyond = e == 0 ? 0 : e / allowed;
    if (!(beyond <= w.beyond)) w = {beyond, i};
  }
  return w;
}

CycleRow CycleCheck::judge(const std::string& formulation, const std::string& integrator) {
  CycleRow row;
  row.formulation = formulation;
  row.integrator = integrator;
  Problem p = problem_;
  p.formulation = formulation;
  p.solver.integrator = integrator;
  std::vector<double> more(reference_.size(), 0);
  const Quantities found = find(p);
  row.period = result_.period.value;
  row.largest = result_.largest();
  if (found.size() != reference_.size()) throw SolverError("It has another number of multipliers.");
  Worst w;
  const auto size = [&](std::size_t i) { return reference_[i].size > 0 ? reference_[i].size : 1; };
  const auto show = [&] {
    row.quantity = reference_[w.at].name;
    row.unit = reference_[w.at].unit;
    row.found = found[w.at].value;
    row.expected = reference_[w.at].value;
    row.error = apart(found, w.at) / size(w.at);
  };
  const auto forgive = [&](double without_warning, const std::string& remark) {
    row.verdict = row.error <= without_warning ? Verdict::ok
                  : row.error <= kTolerable    ? Verdict::inaccurate
                                               : Verdict::disagreement;
    row.remark = remark;
  };
  w = worst(found, more);
  show();
  if (w.beyond <= 1) return row;
  if (has_soft_constraints(formulation)) {
    const Quantities firm = find(with_firmer_constraints(p));
    double soft = 0;
    for (std::size_t i = 0; i < reference_.size() && firm.size() == reference_.size(); ++i) {
      // The error must fall as the expansion in 1/alpha says.
      const double x = std::abs(found[i].value - firm[i].value) / 0.9;
      if (is_multiplier(reference_[i].name) || !(apart(firm, i) <= std::max(allowed_[i], 0.3 * apart(found, i))))
        continue;
      more[i] = 1.5 * x;
      soft = std::max(soft, x / size(i));
    }
    w = worst(found, more);
    show();
    if (w.beyond <= 1) {
      forgive(kSoft, fmt::format("the penalty's own O(1/alpha) is {:.1e}", soft));
      return row;
    }
  }
  for (const double factor : {1e-2, 1e-4}) {
    Problem better = p;
    better.solver.tighten(factor, 1e-13, 1e-15);
    const std::string at = fmt::format("rtol {:g}", better.solver.rtol);
    try {
      const Quantities again = find(better);
      if (again.size() != reference_.size()) continue;
      row.remark = fmt::format("{:.1e} at {}", apart(again, w.at) / size(w.at), at);
      if (apart(again, w.at) <= 0.5 * apart(found, w.at) && worst(again, more).beyond <= 1) {
        forgive(kForgiven * p.solver.rtol,
                fmt::format("limited by the tolerance: {:.2g} times what is expected, and {}", w.beyond, row.remark));
        return row;
      }
    } catch (const SolverError& e) {
      row.remark = fmt::format("at {} it fails: {}", at, e.what());
    }
  }
  row.verdict = Verdict::disagreement;
  return row;
}

void CycleCheck::run(const Yardstick& yardstick, const std::vector<CheckRow>& gradients) {
  Problem p = problem_;
  p.formulation = yardstick.formulation;
  try {
    const double begin = RunBudget::processor_s();
    const Quantities base = find(p);
    seconds_ = RunBudget::processor_s() - begin;
    p.solver.set_rtol(std::min(yardstick.rtol, problem_.solver.rtol));
    reference_ = find(p);
    if (base.size() != reference_.size()) throw SolverError("At a tighter tolerance it has other multipliers.");
    for (std::size_t i = 0; i < reference_.size(); ++i)
      allowed_.push_back((kOfSize * problem_.solver.rtol + 1e-9) * reference_[i].size + 1e-15 +
                         kOfReference * apart(base, i));
  } catch (const Cut& e) {
    note_ = fmt::format("No cycles were compared: the reference was cut {}.", e.what());
    return;
  } catch (const Interrupted&) {
    throw;
  } catch (const Error& e) {
    note_ = fmt::format("No cycles were compared: the reference found none: {}", e.what());
    return;
  }
  note_ = "Cycles are found on idas and cvodes, by tangents; how multipliers change is not compared.";
  for (const Formulation& f : formulations())
    for (const Integrator* integrator : integrators_of(f)) {
      const std::string& name = f.name;
      const bool taken = std::any_of(gradients.begin(), gradients.end(),
                                     [&](const CheckRow& r) { return r.formulation == name && !r.refused(); });
      if (integrator->discrete || !taken) continue;
      throw_if_interrupted();
      CycleRow row;
      const auto ended = [&](Verdict v, const char* why) {
        row = CycleRow();
        row.formulation = name;
        row.integrator = integrator->name;
        row.verdict = v;
        row.why = why;
      };
      try {
        row = judge(name, integrator->name);
      } catch (const Cut& e) {
        ended(Verdict::cut, e.what());
      } catch (const CapabilityError& e) {
        ended(Verdict::refused, e.what());
      } catch (const SolverError& e) {
        ended(Verdict::failed, e.what());
      } catch (const ModelError& e) {
        ended(Verdict::failed, e.what());
      }
      rows_.push_back(row);
    }
  take_notices();
}

void CycleCheck::tell(Json& j, std::string& text, CheckFindings& found) const {
  j["cycles"] = Json::array();
  if (!rows_.empty())
    text += fmt::format("cycles: {} quantities\n  {:<22} {:<16} {:>12} {:>12} {:>9}  {}\n", reference_.size(), "cycle",
                        "integrator", "period [s]", "multiplier", "error", "farthest");
  for (const CycleRow& r : rows_) {
    j["cycles"].push_back(r.json());
    text += r.text();
    found.add(r.verdict, r.sentence());
  }
  if (note_.empty()) return;
  j["cycles_note"] = note_;
  text += note_ + "\n";
}

std::string CycleRow::text() const {
  const std::string begin = fmt::format("  {:<22} {:<16} ", formulation, integrator);
  if (verdict == Verdict::refused) return begin + "-- " + why + "\n";
  if (verdict == Verdict::failed) return begin + "FAILED: " + why + "\n";
  if (verdict == Verdict::cut) return begin + "cut: " + why + "\n";
  return begin + fmt::format("{:>12.9g} {:>12.7g} {:>9.1e}  {}{}{}\n", period, largest, error, quantity,
                             verdict == Verdict::disagreement ? "  DISAGREES"
                             : verdict == Verdict::inaccurate ? "  INACCURATE"
                                                              : "",
                             remark.empty() ? "" : "  (" + remark + ")");
}

std::string CycleRow::sentence() const {
  const std::string name = fmt::format("the cycle of {} on {}", formulation, integrator);
  if (verdict == Verdict::failed) return fmt::format("{} failed: {}", name, why);
  if (verdict == Verdict::cut) return fmt::format("{} was cut {}", name, why);
  return fmt::format("{}: {} is {:.9g}{}, {:.9g} by the reference{}", name, quantity, found,
                     unit.empty() ? "" : " " + unit, expected, remark.empty() ? "" : " (" + remark + ")");
}

Json CycleRow::json() const {
  Json j;
  const bool ended = verdict != Verdict::refused && verdict != Verdict::failed && verdict != Verdict::cut;
  const auto if_ended = [&](const auto& x) { return ended ? Json(x) : Json(nullptr); };
  j["formulation"] = formulation;
  j["integrator"] = integrator;
  j["status"] = name_of(verdict);
  j["period_s"] = if_ended(period);
  j["multiplier"] = if_ended(largest);
  j["error"] = if_ended(error);
  j["quantity"] = if_ended(quantity);
  j["unit"] = if_ended(unit);
  j["value"] = if_ended(found);
  j["expected"] = if_ended(expected);
  if (!ended) j[name_of(verdict)] = why;
  if (!remark.empty()) j["remark"] = remark;
  return j;
}

}  // namespace costate::app
