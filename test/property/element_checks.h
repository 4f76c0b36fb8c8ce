// Checks of one element at one local state: hand-written blocks equal the dual-number ones, and these equal
// differences of values, order by order.
#pragma once

#include <fmt/format.h>
#include <support/differences.h>

#include <Eigen/Dense>
#include <catch2/catch.hpp>

#include "costate/element/element.h"

namespace costate::test {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

constexpr double kHandTolerance = 1e-13;       // hand against dual: rounding only
constexpr double kDifferenceTolerance = 2e-9;  // dual against extrapolated differences: eps / step

/// d f / d x_j for all j by extrapolated central differences.
template <class F>
Matrix differences(const Vector& x, const F& f) {
  if (x.size() == 0) return Matrix(Vector(f(x)).size(), 0);
  return difference_jacobian(f, x, 2e-3);
}

inline double size(const Matrix& m) { return m.size() == 0 ? 0 : m.cwiseAbs().maxCoeff(); }

inline void require_equal(const std::string& what, const Matrix& found, const Matrix& expected, double tolerance) {
  REQUIRE(found.rows() == expected.rows());
  REQUIRE(found.cols() == expected.cols());
  const double allowed = tolerance * std::max({1.0, size(expected), size(found)});
  Eigen::Index row = 0, column = 0;
  const double worst = found.size() == 0 ? 0 : (found - expected).cwiseAbs().maxCoeff(&row, &column);
  INFO(what << ": entry (" << row << ", " << column << ") is " << (found.size() ? found(row, column) : 0)
            << ", expected " << (found.size() ? expected(row, column) : 0) << "; allowed difference " << allowed
            << ", found " << worst);
  REQUIRE(worst <= allowed);
}

/// The local arguments of an element as vectors that can be changed.
struct Local {
  double t = 0;
  Vector q, v, a, lambda, z, p;
  LocalState view() const { return {t, q.data(), v.data(), a.data(), lambda.data(), z.data(), p.data()}; }
  Local with_q(const Vector& x) const { return with(&Local::q, x); }
  Local with_v(const Vector& x) const { return with(&Local::v, x); }
  Local with_z(const Vector& x) const { return with(&Local::z, x); }
  Local with_p(const Vector& x) const { return with(&Local::p, x); }

 private:
  Local with(Vector Local::*member, const Vector& x) const {
    Local r = *this;
    r.*member = x;
    return r;
  }
};

/// A block from a function that fills a map.
template <class F>
Matrix block(Eigen::Index rows, Eigen::Index columns, const F& fill) {
  Matrix m = Matrix::Zero(rows, columns);
  LocalMatrix map(m.data(), rows, columns);
  fill(map);
  return m;
}
template <class F>
Vector column(Eigen::Index rows, const F& fill) {
  Vector m = Vector::Zero(rows);
  fill(m.data());
  return m;
}

/// Weights between -1 and 1 without a pattern.
inline Vector weights(Eigen::Index count, int seed) {
  return Vector::NullaryExpr(count, [seed](Eigen::Index i) { return std::sin(1.7 * static_cast<double>(i) + seed); });
}

/// Sums of weighted derivatives by all numbers at once, and by every other one, added to what is there; `sizes`: sums
/// of the magnitudes of what is weighted, the weights being at most 1.
template <class Add>
void check_sums(const std::string& what, const Vector& expected, const Vector& sizes, const Add& add) {
  const double size = std::max(1.0, sizes.size() == 0 ? 0.0 : sizes.maxCoeff());
  for (const int step : {1, 2}) {
    std::vector<int> numbers;
    for (int k = 0; k < expected.size(); k += step) numbers.push_back(k);
    std::vector<double> found(numbers.size(), 0.5);
    add(numbers.data(), static_cast<int>(numbers.size()), found.data());
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      const double value = 0.5 + expected[numbers[i]];
      INFO(what << ": number " << numbers[i] << " gives " << found[i] << ", expected " << value << "; sizes up to "
                << size);
      REQUIRE(std::abs(found[i] - value) <= kHandTolerance * size);
    }
  }
}

// Bodies.

