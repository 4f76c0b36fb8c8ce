// A scene that 'costate explain' writes in the place of another one, held against it.
#pragma once

#include <string>

#include "costate/command.h"
#include "costate/problem/problem.h"

namespace costate::app {

struct Rewritten {
  Problem problem;  // without parameters
  double psi = 0;
};

/// Reads what is to be written to `file` and runs it with the settings of this run, whose psi is `psi_here`; a notice
/// where the two part by more than the tolerance explains. `option` is what asked for it. Throws CapabilityError where
/// the text is no scene.
Rewritten read_rewritten(const Setup& setup, const std::string& toml, const std::string& file,
                         const std::string& option, double psi_here);

/// Throws CapabilityError where a coordinate that both scenes have starts elsewhere, at another rate, or with another
/// acceleration: the other one is no mechanism that moves as this one does.
void check_same_start(const Setup& setup, const Rewritten& other, const std::string& option);

}  // namespace costate::app
