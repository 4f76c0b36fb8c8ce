#include "costate/assembly/second_terms.h"

#include <algorithm>
#include <array>

#include "costate/element/switched_rows.h"

namespace costate {

namespace {

using Local = std::array<PathDual, kMaxLocal>;
using DirectedLocal = std::array<DirectedPathDual, kMaxLocal>;

// Numbers can be many (a table's values), so they live in per-thread buffers that grow once.
template <class S>
std::vector<S>& number_buffer(std::size_t n) {
  thread_local std::vector<S> buffer;
  if (buffer.size() < n) buffer.resize(n);
  return buffer;
}

/// The numbers of an element on straight lines along the variation.
PathDual* load_numbers(const Element& e, const Assembly& assembly, const Variation& d) {
  auto& p = number_buffer<PathDual>(e.numbers().size() + 1);
  for (std::size_t i = 0; i < e.numbers().size(); ++i)
    p[i] = PathDual(Taylor2(assembly.numbers()[e.numbers()[i]], d.numbers[e.numbers()[i]], 0));
  return p.data();
}

bool takes_part(const Element& e, const Assembly& assembly, const Variation& d) {
  return std::any_of(e.numbers().begin(), e.numbers().end(),
                     [&](int k) { return d.numbers[k] != 0 || !assembly.number_columns()[k].empty(); });
}

/// derivative(local number) for every number of the element that a parameter acts on.
template <class Derivative>
void for_each_active(const Element& e, const Assembly& assembly, double* rho, const Derivative& derivative) {
  for (std::size_t i = 0; i < e.numbers().size(); ++i) {
    const auto& columns = assembly.number_columns()[e.numbers()[i]];
    if (columns.empty()) continue;
    const double x = derivative(i);
    for (const auto& [column, c] : columns) rho[column] += c * x;
  }
}

/// The straight line x + s dx as a path: first-order changes are then rates.
PathDual line(double x, double dx) { return PathDual(Taylor2(x, dx, 0)); }

void add_body(const Body& e, const Assembly& assembly, const StateView& s, const Variation& d, const double* weight,
              const GradientTarget& out) {
  const bool constant = e.constant_mass() && e.constant_force();
  if (constant && !takes_part(e, assembly, d)) return;
  const auto& c = e.coordinates();
  const std::size_t n = c.size();
  Local q, v, a, r;
  for (std::size_t i = 0; i < n; ++i) {
    q[i] = line(s.q[c[i]], d.q[c[i]]);
    v[i] = line(s.v[c[i]], d.v[c[i]]);
    a[i] = line(s.a[c[i]], d.a[c[i]]);
  }
  PathDual* p = load_numbers(e, assembly, d);
  const auto seeded = [&](PathDual& x) {
    x.d[0] = Taylor2(1.0);
    std::fill(r.begin(), r.begin() + static_cast<std::ptrdiff_t>(n), PathDual());
    e.residual(q.data(), v.data(), a.data(), p, r.data());
    x.d[0] = Taylor2(0.0);
    double sum = 0;
    for (std::size_t i = 0; i < n; ++i) sum += weight[c[i]] * r[i].d[0].c1;
    return sum;
  };
  for (std::size_t i = 0; i < n; ++i) {
    if (!constant) {
      out.q[c[i]] += seeded(q[i]);
      out.v[c[i]] += seeded(v[i]);
    }
    out.a[c[i]] += seeded(a[i]);
  }
  for_each_active(e, assembly, out.rho, [&](std::size_t k) { return seeded(p[k]); });
}

void add_force(const Force& e, int z0, const Assembly& assembly, const StateView& s, const Variation& d,
               const TermWeights& w, const GradientTarget& out) {
  const auto& c = e.coordinates();
  const std::size_t n = c.size(), nz = static_cast<std::size_t>(e.states());
  Local q, v, z, Q, f;
  for (std::size_t i = 0; i < n; ++i) {
    q[i] = line(s.q[c[i]], d.q[c[i]]);
    v[i] = line(s.v[c[i]], d.v[c[i]]);
  }
  double* out_z = nz > 0 ? out.z + z0 : nullptr;
  for (std::size_t i = 0; i < nz; ++i) z[i] = line(s.z[z0 + i], d.z[z0 + i]);
  PathDual* p = load_numbers(e, assembly, d);
  PathDual t = line(s.t, d.t);
  const auto seeded = [&](PathDual& x) {
    x.d[0] = Taylor2(1.0);
    std::fill(Q.begin(), Q.begin() + static_cast<std::ptrdiff_t>(n), PathDual());
    std::fill(f.begin(), f.begin() + static_cast<std::ptrdiff_t>(nz), PathDual());
    e.force(t, q.data(), v.data(), z.data(), p, Q.data(), f.data());
    x.d[0] = Taylor2(0.0);
    double sum = 0;
    if (w.force)
      for (std::size_t i = 0; i < n; ++i) sum -= w.force[c[i]] * Q[i].d[0].c1;
    if (w.state)
      for (std::size_t i = 0; i < nz; ++i) sum += w.state[z0 + i] * f[i].d[0].c1;
    return sum;
  };
  for (std::size_t i = 0; i < n; ++i) {
    out.q[c[i]] += seeded(q[i]);
    out.v[c[i]] += seeded(v[i]);
  }
  for (std::size_t i = 0; i < nz; ++i) out_z[i] += seeded(z[i]);
  if (out.t) *out.t += seeded(t);
  for_each_active(e, assembly, out.rho, [&](std::size_t k) { return seeded(p[k]); });
}

/// One constraint. Along the motion a derivative with respect to q_j gives those with respect to v_j and a_j:
/// Phid_v = Phi_q, Phidd_v = 2 Phid_q, Phidd_a = Phi_q; the direction changes all of them alike.
class ConstraintTerms {
 public:
  ConstraintTerms(const Constraint& e, int row, const Assembly& assembly, const StateView& s, const Variation& d,
                  const TermWeights& w)
      : e_(e), c_(e.coordinates()), rows_(e.rows()), row_(row), s_(s), d_(d), w_(w) {
    auto& p = number_buffer<DirectedPathDual>(e.numbers().size() + 1);
    for (std::size_t i = 0; i < e.numbers().size(); ++i) {
      p[i] = DirectedPathDual(assembly.numbers()[e.numbers()[i]]);
      p[i].d[0] = PathDual(d.numbers[e.numbers()[i]]);
    }
    p_ = p.data();
  }

