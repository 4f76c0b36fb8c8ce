#include "explain_parts.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "costate/analysis/start.h"
#include "costate/base/error.h"
#include "costate/objective/output.h"
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
    StateView s;
    s.t = t;
    s.q = start.q.data();
    s.v = start.v.data();
    s.a = a.data();
    s.lambda = lambda.data();
    s.z = start.z.data();
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

/// Union of sets.
struct Groups {
  std::vector<int> parent;
  explicit Groups(int n) : parent(static_cast<std::size_t>(n)) { std::iota(parent.begin(), parent.end(), 0); }
  int of(int i) {
    while (parent[static_cast<std::size_t>(i)] != i) i = parent[static_cast<std::size_t>(i)];
    return i;
  }
  void join(int i, int j) { parent[static_cast<std::size_t>(of(i))] = of(j); }
};

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

std::vector<Part> independent_parts(const Problem& problem, const std::vector<double>& rho,
                                    const std::vector<std::string>& outputs) {
  StartState state(problem, rho);
  Assembly& assembly = state.assembly;
  const StateView s = state.view(problem.solver.t_start);
  const Mechanism& m = *problem.mechanism;
  const int n = assembly.n();
  Groups groups(n);
  // Multipliers and force states by a coordinate of their element.
  std::vector<int> of_row, of_state;
  const auto join = [&](const Element& e) {
    const auto& c = e.coordinates();
    for (std::size_t i = 1; i < c.size(); ++i) groups.join(c[0], c[i]);
    return c.empty() ? -1 : static_cast<int>(c[0]);
  };
  for (const auto& b : m.bodies()) join(*b);
  for (const auto& c : m.constraints()) of_row.insert(of_row.end(), static_cast<std::size_t>(c->rows()), join(*c));
  for (const auto& f : m.forces()) of_state.insert(of_state.end(), static_cast<std::size_t>(f->states()), join(*f));

  ScalarGradient g;
  g.resize(assembly);
  g.set_zero();
  bool all = false;
  const auto depends = [&](const auto& add) {
    try {
      add();
    } catch (const Error&) {  // without derivatives: an energy depends on everything
      all = true;
    }
  };
  for (const auto& name : outputs) {
    const auto o = make_output(m, name);
    depends([&] {
      ScalarGradient own;
      own.resize(assembly);
      own.set_zero();
      o->add_gradient(s, assembly, 1, own);
      for (auto [sum, x] : {std::pair(&g.q, &own.q), std::pair(&g.v, &own.v), std::pair(&g.a, &own.a),
                            std::pair(&g.lambda, &own.lambda), std::pair(&g.z, &own.z)})
        *sum += x->cwiseAbs();
    });
  }
  std::vector<bool> needed(static_cast<std::size_t>(n), all);
  const auto need = [&](int coordinate) {
    if (coordinate >= 0) needed[static_cast<std::size_t>(groups.of(coordinate))] = true;
  };
  for (int i = 0; i < n; ++i)
    if (g.q[i] != 0 || g.v[i] != 0 || g.a[i] != 0) need(i);
  for (int i = 0; i < assembly.m(); ++i)
    if (g.lambda[i] != 0) need(of_row[static_cast<std::size_t>(i)]);
  for (int i = 0; i < assembly.nz(); ++i)
    if (g.z[i] != 0) need(of_state[static_cast<std::size_t>(i)]);

  std::map<int, Part> parts;
  const auto coordinate_names = m.coordinate_names();
  for (int i = 0; i < n; ++i) {
    Part& p = parts[groups.of(i)];
    p.coordinates.push_back(coordinate_names[static_cast<std::size_t>(i)]);
    p.needed = all || needed[static_cast<std::size_t>(groups.of(i))];
  }
  const auto place = [&](const auto& list) {
    for (const auto& e : list) {
      if (!e->coordinates().empty()) {
        auto& names = parts[groups.of(static_cast<int>(e->coordinates()[0]))].elements;
        if (std::find(names.begin(), names.end(), e->path()) == names.end()) names.push_back(e->path());
      }
    }
  };
  place(m.bodies());
  place(m.constraints());
  place(m.forces());
  std::vector<Part> r;
  for (auto& [root, part] : parts) r.push_back(std::move(part));
  std::stable_sort(r.begin(), r.end(),
                   [](const Part& a, const Part& b) { return a.coordinates.size() > b.coordinates.size(); });
  return r;
}

std::optional<PlaneMotion> plane_of(const Mechanism& mechanism, const std::vector<std::vector<double>>& positions) {
  const auto names = mechanism.coordinate_names();
  std::map<std::string, std::array<int, 7>> bodies;  // x, y, z, e0 ... e3 by name
  const std::array<std::string, 7> keys = {"x", "y", "z", "e0", "e1", "e2", "e3"};
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::size_t dot = names[i].rfind('.');
    if (dot == std::string::npos) continue;
    const auto key = std::find(keys.begin(), keys.end(), names[i].substr(dot + 1));
    if (key == keys.end()) continue;
    auto [at, is_new] = bodies.try_emplace(names[i].substr(0, dot));
    if (is_new) at->second.fill(-1);
    at->second[static_cast<std::size_t>(key - keys.begin())] = static_cast<int>(i);
  }
  std::erase_if(bodies, [](const auto& b) { return b.second[2] < 0; });
  if (bodies.empty() || positions.size() < 2) return std::nullopt;
  // The origin of each and, of those that turn, points on its axes.
  const auto points = [&](const std::vector<double>& q) {
    std::vector<Eigen::Vector3d> list;
    for (const auto& [name, at] : bodies) {
      const auto value = [&, &index = at](std::size_t k) {
        return index[k] < 0 ? 0.0 : q[static_cast<std::size_t>(index[k])];
      };
      const Eigen::Vector3d origin(value(0), value(1), value(2));
      list.push_back(origin);
      if (at[3] < 0) continue;
      const double e0 = value(3);
      const Eigen::Vector3d e(value(4), value(5), value(6));
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d u = Eigen::Vector3d::Unit(axis);
        list.push_back(origin + (2 * e0 * e0 - 1) * u + 2 * e * e.dot(u) + 2 * e0 * e.cross(u));
      }
    }
    return list;
  };
  const auto first = points(positions.front());
  std::vector<Eigen::Vector3d> moves;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const auto& q : positions) {
    const auto now = points(q);
    for (std::size_t i = 0; i < now.size(); ++i) {
      moves.push_back(now[i] - first[i]);
      spread += moves.back() * moves.back().transpose();
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  PlaneMotion r;
  r.normal = solver.eigenvectors().col(0);
  Eigen::Index largest_entry = 0;
  r.normal.cwiseAbs().maxCoeff(&largest_entry);
  if (r.normal[largest_entry] < 0) r.normal = -r.normal;
  for (double& x : r.normal)
    if (std::abs(x) < 1e-6) x = 0;
  double largest = 0, out = 0;
  for (const auto& d : moves) {
    largest = std::max(largest, d.norm());
    out = std::max(out, std::abs(d.dot(r.normal)));
  }
  r.out_of_plane = largest > 0 ? out / largest : 0;
  return r;
}

}  // namespace costate::app
