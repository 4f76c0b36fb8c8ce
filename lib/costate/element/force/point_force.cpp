#include "costate/element/force/point_force.h"

namespace costate {

PointForce::PointForce(std::string name, PlanarPoint point, std::shared_ptr<const ScalarLaw> x,
                       std::shared_ptr<const ScalarLaw> y, const std::vector<int>& law_numbers)
    : ForceOf("force", std::move(name)),
      point_(std::move(point)),
      x_(std::move(x)),
      y_(std::move(y)),
      law_number_count_(static_cast<int>(law_numbers.size())) {
  append_coordinates(point_.coordinates());
  append_numbers(law_numbers);
  append_numbers(point_.numbers());
}

void PointForce::calc_partials(const LocalState& s, ForcePartials out) const {
  if (point_.kind() != PlanarPoint::Kind::on_body) return;
  const Eigen::Vector2d f(x_->value(s.t, s.p), y_->value(s.t, s.p + x_->number_count()));
  constexpr int k = PlanarPoint::curvature_index;
  out.Q_q(k, k) = point_.curvature(s.q, s.p + law_number_count_, f);
}

PathDual PointForce::measure(int i, const MeasureArguments& x) const {
  const PathDual f[2] = {x_->value(x.t, x.p), y_->value(x.t, x.p + x_->number_count())};
  if (i < 2) return f[i];
  PathDual v[2];
  point_.velocity(x.q, x.v, x.p + law_number_count_, v[0], v[1]);
  return f[0] * v[0] + f[1] * v[1];
}

Couple::Couple(std::string name, const std::vector<int>& coordinates, std::shared_ptr<const ScalarLaw> torque,
               const std::vector<int>& law_numbers)
    : ForceOf("couple", std::move(name)), torque_(std::move(torque)) {
  append_coordinates(coordinates);
  append_numbers(law_numbers);
}

PathDual Couple::measure(int i, const MeasureArguments& x) const {
  const PathDual torque = torque_->value(x.t, x.p);
  if (i == 0) return torque;
  return torque * (coordinates().size() == 2 ? x.v[1] - x.v[0] : x.v[0]);
}

}  // namespace costate
