#include "costate/analysis/not_finite.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace costate {

namespace {

bool finite(const double* x, std::size_t count) {
  return std::all_of(x, x + count, [](double e) { return std::isfinite(e); });
}

bool finite(const std::vector<double>& x) { return finite(x.data(), x.size()); }

[[noreturn]] void fail(const Element& e, const char* what, const StateView& s) {
  throw NotFinite(e.path(),
                  fmt::format("{} is not a finite number at t = {:.9g} s. A formula is outside its domain there "
                              "(a division by zero, the logarithm or root of a negative number), or numbers are "
                              "so large that they overflow.",
                              what, s.t),
                  s.t);
}

}  // namespace

void require_finite(Assembly& assembly, const StateView& s) {
  const bool dynamics = s.v != nullptr && (s.z != nullptr || assembly.nz() == 0);
  if (finite(assembly.phi) && finite(assembly.phi_q) && finite(assembly.phi_t) &&
      (!dynamics || (finite(assembly.Q) && finite(assembly.M) && finite(assembly.zdot) && finite(assembly.bias))))
    return;
  const Mechanism& m = assembly.mechanism();
  for (int i = 0; i < assembly.n(); ++i)
    if (!std::isfinite(s.q[i]) || (s.v && !std::isfinite(s.v[i])))
      throw ModelError("", fmt::format("The motion of '{}' is not a finite number at t = {:.9g} s.",
                                       m.coordinates()[static_cast<std::size_t>(i)].name, s.t));
  double x[kMaxLocal], y[kMaxLocal], block[kMaxLocal * kMaxLocal];
  for (const auto& c : m.constraints()) {
    const LocalState l = assembly.gather(*c, 0, s);
    const auto rows = static_cast<std::size_t>(c->rows()), n = c->coordinates().size();
    LocalMatrix J(block, c->rows(), static_cast<int>(n));
    J.setZero();
    std::fill(x, x + kMaxLocal, 0.0);
    std::fill(y, y + kMaxLocal, 0.0);
    c->calc_phi(l, x);
    c->calc_phi_q(l, J);
    if (c->rheonomic()) c->calc_phi_t(l, y);
    if (!finite(x, rows) || !finite(block, rows * n)) fail(*c, "Its constraint", s);
    if (!finite(y, rows)) fail(*c, "The rate of its constraint", s);
    if (!dynamics) continue;
    std::fill(y, y + kMaxLocal, 0.0);
    c->calc_bias(l, y);
    if (!finite(y, rows)) fail(*c, "The acceleration of its constraint", s);
  }
  if (!dynamics) return;
  for (const auto& f : m.forces()) {
    std::fill(x, x + kMaxLocal, 0.0);
    std::fill(y, y + kMaxLocal, 0.0);
    f->calc_force(assembly.gather(*f, 0, s), x, y);
    if (!finite(x, f->coordinates().size())) fail(*f, "Its force", s);
    if (!finite(y, static_cast<std::size_t>(f->states()))) fail(*f, "The rate of its state", s);
  }
  for (const auto& b : m.bodies()) {
    const auto n = b->coordinates().size();
    const LocalState l = assembly.gather(*b, 0, s);
    LocalMatrix M(block, static_cast<int>(n), static_cast<int>(n));
    M.setZero();
    std::fill(x, x + kMaxLocal, 0.0);
    b->calc_mass(l, M);
    b->calc_force(l, x);
    if (!finite(block, n * n) || !finite(x, n)) fail(*b, "Its inertia or weight", s);
  }
}

void require_finite_partials(const Assembly& assembly, double t) {
  for (std::size_t k = 0; k < assembly.K.size(); ++k)
    if (!std::isfinite(assembly.K[k] + assembly.C[k]))
      throw SolverError(fmt::format(
          "The derivatives of the force on '{}' are not finite at t = {:.9g} s: a formula or a law is at the edge of "
          "its domain there (a root of zero). Move the start away from it, or write it so that it has a slope.",
          assembly.mechanism().coordinates()[static_cast<std::size_t>(assembly.square().row[k])].name, t));
}

}  // namespace costate
