// A clock beside IDAS's unknowns, where these tell it nothing. IDAS asks the unknowns first whether a lower order would
// do, and the sensitivities and quadratures only where these said no: states that are constant, or polynomials of low
// degree, have an error of 0 <= 0 at any order, and IDAS stays at a low one whatever psi or a derivative needs (a cost
// that moves with time over a mechanism that stands still took 4e5 steps at rtol 1e-10, the derivative of a ball that
// comes to rest 3e5). Where that is seen, a new session goes on with one more unknown, sin(t / a part of the run), in
// units of the tolerance: too small to hold up a step, but smooth at every order.
#include <algorithm>
#include <cmath>

#include "costate/integrator/ida_session.h"

namespace costate {

namespace {
constexpr int kLow = 2;            // an order that IDAS passes within its first steps
constexpr long kLong = 40;         // steps in a row
constexpr double kNoError = 1e-3;  // of the tolerance: an error of the states that asks for no order
constexpr double kClock = 0.05;
}  // namespace

bool IdaSession::asks_for_lead() {
  if (start_.led || (q_.size() == 0 && yS_.count() == 0)) return false;
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

double IdaSession::clock_rate(double t) const {
  const double unit = kClock * (options_.t_end - options_.t_start);
  return std::cos((t - start_time_) / unit) / unit;
}

void IdaSession::begin_lead() {
  const int n = system_.size();
  y_.data()[n] = 0;
  yp_.data()[n] = clock_rate(t_);
}

void IdaSession::solve_newton(double* b) {
  scale_newton(memory_, cj_, id_, b);
  system_.solve(b);
  if (led() > 0) b[system_.size()] /= cj_;
}

std::vector<Unknown> IdaSession::names() const {
  std::vector<Unknown> r = system_.unknowns();
  if (led() > 0) r.push_back({"clock", "1", Unknown::Role::force_state, true, true});
  return r;
}

}  // namespace costate
