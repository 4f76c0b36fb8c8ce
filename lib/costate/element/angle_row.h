// A constraint row A sin(th) - B cos(th) that makes its element's last coordinate th the angle of a direction with the
// components A, B: it holds half a turn away as well, where th is the angle of the opposite direction.
#pragma once

namespace costate {

class AngleRow {
 public:
  virtual ~AngleRow() = default;

 protected:
  AngleRow() = default;
};

}  // namespace costate
