#include "costate/formulation/hessian_systems.h"

#include <fmt/format.h>

#include <algorithm>

#include "costate/base/error.h"
#include "costate/level/unknown_names.h"

namespace costate {

namespace {

[[noreturn]] void no_sensitivities() {
  throw CapabilityError("The passes of a Hessian have no sensitivities of their own; ask for the Hessian instead.");
}

/// `column` is "d1." and so on: the unknowns of one column after those of the motion.
void append_column(const Mechanism& mechanism, const std::string& column, std::vector<Unknown>& unknowns) {
  std::vector<Unknown> of_motion;
  append_differential_unknowns(mechanism, of_motion);
  for (Unknown& u : of_motion) {
    u.name = column + u.name;
    unknowns.push_back(std::move(u));
  }
}

std::shared_ptr<const Mechanism> mechanism_of(const HessianEquations& e) { return e.assembly().mechanism_ptr(); }

}  // namespace

HessianPass::HessianPass(HessianEquations& equations)
    : OdeSystem(mechanism_of(equations), equations.assembly().parameters(), {}),
      equations_(equations),
      newton_(mechanism_of(equations), equations.assembly().parameters(), {}, equations.stabilization()),
      columns_(1 + equations.directions()) {}

void HessianPass::set_parameters(const double* rho) {
  OdeSystem::set_parameters(rho);
  newton_.set_parameters(rho);
}

void HessianPass::jump(double t, double*) {
  throw CapabilityError(
      fmt::format("A driver's law has a kink at t = {:.6g} s, where the velocities jump; second derivatives are not "
                  "carried across, in "
                  "any formulation. Take a law with a continuous slope, or leave the Hessian out.",
                  segment_start(t)));
}

void HessianPass::append_columns(const std::string& first, const std::string& others) {
  append_column(assembly_.mechanism(), first, unknowns_);
  for (int k = 1; k < columns_; ++k) append_column(assembly_.mechanism(), fmt::format("{}{}.", others, k), unknowns_);
}

void HessianPass::solve_columns(double* b, bool transposed) {
  for (int k = 0; k < columns_; ++k, b += equations_.state_size())
    transposed ? newton_.solve_transposed(b) : newton_.solve(b);
}

void HessianPass::tangent(double, const double*, const double* const*, double* const*, int, bool) {
  no_sensitivities();
}
void HessianPass::tangent_running_cost(double, const double*, const double* const*, double*, int) {
  no_sensitivities();
}
void HessianPass::tangent_terminal_cost(double, const double*, const double* const*, double*, int) {
  no_sensitivities();
}
void HessianPass::running_cost_gradient(double, const double*, double*) { no_sensitivities(); }
void HessianPass::adjoint_rhs(double, const double*, const double*, double*) { no_sensitivities(); }
void HessianPass::adjoint_integrand(double, const double*, const double*, double*) { no_sensitivities(); }
void HessianPass::terminal_adjoint(double, const double*, double*, double*) { no_sensitivities(); }

TangentMotion::TangentMotion(HessianEquations& equations) : HessianPass(equations) { append_columns("", "d"); }

void TangentMotion::rhs(double t, const double* y, double* f) {
  const int N = equations_.state_size();
  equations_.motion(t, y, y + N, f, f + N);
}

void TangentMotion::start(double t, double* y, Eigen::MatrixXd*) {
  equations_.start(t, y, y + equations_.state_size());
}

HessianAdjoint::HessianAdjoint(HessianEquations& equations, Motion motion, double t_end, double scale)
    : HessianPass(equations), motion_(std::move(motion)), t_end_(t_end), scale_(scale) {
  for (const Parameter& p : assembly_.parameters().parameters) parameter_scale_.push_back(p.scale);
  append_columns("mu.", "dmu");
  for (int k = 0; k < columns_; ++k)
    for (const auto& name : assembly_.parameters().names())
      unknowns_.push_back(
          {(k == 0 ? "gradient." : fmt::format("product{}.", k)) + name, "1", Unknown::Role::force_state, true, true});
  const auto size = static_cast<std::size_t>(this->size());
  point_.assign(static_cast<std::size_t>(columns_ * equations.state_size()), 0);
  unscaled_.assign(size, 0);
  rates_.assign(size, 0);
}

// Without those of the base: kinks are times of the motion, not of tau, and the motion has none.
void HessianAdjoint::set_parameters(const double* rho) {
  assembly_.set_parameters(rho);
  newton_.set_parameters(rho);
}

double HessianAdjoint::at(double tau) {
  const double t = std::clamp(t_end_ - tau, from_, to_);
  motion_(t, point_.data());
  return t;
}

MechanismState HessianAdjoint::mechanism_state(double tau, const double*) {
  const double t = at(tau);
  return newton_.mechanism_state(t, point_.data());
}

void HessianAdjoint::rhs(double tau, const double* y, double* f) {
  const int N = equations_.state_size(), np = equations_.parameter_count(), all = columns_ * N;
  const double t = at(tau);
  equations_.evaluate(t, point_.data(), point_.data() + N);
  for (int i = 0; i < all; ++i) unscaled_[static_cast<std::size_t>(i)] = scale_ * y[i];
  double *r = rates_.data(), *q = r + all;
  equations_.adjoint(unscaled_.data(), unscaled_.data() + N, r, r + N, q, q + np);
  for (int i = 0; i < all; ++i) f[i] = -r[i] / scale_;
  for (int k = 0; k < columns_; ++k)
    for (int j = 0; j < np; ++j)
      f[all + k * np + j] = q[k * np + j] * parameter_scale_[static_cast<std::size_t>(j)] / scale_;
}

void HessianAdjoint::factor(double tau, const double*, double gamma) {
  const double t = at(tau);
  newton_.factor(t, point_.data(), gamma);
}

void HessianAdjoint::cross(const HessianEquations::Bend& bend, double* y) {
  const int N = equations_.state_size(), np = equations_.parameter_count(), all = columns_ * N;
  for (int i = 0; i < all; ++i) unscaled_[static_cast<std::size_t>(i)] = scale_ * y[i];
  std::vector<double> products(static_cast<std::size_t>((columns_ - 1) * np), 0);
  equations_.cross_bend(bend, unscaled_.data(), unscaled_.data() + N, products.data());
  for (int i = N; i < all; ++i) y[i] = unscaled_[static_cast<std::size_t>(i)] / scale_;
  for (std::size_t i = 0; i < products.size(); ++i)
    y[all + np + static_cast<int>(i)] += products[i] * parameter_scale_[i % static_cast<std::size_t>(np)] / scale_;
}

void HessianAdjoint::start(double tau, double* y, Eigen::MatrixXd*) {
  const int N = equations_.state_size(), np = equations_.parameter_count(), all = columns_ * N;
  const double t = at(tau);
  equations_.evaluate(t, point_.data(), point_.data() + N);
  double* q = y + all;
  std::fill(q, q + columns_ * np, 0.0);
  equations_.end(y, y + N, q, q + np);
  for (int i = 0; i < all; ++i) y[i] /= scale_;
  for (int k = 0; k < columns_; ++k)
    for (int j = 0; j < np; ++j) q[k * np + j] *= parameter_scale_[static_cast<std::size_t>(j)] / scale_;
}

void HessianAdjoint::finish(double t, const double* y, double* gradient, double* products) {
  const int N = equations_.state_size(), np = equations_.parameter_count(), all = columns_ * N;
  for (int i = 0; i < all; ++i) unscaled_[static_cast<std::size_t>(i)] = scale_ * y[i];
  for (int k = 0; k < columns_; ++k)
    for (int j = 0; j < np; ++j)
      (k == 0 ? gradient : products + static_cast<std::ptrdiff_t>(k - 1) * np)[j] =
          y[all + k * np + j] * scale_ / parameter_scale_[static_cast<std::size_t>(j)];
  equations_.begin(t, unscaled_.data(), unscaled_.data() + N, gradient, products);
}

}  // namespace costate
