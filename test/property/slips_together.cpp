// Directions of several contacts that slide in space: of random bodies all ways together against Gauss and Seidel's
// iteration on projections, which knows no ways.
#include "costate/event/slips_together.h"

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

using namespace costate;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Way = SlidingContact::Way;

namespace {

struct RandomBody {
  MatrixXd response;
  VectorXd rates;
  std::vector<SlidingContact> contacts;
};

/// That falls with points of it on the ground, or, without a fall, is pushed there.
RandomBody random_body(std::mt19937& random, int points, double friction) {
  std::normal_distribution<double> normal;
  Eigen::Matrix<double, 6, 6> masses = Eigen::Matrix<double, 6, 6>::Identity();
  for (int i = 3; i < 6; ++i) masses(i, i) = 1 / (0.05 + 0.05 * std::abs(normal(random)));
  RandomBody b;
  MatrixXd J(3 * points, 6);
  for (int c = 0; c < points; ++c) {
    const Vector3d r(0.2 * normal(random), 0.2 * normal(random), -0.2);
    Eigen::Matrix3d across, rows;
    across << 0, -r[2], r[1], r[2], 0, -r[0], -r[1], r[0], 0;
    rows << 0, 0, 1, 1, 0, 0, 0, 1, 0;
    J.block(3 * c, 0, 3, 3) = rows;
    J.block(3 * c, 3, 3, 3) = -rows * across;
  }
  VectorXd v(6);
  for (int i = 0; i < 6; ++i) v[i] = normal(random) * (i > 2 ? 2 : 1);
  v[2] = -1 - std::abs(v[2]);
  b.response = J * masses * J.transpose();
  b.rates = J * v;
  for (int c = 0; c < points; ++c) {
    SlidingContact at;
    at.rows = {3 * c, 3 * c + 1, 3 * c + 2};
    at.friction = friction;
    at.normal = -b.rates[3 * c];
    for (int k = 0; k < 2; ++k) at.along[k] = -b.rates[3 * c + 1 + k];
    b.contacts.push_back(at);
  }
  return b;
}

/// Rates behind, and impulses, by these ways and directions; false where rows have no common solution.
bool solve_ways(const RandomBody& b, const std::vector<SlidingContact>& contacts, const Slips& s, VectorXd& v,
                VectorXd& p) {
  const auto size = b.rates.size();
  std::vector<int> rows;
  std::vector<double> asked;
  MatrixXd P = MatrixXd::Zero(size, 0);
  const auto add = [&](int row, const VectorXd& column, double target) {
    P.conservativeResize(Eigen::NoChange, P.cols() + 1);
    P.col(P.cols() - 1) = column;
    rows.push_back(row);
    asked.push_back(target);
  };
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const SlidingContact& at = contacts[c];
    if (at.way == Way::open) continue;
    VectorXd column = VectorXd::Unit(size, at.rows[0]);
    for (int k = 0; at.way == Way::slides && k < 2; ++k)
      column[at.rows[static_cast<std::size_t>(k + 1)]] = -at.friction * s[c][k];
    add(at.rows[0], column, at.normal);
    for (int k = 1; at.way == Way::sticks && k < 3; ++k)
      add(at.rows[static_cast<std::size_t>(k)], VectorXd::Unit(size, at.rows[static_cast<std::size_t>(k)]),
          at.along[k - 1]);
  }
  v = b.rates;
  p = VectorXd::Zero(size);
  if (!rows.empty()) {
    const MatrixXd A = (b.response * P)(rows, Eigen::all);
    const VectorXd c = Eigen::Map<const VectorXd>(asked.data(), static_cast<Eigen::Index>(asked.size()));
    const VectorXd x = A.completeOrthogonalDecomposition().solve(c);
    if ((A * x - c).norm() > 1e-8 * (c.norm() + A.norm() * x.norm())) return false;
    p = P * x;
    v += b.response * p;
  }
  return true;
}

