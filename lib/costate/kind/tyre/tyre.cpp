#include "costate/kind/tyre/tyre.h"

#include <fmt/format.h>

#include <cmath>

#include "costate/base/error.h"
#include "costate/element/force/tyre_force.h"
#include "costate/kind/tyre/tyre_parts.h"
#include "costate/scene/scene_kind.h"

namespace costate {

namespace {

struct CalspanKey {
  const char* key;
  double CalspanOptions::*member;
  NumberRule rule;
};
// In the order of CalspanTyre's numbers.
constexpr CalspanKey kCalspan[] = {
    {"A0", &CalspanOptions::A0, NumberRule::positive}, {"A1", &CalspanOptions::A1, NumberRule::any},
    {"A2", &CalspanOptions::A2, NumberRule::positive}, {"A3", &CalspanOptions::A3, NumberRule::any},
    {"A4", &CalspanOptions::A4, NumberRule::positive}, {"A_omega", &CalspanOptions::A_omega, NumberRule::positive},
    {"B1", &CalspanOptions::B1, NumberRule::any},      {"B3", &CalspanOptions::B3, NumberRule::any},
    {"B4", &CalspanOptions::B4, NumberRule::any},      {"SN", &CalspanOptions::SN, NumberRule::positive},
    {"AF1", &CalspanOptions::AF1, NumberRule::any},    {"AF2", &CalspanOptions::AF2, NumberRule::any}};

struct LinearKey {
  const char* key;
  double LinearTyreOptions::*member;
};
// In the order of LinearTyre's numbers.
constexpr LinearKey kLinear[] = {{"lateral_damping_N_s_per_m", &LinearTyreOptions::lateral_damping_N_s_per_m},
                                 {"cornering_stiffness_N_per_rad", &LinearTyreOptions::cornering_stiffness_N_per_rad},
                                 {"camber_stiffness_N_per_rad", &LinearTyreOptions::camber_stiffness_N_per_rad},
                                 {"camber_moment_N_m_per_rad", &LinearTyreOptions::camber_moment_N_m_per_rad},
                                 {"aligning_moment_N_m_per_rad", &LinearTyreOptions::aligning_moment_N_m_per_rad},
                                 {"trail_m", &LinearTyreOptions::trail_m}};

void refuse_bilateral(const std::string& name, const TyreOptions& tyre, const char* model) {
  if (tyre.bilateral)
    throw ModelError("tyre." + name + ".bilateral",
                     fmt::format("A {} tyre cannot pull: its forces are not defined for a negative load.", model));
}

}  // namespace

void add_ride_tyre(MechanismBuilder& builder, const std::string& name, const TyreOptions& tyre) {
  add_tyre_force(builder, name, tyre, RideTyre{}, {});
}

void add_linear_tyre(MechanismBuilder& builder, const std::string& name, const TyreOptions& tyre,
                     const TyreSlipOptions& slip, const LinearTyreOptions& o) {
  LinearTyre model;
  std::vector<int> numbers = add_tyre_slip(builder, name, slip, model.slip);
  for (const auto& k : kLinear) numbers.push_back(builder.add_number("tyre." + name + "." + k.key, o.*k.member));
  add_tyre_force(builder, name, tyre, model, numbers);
}

void add_calspan_tyre(MechanismBuilder& builder, const std::string& name, const TyreOptions& tyre,
                      const TyreSlipOptions& slip, const CalspanOptions& o) {
  refuse_bilateral(name, tyre, "Calspan");
  CalspanTyre model;
  std::vector<int> numbers = add_tyre_slip(builder, name, slip, model.slip);
  for (const auto& k : kCalspan)
    numbers.push_back(builder.add_number("tyre." + name + ".calspan." + k.key, o.*k.member, k.rule));
  add_tyre_force(builder, name, tyre, model, numbers);
}

namespace {

void add_tyre(const std::string& name, SceneTable& table, MechanismBuilder& builder) {
  find_tyre_model(table.one_of("model", tyre_model_names())).add(name, table, builder);
}

TyreOptions read_tyre_that_may_pull(SceneTable& table, MechanismBuilder& builder) {
  TyreOptions tyre = read_tyre(table, builder);
  tyre.bilateral = table.flag("bilateral", false);
  return tyre;
}

const RegisterTyreModel ride({"ride", [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
                                add_ride_tyre(builder, name, read_tyre_that_may_pull(table, builder));
                              }});

const RegisterTyreModel linear({"linear", [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
                                  const TyreOptions tyre = read_tyre_that_may_pull(table, builder);
                                  const TyreSlipOptions slip = read_tyre_slip(table);
                                  LinearTyreOptions o;
                                  for (const auto& k : kLinear) o.*k.member = table.value(k.key, NumberRule::any, 0);
                                  add_linear_tyre(builder, name, tyre, slip, o);
                                }});

const RegisterTyreModel calspan({"calspan", [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
                                   const TyreOptions tyre = read_tyre(table, builder);
                                   const TyreSlipOptions slip = read_tyre_slip(table);
                                   SceneTable c = table.table("calspan");
                                   CalspanOptions o;
                                   for (const auto& k : kCalspan) {
                                     const std::string key = k.key;
                                     const bool usual = key == "A_omega" || key == "SN";  // 1 unless given
                                     o.*k.member = usual ? c.value(key, k.rule, 1) : c.value(key, k.rule);
                                   }
                                   add_calspan_tyre(builder, name, tyre, slip, o);
                                 }});

const RegisterSceneKind tyre_registered({
    .name = "tyre",
    .phase = ScenePhase::elements,
    .summary = "a tyre between a wheel and a road: ride, linear, calspan or magic_formula",
    .example = R"(
[gravity]
z_m_per_s2 = -9.81

[road.plain]
kind = "flat"

[road.hill]
kind = "profile"
law = { kind = "sine", amplitude = 0.08, angular_frequency_rad_per_s = 1.3, phase_rad = 0.4 }

[rigid_body.frame]
x_m = 0.3
y_m = 0.1
z_m = 0.6
rotation_axis = [1, -0.8, 2]
angle_rad = 0.25
vx_m_per_s = 4.0
mass_kg = 3.0
inertia_xx_kg_m2 = 0.7
inertia_yy_kg_m2 = 0.9
inertia_zz_kg_m2 = 0.8

[body.rotor]
x_m = 0
y_m = 0
angle_rad = 0.2
angular_velocity_rad_per_s = 3
mass_kg = 1
inertia_kg_m2 = 0.4

[point.hub]
on = "frame"
x_m = 0.2
y_m = -0.3
z_m = 0.0

[point.middle]
on = "frame"
x_m = -0.2
y_m = 0.1
z_m = 0.1

[tyre.linear]
wheel = "hub"
axis = [0.1, 1.2, -0.1]
spin = "rotor.angle"
road = "plain"
radius_m = 1.1
stiffness_N_per_m = 90
damping_N_s_per_m = 3
model = "linear"
bilateral = true
slip_speed_m_per_s = 0.5
lateral_damping_N_s_per_m = 12
cornering_stiffness_N_per_rad = 40
camber_stiffness_N_per_rad = 8
camber_moment_N_m_per_rad = 6
aligning_moment_N_m_per_rad = 9
trail_m = 0.07

[tyre.lagging]
wheel = "middle"
road = "hill"
radius_m = 1.2
stiffness_N_per_m = 70
model = "linear"
contact = "source"
slip_speed_m_per_s = 0.4
relaxation_length_m = 0.6
initial_slip = 0.1
cornering_stiffness_N_per_rad = 50

[tyre.calspan]
wheel = "hub"
axis = [-0.1, 1.2, 0.1]
road = "hill"
road_factor = -0.8
spin = "rotor.angle"
radius_m = 1.1
stiffness_N_per_m = 9
model = "calspan"
slip_speed_m_per_s = 0.5
calspan = { A0 = 8, A1 = 0.9, A2 = 12, A3 = 1.9, A4 = 20, B1 = -0.05, B3 = 1.2, B4 = 0.01, SN = 1.0, AF1 = -0.2, AF2 = 0.15 }

[tyre.beyond]
wheel = "middle"
road = "plain"
radius_m = 1.2
stiffness_N_per_m = 7
damping_N_s_per_m = 0.2
model = "calspan"
contact = "vertical"
slip_speed_m_per_s = 0.5
relaxation_length_m = 0.5
calspan = { A0 = 8, A1 = 0.9, A2 = 2, A3 = 1.9, A4 = 20, B1 = -0.05, B3 = 1.2, B4 = 0.01, AF1 = -0.2, AF2 = 0.15 }

[tyre.formula]
wheel = "hub"
axis = [0.1, 1.2, -0.1]
spin = "rotor.angle"
road = "plain"
radius_m = 1.1
stiffness_N_per_m = 60
model = "magic_formula"
slip_speed_m_per_s = 0.6
magic_formula = { FNOMIN = 30, UNLOADED_RADIUS = 1.1, LONGVL = 4, NOMPRES = 2, INFLPRES = 2.2, LMUX = 0.9, LMUY = 0.95, PCX1 = 1.5, PDX1 = 1.1, PDX2 = -0.3, PDX3 = 0.8, PEX1 = 0.1, PEX2 = -0.5, PEX4 = 0.2, PKX1 = 4, PKX2 = 0.2, PKX3 = -0.5, PHX1 = 0.03, PVX1 = -0.02, PPX1 = -0.4, PPX3 = -0.3, RBX1 = 5, RBX2 = 3, RBX3 = 2, RCX1 = 0.9, REX1 = 0.6, REX2 = 0.5, RHX1 = 0.01, PCY1 = 1.4, PDY1 = 1, PDY2 = -0.1, PDY3 = 0.7, PEY1 = 0.6, PEY2 = 0.1, PEY3 = -0.1, PEY4 = -1.4, PEY5 = 0.5, PKY1 = -6, PKY2 = 1.6, PKY3 = 0.7, PKY4 = 2, PKY5 = 0.4, PKY6 = 0.3, PKY7 = 0.2, PHY1 = 0.02, PVY1 = -0.05, PVY3 = -0.6, PVY4 = -0.4, PPY1 = 0.2, PPY2 = 0.3, PPY3 = -0.2, PPY5 = -0.3, RBY1 = 4, RBY2 = 3, RBY3 = -0.06, RBY4 = 2, RCY1 = 1.2, REY1 = 0.7, REY2 = -0.3, RHY1 = 0.02, RVY1 = 0.1, RVY3 = 0.3, RVY4 = 2, RVY5 = 1.5, RVY6 = 3, QBZ1 = 3, QBZ2 = -0.3, QBZ4 = 0.1, QBZ5 = -0.2, QBZ9 = 2, QBZ10 = 0.5, QCZ1 = 1.2, QDZ1 = 0.2, QDZ2 = -0.1, QDZ3 = -0.4, QDZ4 = -0.5, QDZ6 = 0.02, QDZ8 = 0.4, QDZ10 = 0.3, QEZ1 = -0.3, QEZ4 = 0.3, QEZ5 = -0.8, QHZ1 = 0.02, QHZ3 = 0.1, PPZ1 = 0.2, PPZ2 = 0.1, SSZ1 = 0.03, SSZ2 = 0.1, SSZ3 = 0.2, QSX1 = 0.02, QSX2 = 0.4, QSX3 = 0.1, QSX4 = 0.2, QSX5 = 0.6, QSX6 = 0.9, QSX7 = 0.5, QSX8 = 0.4, QSX9 = 0.7, QSX10 = 0.3, QSX11 = 0.8, QSY1 = 0.05, QSY2 = 0.1, QSY3 = 0.02, QSY4 = 0.01, QSY5 = 0.2, QSY6 = 0.1, QSY7 = 0.9, QSY8 = -0.4 }

[tyre.older]
wheel = "middle"
road = "hill"
radius_m = 1.2
stiffness_N_per_m = 60
model = "magic_formula"
generation = "5.2"
mirror = true
slip_speed_m_per_s = 0.6
relaxation_length_m = 0.5
initial_slip = 0.1
longitudinal_relaxation_length_m = 0.4
initial_longitudinal_slip = 0.05
magic_formula = { FNOMIN = 30, UNLOADED_RADIUS = 1.1, BREFF = 1.5, DREFF = 0.4, FREFF = 0.2, PCX1 = 1.5, PDX1 = 1.1, PKX1 = 4, PCY1 = 1.4, PDY1 = 1, PEY1 = 0.4, PKY1 = -6, PKY2 = 1.6, PHY3 = 0.2, PVY3 = 0.3, RBY1 = 4, RBY2 = 3, RCY1 = 1.2, QBZ1 = 3, QCZ1 = 1.2, QDZ1 = 0.2, QDZ3 = 0.3 }

[tyre.relaxing]
wheel = "hub"
road = "hill"
radius_m = 1.2
stiffness_N_per_m = 60
damping_N_s_per_m = 2
model = "magic_formula"
generation = "5.2"
slip_speed_m_per_s = 0.6
relaxation = "coefficients"
initial_slip = 0.1
initial_longitudinal_slip = 0.05
magic_formula = { FNOMIN = 30, UNLOADED_RADIUS = 1.1, LFZO = 0.9, LSGKP = 1.1, LSGAL = 0.9, PCX1 = 1.5, PDX1 = 1.1, PKX1 = 4, PCY1 = 1.4, PDY1 = 1, PKY1 = -6, PKY2 = 1.6, PKY3 = 0.3, PTX1 = 2.3, PTX2 = 1.6, PTX3 = -0.4, PTY1 = 2.1, PTY2 = 1.9 }

[start]
given = ["frame", "rotor.x", "rotor.y", "rotor.angle"]
)",
    .add = add_tyre,
});

}  // namespace

}  // namespace costate
