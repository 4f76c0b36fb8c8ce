// Random scenes of the plane with one to five rigid contacts, and what must hold of each motion whatever its laws: no
// energy is created, nothing is in the ground, and where it goes no further it says why.
#pragma once

#include <cstdint>
#include <string>

#include "judge.h"

namespace costate::adversary {

std::string random_contact_scene(std::uint64_t seed);
/// The same with parameters and a cost, for second derivatives.
std::string random_struck_scene(std::uint64_t seed);

/// One run of the scene: agreed, or refused or failed by an error that names a contact, or wrong.
Finding run_contacts(const std::string& scene, const std::string& formulation);

}  // namespace costate::adversary