/// Whether these rates violate nothing: impulses of rows that depend on each other are not looked at where projections
/// come to the same rates.
bool is_motion(const RandomBody& b, const std::vector<SlidingContact>& contacts, const Slips& s,
               const VectorXd& projected, VectorXd& v) {
  VectorXd p;
  if (!solve_ways(b, contacts, s, v, p)) return false;
  const bool pushed = (v - projected).norm() <= 1e-7;
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const SlidingContact& at = contacts[c];
    const Vector2d along(v[at.rows[1]], v[at.rows[2]]), friction(p[at.rows[1]], p[at.rows[2]]);
    if (v[at.rows[0]] < -1e-9) return false;
    if (at.way == Way::open) continue;
    if (p[at.rows[0]] < -1e-9 && !pushed) return false;
    if (at.way == Way::sticks && !pushed && friction.norm() > at.friction * p[at.rows[0]] + 1e-9) return false;
    if (at.way != Way::slides) continue;
    CHECK(std::abs(s[c][0] * along[1] - s[c][1] * along[0]) <= 1e-9);
    if (s[c].dot(along) < -1e-9) return false;
  }
  return true;
}

}  // namespace

// Sixty bodies with two and three points that strike at once: one motion each by all ways, that of the projections.
// Where (19.10) holds there is no other; it does for some.
TEST_CASE("contacts together in space: all ways against projections", "[events]") {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  int proven = 0, slide_together = 0;
  for (int k = 0; k < 60; ++k) {
    const RandomBody b = random_body(random, 2 + k % 2, 0.02 + 0.3 * std::abs(normal(random)));
    const VectorXd projected = rates_by_projection(b.response, b.rates, b.contacts);
    proven += has_one_solution(b.response, b.contacts);
    std::vector<VectorXd> motions;
    int ways = 1;
    for (std::size_t c = 0; c < b.contacts.size(); ++c) ways *= 3;
    for (int way = 0; way < ways; ++way) {
      std::vector<SlidingContact> contacts = b.contacts;
      int rest = way;
      for (SlidingContact& at : contacts) {
        at.way = rest % 3 == 0 ? Way::open : rest % 3 == 1 ? Way::sticks : Way::slides;
        at.unknown = at.way == Way::slides;
        rest /= 3;
      }
      const SlipsTogether together = slips_together(b.response, b.rates, contacts, {});
      for (const Slips& s : together.found) {
        VectorXd v;
        if (!is_motion(b, contacts, s, projected, v)) continue;
        bool is_new = true;
        for (const VectorXd& other : motions) is_new = is_new && (other - v).norm() > 1e-6 * (1 + v.norm());
        if (is_new) motions.push_back(v);
        slide_together += is_new && together.starts > 0;
      }
    }
    CAPTURE(k);
    REQUIRE(motions.size() == 1);
    CHECK((motions.front() - projected).norm() <= 1e-7 * (1 + projected.norm()));
  }
  CHECK(proven > 2);
  CHECK(slide_together > 20);
}

// One that slides beside others has the directions of a polynomial: all at which s x v_t changes its sign, looked for
// at 4,000 angles.
TEST_CASE("contacts together in space: one that slides beside others that stick or slide", "[events]") {
  std::mt19937 random(11);
  for (int k = 0; k < 60; ++k) {
    RandomBody b = random_body(random, 2, 0.4);
    b.contacts[0].way = Way::slides;
    b.contacts[0].unknown = true;
    b.contacts[1].way = k % 3 == 0 ? Way::sticks : k % 3 == 1 ? Way::slides : Way::open;
    if (k % 3 == 1) b.contacts[1].slip = {0.6, -0.8};
    const SlipsTogether all = slips_together(b.response, b.rates, b.contacts, {});
    CHECK(all.starts == 0);
    const auto off = [&](double angle) {
      const Slips s{Vector2d(std::cos(angle), std::sin(angle)), b.contacts[1].slip};
      VectorXd v, p;
      solve_ways(b, b.contacts, s, v, p);
      return s[0][0] * v[b.contacts[0].rows[2]] - s[0][1] * v[b.contacts[0].rows[1]];
    };
    std::size_t changes = 0;
    const int looks = 4000;
    for (int i = 0; i < looks; ++i) {
      double a = 2 * 3.141592653589793 * i / looks + 1e-5, c = a + 2 * 3.141592653589793 / looks;
      const bool below = off(a) < 0;
      if (below == (off(c) < 0)) continue;
      for (int half = 0; half < 45; ++half) {
        const double middle = 0.5 * (a + c);
        ((off(middle) < 0) == below ? a : c) = middle;
      }
      changes += std::abs(off(a)) <= 1e-6;  // else through a pole
    }
    CAPTURE(k);
    CHECK(all.found.size() == changes);
    for (const Slips& s : all.found) CHECK(std::abs(off(std::atan2(s[0][1], s[0][0]))) <= 1e-10 * b.rates.norm());
  }
}
