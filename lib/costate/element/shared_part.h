// What several elements share without being an element itself.
#pragma once

namespace costate {

/// Something that several elements refer to by name, such as a road; its numbers are numbers of the scene.
class SharedPart {
 public:
  virtual ~SharedPart() = default;
};

}  // namespace costate
