// Second derivatives of the return by Hessian products of runs whose cost is u^T P (return_map.h), lib/README.md
// (18.8).
#include "costate/base/error.h"
#include "costate/cycle/return_map.h"
#include "costate/hessian/hessian_products.h"

namespace costate {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

std::string ReturnMap::curvature_formulation() const {
  const Formulation& own = find_formulation(problem_.formulation);
  if (own.make_hessian) return own.name;
  // Whose motion is the same but for its tolerance.
  for (const Formulation* f : stand_ins(own.carries_redundancy))
    if (f->make_hessian) return f->name;
  return own.name;
}

MatrixXd ReturnMap::products_of_run(const RunOfWeights& of, const std::vector<double>& values, const MapValue& value,
                                    double by_travel, const MatrixXd& along, Counters& counters) const {
  const int d = section_.size(), np = parameters();
  Problem p = of.problem;
  p.formulation = curvature_formulation();
  p.solver.integrator = "cvodes";
  MatrixXd all = MatrixXd::Zero(static_cast<Index>(values.size()), along.cols());
  all.topRows(d + np) = along;
  const std::optional<EndEvent> end = section_.end() ? std::optional(*section_.end()) : std::nullopt;
  VectorXd start_weights;
  if (of.by_start != 0) {
    start_weights.setZero(p.mechanism->coordinate_count());
    start_weights[section_.carried().coordinate] = of.by_start;
  }
  const HessianProducts products = hessian_products_until(p, end, values, all, start_weights);
  counters += products.counters;
  MatrixXd r = products.products.topRows(d + np);
  // e turns with the parameters: with k = B' - B e'/e, B = l - sum of u_i e_i, the second derivatives of B s gain
  // k (angle_x s_x + s_x angle_x) + l s angle_x angle_x.
  Eigen::RowVectorXd s(d + np), angle = Eigen::RowVectorXd::Zero(d + np);
  s << value.travel_x, value.travel_rho;
  if (of.angle_rho.size() == np) angle.tail(np) = of.angle_rho;
  if (angle.isZero(0)) return r;
  const double k = of.by_turn - of.by_travel * of.turn;
  r += k * (angle.transpose() * (s * along) + s.transpose() * (angle * along)) +
       by_travel * value.travel * angle.transpose() * (angle * along);
  return r;
}

MatrixXd ReturnMap::curvature_once(const VectorXd& x, const std::vector<double>& positions, const MapValue& value,
                                   const VectorXd& u, const MatrixXd& w, Counters& counters) const {
  CycleWeights weights;
  weights.next = u;
  std::vector<double> values;
  const RunOfWeights of = run_of_weights(x, positions, true, false, value, weights, values);
  MatrixXd along = MatrixXd::Zero(section_.size() + parameters(), w.cols());
  along.topRows(section_.size()) = w;
  return products_of_run(of, values, value, 0, along, counters);
}

MatrixXd ReturnMap::second_products(const VectorXd& x, const std::vector<double>& positions, const MapValue& value,
                                    const CycleWeights& of, const MatrixXd& along, Counters& counters) const {
  if (section_.settings().count > 1)
    throw CapabilityError("A cycle that is several returns (count) has no second derivatives of psi.");
  std::vector<double> values;
  const RunOfWeights run = run_of_weights(x, positions, true, true, value, of, values);
  return products_of_run(run, values, value, of.travel, along, counters);
}

std::vector<MatrixXd> ReturnMap::curvature(const VectorXd& x, const std::vector<double>& positions, const MatrixXd& u,
                                           const MatrixXd& w, Counters& counters) const {
  const int d = section_.size(), np = parameters(), count = section_.settings().count;
  // Of several returns, u^T P_N(... P_1(x)), each has its own weights and directions.
  struct Part {
    VectorXd x;
    std::vector<double> positions;
    MapValue value;
    MatrixXd by, w;  // of x by the first one's x and rho; of the directions
  };
  std::vector<Part> parts;
  MatrixXd by = MatrixXd::Identity(d, d + np), directions = w;
  VectorXd at = x;
  std::vector<double> guesses = positions;
  for (int k = 1; k <= count; ++k) {
    const MapValue v = once(at, guesses, MapDerivatives::all, k == count);
    counters += v.counters;
    parts.push_back({at, guesses, v, by, directions});
    by = (v.next_x * by).eval();
    by.rightCols(np) += v.next_rho;
    directions = (v.next_x * directions).eval();
    at = v.next;
    guesses = v.positions;
  }
  std::vector<MatrixXd> all;
  for (Index k = 0; k < u.cols(); ++k) {
    MatrixXd& sum = all.emplace_back(MatrixXd::Zero(d + np, w.cols()));
    VectorXd weights = u.col(k);
    for (auto part = parts.rbegin(); part != parts.rend(); ++part) {
      const MatrixXd own = curvature_once(part->x, part->positions, part->value, weights, part->w, counters);
      sum += part->by.transpose() * own.topRows(d);
      sum.bottomRows(np) += own.bottomRows(np);
      weights = (part->value.next_x.transpose() * weights).eval();
    }
  }
  return all;
}

}  // namespace costate
