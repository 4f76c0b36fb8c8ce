// What a result is known to be off by: whoever finds an error, or says one in a notice, widens what is known, so that
// no more digits are shown than are told of.
#pragma once

#include "costate/problem/problem.h"

namespace costate {

/// psi may be off by that much; whoever knows of the gradient alone gives 0, and of a psi that nobody has given more
/// nothing is known.
void widen_error(Simulation& result, double psi);
/// And the gradient: by `scaled` over each parameter's scale, or by these amounts.
void widen_error(GradientResult& result, const ParameterSelection& parameters, double psi, double scaled);
void widen_error(GradientResult& result, double psi, const std::vector<double>& gradient);

/// By that part of psi, which no tolerance takes away.
void widen_by_what_stays(Simulation& result, double part);
/// KnownError::stays, or 0.
double what_stays(const Simulation& result);
/// A gradient by the drift that its run told of, and by what stays of it.
void widen_by_drift(GradientResult& result, const ParameterSelection& parameters, double drift);

/// |a_j - b_j| of two gradients as what either may be off by. Of a few entries one or the other changes little by
/// chance: none is less, in its parameter's scale, than a tenth of the largest.
std::vector<double> pooled_changes(const ParameterSelection& parameters, const std::vector<double>& a,
                                   const std::vector<double>& b);

}  // namespace costate
