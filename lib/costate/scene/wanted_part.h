// The part of a scene's mechanism that some outputs depend on. Coordinates that an element (a body, a joint, a driver,
// a force, a contact) has in common act on each other; what no chain of elements joins to the coordinates of an output
// cannot change it, whatever the state. So a scene may be read once more without that: its numbers stay, in their
// order, so that parameters are the same ones, and a number that is of nothing any more has derivatives that are zero.
#pragma once

#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "costate/scene/scene.h"

namespace costate {

class MechanismBuilder;

/// By coordinate, which of those that act on each other it belongs to; numbered from 0 in the order of coordinates.
std::vector<int> acting_groups(const Mechanism& mechanism);

/// The coordinates whose motion an output is of, by its own formula; null: perhaps of all.
std::optional<std::vector<int>> coordinates_of(const Mechanism& mechanism, const std::string& output);
/// Of a cost; null also where it has a term of a kind that is not known here.
std::optional<std::vector<int>> coordinates_of(const Mechanism& mechanism, const Objective& objective);

/// The scene with the groups alone that hold one of `wanted`. Null where that is all of them or none, or where the
/// scene cannot be read so, or would be another one in what stays.
std::optional<Scene> read_part(const Scene& scene, const std::vector<int>& wanted);

/// While a part is read, what the reader asks; in any other reading there is none.
class WantedPart {
 public:
  /// `kept`: by coordinate of the whole.
  WantedPart(const Mechanism& whole, std::vector<bool> kept);
  ~WantedPart();
  WantedPart(const WantedPart&) = delete;
  WantedPart& operator=(const WantedPart&) = delete;
  /// Of this thread, or null.
  static const WantedPart* current();

  /// Whether the table [kind.NAME] is of what is left out alone.
  bool leaves_out(const std::string& path) const;
  /// In the place of such a table: its numbers.
  void add_numbers(const std::string& path, MechanismBuilder& builder) const;

 private:
  /// What is of a table.
  struct Own {
    std::vector<int> coordinates;
    std::vector<const Element*> elements;
    std::vector<std::vector<int>> points;  // their coordinates
  };
  const Mechanism& whole_;
  std::vector<bool> kept_;
  std::unordered_map<std::string, Own> own_;  // by path
  mutable std::size_t added_ = 0;             // numbers from the first on that the builder is known to have
  const WantedPart* before_;
};

}  // namespace costate
