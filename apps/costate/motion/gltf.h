// A stage as glTF 2.0 (ISO/IEC 12113): nodes with meshes, one animation of their translation, rotation and scale.
#pragma once

#include <string>

#include "stage.h"

namespace costate::app {

/// The whole file as text, its data inside; y is up, metres and seconds. Solids are nodes named after what they show,
/// below one node that turns the scene's axes; what stays as it is has no channel.
std::string gltf_text(const Stage& stage, const std::string& title);

/// The same as one binary file (.glb).
std::string glb_bytes(const Stage& stage, const std::string& title);

}  // namespace costate::app
