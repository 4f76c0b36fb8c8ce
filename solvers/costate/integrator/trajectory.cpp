#include "costate/integrator/trajectory.h"

#include <algorithm>
#include <cmath>

namespace costate {

void Trajectory::add_step(double begin, double end, const std::vector<std::vector<double>>& d, int order) {
  steps_.push_back({begin, end, order, coefficients_.size()});
  double factorial = 1;
  for (int k = 0; k <= order; ++k) {
    if (k > 1) factorial *= k;
    for (int i = 0; i < width_; ++i)
      coefficients_.push_back(d[static_cast<std::size_t>(k)][static_cast<std::size_t>(i)] / factorial);
  }
}

void Trajectory::add_step(double begin, double end, int order,
                          const std::function<StateView(double t)>& motion) {
  const int p = order + 2;
  const double h = end - begin, pi = std::acos(-1.0);
  const auto width = static_cast<std::size_t>(width_), degrees = static_cast<std::size_t>(p) + 1;
  // Chebyshev's coefficients in x = 1 + 2 (t - end) / h, from the values at x = cos(pi i / p).
  std::vector<double> chebyshev(degrees * width, 0);
  for (int i = 0; i <= p; ++i) {
    const StateView s = motion(i == 0 ? end : i == p ? begin : end + h * 0.5 * (std::cos(pi * i / p) - 1));
    for (int k = 0; k <= p; ++k) {
      const double weight = (i == 0 || i == p ? 0.5 : 1.0) * (k == 0 || k == p ? 1.0 : 2.0) / p *
                            std::cos(pi * ((i * k) % (2 * p)) / p);
      double* out = chebyshev.data() + static_cast<std::size_t>(k) * width;
      for (int j = 0; j < n_; ++j) {
        out[j] += weight * s.q[j];
        out[n_ + j] += weight * s.v[j];
      }
      for (int j = 0; j < nz_; ++j) out[2 * n_ + j] += weight * s.z[j];
    }
  }
  // T_(k+1) = 2 x T_k - T_(k-1) in powers of (t - end) / h, then of t - end.
  const std::size_t first = coefficients_.size();
  steps_.push_back({begin, end, p, first});
  coefficients_.resize(first + degrees * width, 0);
  std::vector<double> last(degrees, 0), now(degrees, 0), next(degrees, 0);
  now[0] = 1;
  for (std::size_t k = 0; k < degrees; ++k) {
    double power = 1;
    for (std::size_t l = 0; l <= k; ++l, power /= h)
      for (std::size_t j = 0; j < width; ++j)
        coefficients_[first + l * width + j] += now[l] * power * chebyshev[k * width + j];
    const double twice = k == 0 ? 1 : 2;  // T_1 = x
    for (std::size_t l = 0; l < degrees; ++l)
      next[l] = twice * (now[l] + (l > 0 ? 2 * now[l - 1] : 0)) - last[l];
    last = now;
    now = next;
  }
}

void Trajectory::evaluate(double t, double* y) const {
  auto at =
      std::lower_bound(steps_.begin(), steps_.end(), t, [](const Step& s, double x) { return s.end < x; });
  if (at == steps_.end()) --at;
  const double s = std::max(t, steps_.front().begin) - at->end;
  const auto width = static_cast<std::size_t>(width_);
  const double* c = coefficients_.data() + at->first + static_cast<std::size_t>(at->order) * width;
  std::copy(c, c + width, y);
  for (int k = at->order - 1; k >= 0; --k) {
    c -= width;
    for (std::size_t i = 0; i < width; ++i) y[i] = y[i] * s + c[i];
  }
}

}  // namespace costate
