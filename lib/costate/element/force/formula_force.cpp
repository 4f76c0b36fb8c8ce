#include "costate/element/force/formula_force.h"

#include <fmt/format.h>

#include <algorithm>

#include "costate/base/error.h"

namespace costate {

FormulaForce::FormulaForce(std::string kind, std::string name, FormulaTarget target, std::vector<Component> components,
                           const std::vector<int>& numbers, const std::vector<int>& lag)
    : ForceOf(std::move(kind), std::move(name)),
      target_(std::move(target)),
      components_(std::move(components)),
      formula_numbers_(numbers.size()),
      lags_(!lag.empty()) {
  // The target's coordinates come first, so that they are its own in order.
  append_numbers(numbers);
  append_numbers(lag);
  target_numbers_ = static_cast<int>(this->numbers().size());
  if (const auto* angles = std::get_if<std::vector<int>>(&target_)) {
    append_coordinates(*angles);
  } else {
    std::visit(
        [&](const auto& points) {
          if constexpr (requires { points.numbers(); }) {
            append_coordinates(points.coordinates());
            append_numbers(points.numbers());
          }
        },
        target_);
  }
  for (const Component& c : components_) {
    auto& of = locals_.emplace_back();
    for (const FormulaInput& input : c.inputs) of.push_back(local(input));
    if (c.formula && (!of.empty() || c.formula->may_bend())) of_motion_.push_back(locals_.size() - 1);
  }
  if (coordinates().size() > static_cast<std::size_t>(kMaxLocal))
    throw ModelError(
        path(), fmt::format("Its formulas depend on {} coordinates, of {} at most.", coordinates().size(), kMaxLocal));
}

int FormulaForce::local_coordinate(int coordinate) {
  const auto& all = coordinates();
  const auto at = static_cast<int>(std::find(all.begin(), all.end(), coordinate) - all.begin());
  if (at == static_cast<int>(all.size())) append_coordinates({coordinate});
  return at;
}

FormulaForce::Local FormulaForce::local(const FormulaInput& input) {
  Local r{-1,
          input.rate,
          false,
          {},
          0,
          PlanarPoint(PlanarPoint::Kind::ground, "", {}, {}),
          SpatialPoint(SpatialPoint::Kind::ground, "", {}, {})};
  const auto of_point = [&](const auto& point) {
    r.component = input.component;
    for (const int c : point.coordinates()) r.at.push_back(local_coordinate(c));
    r.numbers = static_cast<int>(numbers().size());
    append_numbers(point.numbers());
  };
  if (const int* coordinate = std::get_if<int>(&input.of)) {
    r.at = {local_coordinate(*coordinate)};
  } else if (const auto* planar = std::get_if<PlanarPoint>(&input.of)) {
    r.planar = *planar;
    of_point(*planar);
  } else {
    r.spatial = true;
    r.in_space = std::get<SpatialPoint>(input.of);
    of_point(r.in_space);
  }
  return r;
}

void FormulaForce::add_course(const double* p, Course& course) const {
  // What positions and velocities will be is not known; at one the terms of the time are as large as by themselves.
  std::array<double, kMostNames> x;
  x.fill(1);
  std::copy(p, p + formula_numbers_, x.begin());
  for (std::size_t c = 0; c < components_.size(); ++c) {
    const FormulaLaw* formula = components_[c].formula.get();
    if (!formula || !formula->varies()) continue;
    // One of the time alone is a law of time with these numbers, like any other.
    if (locals_[c].empty())
      course.add(*formula, p);
    else
      course.add(GuessedFormula(*formula), x.data());
  }
}

void FormulaForce::add_formula_laws(std::vector<MotionLaw>& laws) const {
  for (const Component& c : components_)
    if (c.formula) add_laws_of(*c.formula, laws);
}

const FormulaLaw& FormulaForce::path_function(int i) const {
  return *components_[of_motion_[static_cast<std::size_t>(i)]].formula;
}

void FormulaForce::path_arguments(int i, const LocalState& s, double* x) const {
  arguments(of_motion_[static_cast<std::size_t>(i)], s.q, s.v, s.p, x);
}

void FormulaForce::coincident(const std::string& from, const std::string& to) const {
  throw ModelError(path(),
                   fmt::format("The end points '{}' and '{}' coincide, so that the force has no direction. Check "
                               "the attachment points or the start.",
                               from, to));
}

std::vector<Measure> FormulaForce::measures() const {
  const bool turns = std::holds_alternative<std::vector<int>>(target_);
  if (lags_ && turns)
    return {{"angle", "rad", false}, {"rate", "rad/s", false}, {"torque", "N m", false}, {"power", "W", false}};
  if (lags_) return {{"length", "m", false}, {"rate", "m/s", false}, {"force", "N", false}, {"power", "W", false}};
  if (std::holds_alternative<std::vector<int>>(target_)) return {{"torque", "N m", false}, {"power", "W", false}};
  std::vector<Measure> r = {{"force_x", "N", false}, {"force_y", "N", false}};
  if (std::holds_alternative<SpatialPoint>(target_)) r.push_back({"force_z", "N", false});
  r.push_back({"power", "W", false});
  return r;
}

/// f.v of what it acts on: what it gives to the mechanism.
template <class S>
S FormulaForce::power(const S& t, const S* q, const S* v, const S* p) const {
  S f[3], r[3];
  evaluate(t, q, v, p, f);
  if (const auto* angles = std::get_if<std::vector<int>>(&target_))
    return f[0] * (angles->size() == 2 ? v[1] - v[0] : v[0]);
  if (const auto* point = std::get_if<PlanarPoint>(&target_)) {
    point->velocity(q, v, p + target_numbers_, r[0], r[1]);
    return f[0] * r[0] + f[1] * r[1];
  }
  std::get<SpatialPoint>(target_).velocity(q, v, p + target_numbers_, r);
  return f[0] * r[0] + f[1] * r[1] + f[2] * r[2];
}

PathDual FormulaForce::measure_lag(int i, const MeasureArguments& x) const {
  PathDual length, rate, n[3];
  double sign = -1;  // of what a positive force does where the rate is positive
  if (const auto* angles = std::get_if<std::vector<int>>(&target_)) {
    const bool relative = angles->size() == 2;
    length = relative ? x.q[1] - x.q[0] : x.q[0];
    rate = relative ? x.v[1] - x.v[0] : x.v[0];
    sign = 1;
  } else if (const auto* line = std::get_if<PlanarVector>(&target_)) {
    geometry(*line, x.q, x.v, x.p, n, length, rate);
  } else {
    geometry(std::get<SpatialVector>(target_), x.q, x.v, x.p, n, length, rate);
  }
  if (i < 2) return i == 0 ? length : rate;
  return i == 2 ? x.z[0] : PathDual(sign) * x.z[0] * rate;
}

PathDual FormulaForce::measure(int i, const MeasureArguments& x) const {
  if (lags_) return measure_lag(i, x);
  if (i == static_cast<int>(FormulaForce::measures().size()) - 1) return power(x.t, x.q, x.v, x.p);
  PathDual f[3];
  evaluate(x.t, x.q, x.v, x.p, f);
  return f[i];
}

}  // namespace costate
