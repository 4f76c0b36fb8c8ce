#include "costate/assembly/time_partials.h"

#include <algorithm>
#include <array>

namespace costate {

namespace {

using LocalDuals = std::array<PathDual, kMaxLocal>;

std::vector<PathDual> duals_of_numbers(const Element& e, const Assembly& assembly) {
  std::vector<PathDual> p;
  for (const int k : e.numbers()) p.emplace_back(assembly.numbers()[static_cast<std::size_t>(k)]);
  return p;
}

/// t, whose derivative is asked for, along a path on which it runs at `rate`.
PathDual varied_time(double t, double rate) {
  PathDual x(Taylor2(t, rate, 0));
  x.d[0] = Taylor2(1.0);
  return x;
}

/// Calls visit(constraint, its first row) for those that depend on time and are there.
template <class Visit>
void for_each_rheonomic(const Assembly& assembly, const Visit& visit) {
  const Mechanism& m = assembly.mechanism();
  for (std::size_t k = 0; k < m.constraints().size(); ++k) {
    const Constraint& e = *m.constraints()[k];
    if (e.rheonomic() && assembly.is_there(m.row_offsets()[k])) visit(e, m.row_offsets()[k]);
  }
}

void add_reaction(const Assembly& assembly, const StateView& s, const double* gamma, std::vector<double>& out) {
  LocalDuals q, phi;
  for_each_rheonomic(assembly, [&](const Constraint& e, int first) {
    const auto p = duals_of_numbers(e, assembly);
    const auto& c = e.coordinates();
    for (std::size_t i = 0; i < c.size(); ++i) q[i] = PathDual(s.q[c[i]]);
    for (std::size_t j = 0; j < c.size(); ++j) {
      // Along the path on which q_j alone runs: Phi_q,j, and its derivative by time.
      q[j].v.c1 = 1;
      phi.fill(PathDual());
      e.phi(varied_time(s.t, 0), q.data(), p.data(), phi.data());
      q[j].v.c1 = 0;
      for (int i = 0; i < e.rows(); ++i)
        out[static_cast<std::size_t>(c[j])] += gamma[first + i] * phi[static_cast<std::size_t>(i)].d[0].c1;
    }
  });
}

}  // namespace

void calc_reaction_time_partial(const Assembly& assembly, const StateView& s, const double* gamma,
                                std::vector<double>& out) {
  out.assign(static_cast<std::size_t>(assembly.n()), 0);
  add_reaction(assembly, s, gamma, out);
}

void calc_time_partials(const Assembly& assembly, const StateView& s, TimePartials& out) {
  const Mechanism& m = assembly.mechanism();
  out.force.assign(static_cast<std::size_t>(assembly.n()), 0);
  out.state.assign(static_cast<std::size_t>(assembly.nz()), 0);
  for (auto* x : {&out.phi, &out.phid, &out.phidd}) x->assign(static_cast<std::size_t>(assembly.m()), 0);
  LocalDuals q, v, z, Q, f, phi;
  for (std::size_t k = 0; k < m.forces().size(); ++k) {
    const Force& e = *m.forces()[k];
    const auto& c = e.coordinates();
    const int z0 = m.state_offsets()[k];
    const auto p = duals_of_numbers(e, assembly);
    for (std::size_t i = 0; i < c.size(); ++i) {
      q[i] = PathDual(s.q[c[i]]);
      v[i] = PathDual(s.v[c[i]]);
    }
    for (int i = 0; i < e.states(); ++i) z[static_cast<std::size_t>(i)] = PathDual(s.z[z0 + i]);
    Q.fill(PathDual());
    f.fill(PathDual());
    e.force(varied_time(s.t, 0), q.data(), v.data(), z.data(), p.data(), Q.data(), f.data());
    for (std::size_t i = 0; i < c.size(); ++i) out.force[static_cast<std::size_t>(c[i])] -= Q[i].d[0].c0;
    for (int i = 0; i < e.states(); ++i)
      out.state[static_cast<std::size_t>(z0 + i)] += f[static_cast<std::size_t>(i)].d[0].c0;
  }
  for_each_rheonomic(assembly, [&](const Constraint& e, int first) {
    const auto p = duals_of_numbers(e, assembly);
    const auto& c = e.coordinates();
    for (std::size_t i = 0; i < c.size(); ++i) q[i] = PathDual(Taylor2(s.q[c[i]], s.v[c[i]], s.a[c[i]]));
    phi.fill(PathDual());
    e.phi(varied_time(s.t, 1), q.data(), p.data(), phi.data());
    for (int i = 0; i < e.rows(); ++i) {
      const Taylor2& by = phi[static_cast<std::size_t>(i)].d[0];
      const auto row = static_cast<std::size_t>(first + i);
      out.phi[row] = by.c0;
      out.phid[row] = by.c1;
      out.phidd[row] = by.c2;
    }
  });
  if (s.lambda) add_reaction(assembly, s, s.lambda, out.force);
}

}  // namespace costate
