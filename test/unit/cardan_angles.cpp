// Roll, pitch and yaw from a rotation matrix: their definition turned round, with derivatives, in every quadrant; and
// as outputs of both kinds of bodies.
#include "costate/element/body/cardan_angles.h"

#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "costate/analysis/start.h"
#include "costate/objective/output.h"
#include "costate/scene/scene.h"

using namespace costate;

TEST_CASE("cardan angles: A_z(yaw) A_y(pitch) A_x(roll) gives them back, with unit derivatives") {
  using S = Dual<3>;
  for (const double yaw : {-3.0, -1.7, -0.6, 0.0, 0.8, 1.6, 3.1})
    for (const double pitch : {-1.5, -0.4, 0.0, 0.9, 1.5})
      for (const double roll : {-2.9, -0.9, 0.0, 0.3, 2.0}) {
        INFO(yaw << " " << pitch << " " << roll);
        S r = roll, p = pitch, y = yaw;
        r.d[0] = p.d[1] = y.d[2] = 1;
        const S A11 = cos(y) * cos(p), A21 = sin(y) * cos(p), A31 = -sin(p), A32 = cos(p) * sin(r),
                A33 = cos(p) * cos(r);
        const double expected[3] = {roll, pitch, yaw};
        for (int i = 0; i < 3; ++i) {
          const S found = cardan_angle(static_cast<CardanAngle>(i), A11, A21, A31, A32, A33);
          // cos(1.5) = 0.07 divides the entries' roundings.
          CHECK(found.v == Approx(expected[i]).margin(1e-14));
          for (int j = 0; j < 3; ++j)
            CHECK(found.d[static_cast<std::size_t>(j)] == Approx(i == j ? 1 : 0).margin(1e-12));
        }
      }
  CHECK(cardan_angle(CardanAngle::pitch, 0.0, 0.0, -1.0, 0.0, 0.0) == Approx(std::acos(-1.0) / 2));
  CHECK(cardan_angle(CardanAngle::roll, 0.0, 0.0, -1.0, 0.0, 0.0) == 0);
}

TEST_CASE("cardan angles: outputs of bodies in Euler parameters and in natural coordinates") {
  for (const char* kind : {"rigid_body", "natural_body"})
    for (const auto& [axis, angle, name] : {std::tuple("1, 0, 0", 0.7, "roll"), std::tuple("0, 1, 0", -0.5, "pitch"),
                                            std::tuple("0, 0, 1", 2.5, "yaw")}) {
      INFO(kind << " " << name);
      const Scene scene = Scene::parse(
          fmt::format("[{}.b]\nx_m = 0\ny_m = 0\nz_m = 0\nmass_kg = 1\ninertia_xx_kg_m2 = 1\ninertia_yy_kg_m2 = 1\n"
                      "inertia_zz_kg_m2 = 1\nrotation_axis = [{}]\nangle_rad = {}\n[start]\ngiven = [\"b\"]\n",
                      kind, axis, angle),
          "s.toml");
      Assembly assembly(scene.mechanism(), scene.mechanism()->select({}));
      const Start start = find_start(assembly, 0, false);
      StateView s;
      s.q = start.q.data();
      s.v = start.v.data();
      for (const char* other : {"roll", "pitch", "yaw"})
        CHECK(make_output(*scene.mechanism(), std::string("b.") + other)->value(s, assembly) ==
              Approx(std::string(name) == other ? angle : 0).margin(1e-14));
    }
}
