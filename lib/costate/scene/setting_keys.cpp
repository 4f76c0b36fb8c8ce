// What the keys of a scene's own tables mean, those that are no kind. Kinds say so themselves.
#include "costate/level/formulation_options.h"
#include "costate/scene/key_reference.h"

namespace costate {

std::vector<SettingsMeaning> settings_meanings() {
  std::vector<KeyMeaning> formulation;
  for (const auto& [key, option] : formulation_options()) formulation.push_back({key, option.help});
  return {
      {"", "at the top", "what the scene is", {{"title", "of reports and pages"}, {"description", "for readers"}}},
      {"gravity",
       "[gravity]",
       "the acceleration of free fall",
       {{"x_m_per_s2, y_m_per_s2, z_m_per_s2", "its components; y is up in the plane, z by custom in space"}}},
      {"start",
       "[start]",
       "what holds at the start; all else follows from the constraints",
       {{"given", "coordinates that start where the scene has them, as many as there are degrees of freedom"},
        {"given_velocities", "the same for velocities; by default those of the given positions"},
        {"equilibrium", "positions that are not given are found by the balance of forces"}}},
      {"parameter",
       "[parameter.NAME]",
       "a name for a number of the scene, or for several at once",
       {{"number", "the path of the number: spring.strut.stiffness_N_per_m"},
        {"numbers", "paths, in the place of 'number'"},
        {"factors", "one for each of 'numbers': the number is factor times parameter; by default 1"},
        {"lower, upper", "bounds for optimization; by default none"},
        {"scale", "a typical amount; by default the start value"}}},
      {"run",
       "[run]",
       "the defaults of a run, which the command line overrides",
       {{"t_start_s", "start time"},
        {"t_end_s", "end time; with 'ends_when' the latest one"},
        {"ends_when", "what ends the run before: a table of its own"},
        {"formulation", "of the equations of motion"},
        {"method", "of the gradient, see costate list methods"},
        {"integrator", "idas, cvodes or fixed; by default the formulation's"},
        {"cvodes_method", "adams for smooth motion (default), bdf for a stiff one"},
        {"sensitivity_corrector", "of forward methods: sensitivities after the state (default) or with it"},
        {"parameters", "names, or paths of numbers, that gradients are taken for"},
        {"rtol", "relative tolerance"},
        {"atol", "absolute tolerance in SI units; by default the number of rtol"},
        {"step_s", "of fixed-step runs; by default chosen from rtol"},
        {"max_step_s", "longest step of integrators; by default unlimited"},
        {"output_step_s", "between the rows of result files; by default the integrator's steps"},
        {"outputs", "outputs that result files and pages show besides"},
        {"events", "whether result files list the run's events, and plots mark them"}}},
      {"run.ends_when",
       "[run.ends_when]",
       "an output that ends the run where it crosses a level",
       {{"output", "its name: costate list SCENE"},
        {"above", "the level, crossed from below; may be a parameter"},
        {"below", "the same, crossed from above, in the place of 'above'"}}},
      {"formulation", "[formulation]", "options of formulations", formulation},
      {"optimize",
       "[optimize]",
       "how costate optimize looks for the best parameters",
       {{"algorithm", "see costate list algorithms"},
        {"max_evaluations", "limit of evaluations, failed ones included"},
        {"stop_value", "ends the run when psi has fallen to it"},
        {"relative_tolerance", "of psi between iterations"},
        {"gradient_tolerance", "of the largest entry of the projected gradient in scaled parameters; 0: off"}}},
      {"optimize.constraint[0]",
       "[[optimize.constraint]]",
       "a cost that must stay below a bound; its terms stand in "
       "[[optimize.constraint.running]] and [[optimize.constraint.terminal]]",
       {{"name", "of reports"}, {"upper", "the bound"}}},
  };
}

}  // namespace costate
