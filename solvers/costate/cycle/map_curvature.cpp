// Second derivatives of the return by Hessian products of runs whose cost is u^T P (return_map.h), lib/README.md
// (18.8).
#include <fmt/format.h>

#include "costate/base/error.h"
#include "costate/cycle/return_map.h"
#include "costate/hessian/hessian_products.h"

namespace costate {

namespace {
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
}  // namespace

std::string ReturnMap::curvature_formulation() const {
  const Formulation& own = find_formulation(problem_.formulation);
  if (own.make_hessian) return own.name;
  // Whose motion is the same but for its tolerance.
  for (const Formulation* f : stand_ins(own.carries_redundancy))
    if (f->make_hessian) return f->name;
  return own.name;
}

MatrixXd ReturnMap::curvature_once(const VectorXd& x, const std::vector<double>& positions, const MapValue& value,
                                   const VectorXd& u, const MatrixXd& w, Counters& counters) const {
  const int d = section_.size(), np = parameters();
  CycleWeights weights;
  weights.next = u;
  std::vector<double> values;
  const RunOfWeights of = run_of_weights(x, positions, true, value, weights, values);
  if (of.by_start != 0)
    throw CapabilityError(
        fmt::format("What travels ('{}') is no position that [start] gives: how it begins is not differentiated twice.",
                    section_.settings().travel));
  Problem p = of.problem;
  p.formulation = curvature_formulation();
  p.solver.integrator = "cvodes";
  MatrixXd along = MatrixXd::Zero(static_cast<Index>(values.size()), w.cols());
  along.topRows(d) = w;
  const std::optional<EndEvent> end = section_.end() ? std::optional(*section_.end()) : std::nullopt;
  const HessianProducts products = hessian_products_until(p, end, values, along);
  counters += products.counters;
  MatrixXd r = products.products.topRows(d + np);
  // With s = (P_c - x_c)/e_c and e of an angle that parameters turn.
  if (of.by_travel != 0 || of.by_turn != 0)
    r.bottomRows(np) += of.angle_rho.transpose() * (value.travel_x * w) * (of.by_turn - of.by_travel * of.turn);
  return r;
}

MatrixXd ReturnMap::curvature(const VectorXd& x, const std::vector<double>& positions, const VectorXd& u,
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
  MatrixXd sum = MatrixXd::Zero(d + np, w.cols());
  VectorXd weights = u;
  for (auto part = parts.rbegin(); part != parts.rend(); ++part) {
    const MatrixXd own = curvature_once(part->x, part->positions, part->value, weights, part->w, counters);
    sum += part->by.transpose() * own.topRows(d);
    sum.bottomRows(np) += own.bottomRows(np);
    weights = (part->value.next_x.transpose() * weights).eval();
  }
  return sum;
}

}  // namespace costate
