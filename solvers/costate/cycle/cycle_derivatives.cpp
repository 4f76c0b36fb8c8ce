#include "costate/cycle/cycle_derivatives.h"

#include <Eigen/LU>

namespace costate {

// (I - P_x) x_rho = P_rho, (I - P_x)^T l = psi_x^T, dpsi = psi_rho + l^T P_rho.
CycleDerivatives cycle_derivatives(const ReturnMap& map, const MapValue& v, const CycleValues& psi_values,
                                   const CycleValues& values) {
  const auto& free = map.section().free();
  const auto k = static_cast<Eigen::Index>(free.size());
  const auto own = Eigen::seqN(0, v.next_rho.cols() - (has_cycle_values(map.problem()) ? kCycleValues : 0));
  const Eigen::MatrixXd P_x = v.next_x(free, free), P_rho = v.next_rho(free, own);
  const Eigen::PartialPivLU<Eigen::MatrixXd> lu(Eigen::MatrixXd::Identity(k, k) - P_x);
  CycleDerivatives d;
  d.x.setZero(map.section().size(), P_rho.cols());
  d.x(free, Eigen::all) = Eigen::MatrixXd(lu.solve(P_rho));
  const auto on_cycle = [&](const Eigen::RowVectorXd& by_x, const Eigen::RowVectorXd& by_rho) -> Eigen::VectorXd {
    const Eigen::VectorXd of_free = by_x(free).transpose(), l = lu.transpose().solve(of_free);
    return by_rho(own).transpose() + P_rho.transpose() * l;
  };
  d.period = on_cycle(v.time_x, v.time_rho);
  d.travel = on_cycle(v.travel_x, v.travel_rho);
  d.psi = on_cycle(v.psi_x, v.psi_rho);
  const PeriodTravel by = by_period_and_travel(psi_values, values);
  d.psi += by.period * d.period + by.travel * d.travel;
  return d;
}

}  // namespace costate
