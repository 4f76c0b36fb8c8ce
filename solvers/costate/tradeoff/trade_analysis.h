// What a table of errors and costs says: which settings are worth their time, what a digit costs, and what is out of
// line. Nothing is run here.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "costate/tradeoff/trade_table.h"

namespace costate {

/// The rows that ended with an error of this measure, by combination, from the loosest setting to the tightest. Errors
/// of psi and of outputs are those of plain simulations, errors of the gradient those of gradient runs.
std::vector<std::vector<std::size_t>> trade_curves(const TradeTable& table, TradeMeasure measure);

/// By row: the error that one can depend on, NaN where there is none. An error that passes through zero is small by
/// chance; so it is the largest of the row's own, the next two of the same combination at tighter settings, and what
/// the reference certifies.
std::vector<double> dependable_errors(const TradeTable& table, TradeMeasure measure);

/// Rows that no other one beats in time and error at once, by rising time.
std::vector<std::size_t> pareto_front(const TradeTable& table, TradeMeasure measure);

struct TradeChoice {
  double target = 0;                 // a power of ten
  std::size_t row = 0;               // the cheapest with a dependable error of no more
  double error = 0;                  // that one
  std::optional<double> next_digit;  // how many times the time of the choice for a tenth of the target is
};
/// For each power of ten from 1e-1 down to the smallest error that is reached, and none below the certified one.
std::vector<TradeChoice> trade_choices(const TradeTable& table, TradeMeasure measure);
/// "for 1e-04 in psi: penalty on cvodes at rtol 1e-06, 4.1 ms; the next digit costs 1.6 times more"
std::string sentence(const TradeTable& table, TradeMeasure measure, const TradeChoice& choice);

struct OutOfLine {
  enum class Kind {
    does_not_fall,  // the error stays where it is while the tolerance or step gets smaller
    rises,          // more steps, less accuracy
    far_off,        // the others are a hundred times as accurate at the same tolerance
  } kind = Kind::does_not_fall;
  std::size_t combination = 0;
  TradeMeasure measure = TradeMeasure::psi;
  std::vector<std::size_t> rows;  // where
  std::string sentence;
};
std::vector<OutOfLine> out_of_line(const TradeTable& table);

}  // namespace costate
