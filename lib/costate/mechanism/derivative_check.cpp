#include "costate/mechanism/derivative_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <typeindex>

#include "costate/base/error.h"
#include "costate/base/library_class.h"

namespace costate {

namespace {

constexpr int kElements = 2;                   // of a class
constexpr double kDistances[] = {1e-4, 3e-2};  // from the start, relative to the largest position
constexpr double kRelative = 1e-6, kRounding = 1e-12;
constexpr int kNumbers = 16;  // of an element; a table can have thousands

using Values = std::vector<double>;

std::size_t count(int n) { return static_cast<std::size_t>(n); }

/// Numbers between -1 and 1 without a pattern.
Values generic(std::size_t n, int seed) {
  Values w(n);
  for (std::size_t i = 0; i < n; ++i) w[i] = std::sin(2.3 * static_cast<double>(i + 1) + 1.7 * seed);
  return w;
}

/// The local arguments of one element.
struct Place {
  double t = 0;
  Values q, v, a, lambda, z, p;
  LocalState view() const { return {t, q.data(), v.data(), a.data(), lambda.data(), z.data(), p.data()}; }
};

Place place_near_start(const Mechanism& m, const Element& e, int rows, int states, int which) {
  const auto& numbers = m.numbers();
  Place x;
  x.t = which == 0 ? 0.37 : 1.61;
  double size = 0;
  for (const int i : e.coordinates()) {
    const Coordinate& c = m.coordinates()[count(i)];
    x.q.push_back(numbers[count(c.position_number)].value);
    size = std::max(size, std::abs(x.q.back()));
  }
  if (size == 0) size = 1;
  const std::size_t n = x.q.size();
  const Values away = generic(n, 3 + which);
  for (std::size_t i = 0; i < n; ++i) x.q[i] += kDistances[which] * size * away[i];
  x.v = generic(n, 5 + which);
  x.a = generic(n, 7 + which);
  x.lambda = generic(count(rows), 9 + which);
  x.z = generic(count(states), 11 + which);
  for (const int k : e.numbers()) x.p.push_back(numbers[count(k)].value);
  return x;
}

/// One block both ways, column-major.
struct Block {
  std::string what;  // "Q_q"
  const char* from;  // the function that gives it
  std::size_t rows;
  Values hand, dual;
};

class Comparison {
 public:
  explicit Comparison(const Mechanism& m, const Element& e) : mechanism_(m), element_(e) {}

  /// fill(double* out, bool by_hand).
  template <class Fill>
  void add(std::string what, const char* from, std::size_t rows, std::size_t columns, const Fill& fill) {
    Block b{std::move(what), from, rows, Values(rows * columns), Values(rows * columns)};
    fill(b.hand.data(), true);
    fill(b.dual.data(), false);
    blocks_.push_back(std::move(b));
  }
  /// "the derivative of phi by 'spring.S.stiffness_N_per_m'".
  std::string by_number(const char* of, int local) const {
    const int k = element_.numbers()[count(local)];
    return fmt::format("derivative of {} by '{}', entry", of, mechanism_.numbers()[count(k)].path);
  }

  void judge() const {
    double all = 0;
    for (const Block& b : blocks_) all = std::max(all, largest(b.dual));
    for (const Block& b : blocks_) {
      const double allowed = kRelative * std::max(largest(b.hand), largest(b.dual)) + kRounding * all;
      for (std::size_t i = 0; i < b.hand.size(); ++i)
        if (std::abs(b.hand[i] - b.dual[i]) > allowed)  // false where one is no number
          throw ModelError(
              element_.path(),
              fmt::format("{} is wrong: {} ({}, {}) is {:.9g}, and the element's own physics by dual numbers gives "
                          "{:.9g}. Mend it, or leave it out: the base class derives what is not written.",
                          b.from, b.what, i % b.rows, i / b.rows, b.hand[i], b.dual[i]));
    }
  }

 private:
  static double largest(const Values& x) {
    double size = 0;
    for (const double y : x)
      if (std::isfinite(y)) size = std::max(size, std::abs(y));
    return size;
  }

