// Where along a motion slips in space are slow, from where they begin from rest and until they stop, and what the
// motion does there, with its second derivatives (adjoint/second_tangents.h), by steps of Radau's scheme of order 9:
// the way back crosses these stretches, and the events at which slips begin, by their maps.
#pragma once

#include <vector>

#include "costate/adjoint/second_tangents.h"
#include "costate/formulation/hessian_systems.h"
#include "costate/integrator/trajectory.h"
#include "costate/problem/problem.h"

namespace costate {

struct SlipMap {
  double begin = 0, end = 0;
  double event = 0;        // when the slip begins, or stops
  bool from_rest = false;  // which of them; the map then has the event, too
  SecondStretchMap map = {};
};

/// Of the stored motion with the tangents along the equations' directions, in order. Bends and events as
/// HessianMotion has them; events at which slips stop get the state before them that the map ends with. `work` gains
/// all steps, those of maps that do not get to their end included.
std::vector<SlipMap> find_slip_maps(const Problem& problem, HessianEquations& equations, TangentMotion& forward,
                                    const Trajectory& motion, const std::vector<HessianEquations::Bend>& bends,
                                    std::vector<HessianEquations::Event>& events, Counters& work);

}  // namespace costate
