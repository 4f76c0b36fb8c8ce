#include "costate/kind/force/actuator.h"

#include "costate/base/error.h"
#include "costate/element/course.h"
#include "costate/element/force/angular_force.h"
#include "costate/element/force/with_work.h"
#include "costate/kind/force/axial_line.h"
#include "costate/kind/force/formula_force.h"
#include "costate/kind/law/law_table.h"
#include "costate/kind/law/table_options.h"
#include "costate/scene/scene_kind.h"

namespace costate {

std::vector<int> add_lag_numbers(MechanismBuilder& builder, const std::string& path, double time_constant_s,
                                 const char* initial_key, double initial) {
  return {builder.add_number(path + ".time_constant_s", time_constant_s, NumberRule::positive),
          builder.add_number(path + "." + initial_key, initial)};
}

namespace {
template <class Law>
struct Lag {
  Law law;
  std::vector<int> numbers;
};
template <class Law>
Lag<Law> add_lag(MechanismBuilder& builder, const std::string& path, double time_constant_s, const char* initial_key,
                 double initial, const char* command_key, const LawOptions& command) {
  if (!command) throw ModelError(path, std::string("An actuator needs a command: '") + command_key + "'.");
  Lag<Law> r;
  r.numbers = add_lag_numbers(builder, path, time_constant_s, initial_key, initial);
  const RegisteredLaw law = add_law(builder, path + "." + command_key, command);
  r.law.command = law.law;
  r.numbers.insert(r.numbers.end(), law.numbers.begin(), law.numbers.end());
  return r;
}
}  // namespace

void add_actuator(MechanismBuilder& builder, const std::string& name, const std::string& from, const std::string& to,
                  const ActuatorOptions& o) {
  const std::string path = "actuator." + name;
  const auto lag = add_lag<LagActuatorLaw>(builder, path, o.time_constant_s, "initial_force_N", o.initial_force_N,
                                           "command_N", o.command_N);
  add_axial_force(builder, "actuator", name, lag.law, lag.numbers, from, to, o.work);
}

void add_rotary_actuator(MechanismBuilder& builder, const std::string& name, const std::vector<std::string>& angles,
                         const RotaryActuatorOptions& o) {
  const std::string path = "actuator." + name;
  const std::vector<int> coordinates = find_angles(builder, path, angles);
  const auto lag = add_lag<LagTorqueLaw>(builder, path, o.time_constant_s, "initial_torque_N_m", o.initial_torque_N_m,
                                         "command_N_m", o.command_N_m);
  builder.add(make_force<AngularForce<LagTorqueLaw>>(o.work, "actuator", name, lag.law, lag.numbers, coordinates));
}

namespace {

template <class Actuator>
bool add_command(const Element& element, const double* p, Course& course) {
  const auto* actuator = dynamic_cast<const Actuator*>(&element);
  if (actuator) course.add(*actuator->law().command, p + 2);
  return actuator != nullptr;
}
const RegisterElementCourse course([](const Element& e, const double* p, Course& c) {
  return add_command<AxialForce<LagActuatorLaw>>(e, p, c) ||
         add_command<AxialForce<LagActuatorLaw, SpatialVector>>(e, p, c) ||
         add_command<AngularForce<LagTorqueLaw>>(e, p, c);
});

void add_actuator(const std::string& name, SceneTable& table, MechanismBuilder& builder) {
  const double time_constant = table.value("time_constant_s");
  const bool work = table.flag("work", false);
  if (table.has("angle") || table.has("angles")) {
    RotaryActuatorOptions o{time_constant, table.value("initial_torque_N_m", NumberRule::any, 0), {}, work};
    const auto angles = read_angles(table);
    if (table.has("formula")) {
      const std::string formula = table.text("formula");
      return add_formula_rotary_actuator(
          builder, name, angles, o, formula,
          read_formula_keys(table, {"angle", "angles", "time_constant_s", "initial_torque_N_m", "formula", "work"}));
    }
    o.command_N_m = read_law(table, "command_N_m");
    return add_rotary_actuator(builder, name, angles, o);
  }
  const std::string from = table.text("from"), to = table.text("to");
  ActuatorOptions o{time_constant, table.value("initial_force_N", NumberRule::any, 0), {}, work};
  if (table.has("formula")) {
    const std::string formula = table.text("formula");
    return add_formula_actuator(
        builder, name, from, to, o, formula,
        read_formula_keys(table, {"from", "to", "time_constant_s", "initial_force_N", "formula", "work"}));
  }
  o.command_N = read_law(table, "command_N");
  add_actuator(builder, name, from, to, o);
}

const RegisterSceneKind actuator_registered({
    .name = "actuator",
    .phase = ScenePhase::elements,
    .summary = "a force or torque that follows a command, a law of time or a formula, with a first-order lag",
    .example = R"(
[gravity]
y_m_per_s2 = -9.81

[point.A]
ground = true
x_m = 0
y_m = 0

[point.P]
x_m = 0.6
y_m = -0.8

[point.anchor]
ground = true
x_m = 1.4
y_m = 0.3

[bar.arm]
from = "A"
to = "P"
mass_kg = 2

[angle.crank]
bar = "arm"

[body.disc]
x_m = 1.5
y_m = 0.2
angle_rad = 0.3
mass_kg = 1
inertia_kg_m2 = 0.1

[actuator.ram]
work = true
from = "anchor"
to = "P"
time_constant_s = 0.1
initial_force_N = 5
command_N = { kind = "sine", mean = 10, amplitude = 4, angular_frequency_rad_per_s = 6, phase_rad = 0.2 }

[actuator.motor]
angle = "crank"
time_constant_s = 0.05
initial_torque_N_m = 0.3
command_N_m = { kind = "smooth_step", from = 0.1, to = 0.9, before = 0, after = 3 }

[actuator.clutch]
work = true
angles = ["crank", "disc"]
time_constant_s = 0.2
command_N_m = 0.5

[actuator.servo]
angle = "crank"
time_constant_s = 0.2
formula = "stiff*(0.4*sin(2*t) - crank.angle) - damp*crank.angle_dot"
stiff = 30
damp = 2
work = true

[actuator.winch]
from = "anchor"
to = "P"
time_constant_s = 0.1
initial_force_N = 1
formula = "(P.y - disc.y)*gain"
gain = 4

[start]
given = ["crank.angle", "disc.x", "disc.y", "disc.angle"]
)",
    .add = add_actuator,
});

}  // namespace

}  // namespace costate
