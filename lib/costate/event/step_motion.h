// The motion over a step of an integrator, for many looks at it: positions, velocities and force states at any part of
// it, by polynomials through few states of its dense output, which for some formulations costs the solution of
// equations. Each piece has three of them, and from these
//   q: the polynomial of degree 5 that has their positions and velocities,
//   v: its rate, or the parabola where the two differ by no more than the integrator's error, as they do in short
//   steps, z: the parabola.
// A piece is halved where the cubic through its ends is off in its middle by a part of what the step travels: what the
// polynomial of degree 5 is off by is less than a thousandth of that.
#pragma once

#include <cmath>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/event/gap_trace.h"

namespace costate {

/// How fast these coordinates, or what they are the direction of, turn at most with the velocities v (n), rad/s; null:
/// all coordinates.
double turning_speed(const Mechanism& mechanism, const std::vector<int>* coordinates, const double* v);

class StepMotion {
 public:
  /// Positions are rounding to atol + rtol |q|.
  StepMotion(const Mechanism& mechanism, double rtol, double atol);

  /// `at` gives the state at times of the step; asked for here, not later. A step that begins where the last one ended
  /// begins with its state.
  void take(double from, double to, const GapTrace::States& at);
  /// The next one does not: the motion may have jumped.
  void forget() { node_count_ = 0; }
  double from() const { return from_; }
  double to() const { return to_; }
  /// At a part u of the step, within [0, 1]; valid until it is called again, with q and v of these coordinates and z
  /// alone.
  const StateView& at(double u, const std::vector<int>& coordinates);

  /// The largest angle by which one of these coordinates, or what they are the direction of, turns over the step, rad.
  double turn(const std::vector<int>& coordinates) const;
  /// The largest of their positions and velocities, in whatever units, over the step.
  double size(const std::vector<int>& coordinates) const;
  /// What is rounding to the integrator of a position, or whatever else, of this size.
  double tolerance(double x) const { return atol_ + rtol_ * std::abs(x); }

 private:
  struct Node {
    double u = 0;
    std::vector<double> q, v, z;
  };
  struct Piece {
    std::size_t begin, middle, end;  // nodes
    std::vector<double> c;           // coefficients of each coordinate (6), velocity (5) and state (3), of u in it
  };
  std::size_t add(double u, const StateView& s);
  void divide(std::size_t begin, std::size_t end, int depth, const GapTrace::States& at);
  bool is_smooth(const Node& a, const Node& m, const Node& b) const;
  void fit(Piece& piece) const;

  const Mechanism& mechanism_;
  std::size_t n_, nz_;
  std::vector<double> angle_per_unit_;  // 0: of a length
  double rtol_, atol_;
  double from_ = 0, to_ = 0;
  std::vector<Node> nodes_;
  std::size_t node_count_ = 0, piece_count_ = 0;
  std::vector<Piece> pieces_;
  std::vector<double> q_, v_, z_;
  StateView here_;
};

}  // namespace costate
