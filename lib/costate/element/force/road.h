// The ground that tyres roll on: a height z over x and time, with its slope z_x and its rate z_t, for every
// scalar type that the tyres' physics is compiled for.
//   flat     z = h
//   profile  z = c r(y / ramp) f(y),  y = x - offset
//   post     z = c r(s / ramp) f(speed s),  s = t - delay: a plate under the wheel that moves up and down
// f is any law, r a smooth step from 0 to 1 (where a ramp is given). c and offset or delay belong to the
// tyre: the other side of an axle may see the profile negated, the rear axle sees it later.
#pragma once

#include <memory>
#include <vector>

#include "costate/element/course.h"
#include "costate/element/law/motion_law.h"
#include "costate/element/law/scalar_law.h"
#include "costate/element/shared_part.h"

namespace costate {

/// f(x) and f'(x) of a law, both with all derivatives that S carries.
inline void law_with_slope(const ScalarLaw& f, double x, const double* p, double& y, double& y_x) {
  const Dual<1> r = f.slope(x, p);
  y = r.v;
  y_x = r.d[0];
}
template <int N>
void law_with_slope(const ScalarLaw& f, const Dual<N>& x, const double* p, Dual<N>& y, Dual<N>& y_x) {
  const Taylor2 r = f.curve(x.v, p);
  y = chain(x, r.c0, r.c1);
  y_x = chain(x, r.c1, r.c2);
}
void law_with_slope(const ScalarLaw& f, const PathDual& x, const PathDual* p, PathDual& y, PathDual& y_x);

/// 10 s^3 - 15 s^4 + 6 s^5 between 0 and 1, and its slope.
template <class S>
void smooth_unit_step(const S& s, S& r, S& r_s) {
  const double at = value_of(s);
  r_s = S(0.0);
  r = S(at < 0.5 ? 0.0 : 1.0);
  if (!(at > 0 && at < 1)) return;
  r = s * s * s * (S(10.0) - S(15.0) * s + S(6.0) * s * s);
  r_s = S(30.0) * s * s * (S(1.0) - s) * (S(1.0) - s);
}

template <class S>
struct RoadPoint {
  S z{}, slope{}, rate{};  // m, 1, m/s
};

class Road final : public SharedPart {
 public:
  enum class Kind { flat, profile, post };

  /// numbers: of a flat road its height; else [speed of a post that has one], [ramp, if any], those of the
  /// law.
  Road(Kind kind, std::shared_ptr<const ScalarLaw> law, bool has_speed, bool has_ramp, std::vector<int> numbers)
      : kind_(kind), law_(std::move(law)), has_speed_(has_speed), has_ramp_(has_ramp), numbers_(std::move(numbers)) {}

  Kind kind() const { return kind_; }
  /// Whether the ground is level everywhere (it may still move).
  bool level() const { return kind_ != Kind::profile; }
  const std::vector<int>& numbers() const { return numbers_; }

  /// At a place x; `factor` and `shift` (m of a profile, s of a post) are the tyre's.
  template <class S, class P>
  RoadPoint<S> at(const S& t, const S& x, const P& factor, const P& shift, const P* p) const {
    RoadPoint<S> r;
    if (kind_ == Kind::flat) {
      r.z = S(p[0]);
      return r;
    }
    const S at = (kind_ == Kind::post ? t : x) - S(shift);
    S scale(1.0), step(1.0), step_slope(0.0), y, y_x;
    if (has_speed_) scale = S(*p++);
    if (has_ramp_) {
      const S length(*p++);
      smooth_unit_step(at / length, step, step_slope);
      step_slope /= length;
    }
    law_with_slope(*law_, has_speed_ ? at * scale : at, p, y, y_x);
    r.z = S(factor) * step * y;
    (kind_ == Kind::post ? r.rate : r.slope) = S(factor) * (step * scale * y_x + step_slope * y);
    return r;
  }

  const ScalarLaw* law() const { return law_.get(); }
  /// Of the law's numbers among the road's.
  int law_numbers() const { return (has_speed_ ? 1 : 0) + (has_ramp_ ? 1 : 0); }
  bool has_ramp() const { return has_ramp_; }
  /// A profile's height and its slope, of the ramp on, where there is one; `first`: of the road's numbers among the
  /// element's.
  void add_motion_laws(int first, std::vector<MotionLaw>& laws) const;
  /// The times at which a post's height or its rate jumps, with the tyre's shift; none of other roads.
  void add_post_jumps(double shift, const double* p, std::vector<double>& times) const;
  /// Those at which the rate of its rate jumps, where numbers decide when.
  void add_post_bends(double shift, const double* p, std::vector<double>& times) const;
  /// by_shift and slopes (one a number of the road) gain how such a time t moves with them.
  void add_post_slopes(double t, double shift, const double* p, double& by_shift, double* slopes) const;

  /// What is on it along time (a post) or along x (a profile), with the tyre's shift.
  void add_course(double shift, const double* p, Course& course) const {
    const double speed = has_speed_ ? *p++ : 1;
    if (has_ramp_) {
      course.add_look(shift, shift + *p, *p / 4);
      ++p;
    }
    if (kind_ != Kind::flat) course.add(*law_, p, shift, speed);
  }

 private:
  /// The first t in floating point at which the law's argument, as at() makes it, has reached x.
  double post_time(double x, double shift, const double* p) const;

  Kind kind_;
  std::shared_ptr<const ScalarLaw> law_;
  bool has_speed_, has_ramp_;
  std::vector<int> numbers_;
};

}  // namespace costate
