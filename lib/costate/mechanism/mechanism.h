// A mechanism: immutable tables of generalized coordinates, numbers, points and elements. It knows no
// formulation, no integrator and no parameter values; every evaluation passes those in.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "costate/element/element.h"
#include "costate/element/point/planar_point.h"
#include "costate/element/point/spatial_point.h"
#include "costate/mechanism/parameter.h"

namespace costate {

/// A number of the scene: mass, length, stiffness, start value, ... `path` is its place in the scene file.
struct Number {
  std::string path;
  double value = 0;
  /// Not empty: why this number cannot be a design parameter.
  std::string fixed_because;
};

struct Coordinate {
  std::string name;          // "P1.x"
  std::string unit;          // "m" or "rad"
  int position_number = -1;  // start value, or first guess where it is not given
  int velocity_number = -1;
};

/// One given value of the start: coordinate i has the value of number k; or, for velocities, a rate bilinear in
/// positions and velocities has it, sum of factor q_i v_j over `terms` (a component of an angular velocity: coordinate
/// = -1).
struct GivenStart {
  struct Term {
    int q, v;
    double factor;
  };
  int coordinate = -1;
  int number = -1;
  std::string name = {};  // "P1.x", "top.omega_z"
  std::vector<Term> terms = {};
};

class Mechanism {
 public:
  const std::vector<Number>& numbers() const { return numbers_; }
  const std::vector<Coordinate>& coordinates() const { return coordinates_; }
  const std::vector<std::unique_ptr<Body>>& bodies() const { return bodies_; }
  const std::vector<std::unique_ptr<Constraint>>& constraints() const { return constraints_; }
  const std::vector<std::unique_ptr<Force>>& forces() const { return forces_; }
  /// First global row of constraint i, first global state of force i.
  const std::vector<int>& row_offsets() const { return row_offsets_; }
  const std::vector<int>& state_offsets() const { return state_offsets_; }
  const std::vector<PlanarPoint>& points() const { return points_; }
  const std::vector<SpatialPoint>& spatial_points() const { return spatial_points_; }
  const std::map<std::string, int>& angles() const { return angles_; }  // name -> coordinate
  const std::vector<GivenStart>& given_positions() const { return given_positions_; }
  const std::vector<GivenStart>& given_velocities() const { return given_velocities_; }
  /// Whether the start balances the forces at the positions that are not given, and the force states with them
  /// (analysis/equilibrium.h), and which of these (one entry a state) keep their initial values all the same.
  bool starts_at_equilibrium() const { return starts_at_equilibrium_; }
  const std::vector<bool>& held_states() const { return held_states_; }
  const std::vector<Parameter>& parameters() const { return parameters_; }
  const std::vector<std::string>& default_parameters() const { return default_parameters_; }

  int coordinate_count() const { return static_cast<int>(coordinates_.size()); }
  int row_count() const { return row_count_; }
  int state_count() const { return state_count_; }
  std::vector<double> base_numbers() const;
  /// Equal for mechanisms that have the same coordinates, numbers and elements, in this order; what holds indices of
  /// one (an Output) means nothing in a mechanism of another.
  std::size_t signature() const { return signature_; }
  /// By coordinates, their start values, or first guesses where they are not given.
  std::vector<double> first_positions() const;

  /// Index of a coordinate, number, planar or spatial point by name; errors list near names.
  int coordinate(const std::string& name) const;
  int number(const std::string& path) const;
  const PlanarPoint& point(const std::string& name) const;
  const SpatialPoint& spatial_point(const std::string& name) const;
  const Element* find_element(const std::string& path_or_name) const;

  std::vector<std::string> coordinate_names() const;
  std::vector<std::string> row_names() const;    // "bar.A1.length"
  std::vector<std::string> state_names() const;  // "actuator.ram.z0"

  /// The chosen parameters by name or number path; an empty list gives the scene's default.
  ParameterSelection select(const std::vector<std::string>& names) const;

 private:
  friend class MechanismBuilder;
  std::vector<Number> numbers_;
  std::map<std::string, int> number_index_, coordinate_index_, point_index_, spatial_point_index_, angles_;
  std::vector<Coordinate> coordinates_;
  std::vector<std::unique_ptr<Body>> bodies_;
  std::vector<std::unique_ptr<Constraint>> constraints_;
  std::vector<std::unique_ptr<Force>> forces_;
  std::vector<int> row_offsets_, state_offsets_;
  int row_count_ = 0, state_count_ = 0;
  std::size_t signature_ = 0;
  std::vector<PlanarPoint> points_;
  std::vector<SpatialPoint> spatial_points_;
  std::vector<GivenStart> given_positions_, given_velocities_;
  bool starts_at_equilibrium_ = false;
  std::vector<bool> held_states_;
  std::vector<Parameter> parameters_;
  std::vector<std::string> default_parameters_;
};

}  // namespace costate
