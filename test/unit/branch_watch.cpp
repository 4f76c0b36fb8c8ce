// A motion in independent coordinates that comes out on the way back: level/branch_watch.h.
#include "costate/level/branch_watch.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

using namespace costate;

namespace {
/// A bar of length 1 whose end is described by its height y; x is the other coordinate.
struct Bar {
  std::vector<double> v, a;
  double t = 0;
  StateView state() const {
    StateView s;
    s.t = t;
    s.v = v.data();
    s.a = a.data();
    return s;
  }
};
/// It turns at rate w, at the angle w t from the top.
Bar turning(double t, double w) {
  const double c = std::cos(w * t), s = std::sin(w * t);
  return {{w * c, -w * s}, {-w * w * s, -w * w * c}, t};
}
const std::vector<double> kSizes{1, 1};
const std::vector<int> kHeight{1};
constexpr double kPart = 0.5;

int turned_since(const Bar& before, const Bar& after, const std::vector<int>& independent = kHeight) {
  BranchWatch watch;
  watch.keep(before.state(), 2);
  CHECK(watch.kept() == before.t);
  return watch.turned(after.state(), kPart, kSizes, independent);
}
}  // namespace

TEST_CASE("branches: a bar that goes over the top has not turned, one that is sent back has") {
  const Bar before = turning(-0.3, 1);
  Bar after = turning(0.3, 1);
  CHECK(turned_since(before, after) == -1);
  // The same height, on the side that it came from.
  after.v[0] = -after.v[0];
  after.a[0] = -after.a[0];
  CHECK(turned_since(before, after) == 0);
  // Not where no independent coordinate turned round, nor behind a blow.
  CHECK(turned_since(before, after, {}) == -1);
  BranchWatch watch;
  watch.keep(before.state(), 2);
  watch.forget();
  CHECK(std::isnan(watch.kept()));
  CHECK(watch.turned(after.state(), kPart, kSizes, kHeight) == -1);
}

TEST_CASE("branches: what accelerations turn round, or rounding, is on its branch") {
  // A pendulum at the end of its swing: both coordinates turn round, by their accelerations.
  const Bar before{{0.2, 0.1}, {-1, -0.5}, 0}, after{{-0.2, -0.1}, {-1, -0.5}, 0.4};
  CHECK(turned_since(before, after) == -1);
  const Bar rest{{1e-12, -1e-12}, {0, 0}, 0}, later{{-1e-12, 1e-12}, {0, 0}, 0.4};
  CHECK(turned_since(rest, later) == -1);
}
