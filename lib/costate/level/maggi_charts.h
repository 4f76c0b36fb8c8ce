// The charts of Maggi's equations that have been made, each of the rows that are there (maggi_rows.h) and of the
// coordinates that are independent; they keep their numbers.
#pragma once

#include <memory>
#include <vector>

#include "costate/level/maggi_chart.h"
#include "costate/level/maggi_rows.h"

namespace costate {

class MaggiCharts {
 public:
  struct Chart {
    MaggiRows rows;
    std::unique_ptr<MaggiChart> rates, forces;  // the latter of Phi_r, where contacts slide
    /// The coordinates of the latter, or null.
    const std::vector<int>* of_reactions() const { return forces ? &forces->independent() : nullptr; }
    MaggiChart& reactions() const { return forces ? *forces : *rates; }
    bool is(const MaggiRows& wanted, const std::vector<int>& independent, const std::vector<int>* of_reactions) const;
  };

  /// `freedoms`: with all rows that come and go open.
  MaggiCharts(const Assembly& assembly, int freedoms) : assembly_(assembly), freedoms_(freedoms) {}

  const Chart& operator[](int chart) const { return charts_[static_cast<std::size_t>(chart)]; }
  /// The number of the one of these rows and coordinates, and of these of the reactions where contacts slide; it is
  /// made unless it is there.
  int find(const MaggiRows& rows, const std::vector<int>& independent, const std::vector<int>* of_reactions);
  /// That of the coordinates that are best at the assembly's last evaluation, by these weights.
  int find_best(const MaggiRows& rows, const std::vector<double>& weight);
  /// That of these coordinates, and of the best ones of the reactions.
  int find_beside(const MaggiRows& rows, const std::vector<int>& independent, const std::vector<double>& weight);
  void clear() { charts_.clear(); }
  void forget_history();
  long factorizations() const;

 private:
  std::vector<int> best(const MaggiRows& rows, const double* phi_q, const std::vector<double>& weight) const;

  const Assembly& assembly_;
  int freedoms_;
  std::vector<Chart> charts_;
  std::vector<double> reactions_;  // Phi_r
};

}  // namespace costate
