// Draws mechanisms for tests straight on MechanismBuilder and the element classes, so that these tests do not
// depend on scene files or scene kinds. Numbers get the paths that their names say ("bar.A1.mass_kg").
#pragma once

#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "costate/element/force/angular_force.h"
#include "costate/element/force/axial_force.h"
#include "costate/element/law/scalar_law.h"
#include "costate/mechanism/builder.h"

namespace costate::test {

/// (key below the element's path, value)
using Keys = std::vector<std::pair<std::string, double>>;

/// A scalar law with its numbers' keys and values.
struct Law {
  std::shared_ptr<const ScalarLaw> law;
  Keys keys;
};
Law polynomial(const std::vector<double>& coefficients);
Law sine(double mean, double amplitude, double omega, double phase);
Law smooth_step(double x0, double x1, double y0, double y1);
Law table(const std::vector<double>& x, const std::vector<double>& y);

struct Sketch {
  MechanismBuilder builder;

  void ground(const std::string& name, double x, double y);
  void point(const std::string& name, double x, double y, double vx = 0, double vy = 0);
  /// A point fixed to a bar or a body, at (x, y) in its frame.
  void attach(const std::string& name, const std::string& on, double x, double y);
  /// Uniform; the length is that between the first positions of its ends.
  void bar(const std::string& name, const std::string& from, const std::string& to, double mass);
  /// General inertia: centre of mass at `centre` from the first end, moment of inertia about it.
  void bar(const std::string& name, const std::string& from, const std::string& to, double mass, double centre,
           double inertia);
  void body(const std::string& name, std::array<double, 3> place, std::array<double, 3> rate, double mass,
            double inertia, double cx, double cy);
  void mass(const std::string& point, double kg);
  /// An angle coordinate of the line between two points, with its first guess.
  void angle(const std::string& name, const std::string& from, const std::string& to, double guess);

  void distance(const std::string& name, const std::string& from, const std::string& to);
  void revolute(const std::string& name, const std::string& a, const std::string& b);
  void slot(const std::string& name, const std::string& line_from, const std::string& line_to,
            const std::string& point);
  void perpendicular(const std::string& name, const std::string& a, const std::string& b, const std::string& c,
                     const std::string& d);
  /// sum_k weight_k coordinate_k = law(t)
  void driver(const std::string& name, const std::vector<std::pair<std::string, double>>& weighted, const Law& law);
  void distance_driver(const std::string& name, const std::string& from, const std::string& to, const Law& law);

  struct Spring {
    double stiffness = 0, natural = 0, damping = 0, preload = 0;
    Law spring, damper;  // optional
  };
  void spring(const std::string& name, const std::string& from, const std::string& to, const Spring& s);
  void maxwell(const std::string& name, const std::string& from, const std::string& to, double stiffness,
               double natural, double damping, double state);
  void lag_actuator(const std::string& name, const std::string& from, const std::string& to, double tau, double state,
                    const Law& command);
  /// Between two angle coordinates, or one and the ground.
  void torsion(const std::string& name, const std::vector<std::string>& angles, const Spring& s);
  void torsion_maxwell(const std::string& name, const std::vector<std::string>& angles, double stiffness,
                       double natural, double damping, double state);
  void point_force(const std::string& name, const std::string& point, const Law& x, const Law& y);
  void couple(const std::string& name, const std::vector<std::string>& angles, const Law& torque);

  PlanarVector line(const std::string& from, const std::string& to) const;
  /// Adds numbers PATH.KEY; returns their indices.
  std::vector<int> numbers(const std::string& path, const Keys& keys);
  /// A design parameter bound to numbers by path, each with a factor; scale: the value's size, or 1.
  void parameter(const std::string& name, const std::vector<std::pair<std::string, double>>& bindings);
  void parameter(const std::string& name, const std::string& path) { parameter(name, {{path, 1.0}}); }
  /// Makes position and velocity of these coordinates given at the start.
  void give(const std::vector<std::string>& coordinates);

 private:
  void add_bar(const std::string& name, const std::string& from, const std::string& to, Keys inertia);
  std::vector<int> coordinates_of(const std::vector<std::string>& names) const;
};

}  // namespace costate::test
