// Drives the distance between two points, planar or of space: phi = d.d - f(t)^2 [m^2] (a hydraulic ram of
// given stroke). Numbers: those of the points, then those of the law f [m].
#pragma once

#include "costate/element/course.h"
#include "costate/element/element.h"
#include "costate/element/law/scalar_law.h"
#include "costate/element/point/planar_vector.h"
#include "costate/element/point/spatial_vector.h"

namespace costate {

template <class Line>
class DistanceDriver final : public ConstraintOf<DistanceDriver<Line>>, public CourseElement {
  static constexpr int dim = Line::Vector::RowsAtCompileTime;
  using Vector = typename Line::Vector;

 public:
  DistanceDriver(std::string kind, std::string name, Line d, std::shared_ptr<const ScalarLaw> law,
                 const std::vector<int>& law_numbers)
      : ConstraintOf<DistanceDriver<Line>>(std::move(kind), std::move(name)), d_(std::move(d)), law_(std::move(law)) {
    this->append_coordinates(d_.coordinates());
    this->append_numbers(d_.numbers());
    this->append_numbers(law_numbers);
  }
  int rows() const override { return 1; }
  std::string row_name(int) const override { return "length"; }
  bool rheonomic() const override { return true; }
  void add_kinks(const double* p, std::vector<double>& times) const override {
    law_->add_kinks(p + d_.number_count(), times);
  }
  void add_acceleration_jumps(const double* p, std::vector<double>& times) const override {
    law_->add_curvature_jumps(p + d_.number_count(), times);
  }
  void add_third_jumps(const double* p, std::vector<double>& times) const override {
    law_->add_third_jumps(p + d_.number_count(), times);
  }
  void add_time_slopes(double t, const double* p, double* slopes) const override {
    law_->add_place_slopes(t, p + d_.number_count(), slopes + d_.number_count());
  }
  void add_course(const double* p, Course& course) const override { course.add(*law_, p + d_.number_count()); }

  template <class S>
  void physics(const S& t, const S* q, const S* p, S* phi) const {
    S d[dim];
    d_.value(q, p, d);
    const S f = law_->value(t, p + d_.number_count());
    phi[0] = d[0] * d[0] - f * f;
    for (int i = 1; i < dim; ++i) phi[0] += d[i] * d[i];
  }
  bool by_hand() const override { return true; }
  void calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const override {
    phi_q.noalias() = 2 * value(s).transpose() * d_.jacobian(s.q, s.p);
  }
  void calc_phi_t(const LocalState& s, double* phi_t) const override {
    const Taylor2 f = length(s);
    phi_t[0] = -2 * f.c0 * f.c1;
  }
  void calc_bias(const LocalState& s, double* bias) const override {
    const double zero[Line::kMax] = {};
    const Taylor2 f = length(s);
    bias[0] =
        2 * (rate(s).squaredNorm() + value(s).dot(d_.acceleration(s.q, s.v, zero, s.p)) - f.c1 * f.c1 - f.c0 * f.c2);
  }
  void calc_hessian(const LocalState& s, LocalMatrix& hessian) const override {
    const auto J = d_.jacobian(s.q, s.p);
    hessian.noalias() = 2 * s.lambda[0] * J.transpose() * J;
    d_.add_curvature(s.q, s.p, 2 * s.lambda[0] * value(s), hessian);
  }
  /// The stroke does not depend on q: as for a distance that is kept.
  void calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                     LocalMatrix& phidd_q) const override {
    calc_hessian(s, hessian);
    const Vector d = value(s), dv = rate(s), da = d_.acceleration(s.q, s.v, s.a, s.p);
    const auto J = d_.jacobian(s.q, s.p), Jv = d_.jacobian_dot(s.q, s.v, s.p);
    phid_q.noalias() = 2 * (dv.transpose() * J + d.transpose() * Jv);
    phidd_q.noalias() = 2 * (da.transpose() * J + 2 * dv.transpose() * Jv +
                             d.transpose() * d_.acceleration_partial(s.q, s.v, s.a, s.p));
  }

  /// The force that pushes the points apart, and the power that it gives to the mechanism.
  std::vector<Measure> measures() const override { return {{"force", "N", true}, {"power", "W", true}}; }
  PathDual measure(int i, const MeasureArguments& x) const override {
    PathDual d[dim], r[dim], squared(0.0), product(0.0);
    d_.value(x.q, x.p, d);
    d_.rate(x.q, x.v, x.p, r);
    for (int k = 0; k < dim; ++k) {
      squared += d[k] * d[k];
      product += d[k] * r[k];
    }
    return -2.0 * x.lambda[0] * (i == 0 ? sqrt(squared) : product);
  }

 private:
  Vector value(const LocalState& s) const {
    Vector d;
    d_.value(s.q, s.p, d.data());
    return d;
  }
  Vector rate(const LocalState& s) const {
    Vector d;
    d_.rate(s.q, s.v, s.p, d.data());
    return d;
  }
  Taylor2 length(const LocalState& s) const { return law_->curve(s.t, s.p + d_.number_count()); }

  Line d_;
  std::shared_ptr<const ScalarLaw> law_;
};

extern template class DistanceDriver<PlanarVector>;
extern template class DistanceDriver<SpatialVector>;

}  // namespace costate
