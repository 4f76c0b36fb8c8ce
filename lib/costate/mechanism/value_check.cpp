#include "costate/mechanism/value_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "costate/base/error.h"
#include "costate/base/extrapolated_difference.h"
#include "costate/base/generic_numbers.h"

namespace costate {

namespace {

using Eigen::VectorXd;
using Values = std::vector<double>;

constexpr double kAllowed = 1e-5, kRounding = 1e-9;
// Of products of numbers with positions or velocities, which may be terms of the values and cancel, and the least step
// of a difference in parts of its scale.
constexpr double kOfTerms = 1e-15, kLeastStep = 1e-6;

double size_of(const Values& x) {
  double size = 0;
  for (const double y : x) size = std::max(size, std::abs(y));
  return size > 0 ? size : 1;
}

/// One element at one place. `values`: what dual numbers are the derivatives of.
class Look {
 public:
  using Of = std::function<VectorXd(const ElementPlace&)>;
  Look(const Element& e, const ElementPlace& x, const char* function, Of values)
      : element_(e), place_(x), function_(function), values_(std::move(values)), here_(values_(x)) {}

  /// `by_dual`: the derivative along `direction` of the group's entries.
  void along(const std::string& by, Values ElementPlace::*group, const Values& direction, double scale,
             const VectorXd& by_dual) const {
    judge(by, scale, by_dual,
          extrapolated_difference(
              [&](double h) {
                ElementPlace y = place_;
                for (std::size_t i = 0; i < direction.size(); ++i) (y.*group)[i] += h * direction[i];
                return values_(y);
              },
              scale));
  }
  void along_time(const VectorXd& by_dual) const {
    judge("time", 1, by_dual,
          extrapolated_difference(
              [&](double h) {
                ElementPlace y = place_;
                y.t += h;
                return values_(y);
              },
              1));
  }
  /// Of each number that is looked at; partial(k): the derivative by it.
  template <class Partial>
  void along_numbers(const Mechanism& m, const Partial& partial) const {
    for_numbers(element_, [&](std::size_t k) {
      Values one(place_.p.size());
      one[k] = 1;
      const double size = std::abs(place_.p[k]);
      along("'" + m.numbers()[static_cast<std::size_t>(element_.numbers()[k])].path + "'", &ElementPlace::p, one,
            size > 0 ? size : 1, partial(static_cast<int>(k)));
    });
  }

 private:
  void judge(const std::string& by, double scale, const VectorXd& by_dual,
             const std::optional<VectorXd>& expected) const {
    if (!expected || !by_dual.allFinite() || !here_.allFinite()) return;
    const double rounding =
        kRounding * std::max(here_.lpNorm<Eigen::Infinity>(), expected->lpNorm<Eigen::Infinity>()) +
        kOfTerms * std::max({1.0, size_of(place_.q), size_of(place_.v)}) * size_of(place_.p) / (kLeastStep * scale);
    for (Eigen::Index i = 0; i < expected->size(); ++i) {
      const double dual = by_dual[i], value = (*expected)[i];
      if (std::abs(dual - value) <= kAllowed * std::max(std::abs(dual), std::abs(value)) + rounding) continue;
      throw LostDerivative(
          element_.path(),
          fmt::format("{}() loses a derivative: of its entry {} by {} dual numbers have {:.9g}, and "
                      "differences of its values {:.9g}. All that depends on its arguments has to be "
                      "computed in their own type: value_of(), a cast to double or a branch at a value has "
                      "no derivative.",
                      function_, i, by, dual + 0.0, value));
    }
  }

