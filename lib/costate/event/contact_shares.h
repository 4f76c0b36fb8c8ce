// Who bears how much, where contacts hold what they hold more often than it takes. In space those that stick rest as
// long as any shares within all cones of friction hold them, and what the best shares (event/resting_shares.h) have at
// its limit there begins to slide, or to open, in one instant: groups of them. And of what slides, in space and in the
// plane, whether shares that are not determined leave the motion open.
#pragma once

#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/event/resting_shares.h"
#include "costate/event/watched_guard.h"
#include "costate/level/impulse_balance.h"

namespace costate {

class ContactShares {
 public:
  /// Of these contacts; both live longer.
  ContactShares(Assembly& assembly, const std::vector<WatchedContact>& contacts);

  struct Group {
    std::vector<int> contacts;
    std::vector<RestingCone> cones;  // one a contact; their rows among these of the mechanism
    std::vector<int> rows;
    Eigen::MatrixXd moves_nothing;
  };
  /// That of one contact, with its best shares of the multipliers -forces of the state.
  struct Held {
    const Group* group;
    std::size_t own;  // which of the group's contacts
    RestingShares shares;
    /// What the best shares leave to the contact: to the limit of its friction, and of its weight.
    double margin() const { return margin_of(group->cones[own], shares.forces); }
    double weight() const { return shares.forces[group->cones[own].first]; }
  };
  /// Null where its own share is determined, or may grow without a limit, or where the state's shares are all within
  /// their cones, unless `anyhow`. Velocities are known to `error`. Valid until the next call.
  const Held* find(int contact, const StateView& s, ImpulseBalance& balance, double error, bool anyhow = false);
  /// Throws SolverError where contacts that slide share a weight in shares that are not determined, and friction makes
  /// accelerations of that: of all parts, or behind an event of one, with velocities known to `error`. Where it makes
  /// none, but would by some parameter, whoever wants derivatives is told.
  void require_determined(const StateView& s, ImpulseBalance& balance, double error, int part = -1);

 private:
  /// Notice of the parameters that make unlike what slides alike, where there are such: of rows whose shares do
  /// accelerations `each` and are free along the columns of `none`.
  void tell_kinks(const std::vector<const WatchedContact*>& sliding, const std::vector<int>& rows,
                  const Eigen::MatrixXd& each, const Eigen::MatrixXd& none) const;
  bool is_closed(const WatchedContact& c, const StateView& s) const {
    return c.closed_state >= 0 && s.z[c.closed_state] > 0.5;
  }
  bool slides(const WatchedContact& c, const StateView& s) const {
    return c.sliding_state >= 0 && s.z[c.sliding_state] != 0;
  }
  /// How many of its rows have a multiplier of their own.
  int rows_of(const WatchedContact& c, const StateView& s) const { return slides(c, s) ? 1 : c.contact->row_count(); }
  RestingCone cone_of(const WatchedContact& c, const StateView& s, int first) const;
  /// Of the part's contacts whether they are open, stick or slide.
  std::vector<char> modes_of(int part, const StateView& s) const;
  /// Rows of the part that have a multiplier of their own, where the assembly is at the state: those along which
  /// contacts slide go with those of their gaps.
  std::vector<int> rows_of_part(int part, const StateView& s) const;
  std::vector<int> coordinates_of(int part) const;
  /// What goes with a multiplier of these rows (coordinates of the part x rows): friction of contacts that slide.
  Eigen::MatrixXd friction_of(int part, const StateView& s, const std::vector<int>& rows) const;
  std::vector<Group> find_groups(int part, const StateView& s, ImpulseBalance& balance, double error) const;
  /// Changes of the rows' shares that do nothing, orthonormal columns, where the balance is prepared.
  Eigen::MatrixXd idle_changes(int part, const StateView& s, const std::vector<int>& rows, ImpulseBalance& balance,
                               double error) const;
  /// What columns of forces on these coordinates do, as the constraints leave it; n rows.
  Eigen::MatrixXd accelerations(const Eigen::MatrixXd& forces, const std::vector<int>& coordinates,
                                ImpulseBalance& balance) const;

  Assembly& assembly_;
  const std::vector<WatchedContact>& contacts_;
  bool several_in_space_ = false;
  std::vector<int> part_of_coordinate_, part_of_row_;
  // Groups of one part where its contacts do this and are here, with these numbers.
  struct {
    int part = -1;
    std::vector<char> modes;
    std::vector<double> places, numbers;
    std::vector<Group> groups;
  } known_;
  // Of a part whose contacts do this its rows depend on each other.
  std::map<std::pair<int, std::vector<char>>, bool> depend_;
  std::optional<Held> held_;
  Eigen::VectorXd shared_;  // of these forces
};

}  // namespace costate
