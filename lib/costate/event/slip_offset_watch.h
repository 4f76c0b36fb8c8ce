// What the offset with which slips in space begin from rest (element/force/rigid_contact.h) leaves in a run: w = v + o
// with |o| = 1e-9 m/s stays as the velocity v turns away from it, and friction points elsewhere by |o|/|v|. That is
// nothing at metres a second, and more than the run's errors where the whole slip stays slow.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/element/unilateral_force.h"

namespace costate {

class SlipOffsetWatch {
 public:
  explicit SlipOffsetWatch(const Mechanism& mechanism);
  bool empty() const { return contacts_.empty(); }

  /// At each step of a run, in order of time, with the numbers of the assembly.
  void look(const StateView& s, const Assembly& assembly);

  struct Slip {
    std::string contact;  // "contact.foot"
    double t = 0;         // at which it was looked at first
    double fastest = 0;   // the largest |v| of it [m/s]
    /// What results that hold this slip are off by, in parts of them, measured on slips of 1e-5 to 1e-3 m/s.
    double part() const;
  };
  /// The slowest of those whose velocity turned away from the offset, if there is any.
  std::optional<Slip> slowest() const;

 private:
  struct Contact {
    const Force* force;
    const UnilateralForce* contact;
    int first_state;
    double offset[2] = {0, 0};  // of the slip that goes on, or none
    bool turned = false;
    Slip slip = {};
  };
  void end(Contact& c);

  std::vector<Contact> contacts_;
  std::optional<Slip> slowest_;
};

}  // namespace costate