inline Matrix mass(const Body& e, const Local& s) {
  return block(s.q.size(), s.q.size(), [&](LocalMatrix& m) { e.Body::calc_mass(s.view(), m); });
}
inline Vector force(const Body& e, const Local& s) {
  return column(s.q.size(), [&](double* out) { e.Body::calc_force(s.view(), out); });
}
inline Vector residual(const Body& e, const Local& s) {
  const auto lift = [](const Vector& x) { return std::vector<PathDual>(x.data(), x.data() + x.size()); };
  const auto q = lift(s.q), v = lift(s.v), a = lift(s.a), p = lift(s.p);
  std::vector<PathDual> r(q.size());
  e.residual(q.data(), v.data(), a.data(), p.data(), r.data());
  Vector out(s.q.size());
  for (std::size_t i = 0; i < r.size(); ++i) out[static_cast<int>(i)] = r[i].v.c0;
  return out;
}

/// Measures on plain numbers are those on path duals; returns how many there are on plain numbers.
inline int check_measures(const Element& e, const Local& s) {
  const auto lift = [](const Vector& x) { return std::vector<PathDual>(x.data(), x.data() + x.size()); };
  const auto q = lift(s.q), v = lift(s.v), a = lift(s.a), lambda = lift(s.lambda), z = lift(s.z), p = lift(s.p);
  const MeasureArguments dual{PathDual(s.t), q.data(), v.data(), a.data(), lambda.data(), z.data(), p.data()};
  const ValueArguments plain{s.t, s.q.data(), s.v.data(), s.a.data(), s.lambda.data(), s.z.data(), s.p.data()};
  int plain_ones = 0;
  const auto measures = e.measures();
  for (int i = 0; i < static_cast<int>(measures.size()); ++i) {
    double value = 0;
    if (!e.measure_value(i, plain, value)) continue;
    ++plain_ones;
    const double expected = e.measure(i, dual).v.c0;
    INFO(measures[static_cast<std::size_t>(i)].name << " is " << value << ", " << expected << " on path duals");
    REQUIRE(std::abs(value - expected) <= kHandTolerance * std::max(1.0, std::abs(expected)));
  }
  return plain_ones;
}

inline void check(const Body& e, const Local& s) {
  const auto n = s.q.size();
  const Matrix M = block(n, n, [&](LocalMatrix& m) { e.calc_mass(s.view(), m); });
  require_equal("mass", M, mass(e, s), kHandTolerance);
  require_equal("force", column(n, [&](double* out) { e.calc_force(s.view(), out); }), force(e, s), kHandTolerance);
  require_equal("residual", M * s.a - force(e, s), residual(e, s), kHandTolerance);

  Matrix r_q = Matrix::Zero(n, n), r_v = r_q, dual_q = r_q, dual_v = r_q;
  LocalMatrix map_q(r_q.data(), n, n), map_v(r_v.data(), n, n), map_dq(dual_q.data(), n, n),
      map_dv(dual_v.data(), n, n);
  e.calc_partials(s.view(), map_q, map_v);
  e.Body::calc_partials(s.view(), map_dq, map_dv);
  require_equal("r_q", r_q, dual_q, kHandTolerance);
  require_equal("r_v", r_v, dual_v, kHandTolerance);
  require_equal("r_q by differences", dual_q,
                differences(s.q, [&](const Vector& x) { return residual(e, s.with_q(x)); }), kDifferenceTolerance);
  require_equal("r_v by differences", dual_v,
                differences(s.v, [&](const Vector& x) { return residual(e, s.with_v(x)); }), kDifferenceTolerance);
  const Matrix r_p = differences(s.p, [&](const Vector& x) { return residual(e, s.with_p(x)); });
  for (int k = 0; k < s.p.size(); ++k) {
    const Vector hand = column(n, [&](double* out) { e.calc_number_partial(s.view(), k, out); });
    const Vector dual = column(n, [&](double* out) { e.Body::calc_number_partial(s.view(), k, out); });
    require_equal(fmt::format("number {}", k), hand, dual, kHandTolerance);
    require_equal(fmt::format("number {} by differences", k), dual, r_p.col(k), kDifferenceTolerance);
  }

  require_equal("symmetry of the mass matrix", M, M.transpose(), 0);
  const Vector eigenvalues = Eigen::SelfAdjointEigenSolver<Matrix>(M).eigenvalues();
  INFO("smallest eigenvalue of the mass matrix " << eigenvalues.minCoeff());
  REQUIRE(eigenvalues.minCoeff() >= -1e-13 * size(M));

  const Vector elsewhere = Vector::LinSpaced(n, -1.5, 0.7);
  if (e.constant_mass()) require_equal("constant mass", mass(e, s.with_q(elsewhere)), mass(e, s), 0);
  if (e.constant_force())
    require_equal("constant force", force(e, s.with_q(elsewhere).with_v(elsewhere)), force(e, s), 0);
  const auto potential = [&](const Vector& x) { return Vector::Constant(1, e.potential_energy(s.with_q(x).view())); };
  require_equal("weight from the potential energy", -differences(s.q, potential).transpose(),
                force(e, s.with_v(Vector::Zero(n))), kDifferenceTolerance);
}

