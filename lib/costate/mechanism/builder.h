// Builds a mechanism, from a scene file or by hand: names are checked here, physics lives in the elements.
// The add_... functions of the scene kinds (kind/) are written on these few operations.
#pragma once

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "costate/element/shared_part.h"
#include "costate/mechanism/mechanism.h"
#include "costate/mechanism/number_rule.h"

namespace costate {

/// Something that points can be fixed to: a body or a bar.
struct AttachmentFrame {
  PlanarPoint::Kind kind = PlanarPoint::Kind::on_body;  // of points on it
  std::vector<int> coordinates, numbers;                // of such a point; the numbers follow its local x, y
  std::vector<PlanarPoint> ends;                        // of a bar
};

class MechanismBuilder {
 public:
  MechanismBuilder();

  /// A uniform field of gravity [m/s^2]; to be set before bodies are added. Default: none.
  void set_gravity(double x, double y, double z = 0);
  const std::vector<int>& gravity_numbers() const { return gravity_; }
  /// With z, which a planar mechanism does not have.
  std::vector<int> spatial_gravity_numbers();

  /// A number under a dotted path ("spring.S1.stiffness_N_per_m"); returns its index.
  int add_number(const std::string& path, double value, NumberRule rule = NumberRule::any);
  double number_value(int index) const { return m_->numbers_[index].value; }
  bool has_number(const std::string& path) const { return m_->number_index_.count(path) > 0; }
  int number(const std::string& path) const { return m_->number(path); }
  void fix_number(int index, const std::string& because) { m_->numbers_[index].fixed_because = because; }

  /// A generalized coordinate; `position` and `velocity` are its start values, or first guesses.
  int add_coordinate(const std::string& name, const std::string& unit, int position_number, int velocity_number);
  /// What this coordinate's velocity starts with was taken from an angular velocity at the values that these numbers
  /// have: where the start gives it they cannot vary.
  void velocity_follows(int coordinate, std::vector<int> numbers) { follows_[coordinate] = std::move(numbers); }
  void add_point(PlanarPoint point);
  const PlanarPoint& point(const std::string& name) const { return m_->point(name); }
  void add_point(SpatialPoint point);
  const SpatialPoint& spatial_point(const std::string& name) const { return m_->spatial_point(name); }
  bool has_spatial_point(const std::string& name) const { return m_->spatial_point_index_.count(name) > 0; }
  void add_angle(const std::string& name, int coordinate);
  /// The angle coordinate of a body or of an [angle] of this name.
  int angle(const std::string& name) const;
  int coordinate(const std::string& name) const { return m_->coordinate(name); }
  const std::string& coordinate_unit(int coordinate) const { return m_->coordinates_[coordinate].unit; }
  void add_frame(const std::string& name, AttachmentFrame frame);
  const AttachmentFrame& frame(const std::string& name) const;
  /// A rigid body in space that points can be fixed to, by its coordinates x, y, z, e0, e1, e2, e3.
  void add_rigid_body_frame(const std::string& name, std::vector<int> coordinates);
  bool has_rigid_body(const std::string& name) const { return rigid_bodies_.count(name) > 0; }
  const std::vector<int>& rigid_body_frame(const std::string& name) const;
  /// A body in natural coordinates, by its coordinates x, y, z, u1x, u1y, ..., u3z.
  void add_natural_body_frame(const std::string& name, std::vector<int> coordinates);
  bool has_natural_body(const std::string& name) const { return natural_bodies_.count(name) > 0; }
  const std::vector<int>& natural_body_frame(const std::string& name) const { return natural_bodies_.at(name); }
  /// Start value, or first guess, of a coordinate.
  double first_value(int coordinate) const { return number_value(m_->coordinates_[coordinate].position_number); }
  /// Position of a point at the start values (first guess) [m].
  Eigen::Vector2d first_position(const PlanarPoint& p) const;
  Eigen::Vector3d first_position(const SpatialPoint& p) const;

  /// Under its dotted path ("road.track"); the builder keeps it only while the mechanism is built.
  void add_shared_part(const std::string& path, std::shared_ptr<const SharedPart> part);
  /// Null when there is none.
  std::shared_ptr<const SharedPart> find_shared_part(const std::string& path) const;
  /// The names NAME of all parts "kind.NAME".
  std::vector<std::string> shared_part_names(const std::string& kind) const;

  void add(std::unique_ptr<Body> body);
  void add(std::unique_ptr<Constraint> constraint);
  void add(std::unique_ptr<Force> force);

  /// A name that stands for several: giving a body's pose gives these coordinates and these velocities.
  void add_start_group(const std::string& name, std::vector<std::string> positions,
                       std::vector<std::string> velocities);
  /// A rate that the start can give in place of a coordinate's velocity.
  void add_rate(GivenStart rate);

  /// Declares a coordinate as given at the start (position and velocity, or the velocity of another one).
  void give_position(const std::string& coordinate);
  void give_velocity(const std::string& coordinate);
  /// Both, as a scene's start.given does.
  void give(const std::string& coordinate) {
    give_position(coordinate);
    give_velocity(coordinate);
  }

  /// The start finds the positions that are not given by balance of forces (see Mechanism::starts_at_equilibrium).
  void start_at_equilibrium() { m_->starts_at_equilibrium_ = true; }
  /// Paths of the initial values of force states; such a state starts balanced, too, unless it is held.
  std::vector<std::string> initial_state_paths() const;
  void hold_initial_state(const std::string& path) { held_states_.insert(number(path)); }

  void add_parameter(Parameter parameter);
  void set_default_parameters(std::vector<std::string> names);

  /// Checks what only the whole can tell and hands out the mechanism; the builder is done then, and what is asked of it
  /// later ends with an Error.
  std::shared_ptr<const Mechanism> build();

 private:
  /// Throws Error for null, and behind build().
  void require_element(const void* element) const;
  /// Throws ModelError where another one of the kind has its path, and one of them is a user's.
  void require_own_path(const Element& element, const char* what);
  void sign();
  std::unique_ptr<Mechanism> m_;
  std::vector<int> gravity_;
  double gravity_z_ = 0;
  std::map<std::string, AttachmentFrame> frames_;
  std::map<std::string, std::vector<int>> rigid_bodies_, natural_bodies_;
  struct StartGroup {
    std::vector<std::string> positions, velocities;
  };
  std::map<int, std::vector<int>> follows_;  // by coordinate
  std::map<std::string, StartGroup> start_groups_;
  std::map<std::string, GivenStart> rates_;
  std::set<int> positions_given_, velocities_given_;  // coordinates
  std::set<std::string> rates_given_;
  std::map<std::string, bool> paths_;  // "force spring.S": whether the library has it
  std::map<std::string, std::shared_ptr<const SharedPart>> shared_parts_;
  std::set<int> held_states_;  // numbers of initial values
  void hold_or_balance_states();
  /// Where nothing is given: points and bodies that no constraint touches start as they are.
  void give_what_is_free();
};

}  // namespace costate