  void add(const Assembly& assembly, const GradientTarget& out) {
    if (w_.phi || w_.phid || w_.phidd) {
      for (std::size_t i = 0; i < c_.size(); ++i) {
        const int k = c_[i];
        q_[i] = DirectedPathDual(PathDual(Taylor2(s_.q[k], s_.v[k], s_.a[k])));
        q_[i].d[0] = PathDual(Taylor2(d_.q[k], d_.v[k], d_.a[k]));
      }
      t_ = DirectedPathDual(PathDual(Taylor2(s_.t, 1, 0)));
      t_.d[0] = PathDual(d_.t);
      const auto* switched = dynamic_cast<const SwitchedRows*>(&e_);
      for (std::size_t j = 0; j < c_.size(); ++j) {
        seed(q_[j]);
        for (int r = 0; r < rows_; ++r) {
          const Taylor2& x = f_[r].d[0].d[0];
          const double w0 = at(w_.phi, r), w1 = at(w_.phid, r), w2 = at(w_.phidd, r);
          out.q[c_[j]] += w0 * x.c0 + w1 * x.c1 + w2 * x.c2;
          if (switched && !switched->is_integrable(r)) continue;
          out.v[c_[j]] += w1 * x.c0 + 2 * w2 * x.c1;
          out.a[c_[j]] += w2 * x.c0;
        }
        if (switched) add_rates_of_rolling(*switched, q_[j], out.v[c_[j]], out.a[c_[j]]);
      }
      for_each_active(e_, assembly, out.rho, [&](std::size_t k) {
        seed(p_[k]);
        return weighted([](int) { return true; });
      });
    }
    if (w_.force) add_reaction(assembly, out);
  }

 private:
  /// force^T Phi_q^T lambda is lambda^T times the rate of Phi along q + s force.
  void add_reaction(const Assembly& assembly, const GradientTarget& out) {
    for (std::size_t i = 0; i < c_.size(); ++i) {
      const int k = c_[i];
      q_[i] = DirectedPathDual(PathDual(Taylor2(s_.q[k], w_.force[k], 0)));
      q_[i].d[0] = PathDual(d_.q[k]);
    }
    t_ = DirectedPathDual(s_.t);
    t_.d[0] = PathDual(d_.t);
    const auto seeded = [&](DirectedPathDual& x) {
      seed(x);
      double sum = 0;
      for (int r = 0; r < rows_; ++r)
        sum += s_.lambda[row_ + r] * f_[r].d[0].d[0].c1 + d_.lambda[row_ + r] * f_[r].v.d[0].c1;
      return sum;
    };
    evaluate();
    for (int r = 0; r < rows_; ++r) out.lambda[row_ + r] += f_[r].d[0].v.c1;
    for (std::size_t j = 0; j < c_.size(); ++j) out.q[c_[j]] += seeded(q_[j]);
    for_each_active(e_, assembly, out.rho, [&](std::size_t k) { return seeded(p_[k]); });
  }

