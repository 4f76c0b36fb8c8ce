// A random mechanism of the plane, small enough to be solved independently: points, bars, springs with
// dampers, forces and drivers that follow laws of time, costs and parameters. It knows its scene text, and
// equivalents of itself (mirrored, turned, renamed) whose motion is the same.
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace costate::adversary {

/// A law of time, evaluated here by formulas of its own.
struct TimeLaw {
  enum class Kind { constant, sine, pulse, kink, steps } kind = Kind::constant;
  // constant: a.  sine: a + b sin(c t).  pulse: a, and b more between t1 and t2, with quintic flanks of
  // length w. kink: a + b t up to t1, from there on slope c. steps: a up to t1, b up to t2, then c.
  double a = 0, b = 0, c = 0, t1 = 0, t2 = 0, w = 0.1;

  double value(double t) const;
  double rate(double t) const;
  double second(double t) const;
  /// Where a derivative jumps, or something starts or ends.
  std::vector<double> breaks() const;
  std::string text() const;
  /// The law times a factor (a driver's position, a mirrored force).
  void scale(double factor);
};

struct Point {
  std::string name;
  bool ground = false;
  double x[2] = {0, 0};  // start, or first guess
  double v[2] = {0, 0};  // given velocity
  bool given[2] = {false, false};
  double mass = 0;
};

struct Bar {
  std::string name;
  int a = 0, b = 0;
  double mass = 0, length = 1;
};

struct Spring {
  std::string name;
  int a = 0, b = 0;
  double stiffness = 0, length = 1, damping = 0,
         damping_out = 0;  // damping_out: for growing lengths, if it differs
  bool kinked = false;
};

struct Force {
  std::string name;
  int point = 0, axis = 0;
  TimeLaw law;
};

struct Driver {
  std::string name;
  int point = 0, axis = 0;
  TimeLaw law;
};

struct Cost {
  int point = 0, axis = 0;
  bool rate = false;  // of the velocity instead of the position
  bool terminal = false;
  double weight = 1, target = 0;
  double from = 0;  // a running cost that counts from then on
};

/// A number that varies: what it is, and of which element.
struct Parameter {
  enum class Kind {
    stiffness,
    natural_length,
    damping,
    bar_length,
    bar_mass,
    point_mass,
    force,
    force_time,  // axis 0: t1, 1: t2
    cost_time,
    position,
    velocity,
    gravity
  };
  Kind kind = Kind::stiffness;
  int element = 0, axis = 0;
};

struct Truss {
  double gravity[2] = {0, -9.81};
  std::vector<Point> points;
  std::vector<Bar> bars;
  std::vector<Spring> springs;
  std::vector<Force> forces;
  std::vector<Driver> drivers;
  std::vector<Cost> costs;
  std::vector<Parameter> parameters;
  double t_end = 1;
  bool redundant = false;  // holds a bar twice

  double& number(const Parameter& p);
  double number(const Parameter& p) const { return const_cast<Truss*>(this)->number(p); }
  std::string path(const Parameter& p) const;
  /// The size by which a change of the parameter is measured.
  double scale(const Parameter& p) const;

  std::string scene() const;

  Truss mirrored() const;              // x -> -x
  Truss turned() const;                // by a quarter: (x, y) -> (-y, x)
  Truss renamed() const;               // other names, elements in another order
  std::vector<Truss> smaller() const;  // each with one thing less, for shrinking
};

/// The mechanism of a seed.
Truss random_truss(std::uint64_t seed);
/// The same with forces and costs that are switched at times, which are parameters.
Truss switched_truss(std::uint64_t seed);

}  // namespace costate::adversary
