#include "costate/formulation/maggi_kink.h"

#include <algorithm>

#include "costate/level/velocity_jump.h"

namespace costate {

namespace {
class MaggiBalance final : public ImpulseBalance {
 public:
  explicit MaggiBalance(MaggiLevel& level) : level_(level) {}
  void prepare(const StateView& s) override { level_.assembly().calc_dynamics(s); }
  void solve(double* b) override { level_.solve_impulses(b); }

 private:
  MaggiLevel& level_;
};
}  // namespace

MaggiKink::MaggiKink(MaggiLevel& level) : level_(level) {
  if (level.assembly().has_switched_rows())
    jump_ = std::make_unique<VelocityJump>(level.assembly(), level.with_multipliers());
  else
    jump_ = std::make_unique<ImpulseJump>(level.assembly(), std::make_unique<MaggiBalance>(level));
  weights_.resize(level.assembly());
}

void MaggiKink::cross(double t_after, double* yd) {
  level_.forget_branch();
  const double* v = jump_->calc(level_.state(), t_after);
  const auto& independent = level_.independent();
  for (std::size_t i = 0; i < independent.size(); ++i) yd[i] = v[independent[i]];
}

void MaggiKink::tangent(double t_after, double* const* s, int count, const MovingTime* moving) {
  const int n = level_.assembly().n(), nz = level_.assembly().nz(), f = level_.freedoms();
  const auto width = static_cast<std::size_t>(2 * n + nz);
  level_.push(s, count, false, true);
  std::vector<double> y(width * static_cast<std::size_t>(count));
  std::vector<double*> columns;
  for (int j = 0; j < count; ++j) {
    double* c = y.data() + static_cast<std::size_t>(j) * width;
    std::copy_n(level_.dq(j), n, c);
    std::copy_n(level_.dv(j), n, c + n);
    std::copy_n(s[j] + 2 * f, nz, c + 2 * n);
    columns.push_back(c);
  }
  jump_->tangent(level_.state(), t_after, columns.data(), count, moving);
  const auto& independent = level_.independent();
  for (int j = 0; j < count; ++j) {
    const double* c = columns[static_cast<std::size_t>(j)];
    for (std::size_t i = 0; i < independent.size(); ++i) {
      s[j][i] = c[independent[i]];
      s[j][static_cast<std::size_t>(f) + i] = c[n + independent[i]];
    }
    std::copy_n(c + 2 * n, nz, s[j] + 2 * f);
  }
}

const ScalarGradient& MaggiKink::adjoint(double t_after, const double* mu, double* gradient, const MovingTime* moving) {
  const int n = level_.assembly().n(), nz = level_.assembly().nz(), f = level_.freedoms();
  std::vector<double> w(static_cast<std::size_t>(2 * n + nz), 0);
  const auto& independent = level_.independent();
  for (std::size_t i = 0; i < independent.size(); ++i) {
    w[static_cast<std::size_t>(independent[i])] = mu[i];
    w[static_cast<std::size_t>(n + independent[i])] = mu[static_cast<std::size_t>(f) + i];
  }
  std::copy(mu + 2 * f, mu + 2 * f + nz, w.begin() + 2 * n);
  jump_->adjoint(level_.state(), t_after, w.data(), gradient, moving);
  weights_.set_zero();
  std::copy_n(w.data(), n, weights_.q.data());
  std::copy_n(w.data() + n, n, weights_.v.data());
  std::copy_n(w.data() + 2 * n, nz, weights_.z.data());
  return weights_;
}

}  // namespace costate
