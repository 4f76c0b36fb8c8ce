// Cranks that may not be able to turn as their motors say: four-bar linkages and slider cranks of random lengths, whose
// closure is known in closed form. Where links come to lie in line the motion ends, and a run has to say so; where they
// do not it has to be that of the closed form.
#pragma once

#include <cstdint>

#include "judge.h"

namespace costate::adversary {

struct Crank {
  std::string scene;
  bool slider = false;
  double crank = 1, coupler = 1, rocker = 1, ground = 1;  // of a slider crank: rod and offset; no rocker
  double from = 0, to = 0;                                // the motor's angle
  double t_end = 1;
  double side = 1;  // on which the coupler's end begins

  /// By how much, in parts of the coupler, the links reach over the gap at the motor's angle: below 0 they do not.
  double spare(double angle) const;
  double least_spare() const;
  /// The coupler's end.
  void end(double angle, double* xy) const;
};

Crank random_crank(std::uint64_t seed);
std::vector<Finding> run_crank(const Crank& crank, const std::vector<std::pair<std::string, std::string>>& runs);

}  // namespace costate::adversary