// Constraints.

inline Matrix phi_q(const Constraint& e, const Local& s) {
  return block(e.rows(), s.q.size(), [&](LocalMatrix& m) { e.Constraint::calc_phi_q(s.view(), m); });
}
inline Vector phi_t(const Constraint& e, const Local& s) {
  return column(e.rows(), [&](double* out) { e.Constraint::calc_phi_t(s.view(), out); });
}
inline Vector bias(const Constraint& e, const Local& s) {
  return column(e.rows(), [&](double* out) { e.Constraint::calc_bias(s.view(), out); });
}
inline Vector phi(const Constraint& e, const Local& s) {
  return column(e.rows(), [&](double* out) { e.calc_phi(s.view(), out); });
}
inline Vector phid(const Constraint& e, const Local& s) { return phi_q(e, s) * s.v + phi_t(e, s); }
inline Vector phidd(const Constraint& e, const Local& s) { return phi_q(e, s) * s.a + bias(e, s); }
inline Vector reaction(const Constraint& e, const Local& s) { return phi_q(e, s).transpose() * s.lambda; }

inline void check(const Constraint& e, const Local& s) {
  const auto n = s.q.size();
  const int m = e.rows();
  require_equal("phi", phi(e, s), column(m, [&](double* out) { e.Constraint::calc_phi(s.view(), out); }),
                kHandTolerance);
  require_equal("phi_q", block(m, n, [&](LocalMatrix& x) { e.calc_phi_q(s.view(), x); }), phi_q(e, s), kHandTolerance);
  require_equal("phi_t", column(m, [&](double* out) { e.calc_phi_t(s.view(), out); }), phi_t(e, s), kHandTolerance);
  require_equal("bias", column(m, [&](double* out) { e.calc_bias(s.view(), out); }), bias(e, s), kHandTolerance);
  if (!e.rheonomic()) REQUIRE(size(phi_t(e, s)) == 0);

  struct Blocks {
    Matrix hessian, phid_q, phidd_q;
    Blocks(Eigen::Index rows, Eigen::Index size)
        : hessian(Matrix::Zero(size, size)), phid_q(Matrix::Zero(rows, size)), phidd_q(phid_q) {}
  };
  Blocks hand(m, n), dual(m, n);
  {
    LocalMatrix h(hand.hessian.data(), n, n), d(hand.phid_q.data(), m, n), dd(hand.phidd_q.data(), m, n);
    e.calc_partials(s.view(), h, d, dd);
  }
  {
    LocalMatrix h(dual.hessian.data(), n, n), d(dual.phid_q.data(), m, n), dd(dual.phidd_q.data(), m, n);
    e.Constraint::calc_partials(s.view(), h, d, dd);
  }
  require_equal("hessian", hand.hessian, dual.hessian, kHandTolerance);
  require_equal("hessian alone", block(n, n, [&](LocalMatrix& x) { e.calc_hessian(s.view(), x); }), dual.hessian,
                kHandTolerance);
  require_equal("phid_q", hand.phid_q, dual.phid_q, kHandTolerance);
  require_equal("phidd_q", hand.phidd_q, dual.phidd_q, kHandTolerance);

  // Each order by differences of the one below.
  const auto by_q = [&](const auto& f) { return differences(s.q, [&](const Vector& x) { return f(e, s.with_q(x)); }); };
  require_equal("phi_q by differences", phi_q(e, s), by_q(phi), kDifferenceTolerance);
  require_equal("hessian by differences", dual.hessian, by_q(reaction), kDifferenceTolerance);
  require_equal("phid_q by differences", dual.phid_q, by_q(phid), kDifferenceTolerance);
  require_equal("phidd_q by differences", dual.phidd_q, by_q(phidd), kDifferenceTolerance);
  const auto along = [&](const Vector& x) {  // the state at s.t + x on the path with velocity v, acceleration a
    Local r = s;
    r.t += x[0];
    r.q += x[0] * s.v + x[0] * x[0] / 2 * s.a;
    r.v += x[0] * s.a;
    return r;
  };
  const Vector now = Vector::Zero(1);
  require_equal("phid by differences", phid(e, s), differences(now, [&](const Vector& x) { return phi(e, along(x)); }),
                kDifferenceTolerance);
  require_equal("phidd by differences", phidd(e, s),
                differences(now, [&](const Vector& x) { return phid(e, along(x)); }), kDifferenceTolerance);

  const auto by_p = [&](const auto& f) { return differences(s.p, [&](const Vector& x) { return f(e, s.with_p(x)); }); };
  const Matrix phi_p = by_p(phi), phid_p = by_p(phid), phidd_p = by_p(phidd), reaction_p = by_p(reaction);
  const Vector w0 = weights(m, 1), w1 = weights(m, 2), w2 = weights(m, 3), w_reaction = weights(n, 4);
  Vector plain = Vector::Zero(s.p.size()), sizes = plain, with_reaction = plain;
  for (int k = 0; k < s.p.size(); ++k) {
    Vector p0 = Vector::Zero(m), p1 = p0, p2 = p0, r = Vector::Zero(n), d0 = p0, d1 = p0, d2 = p0, dr = r;
    e.calc_number_partial(s.view(), k, p0.data(), p1.data(), p2.data(), r.data());
    e.Constraint::calc_number_partial(s.view(), k, d0.data(), d1.data(), d2.data(), dr.data());
    const std::string name = fmt::format("number {}: ", k);
    require_equal(name + "phi", p0, d0, kHandTolerance);
    require_equal(name + "phid", p1, d1, kHandTolerance);
    require_equal(name + "phidd", p2, d2, kHandTolerance);
    require_equal(name + "reaction", r, dr, kHandTolerance);
    require_equal(name + "phi by differences", d0, phi_p.col(k), kDifferenceTolerance);
    require_equal(name + "phid by differences", d1, phid_p.col(k), kDifferenceTolerance);
    require_equal(name + "phidd by differences", d2, phidd_p.col(k), kDifferenceTolerance);
    require_equal(name + "reaction by differences", dr, reaction_p.col(k), kDifferenceTolerance);
    plain[k] = w0.dot(d0) + w1.dot(d1) + w2.dot(d2);
    with_reaction[k] = plain[k] + w_reaction.dot(dr);
    sizes[k] = d0.cwiseAbs().sum() + d1.cwiseAbs().sum() + d2.cwiseAbs().sum() + dr.cwiseAbs().sum();
  }
  const auto add = [&](const double* reaction_weights) {
    return [&s, &e, w = ConstraintWeights{w0.data(), w1.data(), w2.data(), reaction_weights}](const int* numbers,
                                                                                              int count, double* out) {
      for (int i = 0; i < count; ++i) out[i] += e.calc_number_gradient(s.view(), numbers[i], w);
    };
  };
  check_sums("weighted sum by the numbers", plain, sizes, add(nullptr));
  check_sums("weighted sum with the reaction by the numbers", with_reaction, sizes, add(w_reaction.data()));
}

