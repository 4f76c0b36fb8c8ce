#include "costate/formulation/maggi_event.h"

#include <algorithm>

namespace costate {

void read_coordinates(MaggiLevel& level, const StateView& s, double* y) {
  const auto f = static_cast<std::size_t>(level.freedoms());
  const auto& independent = level.independent();
  std::fill(y + independent.size(), y + f, 0.0);
  std::fill(y + f + independent.size(), y + 2 * f, 0.0);
  for (std::size_t i = 0; i < independent.size(); ++i) {
    y[i] = s.q[independent[i]];
    y[f + i] = s.v[independent[i]];
  }
  read_places(level.assembly(), s, level.places(), y + independent.size());
}

void push_coordinates(MaggiLevel& level, const StateView& s, const double* const* dq, const double* const* dv,
                      double* const* out, int count) {
  const auto f = static_cast<std::size_t>(level.freedoms());
  const auto& independent = level.independent();
  std::vector<double*> places;
  for (int j = 0; j < count; ++j) {
    std::fill(out[j] + f + independent.size(), out[j] + 2 * f, 0.0);
    for (std::size_t i = 0; i < independent.size(); ++i) {
      out[j][i] = dq[j][independent[i]];
      out[j][f + i] = dv[j][independent[i]];
    }
    places.push_back(out[j] + independent.size());
  }
  push_places(level.assembly(), s, level.places(), dq, places.data(), count);
}

void push_start(MaggiLevel& level, const Start& start, double t, Eigen::MatrixXd& y_rho) {
  const int np = level.assembly().np();
  std::vector<const double*> q, v;
  std::vector<double*> columns;
  for (int j = 0; j < np; ++j) {
    q.push_back(start.q_rho.col(j).data());
    v.push_back(start.v_rho.col(j).data());
    columns.push_back(y_rho.col(j).data());
  }
  push_coordinates(level, start.state(t), q.data(), v.data(), columns.data(), np);
  y_rho.middleRows(2 * level.freedoms(), level.assembly().nz()) = start.z_rho;
}

void pull_coordinates(MaggiLevel& level, const StateView& s, const double* mu, double* w_q, double* w_v,
                      double* gradient) {
  const auto f = static_cast<std::size_t>(level.freedoms());
  const auto& independent = level.independent();
  for (std::size_t i = 0; i < independent.size(); ++i) {
    w_q[independent[i]] += mu[i];
    w_v[independent[i]] += mu[f + i];
  }
  pull_places(level.assembly(), s, level.places(), mu + independent.size(), w_q, gradient);
}

void cross_event(MaggiLevel& level, MotionEvents& events, int event, double* y, int chart) {
  const int f = level.freedoms();
  const StateView before = level.state();
  level.forget_branch();
  std::vector<double> v(before.v, before.v + level.assembly().n());
  events.cross(event, before, v.data(), y + 2 * f);
  if (level.assembly().has_switched_rows()) {
    StateView after = before;
    after.v = v.data();
    after.z = y + 2 * f;
    level.enter_rows(after, chart);
    return read_coordinates(level, after, y);
  }
  const auto& independent = level.independent();
  for (std::size_t i = 0; i < independent.size(); ++i)
    y[static_cast<std::size_t>(f) + i] = v[static_cast<std::size_t>(independent[i])];
}

void cross_event_tangent(MaggiLevel& level, MotionEvents& events, int event, const MotionEvents::Side& minus,
                         const MotionEvents::Side& plus, int chart, const double* z_after, double* const* s, int count,
                         double* dcost) {
  const int n = level.assembly().n(), nz = level.assembly().nz(), f = level.freedoms();
  const auto width = static_cast<std::size_t>(2 * n + nz);
  level.push(s, count, false, true);
  std::vector<double> x(width * static_cast<std::size_t>(count));
  std::vector<double*> columns, rates;
  for (int j = 0; j < count; ++j) {
    double* c = x.data() + static_cast<std::size_t>(j) * width;
    std::copy_n(level.dq(j), n, c);
    std::copy_n(level.dv(j), n, c + n);
    std::copy_n(s[j] + 2 * f, nz, c + 2 * n);
    columns.push_back(c);
    rates.push_back(c + n);
  }
  StateView after = level.state();
  events.tangent(event, after, minus, plus, columns.data(), count, dcost);
  level.use_chart(chart);
  after.z = z_after;
  push_coordinates(level, after, columns.data(), rates.data(), s, count);
  for (int j = 0; j < count; ++j) std::copy_n(columns[static_cast<std::size_t>(j)] + 2 * n, nz, s[j] + 2 * f);
}

void cross_event_adjoint(MaggiLevel& level, MotionEvents& events, int event, const MotionEvents::Side& minus,
                         const MotionEvents::Side& plus, int chart, const double* z_after, const double* mu,
                         ScalarGradient& weights, double* gradient) {
  const int n = level.assembly().n(), nz = level.assembly().nz(), f = level.freedoms(), chart_before = level.chart();
  std::vector<double> w(static_cast<std::size_t>(2 * n + nz), 0), z(level.state().z, level.state().z + nz);
  StateView before = level.state(), after = before;
  before.z = z.data();
  after.z = z_after;
  level.use_chart(chart);
  pull_coordinates(level, after, mu, w.data(), w.data() + n, gradient);
  level.use_chart(chart_before);
  std::copy(mu + 2 * f, mu + 2 * f + nz, w.begin() + 2 * n);
  events.adjoint(event, before, minus, plus, w.data(), gradient);
  weights = weights_of(level.assembly(), w.data());
}

ScalarGradient weights_of(const Assembly& assembly, const double* w) {
  ScalarGradient weights;
  weights.resize(assembly);
  weights.set_zero();
  std::copy_n(w, assembly.n(), weights.q.data());
  std::copy_n(w + assembly.n(), assembly.n(), weights.v.data());
  std::copy_n(w + 2 * assembly.n(), assembly.nz(), weights.z.data());
  return weights;
}

}  // namespace costate
