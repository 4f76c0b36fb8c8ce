#include "costate/formulation/consistent_state.h"

#include <algorithm>

namespace costate {

StateView ConsistentState::view(double t, const double* y) const {
  StateView s;
  s.t = t;
  s.q = y;
  s.v = y + assembly_.n();
  s.z = s.v + assembly_.n();
  s.a = s.z + assembly_.nz();
  s.lambda = s.a + assembly_.n();
  return s;
}

void ConsistentState::complete(double t, double* y, double* yp) {
  const int n = assembly_.n(), nz = assembly_.nz();
  level_.solve(view(t, y));
  std::copy(level_.a(), level_.a() + n + assembly_.m(), y + 2 * n + nz);
  std::copy(y + n, y + 2 * n, yp);
  std::copy(level_.a(), level_.a() + n, yp + n);
  std::copy(assembly_.zdot.begin(), assembly_.zdot.end(), yp + 2 * n);
}

void ConsistentState::complete_columns(double* const* s, double* const* sp, int count) {
  const int n = assembly_.n(), nz = assembly_.nz();
  level_.linearize();
  assembly_.calc_parameter_columns(level_.state(), columns_);
  Eigen::MatrixXd x(n + assembly_.m(), count);
  level_.solve_tangent(s, count, &columns_, x.data());
  for (int j = 0; j < count; ++j) {
    const double *sv = s[j] + n, *sa = x.col(j).data();
    std::copy(sa, sa + x.rows(), s[j] + 2 * n + nz);
    std::copy(sv, sv + n, sp[j]);
    std::copy(sa, sa + n, sp[j] + n);
    Eigen::Map<Eigen::VectorXd>(sp[j] + 2 * n, nz) = columns_.f.col(j);
    level_.add_state_rows(1, s[j], sv, sv + n, sp[j] + 2 * n);
  }
}

Start ConsistentState::start(double t, bool columns, double* y, double* yp) {
  const int n = assembly_.n();
  Start s = find_start(assembly_, t, columns);
  std::fill(y, y + size_, 0.0);
  std::fill(yp, yp + size_, 0.0);
  std::copy(s.q.data(), s.q.data() + n, y);
  std::copy(s.v.data(), s.v.data() + n, y + n);
  std::copy(s.z.data(), s.z.data() + assembly_.nz(), y + 2 * n);
  complete(t, y, yp);
  return s;
}

void ConsistentState::take(const double* v, double t_after, double* y, double* yp) {
  std::copy(v, v + assembly_.n(), y + assembly_.n());
  complete(t_after, y, yp);
}

void ConsistentState::jump(double t, double t_after, double* y, double* yp) {
  take(jump_.calc(view(t, y), t_after), t_after, y, yp);
}

void ConsistentState::jump_tangent(double t, double t_after, double* y, double* yp, double* const* s, int count,
                                   const MovingTime* moving) {
  take(jump_.tangent(view(t, y), t_after, s, count, moving), t_after, y, yp);
}

void ConsistentState::jump_adjoint(double t, double t_after, const double* y, double* mu, double* gradient,
                                   const MovingTime* moving) {
  jump_.adjoint(view(t, y), t_after, mu, gradient, moving);
}

}  // namespace costate
