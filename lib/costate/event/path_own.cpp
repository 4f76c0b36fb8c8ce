// Of the courses of functions along a step (path_course.h): how often what a user wrote is looked at, and what impulse
// nothing feels.
#include <algorithm>
#include <cmath>

#include "costate/event/path_course.h"

namespace costate {

namespace {
constexpr double kLooksInPart = 9;  // of a step, as path_course.cpp has them
// Of the integrator's absolute tolerance of a velocity, times the least inertia that a force acts on, and of that of
// psi, whose weights are not known here.
constexpr double kUnfelt = 1e-3, kUnfeltCost = 1e-5;
}  // namespace

PathCourse::PathCourse(const Element& element, std::vector<int> coordinates, OwnValue value, double often)
    : element_(&element), own_(std::move(value)), often_(often), search_(true), coordinates_(std::move(coordinates)) {}

int PathCourse::parts_of_own() {
  if (!asks_for_time_) {
    const StateView s = motion_->at(0, coordinates_);
    asks_for_time_ = asks_for_time(own_, s, *assembly_);
  }
  const bool same = !(high_ > low_);
  const double looks = *asks_for_time_ || same ? often_ * (motion_->to() - motion_->from()) : 0;
  return static_cast<int>(std::ceil(std::clamp(looks / kLooksInPart, 1.0, 1e6)));
}

double PathCourse::unfelt_impulse() const {
  const double tolerance = motion_->tolerance(0);
  if (element_->coordinates().empty()) return kUnfeltCost * tolerance;  // the definition of an output
  double least = std::numeric_limits<double>::infinity();
  for (const int c : element_->coordinates()) {
    const auto at = assembly_->square().find(c, c);
    least = std::min(least, at < 0 ? 0 : assembly_->M[static_cast<std::size_t>(at)]);
  }
  return kUnfelt * tolerance * std::max(least, 0.0);
}

}  // namespace costate
