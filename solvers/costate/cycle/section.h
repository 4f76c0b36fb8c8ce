// The section that a cycle begins and ends with, and the state on it: the independent coordinates x of the start, their
// velocities and the force states that have numbers of their own, each read where a cycle ends as the next one begins
// with it: behind the event, roles swapped, moved back along the way. It knows events by name and guard alone; at
// impacts of rigid contacts velocities and modes are those behind them (cycle/behind_impact.h).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "costate/event/named_event.h"
#include "costate/problem/problem.h"
#include "costate/scene/cycle_settings.h"

namespace costate {

/// One entry of x.
struct SectionCoordinate {
  std::string name, unit;                  // "left.angle", "left.angle_dot", "z.contact.left.approach_speed"
  int number = -1;                         // of the mechanism, which a start takes it from
  std::shared_ptr<const Output> at_start;  // where the motion meets the section for the first time
  std::shared_ptr<const Output> at_end;    // where a cycle ends
  int along = 0;                           // of the way that the mechanism travels: 0 none, 1 horizontal, 2 upwards
  bool turns = false;                      // may have gone round
};

/// A mode of a rigid contact, "contact.left.closed": the same at both ends of a cycle, whatever happens between.
struct SectionMode {
  std::string name, contact;
  int state = -1;  // among all force states
  bool closed = false;
  double starts = 0;  // what the scene has
  std::shared_ptr<const Output> at_start, at_end;
};

/// What a coordinate changes by per unit of way: 0, cos(angle) or sin(angle); and the derivative with respect to the
/// angle.
double along_way(int along, double angle);
double along_way_angle(int along, double angle);

class Section {
 public:
  /// Throws ModelError with the paths of [cycle] as subjects. `passive`: states that nothing depends on (an energy that
  /// was lost), one flag each; they begin every cycle anew. `let_go`: the scene starts just behind the impact of a
  /// rigid contact that the section is, at which that contact has let go; empty: it does not.
  Section(const Problem& problem, const CycleSettings& settings, const std::vector<bool>& passive,
          const std::string& let_go);

  const std::vector<SectionCoordinate>& coordinates() const { return coordinates_; }
  int size() const { return static_cast<int>(coordinates_.size()); }
  const std::vector<SectionMode>& modes() const { return modes_; }
  const CycleSettings& settings() const { return settings_; }
  /// The event or crossing that ends a cycle, and the one that begins it, which has its roles swapped; null with a
  /// period.
  std::shared_ptr<const EndEvent> end() const { return end_; }
  std::shared_ptr<const EndEvent> first() const { return first_; }
  /// What is at its level where a cycle begins, as first(); behind an impact that closes a contact the gap of the one
  /// that lets go there, null where none is known.
  std::shared_ptr<const EndEvent> begin() const { return begin_; }
  bool closes() const { return closes_; }
  /// The path of the contact that lets go.
  void set_let_go(const Mechanism& m, const std::string& contact);
  /// Entry of x that travels, or -1.
  int travelling() const { return travelling_; }
  /// What travels and is no entry of x: a rigid contact holds it where first guesses have it. `coordinate` of the
  /// mechanism, or -1; at_end reads where the one that has its role behind the section is.
  struct Carried {
    int coordinate = -1, along = 0;
    std::shared_ptr<const Output> at_end;
  };
  const Carried& carried() const { return carried_; }
  /// Of the mechanism's coordinate i, as SectionCoordinate::along.
  int along(std::size_t i) const { return along_[i]; }
  /// Entries of x that are looked for: all but the one that travels.
  const std::vector<int>& free() const { return free_; }
  /// Multipliers that are zero by construction: the section's own, and one for each state that the event sets.
  int trivial_multipliers() const { return trivial_; }

  /// Of the numbers: how steep the way is, and the number that says so or -1.
  double angle(const std::vector<double>& numbers) const;
  int angle_number() const { return angle_number_; }

  /// All positions of the mechanism where the next cycle begins, from those where one ends, `travel` further on.
  std::vector<double> positions_behind(const double* q, double travel, double angle) const;
  /// All positions, `travel` less far on their way.
  std::vector<double> moved_back(std::vector<double> positions, double travel, double angle) const;
  /// Numbers that are the start's own: x, first guesses, initial states. No parameter of a cycle varies them.
  const std::vector<bool>& start_numbers() const { return start_numbers_; }

 private:
  std::string partner(const std::string& name) const;
  void check_pairs(const Problem& problem) const;
  void find_event_sections(const Mechanism& m);
  void add_positions(const Mechanism& m);
  void add_velocities(const Mechanism& m);
  void find_travel(const Mechanism& m);
  void add_states(const Mechanism& m, const std::vector<bool>& passive);

  CycleSettings settings_;
  std::vector<SectionCoordinate> coordinates_;
  std::vector<SectionMode> modes_;
  std::shared_ptr<const EndEvent> first_, begin_, end_;
  std::optional<NamedEvent> begin_event_, end_event_;
  std::vector<int> free_, partner_coordinate_, along_;
  std::vector<bool> start_numbers_;
  Carried carried_;
  bool impact_ = false, closes_ = false, starts_behind_ = false;  // of a rigid contact; one that closes
  int travelling_ = -1, angle_number_ = -1, trivial_ = 0;
};

}  // namespace costate
