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

Couple::Couple(std::string name, const std::vector<int>& coordinates, std::shared_ptr<const ScalarLaw> torque,
               const std::vector<int>& law_numbers)
    : ForceOf("couple", std::move(name)), torque_(std::move(torque)) {
  append_coordinates(coordinates);
  append_numbers(law_numbers);
}

}  // namespace costate
