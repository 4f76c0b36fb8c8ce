#include "costate/tradeoff/trade_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <mutex>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/fixed_run.h"
#include "costate/problem/redundant_rows.h"
#include "costate/record/jobs.h"
#include "costate/sensitivity/method.h"
#include "costate/tradeoff/stopwatch.h"

namespace costate {

namespace {

// Shares of the budget: until when the reference is to be found, and the rows are to be run.
constexpr double kReferenceShare = 0.35, kRowsShare = 0.8;
// No run is cut before it has taken so long.
constexpr double kLeast_s = 0.2;
constexpr int kSteps = 8;  // lengths of fixed steps
constexpr double kCoarsest = 1e-3;
constexpr double kGrowth = 1.5;  // of the time from one setting to the next
constexpr const char* kRefused = "refused";

bool listed(const std::vector<std::string>& list, const std::string& name) {
  return list.empty() || std::find(list.begin(), list.end(), name) != list.end();
}

}  // namespace

TradeStudy::TradeStudy(const Problem& problem, const std::vector<double>& rho, TradeOptions options)
    : options_(std::move(options)), probe_(problem, rho, options_.outputs, options_.samples) {}

double TradeStudy::spent_s() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
}

void TradeStudy::find_reference() {
  redundant_ = redundant_joints(probe_.problem(), probe_.rho());
  ReferenceSearch search;
  search.redundant = !redundant_.empty();
  search.gradient = options_.gradient;
  search.allow = [this] {
    RunBudget budget;
    if (options_.budget_s > 0) budget.begin(std::max(kLeast_s, kReferenceShare * options_.budget_s - spent_s()));
    return budget;
  };
  search.has_time = [this] { return options_.budget_s <= 0 || spent_s() < kReferenceShare / 2 * options_.budget_s; };
  reference_ = find_trade_reference(probe_, search);
  for (std::size_t m = 0; m < table_.floor.size(); ++m) table_.floor[m] = reference_.proven ? reference_.floor[m] : 0;
}

void TradeStudy::choose_combinations() {
  const auto add = [&](Combination c, const std::string& why) {
    if (why.empty())
      table_.combinations.push_back(std::move(c));
    else
      refusals_.push_back({std::move(c), why});
  };
  const auto redundancy = [&](const Formulation& f) {
    if (redundant_.empty() || f.carries_redundancy) return std::string();
    return fmt::format("{} Formulation '{}' needs independent rows.", redundant_, f.name);
  };
  for (const auto& f : formulations()) {
    if (!listed(options_.formulations, f.name)) continue;
    for (const Integrator& i : integrators()) {
      if (!listed(options_.integrators, i.name)) continue;
      add({f.name, i.name, "", !f.exact_constraints()},
          i.carries(f) ? redundancy(f) : fmt::format("Formulation '{}' has no {} form.", f.name, i.form_name()));
    }
    if (!options_.gradient) continue;
    for (const auto& m : sensitivity_methods()) {
      std::string why = refusal(m, f);
      std::vector<std::string> on = integrators_of(m, f);
      if (on.empty()) on = {f.default_integrator};
      // An oracle of many runs: nobody's choice, unless asked for.
      if (why.empty() && m.perturbs && options_.methods.empty())
        why = "It is an oracle of many runs; --methods names it where it is to be measured.";
      for (const std::string& integrator : on)
        if (listed(options_.methods, m.name) && listed(options_.integrators, integrator))
          add({f.name, integrator, m.name, !f.exact_constraints()}, why.empty() ? redundancy(f) : why);
    }
  }
}

std::vector<double> TradeStudy::fixed_step_lengths(const RunBudget& budget) const {
  if (!options_.steps.empty()) return options_.steps;
  const auto c = std::find_if(table_.combinations.begin(), table_.combinations.end(),
                              [](const Combination& x) { return has_fixed_steps(x.integrator); });
  if (c == table_.combinations.end()) return {};
  const Problem p = watched(probe_.prepared({c->formulation, c->integrator}, kCoarsest, 0), budget);
  const double span = p.solver.t_end - p.solver.t_start;
  long n = 64;
  try {
    n = fixed_steps(p);
  } catch (const Error&) {  // the rows will say why
  }
  std::vector<double> lengths;
  for (int k = 0; k < kSteps; ++k, n *= 2) lengths.push_back(span / static_cast<double>(n));
  return lengths;
}

void TradeStudy::choose_rows() {
  RunBudget budget;
  if (options_.budget_s > 0) budget.begin(std::max(kLeast_s, 0.1 * options_.budget_s));
  std::vector<double> steps;
  try {
    steps = fixed_step_lengths(budget);
  } catch (const Cut&) {
  }
  for (std::size_t c = 0; c < table_.combinations.size(); ++c) {
    const bool fixed = has_fixed_steps(table_.combinations[c].integrator);
    const std::vector<double>& settings = fixed ? steps : options_.tolerances;
    for (std::size_t level = 0; level < settings.size(); ++level) {
      TradeRow row;
      row.combination = c;
      row.level = level;
      (fixed ? row.step_s : row.rtol) = settings[level];
      row.why = "the budget of time was spent before";
      table_.rows.push_back(row);
    }
  }
}

/// Of one that the scene shows to be impossible: its rows go.
void TradeStudy::refuse(std::size_t combination, const std::string& why) {
  refusals_.push_back({table_.combinations[combination], why});
  for (TradeRow& r : table_.rows)
    if (r.combination == combination) {
      r.status = TradeStatus::left_out;
      r.why = kRefused;
    }
}

