#include "costate/discrete/explicit_derivative.h"

#include <algorithm>

#include "costate/base/error.h"

namespace costate {

namespace {
double entry(const ExplicitScheme& scheme, int i, int j) {
  const auto& row = scheme.a[static_cast<std::size_t>(i)];
  return static_cast<std::size_t>(j) < row.size() ? row[static_cast<std::size_t>(j)] : 0;
}

StageAdjoint& stage_adjoint_of(OdeSystem& system) {
  auto* adjoint = dynamic_cast<StageAdjoint*>(&system);
  if (!adjoint)
    throw CapabilityError(
        "The discrete adjoint needs transposed products at the stages of a step, which this formulation's equations do "
        "not give (StageAdjoint). Take discrete-tangent, or cvodes-adjoint.");
  return *adjoint;
}
}  // namespace

ExplicitTangent::ExplicitTangent(OdeSystem& system, const ExplicitScheme& scheme)
    : system_(system), scheme_(scheme), n_(system.size()), np_(system.parameter_count()) {
  const auto columns = static_cast<std::size_t>(n_) * static_cast<std::size_t>(np_);
  rates_.assign(columns * static_cast<std::size_t>(scheme.stages), 0);
  at_.assign(columns, 0);
  cost_.assign(static_cast<std::size_t>(np_), 0);
  in_.resize(static_cast<std::size_t>(np_));
  out_.resize(static_cast<std::size_t>(np_));
}

void ExplicitTangent::step(const ExplicitStages& stages, double* const* s, double* psi) {
  const auto column = static_cast<std::ptrdiff_t>(n_), block = column * np_;
  for (int i = 0; i < scheme_.stages; ++i) {
    double* k = rates_.data() + i * block;
    for (int p = 0; p < np_; ++p) {
      double* at = at_.data() + p * column;
      std::fill(at, at + n_, 0.0);
      for (int j = 0; j < i; ++j) {
        const double a = entry(scheme_, i, j);
        if (a == 0) continue;
        const double* kj = rates_.data() + j * block + p * column;
        for (int e = 0; e < n_; ++e) at[e] += a * kj[e];
      }
      for (int e = 0; e < n_; ++e) at[e] = s[p][e] + stages.h * at[e];
      in_[static_cast<std::size_t>(p)] = at;
      out_[static_cast<std::size_t>(p)] = k + p * column;
    }
    const double t = scheme_.time(i, stages.t, stages.h, stages.t_end);
    const double* y = stages.y + i * stages.stride;
    system_.tangent(t, y, in_.data(), out_.data(), np_, true);
    if (!system_.has_running_cost() || scheme_.weight(i) == 0) continue;
    system_.tangent_running_cost(t, y, in_.data(), cost_.data(), np_);
    for (int p = 0; p < np_; ++p) psi[p] += stages.h * scheme_.weight(i) * cost_[static_cast<std::size_t>(p)];
  }
  for (int i = 0; i < scheme_.stages; ++i) {
    if (scheme_.weight(i) == 0) continue;
    for (int p = 0; p < np_; ++p) {
      const double* k = rates_.data() + i * block + p * column;
      for (int e = 0; e < n_; ++e) s[p][e] += stages.h * scheme_.weight(i) * k[e];
    }
  }
}

ExplicitAdjoint::ExplicitAdjoint(OdeSystem& system, const ExplicitScheme& scheme)
    : system_(stage_adjoint_of(system)),
      scheme_(scheme),
      n_(system.size()),
      has_cost_(system.has_running_cost()),
      pulled_(static_cast<std::size_t>(n_) * static_cast<std::size_t>(scheme.stages)),
      weight_(static_cast<std::size_t>(n_)) {}

// With w_i the weight that k_i has in what follows, w_i = h (b_i mu + sum over j > i of a_ji p_j), and what it pulls
// back to Y_i, p_i = f_y^T w_i + h b_i g_y^T:  mu before = mu + sum of p_i.
void ExplicitAdjoint::step_back(const ExplicitStages& stages, double* mu, double* gradient) {
  const double h = stages.h;
  for (int i = scheme_.stages - 1; i >= 0; --i) {
    const double b = scheme_.weight(i);
    double* w = weight_.data();
    for (int e = 0; e < n_; ++e) w[e] = b * mu[e];
    for (int j = i + 1; j < scheme_.stages; ++j) {
      const double a = entry(scheme_, j, i);
      if (a == 0) continue;
      const double* p = pulled_.data() + static_cast<std::ptrdiff_t>(j) * n_;
      for (int e = 0; e < n_; ++e) w[e] += a * p[e];
    }
    for (int e = 0; e < n_; ++e) w[e] *= h;
    const double* y = stages.y + i * stages.stride;
    const double t = scheme_.time(i, stages.t, h, stages.t_end);
    // Where it cannot be brought back it is solved again.
    if (stages.records) system_.bring_back(t, y, stages.records + static_cast<std::size_t>(i) * stages.record);
    system_.pull_stage(t, y, w, has_cost_ ? h * b : 0, pulled_.data() + static_cast<std::ptrdiff_t>(i) * n_, gradient);
  }
  for (int i = 0; i < scheme_.stages; ++i) {
    const double* p = pulled_.data() + static_cast<std::ptrdiff_t>(i) * n_;
    for (int e = 0; e < n_; ++e) mu[e] += p[e];
  }
}

}  // namespace costate
