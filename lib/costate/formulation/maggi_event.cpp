#include "costate/formulation/maggi_event.h"

#include <algorithm>

namespace costate {

void cross_event(MaggiLevel& level, MotionEvents& events, int event, double* yd, double* z) {
  const StateView before = level.state();
  level.forget_branch();
  std::vector<double> v(before.v, before.v + level.assembly().n());
  events.cross(event, before, v.data(), z);
  const auto& independent = level.independent();
  for (std::size_t i = 0; i < independent.size(); ++i) yd[i] = v[static_cast<std::size_t>(independent[i])];
}

void cross_event_tangent(MaggiLevel& level, MotionEvents& events, int event, const MotionEvents::Side& minus,
                         const MotionEvents::Side& plus, double* const* s, int count, double* dcost) {
  const int n = level.assembly().n(), nz = level.assembly().nz(), f = level.freedoms();
  const auto width = static_cast<std::size_t>(2 * n + nz);
  level.push(s, count, false, true);
  std::vector<double> x(width * static_cast<std::size_t>(count));
  std::vector<double*> columns;
  for (int j = 0; j < count; ++j) {
    double* c = x.data() + static_cast<std::size_t>(j) * width;
    std::copy_n(level.dq(j), n, c);
    std::copy_n(level.dv(j), n, c + n);
    std::copy_n(s[j] + 2 * f, nz, c + 2 * n);
    columns.push_back(c);
  }
  events.tangent(event, level.state(), minus, plus, columns.data(), count, dcost);
  const auto& independent = level.independent();
  for (int j = 0; j < count; ++j) {
    const double* c = columns[static_cast<std::size_t>(j)];
    for (int i = 0; i < f; ++i) {
      s[j][i] = c[independent[static_cast<std::size_t>(i)]];
      s[j][f + i] = c[n + independent[static_cast<std::size_t>(i)]];
    }
    std::copy_n(c + 2 * n, nz, s[j] + 2 * f);
  }
}

void cross_event_adjoint(MaggiLevel& level, MotionEvents& events, int event, const MotionEvents::Side& minus,
                         const MotionEvents::Side& plus, const double* mu, ScalarGradient& weights, double* gradient) {
  const int n = level.assembly().n(), nz = level.assembly().nz(), f = level.freedoms();
  std::vector<double> w(static_cast<std::size_t>(2 * n + nz), 0);
  const auto& independent = level.independent();
  for (int i = 0; i < f; ++i) {
    const int k = independent[static_cast<std::size_t>(i)];
    w[static_cast<std::size_t>(k)] = mu[i];
    w[static_cast<std::size_t>(n + k)] = mu[f + i];
  }
  std::copy(mu + 2 * f, mu + 2 * f + nz, w.begin() + 2 * n);
  events.adjoint(event, level.state(), minus, plus, w.data(), gradient);
  weights.set_zero();
  std::copy_n(w.data(), n, weights.q.data());
  std::copy_n(w.data() + n, n, weights.v.data());
  std::copy_n(w.data() + 2 * n, nz, weights.z.data());
}

}  // namespace costate