  const Mechanism& mechanism_;
  const Element& element_;
  std::vector<Block> blocks_;
};

int looked_at(const Element& e) { return std::min(kNumbers, static_cast<int>(e.numbers().size())); }

void compare(Comparison& c, const Body& e, const Place& x) {
  const std::size_t n = x.q.size();
  const LocalState s = x.view();
  c.add("entry", "calc_mass", n, n, [&](double* out, bool hand) {
    LocalMatrix M(out, n, n);
    hand ? e.calc_mass(s, M) : e.Body::calc_mass(s, M);
  });
  c.add("entry", "calc_force", n, 1,
        [&](double* out, bool hand) { hand ? e.calc_force(s, out) : e.Body::calc_force(s, out); });
  for (const bool of_v : {false, true})
    c.add(of_v ? "r_v" : "r_q", "calc_partials", n, n, [&](double* out, bool hand) {
      Values other(n * n);
      LocalMatrix mine(out, n, n), rest(other.data(), n, n);
      LocalMatrix &r_q = of_v ? rest : mine, &r_v = of_v ? mine : rest;
      hand ? e.calc_partials(s, r_q, r_v) : e.Body::calc_partials(s, r_q, r_v);
    });
  for (int k = 0; k < looked_at(e); ++k)
    c.add(c.by_number("r", k), "calc_number_partial", n, 1, [&](double* out, bool hand) {
      hand ? e.calc_number_partial(s, k, out) : e.Body::calc_number_partial(s, k, out);
    });
}

void compare(Comparison& c, const Constraint& e, const Place& x) {
  const std::size_t n = x.q.size(), m = x.lambda.size();
  const LocalState s = x.view();
  c.add("entry", "calc_phi", m, 1,
        [&](double* out, bool hand) { hand ? e.calc_phi(s, out) : e.Constraint::calc_phi(s, out); });
  c.add("entry", "calc_phi_q", m, n, [&](double* out, bool hand) {
    LocalMatrix phi_q(out, m, n);
    hand ? e.calc_phi_q(s, phi_q) : e.Constraint::calc_phi_q(s, phi_q);
  });
  if (e.rheonomic())
    c.add("entry", "calc_phi_t", m, 1,
          [&](double* out, bool hand) { hand ? e.calc_phi_t(s, out) : e.Constraint::calc_phi_t(s, out); });
  c.add("entry", "calc_bias", m, 1,
        [&](double* out, bool hand) { hand ? e.calc_bias(s, out) : e.Constraint::calc_bias(s, out); });
  c.add("entry", "calc_hessian", n, n, [&](double* out, bool hand) {
    LocalMatrix hessian(out, n, n);
    hand ? e.calc_hessian(s, hessian) : e.Constraint::calc_hessian(s, hessian);
  });
  const auto partial = [&](const char* what, std::size_t rows, int which) {
    c.add(what, "calc_partials", rows, n, [&, which](double* out, bool hand) {
      Values all[3] = {Values(n * n), Values(m * n), Values(m * n)};
      LocalMatrix h(all[0].data(), n, n), d(all[1].data(), m, n), dd(all[2].data(), m, n);
      hand ? e.calc_partials(s, h, d, dd) : e.Constraint::calc_partials(s, h, d, dd);
      std::copy(all[which].begin(), all[which].end(), out);
    });
  };
  partial("hessian", n, 0);
  partial("phid_q", m, 1);
  partial("phidd_q", m, 2);
  const Values w0 = generic(m, 21), w1 = generic(m, 22), w2 = generic(m, 23), wr = generic(n, 24);
  const ConstraintWeights weights{w0.data(), w1.data(), w2.data(), wr.data()};
  for (int k = 0; k < looked_at(e); ++k) {
    c.add(c.by_number("phi, phidot, phiddot and the reaction, one below the other,", k), "calc_number_partial",
          3 * m + n, 1, [&](double* out, bool hand) {
            hand ? e.calc_number_partial(s, k, out, out + m, out + 2 * m, out + 3 * m)
                 : e.Constraint::calc_number_partial(s, k, out, out + m, out + 2 * m, out + 3 * m);
          });
    c.add(c.by_number("a weighted sum", k), "calc_number_gradient", 1, 1, [&](double* out, bool hand) {
      *out = hand ? e.calc_number_gradient(s, k, weights) : e.Constraint::calc_number_gradient(s, k, weights);
    });
  }
}

void compare(Comparison& c, const Force& e, const Place& x) {
  const std::size_t n = x.q.size(), nz = x.z.size();
  const LocalState s = x.view();
  c.add("Q and zdot, one below the other, entry", "calc_force", n + nz, 1,
        [&](double* out, bool hand) { hand ? e.calc_force(s, out, out + n) : e.Force::calc_force(s, out, out + n); });
  const std::size_t sizes[6] = {n * n, n * n, n * nz, nz * n, nz * n, nz * nz};
  const char* names[6] = {"Q_q", "Q_v", "Q_z", "f_q", "f_v", "f_z"};
  for (int which = 0; which < (nz ? 6 : 2); ++which)
    c.add(names[which], "calc_partials", which < 3 ? n : nz, which % 3 < 2 ? n : nz, [&](double* out, bool hand) {
      Values all[6];
      for (int i = 0; i < 6; ++i) all[i].resize(sizes[i]);
      LocalMatrix Qq(all[0].data(), n, n), Qv(all[1].data(), n, n), Qz(all[2].data(), n, nz), fq(all[3].data(), nz, n),
          fv(all[4].data(), nz, n), fz(all[5].data(), nz, nz);
      const ForcePartials to{Qq, Qv, Qz, fq, fv, fz};
      hand ? e.calc_partials(s, to) : e.Force::calc_partials(s, to);
      std::copy(all[which].begin(), all[which].end(), out);
    });
  const Values w_Q = generic(n, 21), w_f = generic(nz, 22);
  for (int k = 0; k < looked_at(e); ++k) {
    Values dual(n + nz);
    e.Force::calc_number_partial(s, k, dual.data(), dual.data() + n);
    c.add(c.by_number("Q and zdot, one below the other,", k), "calc_number_partial", n + nz, 1,
          [&](double* out, bool hand) {
            if (hand)
              e.calc_number_partial(s, k, out, out + n);
            else
              std::copy(dual.begin(), dual.end(), out);
          });
    c.add(c.by_number("a weighted sum", k), "add_number_gradient", 1, 1, [&](double* out, bool hand) {
      if (hand) {
        e.add_number_gradient(s, w_Q.data(), nz ? w_f.data() : nullptr, &k, 1, out);
        return;
      }
      for (std::size_t i = 0; i < n; ++i) *out += w_Q[i] * dual[i];
      for (std::size_t i = 0; i < nz; ++i) *out += w_f[i] * dual[n + i];
    });
  }
}

/// Of what an element says of itself beside its derivatives; `near` and `far` are two of its states.
void check_claims(const Body& e, const Place& near, const Place& far) {
  const std::size_t n = near.q.size();
  const auto same = [&](const char* what, const char* claim, const Values& a, const Values& b) {
    double size = 0, change = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      size = std::max({size, std::abs(a[i]), std::abs(b[i])});
      change = std::max(change, std::abs(a[i] - b[i]));
    }
    if (change > kRelative * size)
      throw ModelError(e.path(),
                       fmt::format("Its {} changes by {:.3g} with positions or velocities, and {}() says that "
                                   "it does not.",
                                   what, change, claim));
  };
  const auto mass = [&](const Place& x) {
    Values m(n * n);
    LocalMatrix M(m.data(), n, n);
    e.Body::calc_mass(x.view(), M);
    return m;
  };
  const auto force = [&](const Place& x) {
    Values Q(n);
    e.Body::calc_force(x.view(), Q.data());
    return Q;
  };
  if (e.constant_mass()) same("mass", "constant_mass", mass(near), mass(far));
  if (e.constant_force()) same("force", "constant_force", force(near), force(far));
}

void check_claims(const Constraint&, const Place&, const Place&) {}

void check_claims(const Force& e, const Place& near, const Place& far) {
  if (!e.may_rest()) return;
  const std::size_t n = near.q.size();
  for (const Place* x : {&near, &far}) {
    Place resting = *x;
    for (const int i : e.states_that_wake()) resting.z[count(i)] = -std::abs(resting.z[count(i)]);
    Values slopes(n), Q(n + resting.z.size());
    const double d = e.calc_rest(resting.view(), slopes.data());
    if (!(d > 0)) continue;
    // Almost at its border, along all coordinates that count.
    const Values away = generic(n, 13);
    double sum = 0;
    for (std::size_t i = 0; i < n; ++i) sum += slopes[i] * std::abs(away[i]);
    if (sum > 0)
      for (std::size_t i = 0; i < n; ++i)
        if (slopes[i] > 0) resting.q[i] += 0.99 * d / sum * away[i];
    e.Force::calc_force(resting.view(), Q.data(), Q.data() + n);
    for (std::size_t i = 0; i < n; ++i)
      if (Q[i] != 0)
        throw ModelError(e.path(), fmt::format("calc_rest() says that it rests, and its force has the entry {:.3g} "
                                               "there, 0.99 of the way to the border.",
                                               Q[i]));
  }
}

template <class Kind>
void check_all(const Mechanism& m, const std::vector<std::unique_ptr<Kind>>& elements, ElementsChecked which_ones) {
  std::map<std::type_index, int> seen;
  for (const auto& owned : elements) {
    const Kind& e = *owned;
    if (which_ones == ElementsChecked::of_users && is_of_library(typeid(e))) continue;
    if (++seen[typeid(e)] > kElements) continue;
    int rows = 0, states = 0;
    if constexpr (std::is_same_v<Kind, Constraint>) rows = e.rows();
    if constexpr (std::is_same_v<Kind, Force>) states = e.states();
    Place places[2];
    for (int which : {0, 1}) places[which] = place_near_start(m, e, rows, states, which);
    bool all = true;
    for (const Place& x : places) {
      Comparison c(m, e);
      try {
        compare(c, e, x);
      } catch (const std::exception&) {
        all = false;  // no state for it
        continue;
      }
      c.judge();
    }
    if (all) check_claims(e, places[0], places[1]);
  }
}

}  // namespace

void check_derivatives(const Mechanism& m, ElementsChecked which) {
  check_all(m, m.bodies(), which);
  check_all(m, m.constraints(), which);
  check_all(m, m.forces(), which);
}

}  // namespace costate
