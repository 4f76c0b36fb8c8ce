#include "critical.h"

#include "costate/adjoint/acceleration_adjoint.h"
#include "costate/adjoint/tangent_equations.h"
#include "costate/formulation/acceleration_dae.h"
#include "costate/formulation/acceleration_ode.h"
#include "costate/formulation/formulation.h"

namespace tutorial {

using namespace costate;

Stabilization critically_damped(double decay_time_s) { return {1, 1 / decay_time_s, 0}; }

namespace {

// [formulation] critical_decay_time_s of scenes, --decay-time on the command line, `costate list critical`: from here.
const FormulationOption decay_time{.key = "critical_decay_time_s",
                                   .help = "time in which constraint errors fall to 1/e",
                                   .number = 0.1,
                                   .rule = NumberRule::positive,
                                   .flag = "--decay-time"};

Stabilization stabilization(const FormulationOptions& o) { return critically_damped(decay_time.number_in(o)); }

const RegisterFormulation critical_registered({
    .name = "critical",
    .summary = "index 1 with critically damped constraint errors, by their decay time",
    .default_integrator = "idas",
    .options = {decay_time},
    .make_dae =
        [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
          return std::make_unique<AccelerationDae>(mechanism, parameters, objective, stabilization(o));
        },
    .make_ode =
        [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
          return std::make_unique<AccelerationOde>(mechanism, parameters, objective, stabilization(o));
        },
    .make_hand_tangent =
        [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
          return std::make_unique<TangentEquations>(mechanism, parameters, objective, stabilization(o),
                                                    TangentEquations::Constraints::acceleration);
        },
    .make_hand_adjoint =
        [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
          return std::make_unique<AccelerationAdjoint>(mechanism, parameters, objective, stabilization(o));
        },
    .candidate_stabilization = [](const auto&, const FormulationOptions& o) { return stabilization(o); },
});

}  // namespace

}  // namespace tutorial
