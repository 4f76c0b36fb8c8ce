// What the keys of contacts mean; the rest of their reference is made from the calls that read them.
#include "costate/scene/key_meaning.h"

namespace costate {

namespace {

const KindKeys contact_keys(
    "contact",
    {{"kind", "compliant: a normal force by the penetration; rigid: impacts"},
     {"point", "name of the point, or of the centre of an arc or a sphere"},
     {"points", "in its place, several on one body: corners, or the points of a patch"},
     {"shares", "of the normal law, one a point; by default 1 each"},
     {"closed", "whether a rigid contact is closed at the start"},
     {"along_m",
      "of one that sticks then: the place along the ground, for an arc plus radius times angle; where it is left out, "
      "that of its body as given"},
     {"across_m", "in space likewise along y"},
     {"sliding", "of a rigid contact that is closed at the start: along x, against it, or not; in space whether"},
     {"closing_speed_m_per_s", "a rigid contact closes below this approach speed; given as 0 it bounces for good"},
     {"ahead_of", "name of a point: it closes only where it is ahead of that one along x"},
     {"law", "of the normal force"},
     {"stiffness_N_per_m_n", "K of F = K d^n, d the penetration"},
     {"youngs_modulus_Pa", "in its place: K is Hertz's, of a sphere on a plane"},
     {"poisson_ratio", "of the sphere"},
     {"ground_youngs_modulus_Pa", "of the ground; by default it is rigid"},
     {"ground_poisson_ratio", "of the ground"},
     {"exponent", "n; the linear law has 1"},
     {"damping_N_s_per_m", "of kelvin-voigt"},
     {"restitution",
      "speed after by speed before, of laws that have one; what comes out of compliant ones is (17.4), more than a "
      "small one"},
     {"restitution_law", "of a rigid contact: newton, of speeds, or poisson, of impulses"},
     {"approach_speed_m_per_s", "of a contact that is closed at the start"},
     {"friction", "its model"},
     {"friction_coefficient", "of sliding"},
     {"static_coefficient", "of sticking; by default that of sliding"},
     {"transition_velocity_m_per_s", "where friction is fully there"},
     {"dead_velocity_m_per_s", "ambrosio: below it there is none"},
     {"decay_s_per_m", "bengisu-akay: of the way from sticking to sliding"},
     {"bristle_stiffness_per_m", "dahl, lugre: the normal force times this is a stiffness"},
     {"bristle_damping_s_per_m", "lugre: the normal force times this is a damping"},
     {"ground_x_m", "where the ground has its height; a wall, at pi/2 or -pi/2, stands there"},
     {"ground_height_m", "of the ground there"},
     {"ground_angle_rad", "by which it rises along x"},
     {"road", "name of a [road]: the ground is as much higher than that plane, along its normal"},
     {"ground_body", "name of a body of the plane that carries the ground, in its frame"},
     {"radius_m", "of the arc or sphere about the point; 0: the point itself"},
     {"rolling_resistance_m", "arm of the normal force in the moment against rolling"},
     {"spinning_resistance_m", "the same about the normal, in space"},
     {"turning_transition_rad_per_s", "where these moments are fully there"},
     {"energy_lost", "whether the energy lost in it so far is integrated, as an output"}},
    R"(
[contact.viscous]
point = "C"
law = "kelvin-voigt"
stiffness_N_per_m_n = 2e4
damping_N_s_per_m = 10
friction = "lugre"
friction_coefficient = 0.4

[contact.ramp]
point = "C"
stiffness_N_per_m_n = 2e4
restitution = 0.5
friction = "ambrosio"
friction_coefficient = 0.4
radius_m = 0.1
rolling_resistance_m = 0.002
energy_lost = true

[point.heel]
on = "ball"
x_m = -0.1
y_m = -0.1

[point.toe]
on = "ball"
x_m = 0.1
y_m = -0.1

[point.ahead]
ground = true
x_m = -1
y_m = 0

[contact.sole]
points = ["heel", "toe"]
shares = [0.5, 0.5]
stiffness_N_per_m_n = 2e4
restitution = 0.5
ahead_of = "ahead"

[contact.rubber]
point = "C"
youngs_modulus_Pa = 1e7
poisson_ratio = 0.45
ground_youngs_modulus_Pa = 1e9
restitution = 0.5
radius_m = 0.1

[contact.hard]
kind = "rigid"
point = "C"
restitution = 0.5
restitution_law = "poisson"
closing_speed_m_per_s = 0.01

[contact.sticking]
kind = "rigid"
point = "C"
closed = true
friction = "coulomb"
friction_coefficient = 0.4
along_m = 0

[contact.sliding]
kind = "rigid"
point = "C"
closed = true
sliding = "forward"
friction = "coulomb"
friction_coefficient = 0.4

[contact.decaying]
point = "C"
stiffness_N_per_m_n = 2e4
restitution = 0.5
friction = "bengisu-akay"
friction_coefficient = 0.4

[road.wave]
kind = "profile"
law = { kind = "sine", amplitude = 0.02, angular_frequency_rad_per_s = 3, phase_rad = 0.4 }

[road.shaker]
kind = "post"
law = { kind = "sine", amplitude = 0.02, angular_frequency_rad_per_s = 3, phase_rad = 0.7 }

[body.deck]
x_m = 0.1
y_m = -0.05
angle_rad = 0.2
mass_kg = 3
inertia_kg_m2 = 0.4

[driver.deck_x]
coordinate = "deck.x"
law = { kind = "polynomial", coefficients = [0.1, 0.3] }

[driver.deck_y]
coordinate = "deck.y"
law = { kind = "polynomial", coefficients = [-0.05, 0.1] }

[driver.deck_angle]
coordinate = "deck.angle"
law = { kind = "polynomial", coefficients = [0.2, -0.5] }

[contact.wave]
point = "C"
road = "wave"
stiffness_N_per_m_n = 2e4
restitution = 0.5
radius_m = 0.1
rolling_resistance_m = 0.002
friction = "lugre"
friction_coefficient = 0.4
approach_speed_m_per_s = 0.31

[contact.shaker]
points = ["heel", "toe"]
road = "shaker"
ground_x_m = -0.01
ground_angle_rad = 0.1
law = "kelvin-voigt"
stiffness_N_per_m_n = 2e4
damping_N_s_per_m = 10
approach_speed_m_per_s = 0.31

[contact.deck]
point = "C"
ground_body = "deck"
ground_x_m = 0.02
ground_height_m = 0.05
law = "hertz"
stiffness_N_per_m_n = 2e4
radius_m = 0.1
rolling_resistance_m = 0.002
friction = "stribeck"
friction_coefficient = 0.4
static_coefficient = 0.5
energy_lost = true

[contact.ridge]
point = "heel"
ground_body = "deck"
road = "wave"
stiffness_N_per_m_n = 2e4
restitution = 0.5
friction = "coulomb"
friction_coefficient = 0.4
)");

}  // namespace

}  // namespace costate