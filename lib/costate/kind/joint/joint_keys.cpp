// What the keys of joints, drivers and coordinates mean; the rest of their reference is made from the calls that read
// them.
#include "costate/scene/key_meaning.h"

namespace costate {

namespace {

const KindKeys angle_keys("angle", {{"bar", "name of a bar"},
                                    {"from, to", "in its place, two points"},
                                    {"angle_rad", "its first value; by default as the points first stand"},
                                    {"angular_velocity_rad_per_s", "its rate at the start"}});

const KindKeys coordinate_keys("coordinate", {{"unit", "m, rad or 1"},
                                              {"value", "its first value"},
                                              {"rate", "its rate at the start"}});

const KindKeys gear_keys("gear", {{"angles", "names of the two angles"},
                                  {"ratio", "turns of the second for one of the first"},
                                  {"offset_rad", "by default as the angles first stand"}});

const KindKeys rack_and_pinion_keys("rack_and_pinion", {{"angle", "name of the angle"},
                                                        {"coordinate", "name of the way"},
                                                        {"radius_m", "way by angle"},
                                                        {"offset_m", "by default as they first stand"}});

const KindKeys screw_keys("screw", {{"angle", "name of the angle"},
                                    {"coordinate", "name of the way"},
                                    {"lead_m_per_turn", "way by turn"},
                                    {"offset_m", "by default as they first stand"}});

const KindKeys distance_keys("distance", {{"from, to", "names of the two points"},
                                          {"length_m", "by default as the points first stand"}});

const KindKeys driver_keys("driver", {{"coordinate", "name of a coordinate"},
                                      {"coordinates", "in its place several"},
                                      {"weights", "their factors in the sum that follows the law"},
                                      {"law", "of time"}});

const KindKeys distance_driver_keys("distance_driver",
                                    {{"from, to", "names of the two points"}, {"length_m", "a law of time"}});

const KindKeys fixed_keys("fixed", {{"points", "one point of each of two bodies, or of a body and the ground"},
                                    {"axis_first", "[x, y, z]: the axis in the frame of the first point's body"},
                                    {"axis_second", "the same in the second body's frame; by default the same numbers"},
                                    {"normal_first, normal_second",
                                     "directions across the axes that are parallel where the angle is zero"}});

const KindKeys hinge_keys("hinge",
                          {{"points", "one point of each of two bodies, or of a body and the ground"},
                           {"axis_first", "[x, y, z]: the axis in the frame of the first point's body"},
                           {"axis_second", "the same in the second body's frame; by default the same numbers"},
                           {"angle", "name of a coordinate NAME.angle, where there is to be one"},
                           {"angle_rad", "its first value; by default that of the first poses, within half a turn"},
                           {"angular_velocity_rad_per_s", "its rate at the start"},
                           {"normal_first, normal_second",
                            "directions across the axes that are parallel where the angle is zero"}});

const KindKeys universal_keys("universal",
                              {{"points", "one point of each of two bodies, or of a body and the ground"},
                               {"axis_first", "[x, y, z]: the axis in the frame of the first point's body"},
                               {"axis_second", "the same in the second body's frame; by default the same numbers"}});

const KindKeys in_plane_keys("in_plane",
                             {{"points", "a point of the body with the plane, and the one that stays in it"},
                              {"normal", "[x, y, z]: of the plane, in the frame of the first point's body"}});

const KindKeys path_driver_keys(
    "path_driver", {{"point", "of the vehicle, which is to follow the path"},
                    {"coordinate", "the steering that it turns"},
                    {"path", "y of the path, a law of x"},
                    {"gain",
                     "steering by sideways error (path less vehicle, ahead): a positive one steers towards the path of "
                     "a vehicle that drives towards larger x, by a negative command to the left"},
                    {"yaw_gain_m_s_per_rad", "steering against the yaw rate"},
                    {"preview_m", "how far ahead the driver looks"},
                    {"decision_lag_s, arm_lag_s", "time constants"},
                    {"stiffness_N_per_m, damping_N_s_per_m", "of the arms on the steering"},
                    {"initial_command_m, initial_steering_m", "of the two lags at the start"}});

const KindKeys prismatic_keys("prismatic",
                              {{"points", "one point of each of two bodies, or of a body and the ground"},
                               {"axis_angle_rad", "of the axis in the frame of the first point's body"},
                               {"relative_angle_rad", "between the bodies; by default as they first stand"}});

const KindKeys revolute_keys("revolute", {{"points", "names of the two points"}});

const KindKeys cylindrical_keys(
    "cylindrical",
    {{"points", "one point of each of two bodies, or of a body and the ground"},
     {"axis_first", "[x, y, z]: the axis in the frame of the first point's body"},
     {"axis_second", "the same in the second body's frame; by default the same numbers"},
     {"angle", "name of a coordinate NAME.angle, where there is to be one"},
     {"angle_rad", "its first value; by default that of the first poses, within half a turn"},
     {"angular_velocity_rad_per_s", "its rate at the start"},
     {"displacement", "name of a coordinate NAME.displacement, where there is to be one"},
     {"displacement_m", "its first value; by default that of the first poses"},
     {"velocity_m_per_s", "its rate at the start"},
     {"normal_first, normal_second", "directions across the axes that are parallel where the angle is zero"}});

const KindKeys translational_keys("translational",
                                  {{"points", "one point of each of two bodies, or of a body and the ground"},
                                   {"axis_first", "[x, y, z]: the axis in the frame of the first point's body"},
                                   {"axis_second", "the same in the second body's frame; by default the same numbers"},
                                   {"displacement", "name of a coordinate NAME.displacement, where there is to be one"},
                                   {"displacement_m", "its first value; by default that of the first poses"},
                                   {"velocity_m_per_s", "its rate at the start"},
                                   {"normal_first, normal_second",
                                    "directions across the axes that are parallel where the angle is zero"}});

const KindKeys planar_keys("planar",
                           {{"points", "one point of each of two bodies, or of a body and the ground"},
                            {"normal_first",
                             "[x, y, z]: the normal of the plane in the frame of the first point's body"},
                            {"normal_second", "the same in the second body's frame; by default the same numbers"}});

const KindKeys spherical_keys("spherical", {{"points", "names of the two points"}});

const KindKeys tie_rod_keys("tie_rod",
                            {{"from", "a point of the body in which the end slides: that end where the slide is zero"},
                             {"to", "a point of the body that the rod's other end is fixed to"},
                             {"slide", "coordinate by which it slides"},
                             {"direction", "[x, y, z]: along which, in the frame of that body"},
                             {"length_m", "by default the distance of the two points, where the slide is zero"}});

const KindKeys parallel_keys("parallel", {{"first, second", "two points each: the lines"}});

const KindKeys perpendicular_keys("perpendicular", {{"first, second", "two points each: the lines"}});

const KindKeys slot_keys("slot", {{"point", "name of the point"}, {"line", "two points: the line"}});

}  // namespace

}  // namespace costate
