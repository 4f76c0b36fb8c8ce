// The best shares of what contacts hold (event/resting_shares.h), by what proves them: the shares are within all cones
// of friction moved in by the margin, and the weights, in the dual cones and orthogonal to what moves nothing, bound
// from above what any shares leave.
#include "costate/event/resting_shares.h"

#include <Eigen/QR>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <vector>

using namespace costate;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

/// Feet on a floor, that hold a weight, a force and a torque about the vertical, and torques that would tip.
struct Feet {
  std::vector<RestingCone> cones;
  VectorXd forces;  // some that hold the load
  MatrixXd moves_nothing;

  Feet(const std::vector<Vector2d>& places, const std::vector<double>& friction, double weight, const Vector2d& force,
       double torque, const Vector2d& tips) {
    const auto n = static_cast<Eigen::Index>(places.size());
    MatrixXd A(6, 3 * n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto at = static_cast<std::size_t>(i);
      const Vector2d& p = places[at];
      A.col(3 * i) << 0, 0, 1, p[1], -p[0], 0;
      A.col(3 * i + 1) << 1, 0, 0, 0, 0, -p[1];
      A.col(3 * i + 2) << 0, 1, 0, 0, 0, p[0];
      cones.push_back({static_cast<int>(3 * i), 3, friction[at]});
    }
    VectorXd load(6);
    load << force, weight, tips, torque;
    forces = A.completeOrthogonalDecomposition().solve(load);
    Eigen::ColPivHouseholderQR<MatrixXd> qr(A.transpose());
    const MatrixXd Q = qr.householderQ();
    moves_nothing = Q.rightCols(3 * n - qr.rank());
  }
};

/// What proves that these are the best: to 1e-9 of the largest force, weights to their own error of 1e-7.
void check_best(const Feet& feet, const RestingShares& best) {
  const double size = feet.forces.cwiseAbs().maxCoeff();
  const VectorXd moved = best.forces - feet.forces;
  CHECK((moved - feet.moves_nothing * (feet.moves_nothing.transpose() * moved)).norm() <= 1e-9 * size);
  for (const RestingCone& c : feet.cones) CHECK(margin_of(c, best.forces) >= best.margin - 1e-9 * size);
  CHECK((feet.moves_nothing.transpose() * best.weights).norm() <= 1e-7);
  double all = 0;
  for (std::size_t i = 0; i < feet.cones.size(); ++i) {
    const RestingCone& c = feet.cones[i];
    const double w = best.at_limit[static_cast<Eigen::Index>(i)];
    all += w;
    CHECK(w >= 0);
    CHECK(std::abs(best.weights[c.first] - w * c.friction) <= 1e-12);
    CHECK(best.weights.segment(c.first + 1, 2).norm() <= w + 1e-12);
  }
  // With weights within the dual cones, of sum 1, no shares leave more than this.
  CHECK(std::abs(all - 1) <= 1e-6);
  CHECK(std::abs(best.weights.dot(feet.forces) - best.margin) <= 2e-6 * size);
}

const std::vector<Vector2d> three = {{1, 0}, {-0.5, 0.8}, {-0.5, -0.8}},
                            four = {{1, 0.5}, {-1, 0.5}, {-1, -0.5}, {1, -0.5}};

}  // namespace

TEST_CASE("resting shares: of random feet and loads the best, proved by weights") {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> in(-1, 1);
  for (int k = 0; k < 200; ++k) {
    const int count = 2 + k % 5;
    std::vector<Vector2d> places;
    std::vector<double> friction;
    for (int i = 0; i < count; ++i) {
      places.emplace_back(in(random), in(random));
      friction.push_back(0.4 + 0.3 * in(random));
    }
    const double scale = std::pow(10.0, k % 19 - 9);
    // Two feet bear no load that tips about their line, but what is held may be any.
    const Vector2d tips = count > 2 ? Vector2d(in(random), in(random)) : Vector2d(0, 0);
    Feet feet(places, friction, 10 * scale, scale * Vector2d(3 * in(random), 3 * in(random)), 2 * scale * in(random),
              scale * tips);
    CAPTURE(k, count, scale);
    const auto best = best_shares(feet.cones, feet.forces, feet.moves_nothing);
    REQUIRE(best);
    check_best(feet, *best);
  }
}

