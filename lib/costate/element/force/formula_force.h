// Forces on a point and torques on angles that are formulas of positions, velocities, the time and numbers: gas
// pressure over a crank's angle, a controller, a map of the air's forces. An actuator's formula is a command, which its
// force F = z or torque follows with a lag: z' = (formula - z)/tau.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "costate/element/course.h"
#include "costate/element/element.h"
#include "costate/element/path_function.h"
#include "costate/element/point/planar_vector.h"
#include "costate/element/point/spatial_vector.h"

namespace costate {

/// Something that such a formula can depend on: a generalized coordinate, a component of a point, or its rate.
struct FormulaInput {
  std::variant<int, PlanarPoint, SpatialPoint> of;  // a coordinate of the mechanism, or a point
  int component = 0;                                // of a point
  bool rate = false;
};

/// What it acts on: {angle_j} against the ground or {angle_i, angle_j} as a couple does, a point, or the line
/// between two, which a positive force pulls together.
using FormulaTarget = std::variant<std::vector<int>, PlanarPoint, SpatialPoint, PlanarVector, SpatialVector>;

class FormulaForce : public ForceOf<FormulaForce>,
                     public CourseElement,
                     public PathFunctionElement,
                     public FormulaElement {
 public:
  static constexpr std::size_t kMostNames = 32;  // of numbers and inputs of one formula

  /// A component of the force or the torque: null where there is none; its formula's arguments are the numbers and,
  /// behind them, `inputs`.
  struct Component {
    std::shared_ptr<const FormulaLaw> formula;
    std::vector<FormulaInput> inputs;
  };
  /// `lag`: no number, or tau and z(0) where the formula, the only one, is a command. Throws ModelError where the
  /// formulas depend on more than kMaxLocal coordinates.
  FormulaForce(std::string kind, std::string name, FormulaTarget target, std::vector<Component> components,
               const std::vector<int>& numbers, const std::vector<int>& lag = {});

  int states() const override { return lags_ ? 1 : 0; }
  int initial_state_number(int) const override { return static_cast<int>(formula_numbers_) + 1; }
  std::string state_unit(int) const override { return std::holds_alternative<std::vector<int>>(target_) ? "N m" : "N"; }

  template <class S>
  void physics(const S& t, const S* q, const S* v, const S* z, const S* p, S* Q, S* zdot) const {
    S f[3];
    evaluate(t, q, v, p, f);
    if (lags_) {
      zdot[0] = (f[0] - z[0]) / p[formula_numbers_];
      f[0] = z[0];
    }
    if (const auto* angles = std::get_if<std::vector<int>>(&target_)) {
      Q[angles->size() - 1] += f[0];
      if (angles->size() == 2) Q[0] -= f[0];
    } else if (const auto* point = std::get_if<PlanarPoint>(&target_)) {
      point->add_generalized_force(q, p + target_numbers_, f, Q);
    } else if (const auto* in_space = std::get_if<SpatialPoint>(&target_)) {
      in_space->add_generalized_force(q, p + target_numbers_, f, Q);
    } else if (const auto* line = std::get_if<PlanarVector>(&target_)) {
      pull(*line, q, v, p, f[0], Q);
    } else {
      pull(std::get<SpatialVector>(target_), q, v, p, f[0], Q);
    }
  }
  void add_course(const double* p, Course& course) const override;
  void add_formula_laws(std::vector<MotionLaw>& laws) const override;
  int path_functions() const override { return static_cast<int>(of_motion_.size()); }
  const FormulaLaw& path_function(int i) const override;
  void path_arguments(int i, const LocalState& s, double* x) const override;

  std::vector<Measure> measures() const override;
  PathDual measure(int i, const MeasureArguments& x) const override;

 private:
  struct Local {
    int component;        // -1: the coordinate itself
    bool rate, spatial;   // of a point: whether it is one of space
    std::vector<int> at;  // local coordinates
    int numbers;          // of a point: its first local number
    PlanarPoint planar;   // where it is one of the plane
    SpatialPoint in_space;
  };
  Local local(const FormulaInput& input);
  int local_coordinate(int coordinate);

  /// The torque, or the components of the force.
  template <class S>
  void evaluate(const S& t, const S* q, const S* v, const S* p, S* f) const {
    std::array<S, kMostNames> x;
    for (std::size_t c = 0; c < 3; ++c) {
      f[c] = S(0.0);
      if (c >= components_.size() || !components_[c].formula) continue;
      arguments(c, q, v, p, x.data());
      f[c] = components_[c].formula->value(t, x.data());
    }
  }
  template <class S>
  void arguments(std::size_t c, const S* q, const S* v, const S* p, S* x) const {
    for (std::size_t k = 0; k < formula_numbers_; ++k) x[k] = p[k];
    for (std::size_t i = 0; i < locals_[c].size(); ++i) x[formula_numbers_ + i] = value(locals_[c][i], q, v, p);
  }
  template <class S>
  S value(const Local& input, const S* q, const S* v, const S* p) const {
    if (input.component < 0) return (input.rate ? v : q)[input.at[0]];
    S own_q[SpatialPoint::kMaxCoordinates], own_v[SpatialPoint::kMaxCoordinates], r[3];
    for (std::size_t i = 0; i < input.at.size(); ++i) {
      own_q[i] = q[input.at[i]];
      own_v[i] = v[input.at[i]];
    }
    const S* numbers = p + input.numbers;
    if (input.spatial) {
      if (input.rate)
        input.in_space.velocity(own_q, own_v, numbers, r);
      else
        input.in_space.position(own_q, numbers, r);
    } else if (input.rate) {
      input.planar.velocity(own_q, own_v, numbers, r[0], r[1]);
    } else {
      input.planar.position(own_q, numbers, r[0], r[1]);
    }
    return r[input.component];
  }
  /// Of the target's point or points.
  template <class S>
  const S* target_numbers(const S* p) const {
    return p + target_numbers_;
  }
  /// Length, rate and unit vector n of the line; throws where its ends coincide.
  template <class Line, class S>
  void geometry(const Line& d, const S* q, const S* v, const S* p, S* n, S& length, S& rate) const {
    using std::sqrt;
    constexpr int dim = Line::Vector::RowsAtCompileTime;
    S dv[dim], square(0.0);
    d.value(q, target_numbers(p), n);
    d.rate(q, v, target_numbers(p), dv);
    for (int i = 0; i < dim; ++i) square += n[i] * n[i];
    if (!(value_of(square) > 1e-24)) coincident(d.from().name(), d.to().name());
    length = sqrt(square);
    rate = S(0.0);
    for (int i = 0; i < dim; ++i) {
      n[i] = n[i] / length;
      rate += n[i] * dv[i];
    }
  }
  [[noreturn]] void coincident(const std::string& from, const std::string& to) const;
  /// Q -= d_q^T n F.
  template <class Line, class S>
  void pull(const Line& d, const S* q, const S* v, const S* p, const S& force, S* Q) const {
    constexpr int dim = Line::Vector::RowsAtCompileTime;
    S n[dim], back[dim], length, rate;
    geometry(d, q, v, p, n, length, rate);
    for (int i = 0; i < dim; ++i) {
      n[i] = n[i] * force;
      back[i] = -n[i];
    }
    const int size = d.from().size();
    d.from().add_generalized_force(q, target_numbers(p), n, Q);
    d.to().add_generalized_force(q + size, target_numbers(p) + d.from().numbers().size(), back, Q + size);
  }
  /// What an actuator reports: its angle or length, the rate, F and the power.
  PathDual measure_lag(int i, const MeasureArguments& x) const;
  template <class S>
  S power(const S& t, const S* q, const S* v, const S* p) const;

  FormulaTarget target_;
  std::vector<Component> components_;
  std::vector<std::vector<Local>> locals_;  // of each component's inputs
  std::vector<std::size_t> of_motion_;      // components with inputs or bends
  std::size_t formula_numbers_;             // behind them those of the lag
  bool lags_;
  int target_numbers_ = 0;  // first local number of the target's point
};

}  // namespace costate
