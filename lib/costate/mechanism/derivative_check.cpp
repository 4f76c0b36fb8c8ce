#include "costate/mechanism/derivative_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <typeindex>

#include "costate/base/error.h"
#include "costate/base/generic_numbers.h"
#include "costate/base/library_class.h"
#include "costate/mechanism/value_check.h"

namespace costate {

namespace {

constexpr int kElements = 8;                   // of a class
constexpr double kDistances[] = {1e-4, 3e-2};  // from the start, relative to the largest position
// Allowed: of an entry; of the largest of its row, in all blocks; of the numbers, times positions and velocities.
constexpr double kRelative = 1e-6, kOfRow = 1e-13, kOfNumbers = 1e-15;

using Values = std::vector<double>;

std::size_t index(int n) { return static_cast<std::size_t>(n); }

using Place = ElementPlace;

/// `q`: positions of all coordinates at the start.
Place place_near_start(const Mechanism& m, const Values& q, const Element& e, int rows, int states, int which) {
  Place x;
  x.t = which == 0 ? 0.37 : 1.61;
  double size = 0;
  for (const int i : e.coordinates()) {
    x.q.push_back(q[index(i)]);
    size = std::max(size, std::abs(x.q.back()));
  }
  if (size == 0) size = 1;
  const std::size_t n = x.q.size();
  const Values away = generic_numbers(n, 3 + which);
  for (std::size_t i = 0; i < n; ++i) x.q[i] += kDistances[which] * size * away[i];
  x.v = generic_numbers(n, 5 + which);
  x.a = generic_numbers(n, 7 + which);
  x.lambda = generic_numbers(index(rows), 9 + which);
  x.z = generic_numbers(index(states), 11 + which);
  for (const int k : e.numbers()) x.p.push_back(m.numbers()[index(k)].value);
  return x;
}

/// One block both ways, column-major. Its rows are those of the element's vectors (r; phi, reaction; Q, zdot; weighted
/// sums) from `first` on.
struct Block {
  std::string what;  // "Q_q"
  const char* from;  // the function that gives it
  std::size_t rows, first;
  Values hand, dual;
};

class Comparison {
 public:
  Comparison(const Mechanism& m, const Element& e, const Place& x) : mechanism_(m), element_(e) {
    double arguments = 1, numbers = 0;
    for (const Values* of : {&x.q, &x.v})
      for (const double y : *of) arguments = std::max(arguments, std::abs(y));
    for (const double y : x.p) numbers = std::max(numbers, std::abs(y));
    rounding_ = kOfNumbers * arguments * numbers;
  }

  void add(std::string what, const char* from, std::size_t rows, std::size_t first, Values hand, Values dual) {
    blocks_.push_back({std::move(what), from, rows, first, std::move(hand), std::move(dual)});
  }
  /// The same with fill(double* out, bool by_hand).
  template <class Fill>
  void fill(std::string what, const char* from, std::size_t rows, std::size_t columns, std::size_t first,
            const Fill& fill) {
    Values hand(rows * columns), dual(rows * columns);
    fill(hand.data(), true);
    fill(dual.data(), false);
    add(std::move(what), from, rows, first, std::move(hand), std::move(dual));
  }
  /// "derivative of phi by 'spring.S.stiffness_N_per_m', entry".
  std::string by_number(const std::string& of, std::size_t local) const {
    const int k = element_.numbers()[local];
    return fmt::format("derivative of {} by '{}', entry", of, mechanism_.numbers()[index(k)].path);
  }

  void judge() const {
    Values sizes;  // of rows
    for (const Block& b : blocks_) {
      sizes.resize(std::max(sizes.size(), b.first + b.rows), 0.0);
      for (std::size_t i = 0; i < b.dual.size(); ++i)
        if (double& size = sizes[b.first + i % b.rows]; std::isfinite(b.dual[i]))
          size = std::max(size, std::abs(b.dual[i]));
    }
    for (const Block& b : blocks_)
      for (std::size_t i = 0; i < b.hand.size(); ++i) {
        const double hand = b.hand[i], dual = b.dual[i], size = std::max(std::abs(hand), std::abs(dual));
        if (!std::isfinite(dual) ||
            std::abs(hand - dual) <= kRelative * size + kOfRow * sizes[b.first + i % b.rows] + rounding_)
          continue;
        throw ModelError(
            element_.path(),
            fmt::format("{} is wrong: {} ({}, {}) is {:.9g}, and the element's own physics by dual numbers gives "
                        "{:.9g}. Mend it, or leave it out: the base class derives what is not written.",
                        b.from, b.what, i % b.rows, i / b.rows, hand, dual));
      }
  }

