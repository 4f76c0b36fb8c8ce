#include "explain_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "costate/analysis/start.h"
#include "costate/scene/wanted_part.h"
#include "costate/tradeoff/stopwatch.h"

namespace costate::app {

namespace {

struct StartState {
  Assembly assembly;
  Start start;
  std::vector<double> a, lambda;

  StartState(const Problem& problem, const std::vector<double>& rho) : assembly(problem.mechanism, problem.parameters) {
    assembly.set_parameters(rho.data());
    start = find_start(assembly, problem.solver.t_start, false);
    a.assign(static_cast<std::size_t>(assembly.n()), 0.1);
    lambda.assign(static_cast<std::size_t>(assembly.m()), 0.1);
  }
  StateView view(double t) const {
    StateView s = start.state(t);
    s.a = a.data();
    s.lambda = lambda.data();
    return s;
  }
};

/// Local blocks, large enough for any element.
class Scratch {
 public:
  LocalMatrix block(int which, std::size_t rows, std::size_t columns) {
    LocalMatrix m(values_[static_cast<std::size_t>(which)].data(), static_cast<Eigen::Index>(rows),
                  static_cast<Eigen::Index>(columns));
    m.setZero();
    return m;
  }

 private:
  std::array<std::array<double, kMaxLocal * kMaxLocal>, 6> values_ = {};
};

double time_of(const std::function<void()>& sweep) {
  constexpr double enough_s = 2e-3;
  sweep();
  for (long n = 1;; n *= 4) {
    const double begin = processor_time_s();
    for (long k = 0; k < n; ++k) sweep();
    const double spent = processor_time_s() - begin;
    if (spent > enough_s || n > 1'000'000) return spent / static_cast<double>(n);
  }
}

}  // namespace

std::vector<KindShare> kind_shares(const Problem& problem, const std::vector<double>& rho) {
  StartState state(problem, rho);
  Assembly& assembly = state.assembly;
  const StateView s = state.view(problem.solver.t_start);
  const Mechanism& m = *problem.mechanism;
  Scratch scratch;
  std::vector<KindShare> shares;
  // A bar is a body and a constraint of one name: one element.
  std::set<std::string> counted;
  const auto number = [&](const Element& e) { return counted.insert(e.path()).second ? 1 : 0; };
  const auto share_of = [&](const std::string& kind) -> KindShare& {
    for (KindShare& k : shares)
      if (k.kind == kind) return k;
    shares.push_back({kind});
    return shares.back();
  };
  const auto add_times = [&](auto&& elements, auto&& dynamics, auto&& partials) {
    std::map<std::string, std::vector<decltype(elements.front().get())>> by_kind;
    for (const auto& e : elements) by_kind[e->kind()].push_back(e.get());
    for (const auto& [kind, list] : by_kind) {
      KindShare& k = share_of(kind);
      k.dynamics_s += time_of([&, &all = list] {
        for (const auto* e : all) dynamics(*e);
      });
      k.partials_s += time_of([&, &all = list] {
        for (const auto* e : all) partials(*e);
      });
    }
  };
  for (const auto& b : m.bodies()) {
    KindShare& k = share_of(b->kind());
    const auto n = static_cast<long>(b->coordinates().size());
    k.elements += number(*b);
    k.square_entries += n * n;
    k.constant_mass += b->constant_mass() ? 1 : 0;
    k.constant_force += b->constant_force() ? 1 : 0;
  }
  for (const auto& c : m.constraints()) {
    KindShare& k = share_of(c->kind());
    const auto n = static_cast<long>(c->coordinates().size());
    k.elements += number(*c);
    k.rows += c->rows();
    k.square_entries += n * n;
    k.jacobian_entries += n * c->rows();
  }
  for (const auto& f : m.forces()) {
    KindShare& k = share_of(f->kind());
    const auto n = static_cast<long>(f->coordinates().size());
    k.elements += number(*f);
    k.states += f->states();
    k.square_entries += n * n;
  }
  if (!m.bodies().empty())
    add_times(
        m.bodies(),
        [&](const auto& e) {
          const LocalState l = assembly.gather(e, 0, s);
          const std::size_t n = e.coordinates().size();
          LocalMatrix block = scratch.block(0, n, n);
          if (!e.constant_mass()) e.calc_mass(l, block);
          double force[kMaxLocal] = {};
          if (!e.constant_force()) e.calc_force(l, force);
        },
        [&](const auto& e) {
          if (e.constant_mass() && e.constant_force()) return;
          const LocalState l = assembly.gather(e, 0, s);
          const std::size_t n = e.coordinates().size();
          LocalMatrix q = scratch.block(0, n, n), v = scratch.block(1, n, n);
          e.calc_partials(l, q, v);
        });
  if (!m.constraints().empty())
    add_times(
        m.constraints(),
        [&](const auto& e) {
          const LocalState l = assembly.gather(e, 0, s);
          const auto rows = static_cast<std::size_t>(e.rows());
          double phi[kMaxLocal] = {}, rate[kMaxLocal] = {}, bias[kMaxLocal] = {};
          LocalMatrix phi_q = scratch.block(0, rows, e.coordinates().size());
          e.calc_phi(l, phi);
          e.calc_phi_q(l, phi_q);
          e.calc_phi_t(l, rate);
          e.calc_bias(l, bias);
        },
        [&](const auto& e) {
          const LocalState l = assembly.gather(e, 0, s);
          const std::size_t n = e.coordinates().size(), rows = static_cast<std::size_t>(e.rows());
          LocalMatrix hessian = scratch.block(0, n, n), d = scratch.block(1, rows, n), dd = scratch.block(2, rows, n);
          e.calc_partials(l, hessian, d, dd);
        });
  if (!m.forces().empty())
    add_times(
        m.forces(),
        [&](const auto& e) {
          double force[kMaxLocal] = {}, rate[kMaxLocal] = {};
          e.calc_force(assembly.gather(e, 0, s), force, rate);
        },
        [&](const auto& e) {
          const LocalState l = assembly.gather(e, 0, s);
          const std::size_t n = e.coordinates().size(), z = static_cast<std::size_t>(e.states());
          LocalMatrix Q_q = scratch.block(0, n, n), Q_v = scratch.block(1, n, n), Q_z = scratch.block(2, n, z),
                      f_q = scratch.block(3, z, n), f_v = scratch.block(4, z, n), f_z = scratch.block(5, z, z);
          e.calc_partials(l, {Q_q, Q_v, Q_z, f_q, f_v, f_z});
        });
  return shares;
}

std::vector<Part> independent_parts(const Mechanism& m, const std::optional<std::vector<int>>& wanted) {
  const std::vector<int> groups = acting_groups(m);
  std::vector<Part> parts(static_cast<std::size_t>(*std::max_element(groups.begin(), groups.end())) + 1);
  const auto part_of = [&](int coordinate) -> Part& {
    return parts[static_cast<std::size_t>(groups[static_cast<std::size_t>(coordinate)])];
  };
  const auto names = m.coordinate_names();
  for (int i = 0; i < m.coordinate_count(); ++i) {
    part_of(i).coordinates.push_back(names[static_cast<std::size_t>(i)]);
    part_of(i).needed = part_of(i).needed || !wanted;
  }
  if (wanted)
    for (const int i : *wanted) part_of(i).needed = true;
  const auto place = [&](const auto& list) {
    for (const auto& e : list) {
      if (e->coordinates().empty()) continue;
      auto& elements = part_of(e->coordinates().front()).elements;
      if (std::find(elements.begin(), elements.end(), e->path()) == elements.end()) elements.push_back(e->path());
    }
  };
  place(m.bodies());
  place(m.constraints());
  place(m.forces());
  std::stable_sort(parts.begin(), parts.end(),
                   [](const Part& a, const Part& b) { return a.coordinates.size() > b.coordinates.size(); });
  return parts;
}

std::vector<Weld> welds(const Mechanism& m) {
  std::map<std::string, std::set<int>> touched;
  std::vector<Weld> list;
  for (const auto& c : m.constraints()) {
    if (c->kind() != "fixed") continue;
    if (touched.try_emplace(c->path()).second) list.push_back({c->path(), {}, 0, 0});
    touched[c->path()].insert(c->coordinates().begin(), c->coordinates().end());
    list.back().rows += c->rows();
  }
  for (Weld& w : list) {
    std::set<int> last;
    for (const auto& b : m.bodies()) {
      const std::set<int> own(b->coordinates().begin(), b->coordinates().end());
      const std::set<int>& all = touched[w.path];
      if (b->kind() == "rotor" || std::none_of(own.begin(), own.end(), [&](int i) { return all.contains(i); }))
        continue;
      w.bodies.push_back(b->path());
      last = own;
    }
    w.coordinates = static_cast<int>(last.size());
    for (const auto& c : m.constraints())
      if (std::all_of(c->coordinates().begin(), c->coordinates().end(), [&](int i) { return last.contains(i); }) &&
          c->path() != w.path)
        w.rows += c->rows();
  }
  return list;
}

}  // namespace costate::app