// A force in the middle slides all where it reaches mu W, a torque where it reaches mu W r of four feet at r, and a box
// tips where what tips it reaches W b: the margin's derivative by the load is then known.
TEST_CASE("resting shares: limits that are known") {
  const std::vector<double> alike(4, 0.3);
  const auto margin = [&](const Vector2d& force, double torque, const Vector2d& tips) {
    const Feet feet(four, alike, 10, force, torque, tips);
    const auto best = best_shares(feet.cones, feet.forces, feet.moves_nothing);
    REQUIRE(best);
    check_best(feet, *best);
    return best->margin;
  };
  const double r = std::sqrt(1.25);
  for (const double part : {0.5, 0.999, 1.0, 1.001, 1.5}) {
    CAPTURE(part);
    // Each foot has a quarter of what is left.
    CHECK(margin({1.8 * part, 2.4 * part}, 0, {0, 0}) == Approx(0.75 * (1 - part)).margin(1e-10));
    CHECK(margin({0, 0}, 3 * r * part, {0, 0}) == Approx(0.75 * (1 - part)).margin(1e-10));
    // What tips leaves W (1 - part)/2 to the feet that lift, half to each.
    if (part > 0.99) CHECK(margin({0, 0}, 0, {0, -10 * part}) == Approx(0.3 * 10 * (1 - part) / 4).margin(1e-10));
  }
}

TEST_CASE("resting shares: of three feet that turn about one of them that one is within its limit") {
  const Feet feet(three, {0.3, 0.3, 0.3}, 10, {1, 1}, 1, {0, 0});
  const auto best = best_shares(feet.cones, feet.forces, feet.moves_nothing);
  REQUIRE(best);
  check_best(feet, *best);
  CHECK(best->at_limit[1] <= 1e-6);
  CHECK(margin_of(feet.cones[1], best->forces) > best->margin + 0.1);
  CHECK(best->at_limit[0] > 0.4);
  CHECK(best->at_limit[2] > 0.4);
}

// Between two walls, or in a groove, any pressure is possible: nothing is said of what friction may hold then.
TEST_CASE("resting shares: what may press against each other without a limit has none") {
  // Normal forces that oppose each other, friction upwards that holds 1 N by both.
  std::vector<RestingCone> cones = {{0, 3, 0.3}, {3, 3, 0.3}};
  VectorXd forces(6);
  forces << 0.1, 0, 0.5, 0.1, 0, 0.5;
  MatrixXd Z = MatrixXd::Zero(6, 2);
  Z(0, 0) = Z(3, 0) = Z(2, 1) = std::sqrt(0.5);
  Z(5, 1) = -std::sqrt(0.5);
  CHECK_FALSE(best_shares(cones, forces, Z));
  // Without that they hold what they hold.
  const auto alone = best_shares(cones, forces, Z.rightCols(1));
  REQUIRE(alone);
  CHECK(alone->margin == Approx(0.03 - 0.5));
}

TEST_CASE("resting shares: of contacts without friction, and of no load") {
  // Four feet that bear a weight off the middle: the least of their shares is the largest where two by two are alike.
  std::vector<RestingCone> cones = {{0, 1, 0}, {1, 1, 0}, {2, 1, 0}, {3, 1, 0}};
  VectorXd forces(4);
  forces << 4, 0, 1, 5;
  MatrixXd Z(4, 1);
  Z << 0.5, -0.5, 0.5, -0.5;
  Z.col(0).normalize();
  // (4 + x, -x, 1 + x, 5 - x): the least is -x or 1 + x.
  const auto best = best_shares(cones, forces, Z);
  REQUIRE(best);
  CHECK(best->margin == Approx(0.5).margin(1e-10));
  const auto none = best_shares(cones, VectorXd::Zero(4), Z);
  REQUIRE(none);
  CHECK(none->margin == 0);
}
