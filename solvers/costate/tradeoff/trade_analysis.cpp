#include "costate/tradeoff/trade_analysis.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace costate {

namespace {

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
// How many tighter settings stand by a row's error.
constexpr std::size_t kWitnesses = 2;
// An error does not fall where it stays within this factor while the tolerance falls by kSpan, or a step is halved
// three times; nobody minds it at kFine times the tolerance.
constexpr double kStays = 3, kSpan = 100, kStepSpan = 8, kFine = 10;
// It rises where it is twice that of the setting before, and a tenth of the one before that: by what a setting may be
// off, and no rise after an error that was small by chance.
constexpr double kRises = 2, kTrend = 0.1;
// Far off: this many times the median at the same tolerance, and this many tolerances.
constexpr double kFar = 100, kFarTolerances = 1e3;

std::size_t index(TradeMeasure m) { return static_cast<std::size_t>(m); }

double setting_of(const TradeRow& r) { return r.step_s > 0 ? r.step_s : r.rtol; }

std::string error_text(const TradeTable& table, TradeMeasure m, double error) {
  return error <= table.floor_of(m) ? fmt::format("<{:.1e}", table.floor_of(m)) : fmt::format("{:.1e}", error);
}

class CurveJudge {
 public:
  CurveJudge(const TradeTable& table, TradeMeasure measure, const std::vector<std::size_t>& curve)
      : table_(table), measure_(measure), curve_(curve) {}

  void judge(std::vector<OutOfLine>& found) const {
    const std::size_t from = stays_from();
    if (from < curve_.size()) found.push_back(stays(from));
    // What rises within a stretch that stays is told already.
    for (std::size_t k = 1; k < std::min(from + 1, curve_.size()); ++k)
      if (rises(k)) found.push_back(rise(k));
  }

 private:
  const TradeRow& row(std::size_t k) const { return table_.rows[curve_[k]]; }
  double error(std::size_t k) const { return std::max(*row(k).error_of(measure_), table_.floor_of(measure_)); }
  const Combination& combination() const { return table_.combinations[row(0).combination]; }

  /// From where on the error stays, to the end; curve_.size() where it falls.
  std::size_t stays_from() const {
    const std::size_t none = curve_.size();
    if (none < 2) return none;
    const std::size_t last = none - 1;
    const TradeRow& r = row(last);
    const bool steps = r.step_s > 0;
    if (error(last) <= kStays * table_.floor_of(measure_)) return none;
    if (!steps && error(last) <= kFine * r.rtol) return none;
    std::size_t from = last;
    double low = error(last), high = low;
    for (std::size_t k = last; k-- > 0;) {
      low = std::min(low, error(k));
      high = std::max(high, error(k));
      if (high > kStays * low) break;
      from = k;
    }
    return setting_of(row(from)) / setting_of(r) >= (steps ? kStepSpan : kSpan) * (1 - 1e-9) ? from : none;
  }

  OutOfLine stays(std::size_t from) const {
    OutOfLine o{OutOfLine::Kind::does_not_fall, row(0).combination, measure_, {}, {}};
    o.rows.assign(curve_.begin() + static_cast<std::ptrdiff_t>(from), curve_.end());
    o.sentence =
        fmt::format("{}: the error of {} stays at {:.1e} from {} to {}{}.", combination().name(), name_of(measure_),
                    error(curve_.size() - 1), row(from).setting(), row(curve_.size() - 1).setting(),
                    combination().soft ? "; its constraints are soft, which costs O(1/alpha) at any tolerance" : "");
    return o;
  }

  bool rises(std::size_t k) const {
    if (row(k).counters.steps <= row(k - 1).counters.steps) return false;
    if (!(error(k) > kRises * error(k - 1)) || !(error(k) > kRises * table_.floor_of(measure_))) return false;
    // Beside the tolerance it is nothing.
    if (row(k).step_s <= 0 && error(k) <= kFine * row(k).rtol) return false;
    return k < 2 || error(k) > kTrend * error(k - 2);
  }

  OutOfLine rise(std::size_t k) const {
    OutOfLine o{OutOfLine::Kind::rises, row(0).combination, measure_, {curve_[k - 1], curve_[k]}, {}};
    o.sentence =
        fmt::format("{}: at {} {} steps give {} an error of {}, at {} only {} steps one of {}.", combination().name(),
                    row(k).setting(), row(k).counters.steps, name_of(measure_), error_text(table_, measure_, error(k)),
                    row(k - 1).setting(), row(k - 1).counters.steps, error_text(table_, measure_, error(k - 1)));
    return o;
  }

