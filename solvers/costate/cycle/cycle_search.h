// Newton's search for the fixed point of a return map, at the map's tolerance.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "costate/cycle/cycle.h"
#include "costate/cycle/return_map.h"

namespace costate {

class CycleSearch {
 public:
  /// Both live longer.
  CycleSearch(ReturnMap& map, const CycleOptions& options) : map_(map), options_(options) {}

  Eigen::VectorXd x;
  std::vector<double> positions;
  MapValue value;        // at x
  Eigen::VectorXd left;  // what Newton's last step would still change, where the runs' errors let it come no nearer
  double residual = 0;
  int iterations = 0;
  std::string worst;
  Counters counters;

  void begin() { look(x, positions); }
  /// Newton's steps until the residual does not fall any more.
  void solve();
  Eigen::MatrixXd monodromy() const { return value.next_x(map_.section().free(), map_.section().free()); }

 private:
  double tolerance(double at) const {
    const SolverOptions& s = map_.problem().solver;
    return s.rtol * std::abs(at) + s.absolute();
  }
  double weigh(const MapValue& v, const Eigen::VectorXd& at, std::string* name) const {
    double most = 0;
    for (const int i : map_.section().free()) {
      const double r = std::abs(v.next[i] - at[i]) / tolerance(at[i]);
      if (r > most || !std::isfinite(r)) {
        most = std::isfinite(r) ? r : std::numeric_limits<double>::infinity();
        if (name) *name = map_.section().coordinates()[static_cast<std::size_t>(i)].name;
      }
    }
    return most;
  }
  void look(const Eigen::VectorXd& at, const std::vector<double>& from) {
    value = map_.evaluate(at, from, MapDerivatives::state);
    counters += value.counters;
    residual = weigh(value, at, &worst);
  }
  Eigen::VectorXd newton_step() const;
  /// A step's entries in tolerances: what returns within them may be far from the cycle, by 1/(1 - mu).
  Eigen::VectorXd in_tolerances(const Eigen::VectorXd& dx) const {
    return dx.cwiseAbs().cwiseQuotient(x(map_.section().free()).unaryExpr([&](double at) { return tolerance(at); }));
  }
  [[noreturn]] void fail(const std::string& why) const;
  double entry(const Eigen::VectorXd& of) const {
    for (int i = 0; i < map_.section().size(); ++i)
      if (map_.section().coordinates()[static_cast<std::size_t>(i)].name == worst) return of[i];
    return 0;
  }

  ReturnMap& map_;
  const CycleOptions& options_;
};

}  // namespace costate