/// False where the combination turns out to be impossible.
bool TradeStudy::fill(TradeRow& row, double limit_s) const {
  const auto end = [&](TradeStatus status, const std::string& why) {
    row.status = status;
    row.why = why;
  };
  const Combination& c = table_.combinations[row.combination];
  RunBudget budget;  // its own: rows run beside each other
  budget.begin(limit_s);
  take_notices();
  try {
    const TradeValues v = probe_.run(c, row.rtol, row.step_s, budget);
    row.warnings = take_notices();
    reference_.judge(v, probe_, row);
    row.counters = v.counters;
    row.time_s = v.time_s;
    row.status = TradeStatus::ok;
  } catch (const Cut& e) {
    end(TradeStatus::cut, e.what());
  } catch (const CapabilityError& e) {
    end(TradeStatus::left_out, e.what());
    return false;
  } catch (const SolverError& e) {
    end(TradeStatus::failed, e.what());
  } catch (const ModelError& e) {
    end(TradeStatus::failed, e.what());
  }
  return true;
}

void TradeStudy::measure() {
  choose_combinations();
  if (table_.combinations.empty()) {
    const std::string why = refusals_.empty() ? "Nothing was asked for." : refusals_.back().why;
    throw CapabilityError("No combination is left that can be measured. " + why);
  }
  choose_rows();
  // What turns out to be impossible is no row of the table.
  const auto clean = [this] { std::erase_if(table_.rows, [](const TradeRow& r) { return r.why == kRefused; }); };
  try {
    run_rows();
  } catch (...) {  // an interruption
    clean();
    throw;
  }
  clean();
  take_times();
}

/// The cheapest first, as far as the row before tells: where time does not suffice for all, the slow ones stay at loose
/// settings, and those that matter get to the tightest. Each worker takes the next row of a combination that no other
/// one is at.
void TradeStudy::run_rows() {
  const double end_s = kRowsShare * options_.budget_s;
  std::vector<std::vector<std::size_t>> next(table_.combinations.size());  // the loosest last
  for (std::size_t i = table_.rows.size(); i-- > 0;) next[table_.rows[i].combination].push_back(i);
  std::vector<double> expected(next.size(), 0);
  std::vector<char> taken(next.size(), 0);
  // What the fastest took: of simulations and of gradients, by the number of settings that were looser.
  std::map<std::pair<bool, std::size_t>, double> fastest;
  std::size_t done = 0, ended = 0, told = 0;
  std::atomic<bool> stopped{false};
  std::mutex books;  // all of the above
  const auto work = [&] {
    std::unique_lock lock(books);
    while (!stopped) {
      std::size_t c = next.size();
      for (std::size_t k = 0; k < next.size(); ++k)
        if (!next[k].empty() && !taken[k] && (c == next.size() || expected[k] < expected[c])) c = k;
      if (c == next.size() || (options_.budget_s > 0 && spent_s() >= end_s)) return;
      TradeRow& row = table_.rows[next[c].back()];
      row.why.clear();
      double& least = fastest[{table_.combinations[c].method.empty(), row.level}];
      double limit = least > 0 ? std::max(kLeast_s, options_.patience * least) : RunBudget::kNoLimit;
      if (options_.budget_s > 0) {
        const double left = std::max(kLeast_s, end_s - spent_s());
        limit = std::min(limit, left);
      }
      taken[c] = 1;
      lock.unlock();
      const bool possible = fill(row, limit);
      lock.lock();
      taken[c] = 0;
      next[c].pop_back();
      ++done;
      if (!possible) {
        refuse(c, std::string(row.why));
        next[c].clear();
      } else if (row.status == TradeStatus::ok) {
        ++ended;
        expected[c] = kGrowth * row.time_s;
        if (least <= 0 || row.time_s < least) least = row.time_s;
      } else if (row.status == TradeStatus::cut) {
        for (const std::size_t i : next[c]) table_.rows[i].why = "it was cut at a looser setting";
        next[c].clear();
      }
      if (done * 10 / table_.rows.size() > told) {
        told = done * 10 / table_.rows.size();
        tell(fmt::format("{} of {} runs, {} ended, {:.1f} s so far", done, table_.rows.size(), ended, spent_s()));
      }
    }
  };
  beside_ = jobs() - 1;
  for_each_job(static_cast<std::size_t>(jobs()), jobs(), [&](std::size_t) {
    try {
      work();
    } catch (...) {  // an interruption; the others end after their rows
      stopped = true;
      throw;
    }
  });
}

void TradeStudy::take_times() {
  const JobsHere alone(1);
  Race race;
  std::vector<TradeRow*> rows;
  for (TradeRow& row : table_.rows)
    if (row.status == TradeStatus::ok) {
      rows.push_back(&row);
      race.add([this, &row] { probe_.repeat(table_.combinations[row.combination], row.rtol, row.step_s); }, row.time_s);
    }
  const auto settle = [&] {
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const int n = race.rounds(static_cast<int>(k));
      if (n == 0) continue;
      rows[k]->time_s = race.timing(static_cast<int>(k)).median_s;
      rows[k]->repeats = n;
    }
    take_notices();
  };
  tell(fmt::format("{} runs once more, up to {} times in turns, for the clock", rows.size(), options_.repeats));
  try {
    race.run(options_.repeats, 2e-3, [this] { return !out_of_time(); });
  } catch (...) {  // an interruption: what was timed stays
    settle();
    throw;
  }
  settle();
}

}  // namespace costate
