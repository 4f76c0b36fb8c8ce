// Time over error, of a program at several tolerances.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

namespace costate::bench {

/// From the loosest tolerance to the tightest.
struct Curve {
  std::vector<double> log_error, log_ms;
  void add(double error, double ms) {
    log_error.push_back(std::log(error));
    log_ms.push_back(std::log(ms));
  }
  /// An error counts from where no tighter tolerance makes a larger one: a lucky run is no merit.
  void without_luck() {
    for (std::size_t i = log_error.size(); i-- > 1;) log_error[i - 1] = std::max(log_error[i - 1], log_error[i]);
  }
  /// Its time at this error, on straight lines through its runs in log-log; none outside of them.
  std::optional<double> ms_at(double error) const {
    const double x = std::log(error);
    for (std::size_t i = 0; i + 1 < log_error.size(); ++i) {
      const double a = log_error[i], b = log_error[i + 1];
      if ((x <= a && x >= b) || (x >= a && x <= b))
        return std::exp(log_ms[i] + (a == b ? 0 : (x - a) / (b - a) * (log_ms[i + 1] - log_ms[i])));
    }
    return std::nullopt;
  }
  /// The same, but its loosest run's time where that errs by less.
  std::optional<double> ms_within(double error) const {
    if (!log_error.empty() && log_error.front() <= std::log(error)) return std::exp(log_ms.front());
    return ms_at(error);
  }
};

}  // namespace costate::bench
