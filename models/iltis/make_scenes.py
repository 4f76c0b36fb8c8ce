#!/usr/bin/env python3
"""Writes the vehicle scene iltis.toml from the data sheet iltis.json: python3 make_scenes.py

All geometry is worked out here from the sheet's numbers, left (y < 0, the source's FL and RL) as given and right
mirrored. The scenes of the runs include iltis.toml and are written by hand.
"""

import json
import math
import pathlib

here = pathlib.Path(__file__).resolve().parent
d = json.loads((here / "iltis.json").read_text())
kin, pts, nominal = d["kinematics"], d["points_left_chassis_frame"], d["points_nominal_abs_z"]
height = 0.57  # of the chassis's centre of mass in the nominal position

upper = nominal["upper_ball_yz"]
lower = nominal["lower_ball_yz"]
wheel = nominal["wheel_centre_yz"]
arm_inner = nominal["a_arm_inner_yz"]


def n(x):
    """A number, to the 12 digits that matter."""
    text = repr(float(f"{x:.12g}"))
    return "0.0" if text == "-0.0" else text


def v(values):
    return "[" + ", ".join(n(x) for x in values) + "]"


def point(name, on, x, y, z):
    return f'[point.{name}]\non = "{on}"\nx_m = {n(x)}\ny_m = {n(y)}\nz_m = {n(z)}\n'


# The tie rod's outer end, from the frame that turns about the carrier's axis: its origin lies on that axis.
incline = kin["kingpin_inclination_rad"]
along = (-math.sin(incline), -math.cos(incline))  # from the upper to the lower ball, (y, z) on the left
s = kin["carrier_upper_to_steer_body"]
origin = (upper[0] + s * along[0], upper[1] + s * along[1])


def tie_rod_end(local):
    _, y, z = local
    return (origin[0] + y * math.cos(incline) + z * math.sin(incline),
            origin[1] - y * math.sin(incline) + z * math.cos(incline))


arm_length = d["a_arm"]["length"]
arm_angle = math.atan2(arm_inner[1] - lower[1], arm_inner[0] - lower[0])  # of the arm's y axis on the left
com = d["a_arm"]["com_from_lower_ball_towards_chassis"]
com_yz = (lower[0] + com * math.cos(arm_angle), lower[1] + com * math.sin(arm_angle))

spring, leaf, tyre = d["damper_spring"], d["leaf_spring"], d["tyre"]
strut_polynomial = [-4.0092e6, 2.8397e7, -6.7061e7, 5.2796e7]
damper_pieces = [[-416.42, 1844.3], [0.0, 9945.627, 33955.72, -59832.25, -395651.0], [1919.1638, 1634.727]]
strut_nominal = 0.44055648
leaf_nominal = pts["leaf_force_stop_z"] - (upper[1] - height) - 0.1  # L at the nominal position
leaf_offset = 0.1                                                     # x = L + 0.1 is the ball's distance from the stop
leaf_force = leaf["k"] * (leaf_nominal - leaf["L0"])
stop = leaf["bump_stop"]