  const Element& element_;
  const ElementPlace& place_;
  const char* function_;
  Of values_;
  VectorXd here_;
};

/// M d of a column-major n x d.size() matrix.
VectorXd product(const Values& M, const Values& d) {
  const auto rows = static_cast<Eigen::Index>(d.empty() ? 0 : M.size() / d.size()),
             columns = static_cast<Eigen::Index>(d.size());
  return Eigen::Map<const Eigen::MatrixXd>(M.data(), rows, columns) * Eigen::Map<const VectorXd>(d.data(), columns);
}

VectorXd residual(const Body& e, const ElementPlace& x) {
  const auto lifted = [](const Values& of) { return std::vector<PathDual>(of.begin(), of.end()); };
  const std::vector<PathDual> q = lifted(x.q), v = lifted(x.v), a = lifted(x.a), p = lifted(x.p);
  std::vector<PathDual> r(x.q.size());
  e.residual(q.data(), v.data(), a.data(), p.data(), r.data());
  VectorXd values(static_cast<Eigen::Index>(r.size()));
  for (std::size_t i = 0; i < r.size(); ++i) values[static_cast<Eigen::Index>(i)] = value_of(r[i]);
  return values;
}

/// M by dual numbers, which knows of no velocities, is symmetric, and the whole of what accelerations do.
void check_mass(const Body& e, const ElementPlace& x) {
  const std::size_t n = x.q.size();
  const auto mass = [&](const ElementPlace& at) {
    Values M(n * n);
    LocalMatrix to(M.data(), static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(n));
    e.Body::calc_mass(at.view(), to);
    return Eigen::MatrixXd(to);
  };
  ElementPlace still = x;
  for (double& a : still.a) a = 0;
  const Eigen::MatrixXd M = mass(x);
  const double size = M.lpNorm<Eigen::Infinity>();
  const VectorXd a = Eigen::Map<const VectorXd>(x.a.data(), static_cast<Eigen::Index>(n)), here = residual(e, x),
                 rest = residual(e, still);
  const auto require = [&](double off, double of, const char* what) {
    if (off > kAllowed * of)
      throw LostDerivative(e.path(),
                           fmt::format("Its residual is no M(q) a - Q(q, v) with a symmetric M: {} (by {:.3g} of "
                                       "{:.3g}).",
                                       what, off, of));
  };
  require((M - M.transpose()).lpNorm<Eigen::Infinity>(), size, "M, its derivative by accelerations, is not symmetric");
  require((here - rest - M * a).lpNorm<Eigen::Infinity>(),
          std::max({size, here.lpNorm<Eigen::Infinity>(), rest.lpNorm<Eigen::Infinity>()}),
          "it is not linear in accelerations, or what they are multiplied by changes with velocities");
}

}  // namespace

void check_values(const Mechanism& m, const Body& e, const ElementPlace& x) {
  const std::size_t n = x.q.size();
  if (n == 0) return;
  const auto rows = static_cast<Eigen::Index>(n);
  check_mass(e, x);
  const Look look(e, x, "residual", [&](const ElementPlace& y) { return residual(e, y); });
  Values of_q(n * n), of_v(n * n);
  LocalMatrix r_q(of_q.data(), rows, rows), r_v(of_v.data(), rows, rows);
  e.Body::calc_partials(x.view(), r_q, r_v);
  const Values d = generic_numbers(n, 31);
  look.along("positions", &ElementPlace::q, d, size_of(x.q), product(of_q, d));
  look.along("velocities", &ElementPlace::v, d, 1, product(of_v, d));
  look.along_numbers(m, [&](int k) {
    Values r(n);
    e.Body::calc_number_partial(x.view(), k, r.data());
    return VectorXd(Eigen::Map<const VectorXd>(r.data(), rows));
  });
}

void check_values(const Mechanism& m, const Constraint& e, const ElementPlace& x) {
  const std::size_t n = x.q.size(), nr = x.lambda.size();
  if (n == 0 || nr == 0) return;
  const auto rows = static_cast<Eigen::Index>(nr);
  const auto vector = [rows](const Values& of) { return VectorXd(Eigen::Map<const VectorXd>(of.data(), rows)); };
  const Look look(e, x, "phi", [&](const ElementPlace& y) {
    Values phi(nr);
    e.Constraint::calc_phi(y.view(), phi.data());
    return vector(phi);
  });
  Values of_q(nr * n);
  LocalMatrix phi_q(of_q.data(), rows, static_cast<Eigen::Index>(n));
  e.Constraint::calc_phi_q(x.view(), phi_q);
  const Values d = generic_numbers(n, 31);
  look.along("positions", &ElementPlace::q, d, size_of(x.q), product(of_q, d));
  if (e.rheonomic()) {
    Values phi_t(nr);
    e.Constraint::calc_phi_t(x.view(), phi_t.data());
    look.along_time(vector(phi_t));
  }
  look.along_numbers(m, [&](int k) {
    Values r(3 * nr + n);
    e.Constraint::calc_number_partial(x.view(), k, r.data(), r.data() + nr, r.data() + 2 * nr, r.data() + 3 * nr);
    return vector(r);
  });
}

void check_values(const Mechanism& m, const Force& e, const ElementPlace& x) {
  const std::size_t n = x.q.size(), nz = x.z.size();
  if (n + nz == 0) return;
  const auto all = static_cast<Eigen::Index>(n + nz), q = static_cast<Eigen::Index>(n), z = all - q;
  const auto vector = [all](const Values& of) { return VectorXd(Eigen::Map<const VectorXd>(of.data(), all)); };
  const Look look(e, x, "force", [&](const ElementPlace& y) {
    Values r(n + nz);
    e.Force::calc_force(y.view(), r.data(), r.data() + n);
    return vector(r);
  });
  std::array<Values, 6> of{Values(n * n),  Values(n * n),  Values(n * nz),
                           Values(nz * n), Values(nz * n), Values(nz * nz)};
  LocalMatrix Q_q(of[0].data(), q, q), Q_v(of[1].data(), q, q), Q_z(of[2].data(), q, z), f_q(of[3].data(), z, q),
      f_v(of[4].data(), z, q), f_z(of[5].data(), z, z);
  e.Force::calc_partials(x.view(), {Q_q, Q_v, Q_z, f_q, f_v, f_z});
  const Values d = generic_numbers(n, 31), dz = generic_numbers(nz, 33);
  const auto along = [&](const Values& Q, const Values& f, const Values& direction) {
    VectorXd r(all);
    r.head(q) = product(Q, direction);
    if (z > 0) r.tail(z) = product(f, direction);
    return r;
  };
  look.along("positions", &ElementPlace::q, d, size_of(x.q), along(of[0], of[3], d));
  look.along("velocities", &ElementPlace::v, d, 1, along(of[1], of[4], d));
  if (nz > 0) look.along("states", &ElementPlace::z, dz, 1, along(of[2], of[5], dz));
  look.along_numbers(m, [&](int k) {
    Values r(n + nz);
    e.Force::calc_number_partial(x.view(), k, r.data(), r.data() + n);
    return vector(r);
  });
}

}  // namespace costate
