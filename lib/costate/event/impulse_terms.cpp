#include "costate/event/impulse_terms.h"

#include <algorithm>
#include <array>

namespace costate {

namespace {

using Eigen::VectorXd;

PathDual on_line(double x, double dx) { return PathDual(Taylor2(x, dx, 0)); }

/// M y of one body along the direction: residuals at rest with accelerations y and without.
class MassOf {
 public:
  MassOf(const Body& body, const Assembly& assembly, const StateView& s, const Variation& d)
      : body_(body), size_(body.coordinates().size()) {
    for (std::size_t i = 0; i < size_; ++i) {
      const int c = body.coordinates()[i];
      q[i] = on_line(s.q[c], d.q[c]);
    }
    for (const int number : body.numbers())
      p.push_back(on_line(assembly.numbers()[static_cast<std::size_t>(number)], d.numbers[number]));
  }
  void times(const VectorXd& y, const VectorXd* dy) {
    for (std::size_t i = 0; i < size_; ++i) {
      const int c = body_.coordinates()[i];
      y_[i] = on_line(y[c], dy ? (*dy)[c] : 0);
    }
    out.fill(PathDual());
    still_.fill(PathDual());
    body_.residual(q.data(), rest_.data(), y_.data(), p.data(), out.data());
    body_.residual(q.data(), rest_.data(), rest_.data(), p.data(), still_.data());
    for (std::size_t i = 0; i < size_; ++i) out[i] -= still_[i];
  }

  std::array<PathDual, kMaxLocal> q, out;
  std::vector<PathDual> p;

 private:
  const Body& body_;
  std::size_t size_;
  std::array<PathDual, kMaxLocal> y_, still_, rest_ = {};
};

/// One constraint along y, which may change, and the clock, at a point that changes.
class ConstraintAlong {
 public:
  ConstraintAlong(const Constraint& e, const Assembly& assembly, const StateView& s, const Variation& d,
                  const VectorXd& y, const VectorXd* dy, double clock)
      : t(on_line(s.t, clock)), e_(e) {
    for (std::size_t i = 0; i < e.coordinates().size(); ++i) {
      const int c = e.coordinates()[i];
      q[i] = DirectedPathDual(on_line(s.q[c], y[c]));
      q[i].d[0] = on_line(d.q[c], dy ? (*dy)[c] : 0);
    }
    t.d[0] = PathDual(d.t);
    for (const int number : e.numbers()) {
      p.emplace_back(assembly.numbers()[static_cast<std::size_t>(number)]);
      p.back().d[0] = PathDual(d.numbers[number]);
    }
  }
  void evaluate() {
    phi.fill(DirectedPathDual());
    e_.phi_directed(t, q.data(), p.data(), phi.data());
  }
  /// The sum of take(row, Phi) over the rows, with the derivative by x in their values' dual parts.
  template <class Take>
  double seeded(DirectedPathDual& x, const Take& take) {
    x.v.d[0] = Taylor2(1.0);
    evaluate();
    x.v.d[0] = Taylor2();
    double sum = 0;
    for (int r = 0; r < e_.rows(); ++r) sum += take(r, phi[static_cast<std::size_t>(r)]);
    return sum;
  }

  DirectedPathDual t;
  std::array<DirectedPathDual, kMaxLocal> q, phi;
  std::vector<DirectedPathDual> p;

 private:
  const Constraint& e_;
};

/// visit(constraint, its first row) of those that are there.
template <class Visit>
void for_each_constraint(const Assembly& assembly, const Visit& visit) {
  const Mechanism& m = assembly.mechanism();
  for (std::size_t k = 0; k < m.constraints().size(); ++k)
    if (assembly.is_there(m.row_offsets()[k])) visit(*m.constraints()[k], m.row_offsets()[k]);
}

}  // namespace

void add_mass_terms(const Assembly& assembly, const StateView& s, const Variation& d, const Changing& a,
                    const Changing& u, ImpulseDerivatives& out) {
  for (const auto& body : assembly.mechanism().bodies()) {
    MassOf M(*body, assembly, s, d);
    const auto& c = body->coordinates();
    const auto seeded = [&](PathDual& x) {
      x.d[0] = Taylor2(1.0);
      M.times(u.value, &u.change);
      x.d[0] = Taylor2();
      double sum = 0;
      for (std::size_t i = 0; i < c.size(); ++i)
        sum += a.value[c[i]] * M.out[i].d[0].c1 + a.change[c[i]] * M.out[i].d[0].c0;
      return sum;
    };
    for (std::size_t i = 0; !body->constant_mass() && i < c.size(); ++i) out.q[c[i]] -= seeded(M.q[i]);
    for (std::size_t k = 0; k < M.p.size(); ++k)
      if (varies(assembly, body->numbers()[k])) add_number(assembly, body->numbers()[k], -seeded(M.p[k]), out.rho);
  }
}

void add_row_terms(const Assembly& assembly, const StateView& s, const Variation& d, const Changing& w,
                   const Changing& y, double clock, ImpulseDerivatives& out) {
  for_each_constraint(assembly, [&](const Constraint& e, int row) {
    ConstraintAlong phi(e, assembly, s, d, y.value, &y.change, clock);
    const auto take = [&](int r, const DirectedPathDual& f) {
      return w.value[row + r] * f.d[0].d[0].c1 + w.change[row + r] * f.v.d[0].c1;
    };
    for (std::size_t i = 0; i < e.coordinates().size(); ++i) out.q[e.coordinates()[i]] -= phi.seeded(phi.q[i], take);
    out.t -= phi.seeded(phi.t, take);
    for (std::size_t k = 0; k < phi.p.size(); ++k)
      if (varies(assembly, e.numbers()[k])) add_number(assembly, e.numbers()[k], -phi.seeded(phi.p[k], take), out.rho);
  });
}

void subtract_mass_change(const Assembly& assembly, const StateView& s, const Variation& d, const VectorXd& y,
                          double* force) {
  for (const auto& body : assembly.mechanism().bodies()) {
    MassOf M(*body, assembly, s, d);
    M.times(y, nullptr);
    for (std::size_t i = 0; i < body->coordinates().size(); ++i) force[body->coordinates()[i]] -= M.out[i].v.c1;
  }
}

void subtract_row_change(const Assembly& assembly, const StateView& s, const Variation& d, const VectorXd& y,
                         double clock, double* row, const VectorXd* b, double* force) {
  for_each_constraint(assembly, [&](const Constraint& e, int first) {
    ConstraintAlong phi(e, assembly, s, d, y, nullptr, clock);
    phi.evaluate();
    for (int r = 0; r < e.rows(); ++r) row[first + r] -= phi.phi[static_cast<std::size_t>(r)].d[0].v.c1;
    for (std::size_t i = 0; b && i < e.coordinates().size(); ++i)
      force[e.coordinates()[i]] -=
          phi.seeded(phi.q[i], [&](int r, const DirectedPathDual& f) { return (*b)[first + r] * f.d[0].d[0].c0; });
  });
}

}  // namespace costate
