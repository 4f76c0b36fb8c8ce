// What differences of runs tell of errors, on runs whose errors are known powers of the tolerance.
#include "costate/tradeoff/error_order.h"

#include <catch2/catch.hpp>
#include <cmath>

using costate::ErrorOrder;

namespace {

/// The difference of two runs with errors amount r^p of one sign.
double apart(double amount, double p, double looser, double rtol) {
  return amount * (std::pow(looser, p) - std::pow(rtol, p));
}

}  // namespace

TEST_CASE("error order: an error in proportion to the tolerance is never larger than said", "[error_order]") {
  for (const bool scheme : {false, true})
    for (const double amount : {0.1, 1.0, 30.0}) {
      CAPTURE(scheme, amount);
      ErrorOrder order(scheme);
      double looser = 1e-3;
      for (const double rtol : {1e-4, 3e-6, 1e-7, 1e-9}) {
        const double d = apart(amount, 1, looser, rtol);
        order.look(looser, rtol, d);
        CHECK(order.share() * d >= amount * rtol);
        // And of errors of the size of the tolerances no more than the safe order makes of the difference.
        if (amount < 10) CHECK(order.share() <= 1.001 / (std::sqrt(std::min(looser / rtol, 30.0)) - 1));
        looser = rtol;
      }
    }
}

TEST_CASE("error order: one that falls with the root of the tolerance is known once it has been seen",
          "[error_order]") {
  ErrorOrder order(true);
  double looser = 1e-4;
  int looks = 0;
  for (const double rtol : {1e-5, 1e-6, 1e-7, 1e-8}) {
    const double d = apart(1, 0.5, looser, rtol);
    order.look(looser, rtol, d);
    if (++looks > 1) CHECK(order.share() * d >= 0.999 * std::sqrt(rtol));
    looser = rtol;
  }
}

TEST_CASE("error order: the next tolerance serves the aim, in one step or in two", "[error_order]") {
  for (const double amount : {0.3, 3.0, 30.0, 3000.0})
    for (const double aim : {1e-4, 1e-6}) {
      CAPTURE(amount, aim);
      ErrorOrder order(true);
      double looser = 1e-3, rtol = 1e-4, d = 0;
      int runs = 0;
      for (;; ++runs) {
        d = apart(amount, 1, looser, rtol);
        order.look(looser, rtol, d);
        if (order.share() * d <= aim) break;
        looser = rtol;
        rtol *= order.step(aim);
        REQUIRE(runs < 6);
      }
      // By share() it is no error of more than the aim, and not a thousandth of it: no tolerance is wasted.
      CHECK(amount * rtol <= aim);
      CHECK(amount * rtol >= 1e-3 * aim);
      CHECK(runs <= 3);
    }
}

TEST_CASE("error order: what falls faster than tolerances do has fallen by chance", "[error_order]") {
  costate::FastestFall fall;
  fall.look(1e-4, 1e-5, {1e-2, 0});
  CHECK(fall.least(0) == 0);
  // Errors of 1e-2 at 1e-4 are no less than a hundredth of that at 1e-7 (1e-3^0.7 = 1/126), whatever runs differ by.
  fall.look(1e-5, 1e-7, {1e-9, 1e-9});
  CHECK(fall.least(0) == Approx(1e-2 * std::pow(1e-3, 0.7)));
  CHECK(fall.least(1) == 0);
}