  const TradeTable& table_;
  TradeMeasure measure_;
  const std::vector<std::size_t>& curve_;
};

/// Once a combination: where it is farthest beyond the others.
void find_far_off(const TradeTable& table, TradeMeasure m, const std::vector<std::vector<std::size_t>>& curves,
                  std::vector<OutOfLine>& found) {
  for (const auto& curve : curves) {
    double most = 0, usual = 0;
    std::vector<std::size_t> where;
    std::size_t farthest = 0;
    for (const std::size_t i : curve) {
      const TradeRow& r = table.rows[i];
      if (r.step_s > 0) continue;
      std::vector<double> others;
      for (const auto& other : curves)
        for (const std::size_t k : other)
          if (&other != &curve && table.rows[k].rtol == r.rtol)
            others.push_back(std::max(*table.rows[k].error_of(m), table.floor_of(m)));
      if (others.size() < 3) continue;
      std::nth_element(others.begin(), others.begin() + static_cast<std::ptrdiff_t>(others.size() / 2), others.end());
      const double median = others[others.size() / 2], error = *r.error_of(m);
      if (!(error > kFar * median && error > kFarTolerances * r.rtol)) continue;
      where.push_back(i);
      if (error / median > most) most = error / median, usual = median, farthest = i;
    }
    if (where.empty()) continue;
    const TradeRow& r = table.rows[farthest];
    found.push_back({OutOfLine::Kind::far_off, r.combination, m, where,
                     fmt::format("{}: at {} the error of {} is {:.1e}, where half of the others are below {}.",
                                 table.combinations[r.combination].name(), r.setting(), name_of(m), *r.error_of(m),
                                 error_text(table, m, usual))});
  }
}

}  // namespace

std::vector<std::vector<std::size_t>> trade_curves(const TradeTable& table, TradeMeasure measure) {
  std::vector<std::vector<std::size_t>> curves(table.combinations.size());
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    const TradeRow& r = table.rows[i];
    const bool differentiates = !table.combinations[r.combination].method.empty();
    if (r.status == TradeStatus::ok && r.error[index(measure)] && differentiates == (measure == TradeMeasure::gradient))
      curves[r.combination].push_back(i);
  }
  for (auto& curve : curves)
    std::stable_sort(curve.begin(), curve.end(), [&](std::size_t a, std::size_t b) {
      return setting_of(table.rows[a]) > setting_of(table.rows[b]);
    });
  std::erase_if(curves, [](const auto& curve) { return curve.empty(); });
  return curves;
}

std::vector<double> dependable_errors(const TradeTable& table, TradeMeasure measure) {
  std::vector<double> errors(table.rows.size(), kNothing);
  for (const auto& curve : trade_curves(table, measure))
    for (std::size_t k = 0; k < curve.size(); ++k) {
      double& e = errors[curve[k]] = table.floor_of(measure);
      for (std::size_t l = k; l < std::min(curve.size(), k + kWitnesses + 1); ++l)
        e = std::max(e, *table.rows[curve[l]].error_of(measure));
    }
  return errors;
}

std::vector<std::size_t> pareto_front(const TradeTable& table, TradeMeasure measure) {
  const std::vector<double> errors = dependable_errors(table, measure);
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < errors.size(); ++i)
    if (std::isfinite(errors[i])) rows.push_back(i);
  std::stable_sort(rows.begin(), rows.end(), [&](std::size_t a, std::size_t b) {
    const double s = table.rows[a].time_s, t = table.rows[b].time_s;
    return s < t || (s == t && errors[a] < errors[b]);
  });
  std::vector<std::size_t> front;
  double best = std::numeric_limits<double>::infinity();
  for (const std::size_t i : rows)
    if (errors[i] < best) {
      best = errors[i];
      front.push_back(i);
    }
  return front;
}

std::vector<TradeChoice> trade_choices(const TradeTable& table, TradeMeasure measure) {
  const std::vector<double> errors = dependable_errors(table, measure);
  const std::vector<std::size_t> front = pareto_front(table, measure);
  std::vector<TradeChoice> choices;
  for (int digits = 1; digits <= 15; ++digits) {
    const double target = std::pow(10.0, -digits);
    const auto row = std::find_if(front.begin(), front.end(), [&](std::size_t i) { return errors[i] <= target; });
    if (row == front.end()) break;
    choices.push_back({target, *row, errors[*row], std::nullopt});
  }
  for (std::size_t k = 0; k + 1 < choices.size(); ++k) {
    const double now = table.rows[choices[k].row].time_s;
    if (now > 0) choices[k].next_digit = table.rows[choices[k + 1].row].time_s / now;
  }
  return choices;
}

std::string sentence(const TradeTable& table, TradeMeasure measure, const TradeChoice& choice) {
  const TradeRow& r = table.rows[choice.row];
  std::string text = fmt::format("for {:.0e} in {}: {} at {}, {:.3g} ms", choice.target,
                                 measure == TradeMeasure::gradient ? "the gradient" : name_of(measure),
                                 table.combinations[r.combination].name(), r.setting(), 1e3 * r.time_s);
  if (!choice.next_digit) return text + "; no setting that was run gives the next digit";
  if (*choice.next_digit == 1) return text + "; the next digit costs nothing";
  if (*choice.next_digit < 1.05) return text + "; the next digit costs hardly more";
  return text + fmt::format("; the next digit costs {:.2g} times as much", *choice.next_digit);
}

std::vector<OutOfLine> out_of_line(const TradeTable& table) {
  std::vector<OutOfLine> found;
  for (const TradeMeasure m : kTradeMeasures) {
    const auto curves = trade_curves(table, m);
    for (const auto& curve : curves) CurveJudge(table, m, curve).judge(found);
    find_far_off(table, m, curves, found);
  }
  return found;
}

}  // namespace costate
