// What the keys of tyres mean; the rest of their reference is made from the calls that read them.
#include "costate/scene/key_meaning.h"

namespace costate {

namespace {

const KindKeys tyre_keys(
    "tyre", {{"model", "how its forces follow from load and slip"},
             {"wheel", "a point of the body that is the wheel, its centre"},
             {"road", "name of the road"},
             {"axis", "[x, y, z]: of the wheel, in its body's frame; by default [0, 1, 0]"},
             {"spin", "name of the wheel's rotor, where one carries the spin"},
             {"radius_m", "without load"},
             {"stiffness_N_per_m", "force by deflection"},
             {"damping_N_s_per_m", "force by its rate"},
             {"damping_ramp_m",
              "deflection over which damping sets in; below 3e-5 of the radius it does at once, and its force jumps"},
             {"road_factor", "of the road's height"},
             {"road_offset_m", "by how much a profile lies further along x: f(x - offset)"},
             {"road_delay_s", "of a post: this much later"},
             {"contact", "where the road is felt"},
             {"bilateral", "the tyre may pull"},
             {"slip_speed_m_per_s", "speed below which slip is rounded"},
             {"relaxation_length_m", "of the lag of lateral slip; by default none"},
             {"initial_slip", "lateral slip at the start"},
             {"calspan", "the table of the model's coefficients"},
             {"magic_formula", "a table of coefficients by their names in tyre files; it stands over the file"},
             {"tir_file", "path of a tyre file, from the scene"},
             {"generation", "of the formulas, where there is no file"},
             {"free_rolling", "no longitudinal slip, hence neither a longitudinal force nor rolling resistance"},
             {"mirror", "left and right exchanged"},
             {"relaxation", "coefficients: relaxation lengths from the formulas"},
             {"initial_longitudinal_slip", "longitudinal slip at the start"},
             {"longitudinal_relaxation_length_m", "of the lag of longitudinal slip"},
             {"lateral_damping_N_s_per_m", "linear: side force by the sideways speed that slip is of"},
             {"cornering_stiffness_N_per_rad", "linear: side force by slip angle"},
             {"camber_stiffness_N_per_rad", "linear: side force by camber"},
             {"camber_moment_N_m_per_rad", "linear: moment about the forward direction by camber"},
             {"aligning_moment_N_m_per_rad", "linear: moment about the ground's normal by slip angle"},
             {"trail_m", "linear: by how much the side force acts behind the contact"}});

}  // namespace

}  // namespace costate
