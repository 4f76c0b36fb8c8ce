// A force at a point of space and a couple on a rigid body, each with three components as laws of time, in
// the ground's frame or turning with a body. A couple can act between two bodies: on the second, its reaction
// on the first.
#pragma once

#include <array>
#include <memory>

#include "costate/element/course.h"
#include "costate/element/element.h"
#include "costate/element/law/scalar_law.h"
#include "costate/element/point/spatial_point.h"

namespace costate {

/// Three laws of time; their numbers follow one another.
struct VectorLaw {
  std::array<std::shared_ptr<const ScalarLaw>, 3> component;

  int number_count() const {
    return component[0]->number_count() + component[1]->number_count() + component[2]->number_count();
  }
  template <class S>
  void operator()(const S& t, const S* p, S* out) const {
    for (std::size_t k = 0; k < 3; ++k) {
      out[k] = component[k]->value(t, p);
      p += component[k]->number_count();
    }
  }
  void add_course(const double* p, Course& course) const {
    for (const auto& f : component) {
      course.add(*f, p);
      p += f->number_count();
    }
  }
};

enum class ForceFrame { ground, body };

/// Numbers: those of the laws, then those of the point.
class SpatialPointForce : public ForceOf<SpatialPointForce>, public CourseElement {
 public:
  SpatialPointForce(std::string name, SpatialPoint point, VectorLaw law, const std::vector<int>& law_numbers,
                    ForceFrame frame);

  template <class S>
  void physics(const S& t, const S* q, const S*, const S*, const S* p, S* Q, S*) const {
    S f[3], turned[3];
    law_(t, p, f);
    if (frame_ == ForceFrame::body) rotated(q + SpatialPoint::curvature_index, f, turned);
    point_.add_generalized_force(q, p + law_.number_count(), frame_ == ForceFrame::body ? turned : f, Q);
  }
  void add_course(const double* p, Course& course) const override { law_.add_course(p, course); }
  bool by_hand() const override { return true; }
  void calc_partials(const LocalState& s, ForcePartials out) const override;
  /// Along the ground's axes; the power is what it gives to the mechanism.
  std::vector<Measure> measures() const override {
    return {{"force_x", "N", false}, {"force_y", "N", false}, {"force_z", "N", false}, {"power", "W", false}};
  }
  PathDual measure(int i, const MeasureArguments& x) const override;

 private:
  SpatialPoint point_;
  VectorLaw law_;
  ForceFrame frame_;
};

/// A couple M on the last body, -M on the first of two: Q = 2 E^T M, or 2 G^T M with components in the first
/// body's frame (of two, else the only one's). Coordinates: e0, e1, e2, e3 of each body. Numbers: those of
/// the laws.
class SpatialCouple : public ForceOf<SpatialCouple>, public CourseElement {
 public:
  SpatialCouple(std::string name, const std::vector<int>& rotations, VectorLaw law, const std::vector<int>& law_numbers,
                ForceFrame frame);

  template <class S>
  void physics(const S& t, const S* q, const S*, const S*, const S* p, S* Q, S*) const {
    S m[3], ground[3];
    law_(t, p, m);
    const bool two = coordinates().size() == 8;
    if (frame_ == ForceFrame::ground)
      for (int k = 0; k < 3; ++k) ground[k] = m[k];
    else
      rotated(q, m, ground);
    add_moment(q + (two ? 4 : 0), ground, 2, Q + (two ? 4 : 0));
    if (two) add_moment(q, ground, -2, Q);
  }
  void add_course(const double* p, Course& course) const override { law_.add_course(p, course); }
  bool by_hand() const override { return true; }
  void calc_partials(const LocalState& s, ForcePartials out) const override;
  /// On the last body, along the ground's axes; the power is what it gives to the mechanism.
  std::vector<Measure> measures() const override {
    return {{"torque_x", "N m", false}, {"torque_y", "N m", false}, {"torque_z", "N m", false}, {"power", "W", false}};
  }
  PathDual measure(int i, const MeasureArguments& x) const override;

 private:
  /// out += factor E(p)^T m.
  template <class S>
  static void add_moment(const S* p, const S* m, double factor, S* out) {
    S exm[3];
    cross3(p + 1, m, exm);
    out[0] -= S(factor) * dot3(p + 1, m);
    for (int i = 0; i < 3; ++i) out[1 + i] += S(factor) * (p[0] * m[i] - exm[i]);
  }

  VectorLaw law_;
  ForceFrame frame_;
};

}  // namespace costate
