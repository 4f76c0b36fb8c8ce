// psi beside IDAS's unknowns, where these tell it nothing. IDAS asks the unknowns first whether a lower order would do,
// and the quadratures only where these said no: states that are constant, or polynomials of low degree, have an error
// of 0 <= 0 at any order, and IDAS stays at a low one whatever psi needs (a cost that moves with time over a mechanism
// that stands still took 4e5 steps at rtol 1e-10). Where that is seen, a new session goes on with psi as one more
// unknown. psi itself and its gradient stay the quadratures.
#include <algorithm>
#include <cmath>

#include "costate/integrator/ida_session.h"

namespace costate {

namespace {
constexpr int kLow = 2;            // an order that IDAS passes within its first steps
constexpr long kLong = 40;         // steps in a row
constexpr double kNoError = 1e-3;  // of the tolerance: an error of the states that asks for no order
}  // namespace

bool IdaSession::asks_for_lead() {
  if (start_.led || !system_.has_running_cost() || q_.size() == 0) return false;
  int order = 0;
  IDAGetLastOrder(memory_, &order);
  low_ = order <= kLow && states_have_no_error() ? low_ + 1 : 0;
  return low_ >= kLong;
}

bool IdaSession::states_have_no_error() {
  Vector errors(y_.size(), context_), weights(y_.size(), context_);
  if (IDAGetEstLocalErrors(memory_, errors) < 0 || IDAGetErrWeights(memory_, weights) < 0) return false;
  for (int i = 0; i < system_.size(); ++i)
    if (id_.data()[i] != 0 && !(std::abs(errors.data()[i]) * weights.data()[i] < kNoError)) return false;
  return true;
}

void IdaSession::begin_lead() {
  const int n = system_.size();
  y_.data()[n] = start_.cost;
  yp_.data()[n] = system_.running_cost(t_, y_.data());
}

void IdaSession::begin_lead_sensitivities() {
  const int n = system_.size();
  prepare_lead_tangent(t_, y_.data());
  for (int j = 0; j < yS_.count(); ++j) {
    const auto k = static_cast<std::size_t>(j);
    yS_.data(j)[n] = k < start_.cost_gradient.size() ? start_.cost_gradient[k] : 0;
    ypS_.data(j)[n] = lead_tangent(yS_.data(j), j);
  }
}

void IdaSession::prepare_lead_tangent(double t, const double* y) {
  lead_g_y_.assign(static_cast<std::size_t>(system_.size()), 0);
  lead_g_rho_.assign(static_cast<std::size_t>(system_.parameter_count()), 0);
  system_.running_cost_gradient(t, y, lead_g_y_.data(), 1, lead_g_rho_.data());
}

// d(psi')/d(rho_j) = g_y s_j + g_rho_j
double IdaSession::lead_tangent(const double* s, int j) const {
  double sum = lead_g_rho_[static_cast<std::size_t>(j)];
  for (int i = 0; i < system_.size(); ++i) sum += lead_g_y_[static_cast<std::size_t>(i)] * s[i];
  return sum;
}

void IdaSession::factor_lead(double t, const double* y) {
  lead_g_.assign(static_cast<std::size_t>(system_.size()), 0);
  system_.running_cost_gradient(t, y, lead_g_.data(), 0, nullptr);
}

// The last row of Newton's system: cj dpsi - g_y dy = r.
void IdaSession::solve_newton(double* b) {
  system_.solve(b);
  if (led() > 0) {
    const int n = system_.size();
    for (int i = 0; i < n; ++i) b[n] += lead_g_[static_cast<std::size_t>(i)] * b[i];
    b[n] /= cj_;
  }
  scale_newton(memory_, cj_, id_, b);
}

std::vector<Unknown> IdaSession::names() const {
  std::vector<Unknown> r = system_.unknowns();
  if (led() > 0) r.push_back({"psi", "1", Unknown::Role::force_state, true, true});
  return r;
}

}  // namespace costate