def corner(name, front, side):
    """side: -1 left, +1 right. The left corner's y are mirrored on the right."""
    axle = d["front_axle_x"] if front else d["rear_axle_x"]
    m = -side  # multiplies the y of the left corner: 1 on the left
    end = "front" if front else "rear"
    tie = tie_rod_end(kin[f"tie_rod_point_in_steer_body_{end}_left"])
    tie_x = kin[f"tie_rod_point_in_steer_body_{end}_left"][0]
    rack = pts[f"rack_centre_{end}"]
    strut = pts[f"damper_chassis_{end}"]
    damper = kin["damper_point_in_a_arm_frame_front_left"] if front else kin["damper_point_rear_left"]
    k = spring["linearised"][f"k_{end}"]
    out = []
    where = ("front" if front else "rear") + (" left" if side < 0 else " right")
    out.append(f"# ---- {name}: {where} corner (y {'<' if side < 0 else '>'} 0)\n")
    Ja, Jw = d["a_arm"]["I_diag"], d["wheel_incl_knuckle"]["I_diag"]
    out.append(f"""[rigid_body.arm_{name}]
x_m = {n(axle)}
y_m = {n(m * com_yz[0])}
z_m = {n(com_yz[1])}
rotation_axis = [1.0, 0.0, 0.0]
angle_rad = {n(m * arm_angle)}
mass_kg = {n(d["a_arm"]["mass"])}
inertia_xx_kg_m2 = {n(Ja[0])}
inertia_yy_kg_m2 = {n(Ja[1])}
inertia_zz_kg_m2 = {n(Ja[2])}
""")
    out.append(f"""# The upright, massless itself, carries mass and transverse inertia of the wheel (with its knuckle).
[rigid_body.upright_{name}]
x_m = {n(axle)}
y_m = {n(m * wheel[0])}
z_m = {n(wheel[1])}
mass_kg = {n(d["wheel_incl_knuckle"]["mass"])}
inertia_xx_kg_m2 = {n(Jw[0])}
inertia_yy_kg_m2 = 0.0
inertia_zz_kg_m2 = {n(Jw[2])}

[rotor.wheel_{name}]
on = "upright_{name}"
axis = [0.0, 1.0, 0.0]
inertia_kg_m2 = {n(Jw[1])}
""")
    inner = pts["leaf_upper_link_inner"]
    pivot = pts["a_arm_inner"]
    out.append(point(f"leaf_pivot_{name}", "chassis", axle, m * inner[1], inner[2]))
    out.append(point(f"leaf_stop_{name}", "chassis", axle, m * upper[0], pts["leaf_force_stop_z"]))
    out.append(point(f"arm_pivot_{name}", "chassis", axle, m * pivot[1], pivot[2]))
    out.append(point(f"strut_top_{name}", "chassis", strut[0], m * strut[1], strut[2]))
    out.append(point(f"rack_{name}", "chassis", rack[0], -m * pts["rack_half_length"], rack[2]))
    out.append(point(f"arm_inner_{name}", f"arm_{name}", 0, m * (arm_length - com), 0))
    out.append(point(f"arm_ball_{name}", f"arm_{name}", 0, -m * com, 0))
    out.append(point(f"strut_foot_{name}", f"arm_{name}", damper[0], m * (damper[1] - com), damper[2]))

    def on_upright(label, x, yz):
        out.append(point(f"{label}_{name}", f"upright_{name}", x, m * (yz[0] - wheel[0]), yz[1] - wheel[1]))

    on_upright("lower_ball", 0, lower)
    on_upright("upper_ball", 0, upper)
    on_upright("tie", tie_x, tie)
    out.append(f'[point.center_{name}]\non = "upright_{name}"\nx_m = 0.0\ny_m = 0.0\nz_m = 0.0\n')
    out.append(f"""[hinge.arm_{name}]
points = ["arm_pivot_{name}", "arm_inner_{name}"]
axis_first = [1.0, 0.0, 0.0]
""")
    out.append(f"""[spherical.lower_ball_{name}]
points = ["arm_ball_{name}", "lower_ball_{name}"]
""")
    out.append(f"""# The leaf spring as a massless upper link that turns about the x axis.
[distance.leaf_link_{name}]
from = "leaf_pivot_{name}"
to = "upper_ball_{name}"
length_m = {n(kin["upper_link_length"])}

[in_plane.leaf_link_{name}]
points = ["leaf_pivot_{name}", "upper_ball_{name}"]
normal = [1.0, 0.0, 0.0]
""")
    slide = 'slide = "rack"\ndirection = [0.0, 1.0, 0.0]\n' if front else ""
    out.append(f"""[{'tie_rod' if front else 'distance'}.tie_rod_{name}]
from = "rack_{name}"
to = "tie_{name}"
{slide}length_m = {n(kin["tie_rod_length"])}
""")
    extra = stop["k_stop"] - leaf["k"]
    gap = leaf_nominal - stop["L_stop"]
    out.append(f"""# F = F_nominal + kL (L - L_nominal), and the stop's additional stiffness below L = {stop["L_stop"]} m.
[axis_spring.leaf_{name}]
from = "leaf_stop_{name}"
to = "upper_ball_{name}"
axis = [0.0, 0.0, -1.0]
stiffness_N_per_m = {n(leaf["k"])}
natural_length_m = {n(leaf_nominal + leaf_offset)}
preload_N = {n(leaf_force)}
spring_law = {{ kind = "piecewise", breaks = [{n(-gap)}], coefficients = [[{n(extra * gap)}, {n(extra)}], [0.0, 0.0]] }}
""")
    out.append(f"""[spring.strut_{name}]
from = "strut_top_{name}"
to = "strut_foot_{name}"
natural_length_m = 0.0
spring_law = {{ kind = "scaled", slope = {n(k)}, nominal_slope = {n(k)}, reference = {n(strut_nominal)}, law = {{ kind = "polynomial", coefficients = {v(strut_polynomial)} }} }}
damper_law = {{ kind = "scaled", slope = {n(spring["linearised"]["c"])}, nominal_slope = {n(spring["linearised"]["c"])}, reference = 0.0, law = {{ kind = "piecewise", breaks = [-0.2, 0.21], coefficients = [{", ".join(v(c) for c in damper_pieces)}] }} }}
""")
    R = tyre[f"unloaded_radius_{end}"]
    keys = ["A0", "A1", "A2", "A3", "A4", "B1", "B3", "B4", "SN", "AF1", "AF2"]
    calspan = ", ".join(f"{key} = {n(tyre[key])}" for key in keys) + f", A_omega = {n(tyre['Aomega'])}"
    out.append(f"""[tyre.{name}]
model = "calspan"
wheel = "center_{name}"
axis = [0.0, 1.0, 0.0]
road = "ground"
contact = "source"
radius_m = {n(R)}
stiffness_N_per_m = {n(tyre["vertical_stiffness"])}
slip_speed_m_per_s = 0.0
calspan = {{ {calspan} }}
""")
    return "\n".join(out)


