#include "costate/adjoint/maggi_equations.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "costate/analysis/start.h"
#include "costate/base/error.h"
#include "costate/level/maggi_names.h"

namespace costate {

SparsePattern full_pattern(int rows, int cols) {
  std::vector<std::pair<int, int>> entries;
  for (int j = 0; j < cols; ++j)
    for (int i = 0; i < rows; ++i) entries.emplace_back(i, j);
  return SparsePattern::from_entries(rows, cols, std::move(entries));
}

Eigen::VectorXd stacked(const Eigen::VectorXd& a, const Eigen::VectorXd& b, const Eigen::VectorXd& c) {
  Eigen::VectorXd x(a.size() + b.size() + c.size());
  x.head(a.size()) = a;
  x.segment(a.size(), b.size()) = b;
  x.tail(c.size()) = c;
  return x;
}

namespace {
class BlocksBalance final : public ImpulseBalance {
 public:
  BlocksBalance(Assembly& assembly, MaggiBlocks& at) : assembly_(assembly), at_(at) {}
  void prepare(const StateView& s) override { assembly_.calc_dynamics(s); }
  void solve(double* b) override { at_.solve_impulses(b); }

 private:
  Assembly& assembly_;
  MaggiBlocks& at_;
};
}  // namespace

MaggiEquations::MaggiEquations(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters,
                               Objective objective, Direction direction)
    : HandEquations(std::move(mechanism), std::move(parameters), std::move(objective), Stabilization{}, direction),
      at_(assembly_),
      velocity_jump_(assembly_, std::make_unique<BlocksBalance>(assembly_, at_)),
      f_(at_.freedoms()) {}

void MaggiEquations::set_parameters(const double* rho) {
  HandEquations::set_parameters(rho);
  plan_.clear();
  begin_afresh();
}

std::vector<std::string> MaggiEquations::independent_names() const {
  std::vector<std::string> names;
  for (int i = 0; i < f_; ++i) names.push_back("independent." + std::to_string(i));
  return names;
}

void MaggiEquations::solve_motion(const StateView& s) {
  if (fresh_) {
    if (plan_.empty()) plan_.push_back({std::numeric_limits<double>::infinity(), at_.best_chart(s)});
    at_.use_chart((direction() == Direction::forward ? plan_.front() : plan_.back()).chart);
  }
  fresh_ = has_parameters_ = false;
  if (!at_.has_rows(at_.chart(), s.z)) at_.use_chart(chart_for(s));
  if (at_.shares() && (objective_.running_needs_accelerations() || objective_.terminal_needs_accelerations()))
    throw CapabilityError(fmt::format(
        "At t = {:.9g} s rigid contacts that close hold a body more often than determines who bears what, and the cost "
        "holds accelerations or reactions: the hand-derived equations of Maggi do not share them out. Take idas, "
        "cvodes "
        "or discrete methods, or index1.",
        s.t));
  at_.evaluate(s);
}

int MaggiEquations::chart_for(const StateView& s) {
  double begin = -std::numeric_limits<double>::infinity(), nearest = std::numeric_limits<double>::infinity();
  int chart = -1;
  for (const Stretch& stretch : plan_) {
    const double distance = std::max({0.0, begin - s.t, s.t - stretch.end});
    begin = stretch.end;
    if (distance >= nearest || !at_.has_rows(stretch.chart, s.z)) continue;
    nearest = distance;
    chart = stretch.chart;
  }
  return chart >= 0 ? chart : at_.best_chart(s);
}

void MaggiEquations::evaluate_parameters() {
  if (!has_parameters_) at_.evaluate_parameters(parameter_columns());
  has_parameters_ = true;
}

void MaggiEquations::evaluate_start() {
  const Start& s = start();
  const Eigen::VectorXd y = stacked(s.q, s.v, s.z);
  evaluate(t_start, y.data());
}

void MaggiEquations::evaluate_in_chart(int chart) {
  const StateView s = state();
  const auto vector = [](const double* x, int n) { return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(x, n)); };
  const Eigen::VectorXd y = stacked(vector(s.q, n_), vector(s.v, n_), vector(s.z, nz_));
  at_.use_chart(chart);
  evaluate(s.t, y.data());
}

std::vector<double> MaggiEquations::plan(const std::vector<double>& times, const Motion& motion) {
  plan_.clear();
  std::vector<double> changes, y(static_cast<std::size_t>(2 * n_ + nz_));
  StateView s;
  s.q = y.data();
  s.v = s.q + n_;
  s.z = s.v + n_;
  int chart = -1;
  for (const double t : times) {
    motion(t, y.data());
    s.t = t;
    if (chart >= 0 && at_.chart_ratio(chart, s) <= kWorstMaggiRatio) continue;
    const int best = at_.best_chart(s);
    if (chart >= 0 && best != chart) {
      plan_.push_back({t, chart});
      changes.push_back(t);
    }
    chart = best;
  }
  plan_.push_back({std::numeric_limits<double>::infinity(), chart});
  return changes;
}

int MaggiEquations::planned(double t, double next) const {
  std::size_t i = 0;
  while (i + 1 < plan_.size() && plan_[i].end < 0.5 * (t + next)) ++i;
  return plan_[i].chart;
}

bool MaggiEquations::before_step(double t, double next, const double* qvz, Eigen::MatrixXd& X,
                                 Eigen::VectorXd& gradient) {
  if (plan_.empty() || planned(t, next) == at_.chart() || !at_.has_rows(planned(t, next), qvz + 2 * n_)) return false;
  evaluate(t, qvz);
  change_chart(planned(t, next), X, gradient);
  return true;
}

}  // namespace costate