  /// Of rows that are no functions of places, linear in the rates, v and a have derivatives of their own.
  void add_rates_of_rolling(const SwitchedRows& switched, DirectedPathDual& x, double& by_v, double& by_a) {
    const auto rolls = [&](int r) { return !switched.is_integrable(r); };
    bool any = false;
    for (int r = 0; r < rows_; ++r) any = any || rolls(r);
    if (!any) return;
    seed(x, Taylor2(0, 1, 0));
    by_v += weighted(rolls);
    seed(x, Taylor2(0, 0, 1));
    by_a += weighted(rolls);
  }
  /// The weighted sum of the rows' mixed derivatives, of those that count.
  template <class Counts>
  double weighted(const Counts& counts) const {
    double sum = 0;
    for (int r = 0; r < rows_; ++r) {
      const Taylor2& x = f_[r].d[0].d[0];
      if (counts(r)) sum += at(w_.phi, r) * x.c0 + at(w_.phid, r) * x.c1 + at(w_.phidd, r) * x.c2;
    }
    return sum;
  }
  double at(const double* w, int r) const { return w ? w[row_ + r] : 0; }
  void evaluate() {
    std::fill(f_.begin(), f_.begin() + rows_, DirectedPathDual());
    e_.phi_directed(t_, q_.data(), p_, f_.data());
  }
  void seed(DirectedPathDual& x, const Taylor2& along = Taylor2(1.0)) {
    x.v.d[0] = along;
    evaluate();
    x.v.d[0] = Taylor2(0.0);
  }

  const Constraint& e_;
  const std::vector<int>& c_;
  int rows_, row_;
  const StateView& s_;
  const Variation& d_;
  const TermWeights& w_;
  DirectedPathDual* p_ = nullptr;
  DirectedPathDual t_;
  DirectedLocal q_, f_;
};

/// 2 T of one body on path duals: v^T (M v), and M v is the difference of two residuals at rest, with a := v
/// and with a := 0.
class KineticEnergyOf {
 public:
  KineticEnergyOf(const Body& e, const Assembly& assembly, const StateView& s, const Variation& d)
      : e_(e), n_(e.coordinates().size()), p_(load_numbers(e, assembly, d)) {
    for (std::size_t i = 0; i < n_; ++i) {
      const int k = e.coordinates()[i];
      q_[i] = line(s.q[k], d.q[k]);
      v_[i] = line(s.v[k], d.v[k]);
    }
  }
  PathDual twice() {
    moving_.fill(PathDual());
    still_.fill(PathDual());
    e_.residual(q_.data(), rest_.data(), v_.data(), p_, moving_.data());
    e_.residual(q_.data(), rest_.data(), rest_.data(), p_, still_.data());
    PathDual sum;
    for (std::size_t i = 0; i < n_; ++i) sum += v_[i] * (moving_[i] - still_[i]);
    return sum;
  }
  double seeded(PathDual& x) {
    x.d[0] = Taylor2(1.0);
    const double y = twice().d[0].c1;
    x.d[0] = Taylor2(0.0);
    return y;
  }
  PathDual& q(std::size_t i) { return q_[i]; }
  PathDual& v(std::size_t i) { return v_[i]; }
  PathDual& number(std::size_t i) { return p_[i]; }

 private:
  const Body& e_;
  std::size_t n_;
  PathDual* p_;
  Local q_, v_, rest_, moving_, still_;
};

}  // namespace

void add_gradient_change(const Assembly& assembly, const StateView& s, const Variation& d, const TermWeights& weights,
                         const GradientTarget& out) {
  const Mechanism& m = assembly.mechanism();
  if (weights.force)
    for (const auto& e : m.bodies()) add_body(*e, assembly, s, d, weights.force, out);
  if (weights.force || weights.state)
    for (std::size_t k = 0; k < m.forces().size(); ++k)
      add_force(*m.forces()[k], m.state_offsets()[k], assembly, s, d, weights, out);
  for (std::size_t k = 0; k < m.constraints().size(); ++k)
    if (assembly.is_there(m.row_offsets()[k]))
      ConstraintTerms(*m.constraints()[k], m.row_offsets()[k], assembly, s, d, weights).add(assembly, out);
}

double kinetic_energy_change(const StateView& s, const Assembly& assembly, const Variation& d) {
  double sum = 0;
  for (const auto& e : assembly.mechanism().bodies()) sum += KineticEnergyOf(*e, assembly, s, d).twice().v.c1;
  return sum / 2;
}

void add_kinetic_energy_gradient_change(const StateView& s, const Assembly& assembly, const Variation& d, double factor,
                                        const GradientTarget& out) {
  for (const auto& e : assembly.mechanism().bodies()) {
    KineticEnergyOf T(*e, assembly, s, d);
    for (std::size_t i = 0; i < e->coordinates().size(); ++i) {
      const int k = e->coordinates()[i];
      if (!e->constant_mass()) out.q[k] += factor / 2 * T.seeded(T.q(i));
      out.v[k] += factor / 2 * T.seeded(T.v(i));
    }
    for_each_active(*e, assembly, out.rho, [&](std::size_t k) { return factor / 2 * T.seeded(T.number(k)); });
  }
}

void calc_number_changes(const Assembly& assembly, const double* drho, std::vector<double>& out) {
  const auto& columns = assembly.number_columns();
  out.assign(columns.size(), 0.0);
  for (std::size_t k = 0; k < columns.size(); ++k)
    for (const auto& [column, c] : columns[k]) out[k] += c * drho[column];
}

}  // namespace costate