J = d["chassis"]["I_diag"]
corners = {"FL": (True, -1), "FR": (True, 1), "RL": (False, -1), "RR": (False, 1)}

head = f"""# Written by make_scenes.py from iltis.json: change those.
title = "Bombardier Iltis"
description = "The complete vehicle at rest in its nominal position: a chassis, four double-wishbone corners with leaf springs and struts, a steered front axle, Calspan tyres."

[gravity]
z_m_per_s2 = {n(-d["gravity"])}

[road.ground]
kind = "flat"
height_m = 0.0

[rigid_body.chassis]
x_m = 0.0
y_m = 0.0
z_m = {n(height)}
mass_kg = {n(d["chassis"]["mass"])}
inertia_xx_kg_m2 = {n(J[0])}
inertia_yy_kg_m2 = {n(J[1])}
inertia_zz_kg_m2 = {n(J[2])}

# The steering rack's displacement; +y turns the wheels to the right.
[coordinate.rack]
unit = "m"

[driver.steering]
coordinate = "rack"
law = 0.0

"""

tail = """# ---- the start: the static equilibrium; held are x, y and yaw of the chassis and the turn of the wheels

[start]
equilibrium = true
given = ["chassis.x", "chassis.y", "chassis.e3", "wheel_FL.spin_angle", "wheel_FR.spin_angle", "wheel_RL.spin_angle", "wheel_RR.spin_angle"]
given_velocities = ["chassis.x", "chassis.y", "chassis.z", "chassis.omega_x", "chassis.omega_y", "chassis.omega_z", "upright_FL.z", "upright_FR.z", "upright_RL.z", "upright_RR.z", "wheel_FL.spin_angle", "wheel_FR.spin_angle", "wheel_RL.spin_angle", "wheel_RR.spin_angle"]

# The ride: the chassis's vertical acceleration squared.
[[cost.running]]
kind = "square"
output = "chassis.z_ddot"
target = 0.0
"""


def parameters():
    out = []
    for i, axle, k in (("1", "F", spring["linearised"]["k_front"]), ("2", "R", spring["linearised"]["k_rear"])):
        sides = [axle + "L", axle + "R"]
        for name, what, value, low, high in (
                (f"kL{i}", "axis_spring.leaf_{}.stiffness_N_per_m", leaf["k"], 0.4, 2.5),
                (f"k{i}", "spring.strut_{}.spring_law.slope", k, 0.4, 2.5),
                (f"c{i}", "spring.strut_{}.damper_law.slope", spring["linearised"]["c"], 0.3, 4.0)):
            numbers = ", ".join('"' + what.format(s) + '"' for s in sides)
            out.append(f"[parameter.{name}]\nnumbers = [{numbers}]\nlower = {n(low * value)}\nupper = {n(high * value)}\n")
    return "\n".join(out)


run = """
[run]
t_end_s = 1.0
formulation = "index1"
method = "idas-adjoint"
parameters = ["kL1", "kL2", "c1", "c2", "k1", "k2"]
rtol = 1e-8
outputs = ["chassis.z", "upright_FL.z", "FL.normal_force", "strut_FL.length"]

[optimize]
max_evaluations = 200
relative_tolerance = 0.0
gradient_tolerance = 1e-6
"""

text = head + "\n".join(corner(name, *where) for name, where in corners.items()) + "\n" + tail + "\n" + parameters() + run
(here / "iltis.toml").write_text(text)
