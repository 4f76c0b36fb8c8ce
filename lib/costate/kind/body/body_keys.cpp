// What the keys of bodies, bars and points mean; the rest of their reference is made from the calls that read them.
#include "costate/scene/key_meaning.h"

namespace costate {

namespace {

const KindKeys bar_keys("bar", {{"from, to", "names of the points at its ends"},
                                {"mass_kg", "its mass; 0: a link without inertia"},
                                {"length_m", "by default the distance of its ends as they first stand"},
                                {"center_m", "from 'from' to the centre of mass, of a bar that is not uniform"},
                                {"inertia_kg_m2", "about the centre of mass, of a bar that is not uniform"}});

const KindKeys body_keys("body", {{"mass_kg", "its mass"},
                                  {"inertia_kg_m2", "about the centre of mass"},
                                  {"center_x_m, center_y_m", "centre of mass in the body's frame"},
                                  {"x_m, y_m, angle_rad", "where its frame starts, or a first guess"},
                                  {"vx_m_per_s, vy_m_per_s, angular_velocity_rad_per_s", "its velocity at the start"}});

const KindKeys mass_keys("mass", {{"point", "name of the point"}, {"mass_kg", "its mass"}});

const KindKeys natural_body_keys(
    "natural_body",
    {{"mass_kg", "its mass"},
     {"inertia_xx_kg_m2, inertia_yy_kg_m2, inertia_zz_kg_m2",
      "moments of inertia about the centre of mass, in the body's frame"},
     {"inertia_xy_kg_m2, inertia_xz_kg_m2, inertia_yz_kg_m2", "off-diagonal entries of the inertia matrix"},
     {"center_x_m, center_y_m, center_z_m", "centre of mass in the body's frame"},
     {"x_m, y_m, z_m", "where its frame starts, or a first guess"},
     {"vx_m_per_s, vy_m_per_s, vz_m_per_s", "its velocity at the start"},
     {"e0, e1, e2, e3", "Euler parameters of the orientation at the start, all four or none"},
     {"rotation_axis", "[x, y, z]: in the place of Euler parameters, an axis to turn about"},
     {"angle_rad", "by how much about 'rotation_axis'"},
     {"omega_x_rad_per_s, omega_y_rad_per_s, omega_z_rad_per_s", "angular velocity at the start, in the body's frame"},
     {"omega_global_x_rad_per_s, omega_global_y_rad_per_s, omega_global_z_rad_per_s", "the same in the global frame"}});

const KindKeys point_keys("point",
                          {{"ground", "stands on the ground"},
                           {"on", "name of the body or bar that it is fixed to"},
                           {"x_m, y_m, z_m",
                            "where it is: in the frame of what it is on, else globally (of a free point a "
                            "first guess); z makes it a point of space"},
                           {"vx_m_per_s, vy_m_per_s, vz_m_per_s", "velocity of a free point at the start"}},
                          "\n[point.flying]\nx_m = 0\ny_m = 0\nz_m = 1\n");

const KindKeys rigid_body_keys(
    "rigid_body",
    {{"mass_kg", "its mass"},
     {"inertia_xx_kg_m2, inertia_yy_kg_m2, inertia_zz_kg_m2",
      "moments of inertia about the centre of mass, in the body's frame"},
     {"inertia_xy_kg_m2, inertia_xz_kg_m2, inertia_yz_kg_m2", "off-diagonal entries of the inertia matrix"},
     {"center_x_m, center_y_m, center_z_m", "centre of mass in the body's frame"},
     {"x_m, y_m, z_m", "where its frame starts, or a first guess"},
     {"vx_m_per_s, vy_m_per_s, vz_m_per_s", "its velocity at the start"},
     {"e0, e1, e2, e3", "Euler parameters of the orientation at the start, all four or none"},
     {"rotation_axis", "[x, y, z]: in the place of Euler parameters, an axis to turn about"},
     {"angle_rad", "by how much about 'rotation_axis'"},
     {"omega_x_rad_per_s, omega_y_rad_per_s, omega_z_rad_per_s", "angular velocity at the start, in the body's frame"},
     {"omega_global_x_rad_per_s, omega_global_y_rad_per_s, omega_global_z_rad_per_s", "the same in the global frame"}});

const KindKeys rotor_keys(
    "rotor", {{"on", "name of the rigid body that carries it"},
              {"axis", "[x, y, z]: its axis in the body's frame"},
              {"inertia_kg_m2", "about its axis"},
              {"angle_rad", "its angle at the start"},
              {"spin_rad_per_s",
               "its rate against the body at the start; the output NAME.spin counts the body's turning with it"}});

}  // namespace

}  // namespace costate
