#include "costate/discrete/radau_derivative.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "costate/analysis/complaints.h"
#include "costate/base/error.h"
#include "costate/formulation/stage_parameters.h"

namespace costate {

namespace {
// As in radau_step.cpp; an iteration that would take more than so many rounds is none.
constexpr double kSolveRounding = std::numeric_limits<double>::epsilon(), kSolveNoise = 1e-12, kSolveFalls = 0.3,
                 kSlowSolve = 0.5;
// With the step's own factors: slower ones are made anew.
constexpr double kSlowWithKept = 0.1;
constexpr int kMostSolveIterations = 30;

std::vector<char> solve_differential(const DaeSystem& system) {
  std::vector<char> r;
  for (const Unknown& u : system.unknowns()) r.push_back(u.differential ? 1 : 0);
  return r;
}

DaeSystem& with_stage_parameters(DaeSystem& system) {
  if (auto* terms = dynamic_cast<StageParameters*>(&system)) terms->take_stage_parameters();
  return system;
}
}  // namespace

StageDerivative::StageDerivative(const RadauScheme& scheme, DaeSystem& system)
    : scheme_(scheme),
      system_(with_stage_parameters(system)),
      n_(system.size()),
      matrix_(scheme, system.jacobian_pattern(), solve_differential(system)) {
  const auto s = static_cast<std::size_t>(scheme.stages), n = static_cast<std::size_t>(n_);
  for (int i = 0; i < scheme.stages; ++i) start_weight_.push_back(scheme.w.row(i).sum());
  differential_.resize(n_);
  for (int e = 0; e < n_; ++e) differential_[e] = matrix_.differential()[static_cast<std::size_t>(e)] ? 1 : 0;
  zero_.assign(n, 0);
  mean_.assign(system.jacobian_pattern().row.size(), 0);
  jacobians_.assign(s, mean_);
  right_.assign(s * n, 0);
  residual_ = right_;
  kinds_.resize(static_cast<std::size_t>(Unknown::Role::stabilizer) + 1);
  for (std::size_t e = 0; e < n; ++e) kinds_[static_cast<std::size_t>(system.unknowns()[e].role)].push_back(e);
}

void StageDerivative::linearize(const RadauStages& stages, const std::function<void(int)>& at_stage) {
  t_ = stages.t;
  h_ = stages.h;
  whole_factored_ = false;
  std::fill(mean_.begin(), mean_.end(), 0.0);
  for (int i = scheme_.stages - 1; i >= 0; --i) {
    auto& J = jacobians_[static_cast<std::size_t>(i)];
    system_.jacobian(scheme_.time(i, t_, h_, stages.t_end), stages.y + i * stages.stride, zero_.data(), 0, J.data());
    at_stage(i);
    for (std::size_t k = 0; k < J.size(); ++k) mean_[k] += scheme_.weight(i) * J[k];
  }
  at_.assign(stages.y, stages.y + n_);
  used_ = stages.factors && stages.matrix->restore(stages.factors) ? stages.matrix : nullptr;
  if (!used_) factor_mean();
}

void StageDerivative::factor_mean() {
  used_ = &matrix_;
  if (const int bad = matrix_.factor(mean_.data(), h_); bad >= 0) throw_singular(bad);
}

void StageDerivative::throw_singular(int unknown) {
  const std::string rows = dependent_row(system_.assembly(), system_.look_state(t_, at_.data()));
  throw SolverError(fmt::format("The derivative of a step of '{}' is singular at t = {:.9g} s, at '{}'.{}{}",
                                scheme_.name, t_, system_.unknowns()[static_cast<std::size_t>(unknown)].name,
                                rows.empty() ? "" : " ", rows));
}

void StageDerivative::subtract_product(const double* x, double* out, bool transposed) const {
  const SparsePattern& p = system_.jacobian_pattern();
  for (int i = 0; i < scheme_.stages; ++i) {
    double* oi = out + static_cast<std::ptrdiff_t>(i) * n_;
    const double* J = jacobians_[static_cast<std::size_t>(i)].data();
    const double* xi = x + static_cast<std::ptrdiff_t>(i) * n_;
    if (transposed)
      add_transposed_product(p, J, -1, xi, oi);
    else
      add_product(p, J, -1, xi, oi);
    Eigen::Map<Eigen::ArrayXd> to(oi, n_);
    for (int j = 0; j < scheme_.stages; ++j)
      to -= ((transposed ? scheme_.w(j, i) : scheme_.w(i, j)) / h_) * differential_.array() *
            Eigen::Map<const Eigen::ArrayXd>(x + static_cast<std::ptrdiff_t>(j) * n_, n_);
  }
}

bool StageDerivative::iterate(const double* b, double* x, bool transposed) {
  const auto n = static_cast<std::size_t>(n_), s = static_cast<std::size_t>(scheme_.stages);
  std::fill(x, x + s * n, 0.0);
  double before = 0;
  for (int k = 0; k < kMostSolveIterations; ++k) {
    std::copy(b, b + s * n, residual_.begin());
    if (k > 0) subtract_product(x, residual_.data(), transposed);
    if (transposed)
      used_->solve_transposed(residual_.data());
    else
      used_->solve(residual_.data());
    for (std::size_t e = 0; e < s * n; ++e) x[e] += residual_[e];
    double size = 0;
    for (const auto& kind : kinds_) {
      double largest = 0, correction = 0;
      for (std::size_t i = 0; i < s; ++i)
        for (const std::size_t e : kind) {
          largest = std::max(largest, std::abs(x[i * n + e]));
          correction = std::max(correction, std::abs(residual_[i * n + e]));
          if (!std::isfinite(residual_[i * n + e])) return false;
        }
      if (largest > 0) size = std::max(size, correction / largest);
    }
    if (size <= kSolveRounding) return true;
    if (k > 0) {
      const double rate = size / before;
      if (rate < 1 && size * rate / (1 - rate) <= kSolveRounding) return true;
      if (size < kSolveNoise && rate > kSolveFalls) return true;
      if (k > 2 && rate > kSlowSolve) return false;
      if (used_ != &matrix_ && size > kSolveNoise && rate > kSlowWithKept) return false;
    }
    before = size;
  }
  return false;
}

void StageDerivative::solve_whole(double* x, bool transposed) {
  const SparsePattern& p = system_.jacobian_pattern();
  const int s = scheme_.stages;
  if (!whole_matrix_) {
    whole_matrix_ = std::make_unique<BlockMatrix>(s * n_);
    std::vector<std::pair<int, int>> entries;
    for (int e = 0; e < n_; ++e)
      if (matrix_.differential()[static_cast<std::size_t>(e)]) entries.emplace_back(e, e);
    const SparsePattern diagonal = SparsePattern::from_entries(n_, n_, entries);
    for (int i = 0; i < s; ++i) {
      blocks_.emplace_back();
      for (int j = 0; j < s; ++j) blocks_.back().push_back(whole_matrix_->place(diagonal, i * n_, j * n_));
      blocks_.back().push_back(whole_matrix_->place(p, i * n_, i * n_));
    }
    whole_matrix_->finalize();
    whole_ = std::make_unique<KluSolver>(whole_matrix_->pattern());
  }
  if (!whole_factored_) {
    whole_matrix_->set_zero();
    for (int i = 0; i < s; ++i) {
      const auto& row = blocks_[static_cast<std::size_t>(i)];
      for (int j = 0; j < s; ++j) whole_matrix_->add_constant(row[static_cast<std::size_t>(j)], scheme_.w(i, j) / h_);
      whole_matrix_->add(row.back(), jacobians_[static_cast<std::size_t>(i)].data());
    }
    if (const int bad = whole_->factor(whole_matrix_->values().data()); bad >= 0) throw_singular(bad % n_);
    whole_factored_ = true;
  }
  if (transposed)
    whole_->solve_transposed(x);
  else
    whole_->solve(x);
}

void StageDerivative::solve(double* x, bool transposed) {
  std::copy(x, x + right_.size(), right_.begin());
  if (!whole_factored_) {
    if (iterate(right_.data(), x, transposed)) return;
    if (used_ != &matrix_) {
      factor_mean();
      if (iterate(right_.data(), x, transposed)) return;
    }
  }
  std::copy(right_.begin(), right_.end(), x);
  solve_whole(x, transposed);
  // Once more for what is left: rows differ widely in size.
  std::copy(right_.begin(), right_.end(), residual_.begin());
  subtract_product(x, residual_.data(), transposed);
  solve_whole(residual_.data(), transposed);
  for (std::size_t e = 0; e < residual_.size(); ++e) x[e] += residual_[e];
}

RadauTangent::RadauTangent(DaeSystem& system, const RadauScheme& scheme)
    : system_(system), scheme_(scheme), derivative_(scheme, system), n_(system.size()), np_(system.parameter_count()) {
  F_rho_.resize(static_cast<std::size_t>(scheme.stages));
  x_.assign(static_cast<std::size_t>(n_) * F_rho_.size(), 0);
  g_.assign(static_cast<std::size_t>(n_), 0);
}

void RadauTangent::step(const RadauStages& stages, double* const* s, double* psi) {
  derivative_.linearize(stages, [&](int i) { system_.parameter_columns(F_rho_[static_cast<std::size_t>(i)]); });
  std::vector<std::vector<double>> costs;
  if (system_.has_running_cost())
    for (int i = 0; i < scheme_.stages; ++i) {
      const double weight = stages.h * scheme_.weight(i);
      rho_.assign(static_cast<std::size_t>(np_), 0);
      system_.running_cost_gradient(scheme_.time(i, stages.t, stages.h, stages.t_end), stages.y + i * stages.stride,
                                    g_.data(), weight, rho_.data());
      for (double& g : g_) g *= weight;
      for (int p = 0; p < np_; ++p) psi[p] += rho_[static_cast<std::size_t>(p)];
      costs.push_back(g_);
    }
  for (int p = 0; p < np_; ++p) {
    for (int i = 0; i < scheme_.stages; ++i) {
      double* x = x_.data() + static_cast<std::ptrdiff_t>(i) * n_;
      const Eigen::MatrixXd& F_rho = F_rho_[static_cast<std::size_t>(i)];
      for (int e = 0; e < n_; ++e)
        x[e] = (derivative_.differential()[static_cast<std::size_t>(e)] ? derivative_.start_weight(i) * s[p][e] : 0) -
               F_rho(e, p);
    }
    derivative_.solve(x_.data());
    for (std::size_t i = 0; i < costs.size(); ++i)
      for (int e = 0; e < n_; ++e)
        psi[p] +=
            costs[i][static_cast<std::size_t>(e)] * x_[i * static_cast<std::size_t>(n_) + static_cast<std::size_t>(e)];
    std::copy(x_.end() - n_, x_.end(), s[p]);
  }
}

RadauAdjoint::RadauAdjoint(DaeSystem& system, const RadauScheme& scheme)
    : system_(system),
      scheme_(scheme),
      derivative_(scheme, system),
      parameter_point_(dynamic_cast<ParameterPoint*>(&system)),
      n_(system.size()) {
  x_.assign(static_cast<std::size_t>(n_) * static_cast<std::size_t>(scheme.stages), 0);
  g_.assign(static_cast<std::size_t>(n_), 0);
  zero_ = g_;
}

// With x = A^-T (h b_i g_y^T, and mu in the last stage):
//   mu before = E sum of start_weight_i x_i,   gradient -= sum of x_i^T F_rho.
void RadauAdjoint::step_back(const RadauStages& stages, double* mu, double* gradient) {
  const auto time = [&](int i) { return scheme_.time(i, stages.t, stages.h, stages.t_end); };
  const auto at = [&](int i) { return x_.data() + static_cast<std::ptrdiff_t>(i) * n_; };
  std::fill(x_.begin(), x_.end(), 0.0);
  derivative_.linearize(stages, [](int) {});
  if (system_.has_running_cost())
    for (int i = 0; i < scheme_.stages; ++i) {
      const double weight = stages.h * scheme_.weight(i);
      system_.running_cost_gradient(time(i), stages.y + i * stages.stride, g_.data(), weight, gradient);
      for (int e = 0; e < n_; ++e) at(i)[e] = weight * g_[static_cast<std::size_t>(e)];
    }
  for (int e = 0; e < n_; ++e) at(scheme_.stages - 1)[e] += mu[e];
  derivative_.solve_transposed(x_.data());
  std::fill(mu, mu + n_, 0.0);
  for (int i = 0; i < scheme_.stages; ++i) {
    for (int e = 0; e < n_; ++e)
      if (derivative_.differential()[static_cast<std::size_t>(e)]) mu[e] += derivative_.start_weight(i) * at(i)[e];
    if (parameter_point_)
      parameter_point_->go_to_parameters(time(i), stages.y + i * stages.stride, zero_.data());
    else
      system_.linearize(time(i), stages.y + i * stages.stride, zero_.data());
    system_.add_parameter_gradient(-1, at(i), gradient);
  }
}

}  // namespace costate
