#include "body_frame.h"

#include <fmt/format.h>

#include "costate/element/point/rotation.h"

namespace costate::app {

BodyFrame body_frame(const Mechanism& mechanism, const Start& start, const std::string& kind, const std::string& name) {
  const auto q = [&](const std::string& c) { return start.q[mechanism.coordinate(name + "." + c)]; };
  const auto v = [&](const std::string& c) { return start.v[mechanism.coordinate(name + "." + c)]; };
  BodyFrame f;
  f.r = {q("x"), q("y"), q("z")};
  for (int k = 0; k < 3; ++k) {
    const Vector3 unit = Vector3::Unit(k);
    if (kind == "rigid_body") {
      double p[4], w[4];
      for (int i = 0; i < 4; ++i) {
        p[i] = q(fmt::format("e{}", i));
        w[i] = v(fmt::format("e{}", i));
      }
      rotated(p, unit.data(), f.A.col(k).data());
      rotated_rate(p, w, unit.data(), f.rate.col(k).data());
    } else {
      for (int i = 0; i < 3; ++i) {
        f.A(i, k) = q(fmt::format("u{}{}", k + 1, "xyz"[i]));
        f.rate(i, k) = v(fmt::format("u{}{}", k + 1, "xyz"[i]));
      }
    }
  }
  return f;
}

}  // namespace costate::app
