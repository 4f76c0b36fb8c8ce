#include "costate/assembly/path_rates.h"

#include <algorithm>
#include <array>

#include "costate/assembly/rolling_rows.h"

namespace costate {

namespace {

using Local = std::array<PathDual, kMaxLocal>;

std::vector<PathDual> numbers_of(const Element& e, const Assembly& assembly) {
  std::vector<PathDual> p;
  for (int k : e.numbers()) p.emplace_back(assembly.numbers()[k]);
  return p;
}

void add(const Assembly& assembly, const Element& e, int i, int j, double x, std::vector<double>& out) {
  if (x != 0) out[assembly.square().find(e.coordinates()[i], e.coordinates()[j])] += x;
}

/// force += (J^T)' lambda of the rows along which contacts slide, which phid_q does not hold: of one of them along the
/// j-th coordinate J_j = r', and J_j' is its change along v.
void add_friction_rates(const Assembly& assembly, const StateView& s, double* force) {
  const Mechanism& m = assembly.mechanism();
  Local q, phi;
  for (const Assembly::SlidingRow& at : assembly.sliding_rows())
    for (std::size_t k = 0; k < m.constraints().size(); ++k) {
      if (m.row_offsets()[k] != at.normal) continue;
      const Constraint& e = *m.constraints()[k];
      const auto p = numbers_of(e, assembly);
      const auto& c = e.coordinates();
      for (std::size_t i = 0; i < c.size(); ++i) {
        q[i] = PathDual(s.q[c[i]]);
        q[i].d[0] = Taylor2(s.v[c[i]]);
      }
      for (std::size_t j = 0; j < c.size(); ++j) {
        q[j].v.c1 = 1;
        phi.fill(PathDual());
        e.phi(PathDual(s.t), q.data(), p.data(), phi.data());
        q[j].v.c1 = 0;
        force[c[j]] += s.lambda[at.along] * phi[static_cast<std::size_t>(at.along - at.normal)].d[0].c1;
      }
    }
}

}  // namespace

void calc_path_rates(Assembly& assembly, const StateView& s, PathRates& out) {
  const Mechanism& m = assembly.mechanism();
  out.M_dot.assign(assembly.square().row.size(), 0);
  out.M_ddot = out.C_dot = out.M_dot;
  out.f_v_dot.assign(assembly.state_force().row.size(), 0);
  Local q, v, a, z, r, f;
  const auto load = [&](const Element& e) {
    for (std::size_t i = 0; i < e.coordinates().size(); ++i) {
      const int c = e.coordinates()[i];
      q[i] = PathDual(Taylor2(s.q[c], s.v[c], s.a[c]));
      v[i] = PathDual(Taylor2(s.v[c], s.a[c], 0));  // only first rates are taken of what depends on v
    }
  };
  const PathDual t(Taylor2(s.t, 1, 0));
  for (const auto& b : m.bodies()) {
    const int n = static_cast<int>(b->coordinates().size());
    const auto p = numbers_of(*b, assembly);
    load(*b);
    for (int j = 0; j < n; ++j) {
      if (!b->constant_mass()) {
        // M e_j along the path: the dual part with respect to a_j.
        a.fill(PathDual());
        a[j].d[0] = Taylor2(1.0);
        r.fill(PathDual());
        b->residual(q.data(), v.data(), a.data(), p.data(), r.data());
        for (int i = 0; i < n; ++i) {
          add(assembly, *b, i, j, r[i].d[0].c1, out.M_dot);
          add(assembly, *b, i, j, r[i].d[0].c2, out.M_ddot);
        }
      }
      if (!b->constant_force()) {
        a.fill(PathDual());
        v[j].d[0] = Taylor2(1.0);
        r.fill(PathDual());
        b->residual(q.data(), v.data(), a.data(), p.data(), r.data());
        for (int i = 0; i < n; ++i) add(assembly, *b, i, j, r[i].d[0].c1, out.C_dot);
        v[j].d[0] = Taylor2(0.0);
      }
    }
  }
  for (std::size_t k = 0; k < m.forces().size(); ++k) {
    const Force& e = *m.forces()[k];
    const int n = static_cast<int>(e.coordinates().size()), nz = e.states(), z0 = m.state_offsets()[k];
    const auto p = numbers_of(e, assembly);
    load(e);
    for (int i = 0; i < nz; ++i) z[i] = PathDual(Taylor2(s.z[z0 + i], assembly.zdot[z0 + i], 0));
    for (int j = 0; j < n; ++j) {
      v[j].d[0] = Taylor2(1.0);
      r.fill(PathDual());
      f.fill(PathDual());
      e.force(t, q.data(), v.data(), z.data(), p.data(), r.data(), f.data());
      v[j].d[0] = Taylor2(0.0);
      for (int i = 0; i < n; ++i) add(assembly, e, i, j, -r[i].d[0].c1, out.C_dot);
      for (int i = 0; i < nz; ++i)
        if (f[i].d[0].c1 != 0) out.f_v_dot[assembly.state_force().find(z0 + i, e.coordinates()[j])] += f[i].d[0].c1;
    }
  }
}

void calc_motion_rates(Assembly& assembly, const StateView& s, double* force, double* row) {
  const Mechanism& m = assembly.mechanism();
  std::fill(force, force + assembly.n(), 0.0);
  std::fill(row, row + assembly.m(), 0.0);
  Local q, v, a, z, r, f;
  const auto load = [&](const Element& e) {
    for (std::size_t i = 0; i < e.coordinates().size(); ++i) {
      const int c = e.coordinates()[i];
      q[i] = PathDual(Taylor2(s.q[c], s.v[c], s.a[c]));
      v[i] = PathDual(Taylor2(s.v[c], s.a[c], 0));
      a[i] = PathDual(s.a[c]);
    }
    r.fill(PathDual());
  };
  const auto scatter = [&](const Element& e, double c) {
    for (std::size_t i = 0; i < e.coordinates().size(); ++i) force[e.coordinates()[i]] += c * r[i].v.c1;
  };
  const PathDual t(Taylor2(s.t, 1, 0));
  for (const auto& b : m.bodies()) {
    const auto p = numbers_of(*b, assembly);
    load(*b);
    b->residual(q.data(), v.data(), a.data(), p.data(), r.data());
    scatter(*b, 1);
  }
  for (std::size_t k = 0; k < m.forces().size(); ++k) {
    const Force& e = *m.forces()[k];
    const int z0 = m.state_offsets()[k];
    const auto p = numbers_of(e, assembly);
    load(e);
    for (int i = 0; i < e.states(); ++i) z[i] = PathDual(Taylor2(s.z[z0 + i], assembly.zdot[z0 + i], 0));
    f.fill(PathDual());
    e.force(t, q.data(), v.data(), z.data(), p.data(), r.data(), f.data());
    scatter(e, -1);
  }
  // (Phi_q^T)' lambda, of what rolls J' = (J v)_q and its twist.
  if (assembly.m() > 0) {
    add_transposed_product(assembly.jacobian(), assembly.phid_q.data(), 1, s.lambda, force);
    if (const std::vector<double> twist = rolling_twist(assembly, s); !twist.empty())
      add_transposed_product(assembly.jacobian(), twist.data(), 1, s.lambda, force);
  }
  add_friction_rates(assembly, s, force);
  // The change of Phidd along (1, v, a, 0) of (t, q, v, a): one more rate of a path of two.
  std::array<DirectedPathDual, kMaxLocal> path, phi;
  DirectedPathDual time{PathDual(Taylor2(s.t, 1, 0))};
  time.d[0] = PathDual(Taylor2(1.0));
  for (std::size_t k = 0; k < m.constraints().size(); ++k) {
    const Constraint& e = *m.constraints()[k];
    std::vector<DirectedPathDual> p;
    for (const int i : e.numbers()) p.emplace_back(assembly.numbers()[i]);
    for (std::size_t i = 0; i < e.coordinates().size(); ++i) {
      const int c = e.coordinates()[i];
      path[i] = DirectedPathDual(PathDual(Taylor2(s.q[c], s.v[c], s.a[c])));
      path[i].d[0] = PathDual(Taylor2(s.v[c], s.a[c], 0));
    }
    phi.fill(DirectedPathDual());
    e.phi_directed(time, path.data(), p.data(), phi.data());
    for (int i = 0; i < e.rows(); ++i) row[m.row_offsets()[k] + i] = phi[static_cast<std::size_t>(i)].d[0].v.c2;
  }
}

}  // namespace costate