// Forces.

/// Q and zdot, one above the other.
inline Vector force(const Force& e, const Local& s) {
  const auto n = s.q.size();
  Vector out = Vector::Zero(n + e.states());
  e.calc_force(s.view(), out.data(), out.data() + n);
  return out;
}

struct ForceBlocks {
  Matrix Q_q, Q_v, Q_z, f_q, f_v, f_z;
  template <class Calculate>
  ForceBlocks(Eigen::Index n, Eigen::Index nz, const Calculate& calculate)
      : Q_q(Matrix::Zero(n, n)),
        Q_v(Q_q),
        Q_z(Matrix::Zero(n, nz)),
        f_q(Matrix::Zero(nz, n)),
        f_v(f_q),
        f_z(Matrix::Zero(nz, nz)) {
    LocalMatrix a(Q_q.data(), n, n), b(Q_v.data(), n, n), c(Q_z.data(), n, nz), d(f_q.data(), nz, n),
        f(f_v.data(), nz, n), g(f_z.data(), nz, nz);
    calculate(ForcePartials{a, b, c, d, f, g});
  }
};

inline void check(const Force& e, const Local& s) {
  const auto n = s.q.size(), nz = s.z.size();
  Vector dual_force = Vector::Zero(n + nz);
  e.Force::calc_force(s.view(), dual_force.data(), dual_force.data() + n);
  require_equal("Q and zdot", force(e, s), dual_force, kHandTolerance);

  const ForceBlocks hand(n, nz, [&](ForcePartials out) { e.calc_partials(s.view(), out); });
  const ForceBlocks dual(n, nz, [&](ForcePartials out) { e.Force::calc_partials(s.view(), out); });
  require_equal("Q_q", hand.Q_q, dual.Q_q, kHandTolerance);
  require_equal("Q_v", hand.Q_v, dual.Q_v, kHandTolerance);
  require_equal("Q_z", hand.Q_z, dual.Q_z, kHandTolerance);
  require_equal("f_q", hand.f_q, dual.f_q, kHandTolerance);
  require_equal("f_v", hand.f_v, dual.f_v, kHandTolerance);
  require_equal("f_z", hand.f_z, dual.f_z, kHandTolerance);
  const Matrix by_q = differences(s.q, [&](const Vector& x) { return force(e, s.with_q(x)); });
  const Matrix by_v = differences(s.v, [&](const Vector& x) { return force(e, s.with_v(x)); });
  const Matrix by_z = differences(s.z, [&](const Vector& x) { return force(e, s.with_z(x)); });
  require_equal("Q_q by differences", dual.Q_q, by_q.topRows(n), kDifferenceTolerance);
  require_equal("Q_v by differences", dual.Q_v, by_v.topRows(n), kDifferenceTolerance);
  require_equal("Q_z by differences", dual.Q_z, by_z.topRows(n), kDifferenceTolerance);
  require_equal("f_q by differences", dual.f_q, by_q.bottomRows(nz), kDifferenceTolerance);
  require_equal("f_v by differences", dual.f_v, by_v.bottomRows(nz), kDifferenceTolerance);
  require_equal("f_z by differences", dual.f_z, by_z.bottomRows(nz), kDifferenceTolerance);

  const Matrix by_p = differences(s.p, [&](const Vector& x) { return force(e, s.with_p(x)); });
  const Vector w_Q = weights(n, 1), w_f = weights(nz, 2);
  Vector of_force = Vector::Zero(s.p.size()), of_states = of_force, sizes = of_force;
  for (int k = 0; k < s.p.size(); ++k) {
    Vector found = Vector::Zero(n + nz), dual_p = found;
    e.calc_number_partial(s.view(), k, found.data(), found.data() + n);
    e.Force::calc_number_partial(s.view(), k, dual_p.data(), dual_p.data() + n);
    require_equal(fmt::format("number {}", k), found, dual_p, kHandTolerance);
    require_equal(fmt::format("number {} by differences", k), dual_p, by_p.col(k), kDifferenceTolerance);
    of_force[k] = w_Q.dot(dual_p.head(n));
    of_states[k] = w_f.dot(dual_p.tail(nz));
    sizes[k] = dual_p.cwiseAbs().sum();
  }
  const auto add = [&](const double* force_weights, const double* state_weights) {
    return [&s, &e, force_weights, state_weights](const int* numbers, int count, double* out) {
      e.add_number_gradient(s.view(), force_weights, state_weights, numbers, count, out);
    };
  };
  check_sums("weighted force by the numbers", of_force, sizes, add(w_Q.data(), nullptr));
  check_sums("weighted rates by the numbers", of_states, sizes, add(nullptr, w_f.data()));
  check_sums("weighted sum by the numbers", of_force + of_states, sizes, add(w_Q.data(), w_f.data()));

  const auto potential = [&](const Vector& x) { return Vector::Constant(1, e.potential_energy(s.with_q(x).view())); };
  if (e.potential_energy(s.view()) != 0)
    require_equal("force at rest from the potential energy", -differences(s.q, potential).transpose(),
                  force(e, s.with_v(Vector::Zero(n))).head(n), kDifferenceTolerance);
}

}  // namespace costate::test
