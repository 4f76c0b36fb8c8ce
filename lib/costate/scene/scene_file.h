// A file besides its own that a scene reads.
#pragma once

#include <string>

namespace costate {

struct SceneFile {
  std::string path;  // of the key that names it, "road.left.law.file"; empty for an included scene, which dump() holds
  std::string file;  // as it can be opened from here
  std::string digest;  // of its bytes (base/digest.h); empty for an included scene and for what cannot be read
};

}  // namespace costate