 private:
  const Mechanism& mechanism_;
  const Element& element_;
  double rounding_ = 0;
  std::vector<Block> blocks_;
};

Values part(const Values& x, std::size_t first, std::size_t size) {
  const auto at = x.begin() + static_cast<std::ptrdiff_t>(first);
  return {at, at + static_cast<std::ptrdiff_t>(size)};
}

void compare(Comparison& c, const Body& e, const Place& x) {
  const std::size_t n = x.q.size();
  const LocalState s = x.view();
  c.fill("entry", "calc_mass", n, n, 0, [&](double* out, bool by_hand) {
    LocalMatrix M(out, n, n);
    by_hand ? e.calc_mass(s, M) : e.Body::calc_mass(s, M);
  });
  c.fill("entry", "calc_force", n, 1, 0,
         [&](double* out, bool by_hand) { by_hand ? e.calc_force(s, out) : e.Body::calc_force(s, out); });
  const auto partials = [&](bool by_hand) {
    std::array<Values, 2> r{Values(n * n), Values(n * n)};
    LocalMatrix r_q(r[0].data(), n, n), r_v(r[1].data(), n, n);
    by_hand ? e.calc_partials(s, r_q, r_v) : e.Body::calc_partials(s, r_q, r_v);
    return r;
  };
  const auto hand = partials(true), dual = partials(false);
  c.add("r_q", "calc_partials", n, 0, hand[0], dual[0]);
  c.add("r_v", "calc_partials", n, 0, hand[1], dual[1]);
  for_numbers(e, [&](std::size_t at) {
    const int k = static_cast<int>(at);
    c.fill(c.by_number("r", at), "calc_number_partial", n, 1, 0, [&](double* out, bool by_hand) {
      by_hand ? e.calc_number_partial(s, k, out) : e.Body::calc_number_partial(s, k, out);
    });
  });
}

void compare(Comparison& c, const Constraint& e, const Place& x) {
  const std::size_t n = x.q.size(), m = x.lambda.size();
  const LocalState s = x.view();
  c.fill("entry", "calc_phi", m, 1, 0,
         [&](double* out, bool by_hand) { by_hand ? e.calc_phi(s, out) : e.Constraint::calc_phi(s, out); });
  c.fill("entry", "calc_phi_q", m, n, 0, [&](double* out, bool by_hand) {
    LocalMatrix phi_q(out, m, n);
    by_hand ? e.calc_phi_q(s, phi_q) : e.Constraint::calc_phi_q(s, phi_q);
  });
  if (e.rheonomic())
    c.fill("entry", "calc_phi_t", m, 1, 0,
           [&](double* out, bool by_hand) { by_hand ? e.calc_phi_t(s, out) : e.Constraint::calc_phi_t(s, out); });
  c.fill("entry", "calc_bias", m, 1, 0,
         [&](double* out, bool by_hand) { by_hand ? e.calc_bias(s, out) : e.Constraint::calc_bias(s, out); });
  c.fill("entry", "calc_hessian", n, n, m, [&](double* out, bool by_hand) {
    LocalMatrix hessian(out, n, n);
    by_hand ? e.calc_hessian(s, hessian) : e.Constraint::calc_hessian(s, hessian);
  });
  const auto partials = [&](bool by_hand) {
    std::array<Values, 3> r{Values(n * n), Values(m * n), Values(m * n)};
    LocalMatrix h(r[0].data(), n, n), d(r[1].data(), m, n), dd(r[2].data(), m, n);
    by_hand ? e.calc_partials(s, h, d, dd) : e.Constraint::calc_partials(s, h, d, dd);
    return r;
  };
  const auto hand = partials(true), dual = partials(false);
  c.add("hessian", "calc_partials", n, m, hand[0], dual[0]);
  c.add("phid_q", "calc_partials", m, 0, hand[1], dual[1]);
  c.add("phidd_q", "calc_partials", m, 0, hand[2], dual[2]);
  const Values w = generic_numbers(std::max(m, n), 21), none(std::max(m, n));
  for_numbers(e, [&](std::size_t at) {
    const int k = static_cast<int>(at);
    const auto partial = [&](bool by_hand) {
      Values r(3 * m + n);
      double *phi = r.data(), *phid = phi + m, *phidd = phid + m, *reaction = phidd + m;
      by_hand ? e.calc_number_partial(s, k, phi, phid, phidd, reaction)
              : e.Constraint::calc_number_partial(s, k, phi, phid, phidd, reaction);
      return r;
    };
    const Values own = partial(true), expected = partial(false);
    const char* names[4] = {"phi", "phidot", "phiddot", "the reaction"};
    for (std::size_t which = 0; which < 4; ++which) {
      const bool reaction = which == 3;
      const std::size_t rows = reaction ? n : m;
      c.add(c.by_number(names[which], at), "calc_number_partial", rows, reaction ? m : 0, part(own, which * m, rows),
            part(expected, which * m, rows));
      const auto weight = [&](std::size_t of) { return of == which ? w.data() : none.data(); };
      const ConstraintWeights weights{weight(0), weight(1), weight(2), reaction ? w.data() : nullptr};
      c.add(c.by_number(fmt::format("a weighted sum of {}", names[which]), at), "calc_number_gradient", 1, m + n,
            {e.calc_number_gradient(s, k, weights)}, {e.Constraint::calc_number_gradient(s, k, weights)});
    }
  });
}

void compare(Comparison& c, const Force& e, const Place& x) {
  const std::size_t n = x.q.size(), nz = x.z.size();
  const LocalState s = x.view();
  c.fill("Q and zdot, one below the other, entry", "calc_force", n + nz, 1, 0, [&](double* out, bool by_hand) {
    by_hand ? e.calc_force(s, out, out + n) : e.Force::calc_force(s, out, out + n);
  });
  const auto partials = [&](bool by_hand) {
    std::array<Values, 6> r{Values(n * n),  Values(n * n),  Values(n * nz),
                            Values(nz * n), Values(nz * n), Values(nz * nz)};
    LocalMatrix Q_q(r[0].data(), n, n), Q_v(r[1].data(), n, n), Q_z(r[2].data(), n, nz), f_q(r[3].data(), nz, n),
        f_v(r[4].data(), nz, n), f_z(r[5].data(), nz, nz);
    const ForcePartials to{Q_q, Q_v, Q_z, f_q, f_v, f_z};
    by_hand ? e.calc_partials(s, to) : e.Force::calc_partials(s, to);
    return r;
  };
  const auto hand = partials(true), dual = partials(false);
  const char* names[6] = {"Q_q", "Q_v", "Q_z", "f_q", "f_v", "f_z"};
  for (std::size_t which = 0; which < 6; ++which)
    c.add(names[which], "calc_partials", which < 3 ? n : nz, which < 3 ? 0 : n, hand[which], dual[which]);
  // All numbers at once, added to what is there: by one or the other weights, whose sums have sizes of their own.
  const Values w = generic_numbers(n + nz, 21);
  const std::size_t np = e.numbers().size();
  constexpr double there = 0.5;
  std::vector<int> all(np);
  std::iota(all.rbegin(), all.rend(), 0);  // not in order
  Values of_Q(np, there), of_f(np, there);
  e.add_number_gradient(s, w.data(), nullptr, all.data(), static_cast<int>(np), of_Q.data());
  if (nz) e.add_number_gradient(s, nullptr, w.data() + n, all.data(), static_cast<int>(np), of_f.data());
  for_numbers(e, [&](std::size_t at) {
    const int k = static_cast<int>(at);
    Values own(n + nz), expected(n + nz);
    e.calc_number_partial(s, k, own.data(), own.data() + n);
    e.Force::calc_number_partial(s, k, expected.data(), expected.data() + n);
    const auto sum = [&](std::size_t from, std::size_t to) {
      return std::inner_product(w.begin() + static_cast<std::ptrdiff_t>(from),
                                w.begin() + static_cast<std::ptrdiff_t>(to),
                                expected.begin() + static_cast<std::ptrdiff_t>(from), there);
    };
    c.add(c.by_number("a weighted sum of Q", at), "add_number_gradient", 1, n + nz, {of_Q[np - 1 - at]}, {sum(0, n)});
    c.add(c.by_number("a weighted sum of zdot", at), "add_number_gradient", 1, n + nz, {of_f[np - 1 - at]},
          {sum(n, n + nz)});
    c.add(c.by_number("Q and zdot, one below the other,", at), "calc_number_partial", n + nz, 0, std::move(own),
          std::move(expected));
  });
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
    for (const int i : e.states_that_wake()) resting.z[index(i)] = -std::abs(resting.z[index(i)]);
    Values slopes(n), Q(n + resting.z.size());
    const double d = e.calc_rest(resting.view(), slopes.data());
    if (!(d > 0)) continue;
    // Almost at its border, along all coordinates that count.
    const Values away = generic_numbers(n, 13);
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

/// `q`: as place_near_start() has it.
template <class Kind>
void check_all(const Mechanism& m, const Values& q, const std::vector<std::unique_ptr<Kind>>& elements,
               ElementsChecked which_ones) {
  std::map<std::type_index, int> seen;
  for (const auto& owned : elements) {
    const Kind& e = *owned;
    if (which_ones == ElementsChecked::of_users && is_wholly_of_library(typeid(e))) continue;
    if (++seen[typeid(e)] > kElements) continue;
    int rows = 0, states = 0;
    if constexpr (std::is_same_v<Kind, Constraint>) rows = e.rows();
    if constexpr (std::is_same_v<Kind, Force>) states = e.states();
    Place places[2];
    for (int which : {0, 1}) places[which] = place_near_start(m, q, e, rows, states, which);
    bool all = true;
    for (const Place& x : places) {
      Comparison c(m, e, x);
      try {
        compare(c, e, x);
      } catch (const std::exception&) {
        all = false;  // no state for it
        continue;
      }
      c.judge();
      try {
        check_values(m, e, x);
      } catch (const LostDerivative&) {
        throw;
      } catch (const std::exception&) {  // no state for it, a step away
      }
    }
    if (all) check_claims(e, places[0], places[1]);
  }
}

}  // namespace

void check_derivatives(const Mechanism& m, ElementsChecked which) {
  const Values q = m.first_positions();
  check_all(m, q, m.bodies(), which);
  check_all(m, q, m.constraints(), which);
  check_all(m, q, m.forces(), which);
}

}  // namespace costate
