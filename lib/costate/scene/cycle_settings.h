// [cycle]: the periodic motion that 'costate cycle' looks for.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace costate {

/// Where a cycle begins and ends: an event, an output that crosses a level, or a time.
struct CycleSettings {
  std::string event;               // "contact.left touch"
  std::string output;              // or this one crosses a level
  bool above = true;               // from below
  int level_number = -1;           // of the mechanism
  std::optional<double> period_s;  // or this has gone by
  double after_s = 0;              // the section is looked for from then on
  int count = 1;                   // times that the section is met in a cycle
  int settle = 0;                  // cycles gone through before the search begins
  /// Names of bodies, points and elements that swap roles at the section, each pair both ways.
  std::map<std::string, std::string> relabel;
  std::string travel;               // the coordinate that moves on, "left.x", or empty
  std::string travel_angle_number;  // path of the number that says how steep the way is, or empty
  double travel_angle_rad = 0;      // where no number does
  std::vector<std::string> turns;   // angles that may have gone round
};

}  // namespace costate
