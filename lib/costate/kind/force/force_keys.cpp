// What the keys of forces mean; the rest of their reference is made from the calls that read them.
#include "costate/scene/key_meaning.h"

namespace costate {

namespace {

const KindKeys actuator_keys(
    "actuator",
    {{"from, to", "names of the two points"},
     {"angle", "an angle against the ground"},
     {"angles", "two angles: the second against the first"},
     {"time_constant_s", "of the lag"},
     {"initial_force_N", "the force at the start"},
     {"initial_torque_N_m", "the torque at the start"},
     {"command_N", "what the force follows, a law of time; positive pulls the points together"},
     {"command_N_m", "what the torque follows, a law of time; positive turns the angle forward, as a [couple] does"},
     {"formula",
      "in the place of the command, a formula of t, coordinates, points and rates (crank.angle_dot), and the table's "
      "other "
      "keys [N or N m]"},
     {"damp, gain, stiff", "numbers of the formulas of the example; any names will do"},
     {"work", "whether the work that it does is integrated, as an output"}});

const KindKeys axis_spring_keys(
    "axis_spring",
    {{"from, to", "names of the two points"},
     {"axis", "[x, y, z]: the axis in the frame of from's body"},
     {"stiffness_N_per_m", "force by displacement along the axis"},
     {"natural_length_m", "length without force; required with a stiffness or a 'spring_law'"},
     {"damping_N_s_per_m", "force by the rate of displacement along the axis"},
     {"preload_N", "constant pull"},
     {"spring_law", "a law of the displacement along the axis less natural_length_m, added to the stiffness"},
     {"damper_law", "a law of the rate of displacement along the axis, added to the damping"}});

const KindKeys bushing_keys(
    "bushing",
    {{"from, to", "names of the two points"},
     {"stiffness_N_per_m", "[x, y, z] along the axes of its frame; by default zeros, as all of these"},
     {"stiffness_N_m_per_rad", "[x, y, z] about them"},
     {"damping_N_s_per_m", "[x, y, z] along them"},
     {"damping_N_m_s_per_rad", "[x, y, z] about them"},
     {"preload_N", "[x, y, z]: constant force, as of what is stretched: it pulls to back"},
     {"preload_N_m", "[x, y, z]: constant torque, likewise"},
     {"rotation_axis_from, rotation_axis_to", "[x, y, z]: the axis that turns its frame in from's, or to's, body"},
     {"angle_from_rad, angle_to_rad", "by how much about that axis"}});

const KindKeys drag_keys("drag",
                         {{"point", "name of the point"},
                          {"drag_coefficient", "of the shape"},
                          {"area_m2", "that the coefficient belongs to"},
                          {"air_density_kg_per_m3", "of the air"},
                          {"smoothing_m_per_s", "speed w0 below which the square is rounded: sqrt(w^2 + w0^2)"},
                          {"wind_x_m_per_s, wind_y_m_per_s, wind_z_m_per_s", "velocity of the air, laws of time"}});

const KindKeys force_keys("force", {{"point", "name of the point"},
                                    {"x_N, y_N, z_N", "components, laws of time"},
                                    {"formula_x_N, formula_y_N, formula_z_N",
                                     "in their place, formulas of t, coordinates, points and rates (P.x_dot), and the "
                                     "table's other keys"},
                                    {"c, g, k, w", "numbers of the formulas of the example; any names will do"},
                                    {"frame", "body: the components turn with the point's body"},
                                    {"work", "whether the work that it does is integrated, as an output"}});

const KindKeys couple_keys("couple", {{"angle", "an angle against the ground"},
                                      {"angles", "two angles: the second against the first"},
                                      {"torque_N_m", "a law of time"},
                                      {"formula",
                                       "in its place, a formula of t, coordinates, points and rates (crank.angle_dot), "
                                       "and the table's other keys [N m]"},
                                      {"a, d, k, p, w", "numbers of the formulas of the example; any names will do"},
                                      {"valve", "a law is a function of the formula of the example; any name will do"},
                                      {"body", "name of a rigid body in space"},
                                      {"bodies", "two of them: on the second, and back on the first"},
                                      {"x_N_m, y_N_m, z_N_m", "components, laws of time"},
                                      {"frame", "body: the components turn with the body, of two with the first"},
                                      {"work", "whether the work that it does is integrated, as an output"}});

const KindKeys friction_keys("friction",
                             {{"coordinate", "name of a coordinate"},
                              {"coordinates", "two of them: the second against the first"},
                              {"angle", "an angle against the ground"},
                              {"angles", "two angles: the second against the first"},
                              {"radius_m", "at which friction on an angle acts"},
                              {"from, to", "names of two points, whose distance changes"},
                              {"axis", "[x, y, z]: friction along it, in the frame of from's body"},
                              {"axis_angle_rad", "the same in the plane"},
                              {"normal_force_N", "a number, or the path of one: \"spring.clamp.preload_N\""},
                              {"static_coefficient", "largest friction by normal force"},
                              {"dynamic_coefficient", "at speed; by default the static one"},
                              {"transition_velocity_m_per_s", "where friction is largest; below, it creeps"},
                              {"viscous_N_s_per_m", "added by speed"}});

const KindKeys maxwell_keys("maxwell", {{"from, to", "names of the two points"},
                                        {"stiffness_N_per_m", "of the spring"},
                                        {"natural_length_m", "of the whole without force"},
                                        {"damping_N_s_per_m", "of the damper in series"},
                                        {"initial_stroke_m", "of the damper at the start"}});

const KindKeys spring_keys("spring",
                           {{"from, to", "names of the two points"},
                            {"stiffness_N_per_m", "force by stretch"},
                            {"natural_length_m", "length without force; required with a stiffness or a 'spring_law'"},
                            {"damping_N_s_per_m", "force by the rate of stretch"},
                            {"preload_N", "constant pull"},
                            {"spring_law", "a law of the stretch, added to the stiffness"},
                            {"damper_law", "a law of the rate of stretch, added to the damping"}});

const KindKeys torsion_spring_keys("torsion_spring",
                                   {{"angle", "an angle against the ground"},
                                    {"angles", "two angles: the second against the first"},
                                    {"stiffness_N_m_per_rad", "torque by angle"},
                                    {"natural_angle_rad", "angle without torque"},
                                    {"damping_N_m_s_per_rad", "torque by rate"},
                                    {"preload_N_m", "constant torque"},
                                    {"spring_law", "a law of the angle less natural_angle_rad, added to the stiffness"},
                                    {"damper_law", "a law of the rate, added to the damping"}});

}  // namespace

}  // namespace costate
