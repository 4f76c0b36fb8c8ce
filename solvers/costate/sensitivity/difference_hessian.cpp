#include "costate/sensitivity/difference_hessian.h"

#include <algorithm>

#include "costate/problem/scaled_gradient.h"
#include "costate/record/jobs.h"
#include "costate/sensitivity/method.h"

namespace costate {

namespace {

using Eigen::Index;
using Eigen::VectorXd;

// Of a parameter's scale: gradients are known to some 1e-7 at the usual tolerances, which this leaves 1e-4 of, and what
// the extrapolation leaves is of the third order and more.
constexpr double kStep = 4e-3;

struct Column {
  VectorXd value, change;  // of the extrapolation
};

/// The derivative at 0 of f along one parameter, k being half a step.
template <class Gradient>
Column central(const Gradient& f, double k) {
  const VectorXd near = (f(k) - f(-k)) / (2 * k), far = (f(2 * k) - f(-2 * k)) / (4 * k);
  return {(4 * near - far) / 3, (near - far) / 3};
}
template <class Gradient>
Column one_sided(const Gradient& f, const VectorXd& here, double k) {
  const VectorXd a = f(k), b = f(2 * k), c = f(3 * k);
  const VectorXd third = (-11 * here + 18 * a - 9 * b + 2 * c) / (6 * k), second = (-3 * here + 4 * a - b) / (2 * k);
  return {third, third - second};
}

}  // namespace

Hessian hessian_by_differences(const Problem& problem, const std::string& method, const std::vector<double>& rho) {
  Problem p = problem;
  p.solver.confirm = false;
  const auto& parameters = problem.parameters.parameters;
  const auto n = static_cast<Index>(parameters.size());
  Hessian h;
  const GradientResult here = gradient(p, method, rho);
  h.counters += here.counters;
  h.psi = here.psi;
  h.gradient = here.gradient;
  const VectorXd scale = scales(problem.parameters);
  std::vector<Counters> spent(parameters.size());
  Eigen::MatrixXd H(n, n), change(n, n);
  for_each_job(parameters.size(), jobs(), [&](std::size_t column) {
    const auto j = static_cast<Index>(column);
    const Parameter& of = parameters[column];
    const double x = rho[column], below = x - of.lower, above = of.upper - x, room = std::max(below, above);
    double k = 0.5 * kStep * of.scale;
    if (2 * k > room && room > 0) k = room / 3;  // bounds are nearer than a step
    const auto moved = [&](double by) -> VectorXd {
      std::vector<double> other = rho;
      other[column] = x + by;
      const GradientResult r = gradient(p, method, other);
      spent[column] += r.counters;
      return Eigen::Map<const VectorXd>(r.gradient.data(), n);
    };
    const VectorXd g = Eigen::Map<const VectorXd>(here.gradient.data(), n);
    const bool down = below >= 2 * k, up = above >= 2 * k;
    const Column c = down == up ? central(moved, k) : one_sided(moved, g, up ? k : -k);
    H.col(j) = c.value;
    change.col(j) = c.change;
  });
  for (const Counters& c : spent) h.counters += c;
  h.matrix = 0.5 * (H + H.transpose());
  const double size = largest_scaled(scale, H);
  if (size == 0) return h;
  const double apart = largest_scaled(scale, H - H.transpose()), changed = largest_scaled(scale, change);
  h.asymmetry = std::max(apart, changed) / size;
  // Errors of gradients that have nothing to do with each other are three times larger in (4 near - far)/3 than in
  // (near - far)/3, which besides may be small by chance.
  h.error = std::max(apart, 4 * changed) / size;
  return h;
}

}  // namespace costate
