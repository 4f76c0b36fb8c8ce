// psi with weights of the return, of the period and of the travel, as the cost of one run (return_map.h).
#include <fmt/format.h>

#include <cmath>

#include "costate/base/error.h"
#include "costate/cycle/return_map.h"

namespace costate {

namespace {

// Part of a cycle before its end in which no event but that of the section may happen.
constexpr double kBeforeEnd = 1e-6;

/// Sum of weight times output.
class WeightedOutputs final : public CostTerm {
 public:
  std::vector<std::pair<double, std::shared_ptr<const Output>>> parts;

  double value(const StateView& s, Assembly& assembly) const override {
    double sum = 0;
    for (const auto& [weight, output] : parts) sum += weight * output->value(s, assembly);
    return sum;
  }
  void add_gradient(const StateView& s, Assembly& assembly, double factor, ScalarGradient& g) const override {
    for (const auto& [weight, output] : parts) output->add_gradient(s, assembly, factor * weight, g);
  }
  bool needs_accelerations() const override { return false; }
  void add_gradient_change(const StateView& s, Assembly& assembly, const Variation& d,
                           ScalarGradient& g) const override {
    for (const auto& [weight, output] : parts) output->add_gradient_change(s, assembly, d, weight, g);
  }
  double change(const StateView& s, Assembly& assembly, const Variation& d) const override {
    double sum = 0;
    for (const auto& [weight, output] : parts) sum += weight * output->change(s, assembly, d);
    return sum;
  }
};

}  // namespace

ReturnMap::RunOfWeights ReturnMap::run_of_weights(const Eigen::VectorXd& x, const std::vector<double>& positions,
                                                  bool vary_x, bool with_psi, const MapValue& value,
                                                  const CycleWeights& of, std::vector<double>& values) const {
  const int np = parameters(), d = section_.size();
  RunOfWeights r;
  Problem& p = r.problem = problem_at(x, positions, vary_x, np, values);
  if (!with_psi) p.objective.running.clear();
  if (!with_psi) p.objective.terminal.clear();
  std::vector<const SectionCoordinate*> read;
  for (const auto& c : section_.coordinates()) read.push_back(&c);
  const bool carries = section_.carried().coordinate >= 0;
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(d + (carries ? 1 : 0));
  weights.head(d) = of.next;
  const double angle = this->angle(np, r.angle_rho);
  if (const int c = section_.travelling(); c >= 0 || carries) {
    r.by_travel = of.travel;
    for (int i = 0; i < d; ++i) {
      const int along = read[static_cast<std::size_t>(i)]->along;
      r.by_travel -= of.next[i] * along_way(along, angle);
      r.by_turn -= of.next[i] * along_way_angle(along, angle);
    }
    const int along = carries ? section_.carried().along : read[static_cast<std::size_t>(c)]->along;
    weights[carries ? d : c] += r.by_travel / along_way(along, angle);
    r.turn = along_way_angle(along, angle) / along_way(along, angle);
    if (carries) r.by_start = -r.by_travel / along_way(along, angle);
  }
  const auto term = std::make_shared<WeightedOutputs>();
  const auto time = weights.size();
  double kappa = of.time * value.kappa[time] + (with_psi ? value.kappa[time + 1] : 0);
  // First derivatives of a run to a fixed time need kappa alone.
  if (vary_x && of.time != 0 && section_.end()) term->parts.emplace_back(of.time, make_output(*p.mechanism, "time"));
  for (Eigen::Index i = 0; i < weights.size(); ++i) {
    if (weights[i] == 0) continue;
    term->parts.emplace_back(weights[i], i < d ? read[static_cast<std::size_t>(i)]->at_end : section_.carried().at_end);
    kappa += weights[i] * value.kappa[i];
  }
  p.objective.terminal.push_back(term);
  if (section_.end()) {
    p.objective.terminal.push_back(end_term(*section_.end(), kappa));
    p.solver.t_end = p.solver.t_start + value.time;
    // What ends the cycle is not crossed by this run, whose own errors would decide whether it is.
    p.solver.events_until = p.solver.t_end - kBeforeEnd * value.time;
    for (std::size_t k = 0; k + 1 < value.events.size(); ++k)
      if (value.events[k].t >= p.solver.events_until)
        throw SolverError(
            fmt::format("'{}' happens at t = {:.9g} s, at the section itself ({:.9g} s): an adjoint cannot tell one "
                        "from the other. "
                        "Take a forward method, or another section.",
                        value.events[k].name, value.events[k].t, p.solver.t_end));
  }
  return r;
}

Problem ReturnMap::linear_problem(const Eigen::VectorXd& x, const std::vector<double>& positions, const MapValue& value,
                                  const CycleWeights& of, std::vector<double>& values, Eigen::VectorXd& more) const {
  const RunOfWeights r = run_of_weights(x, positions, false, true, value, of, values);
  // What x_c and the angle of e do by themselves.
  more = (r.by_turn - r.by_travel * r.turn) * value.travel * r.angle_rho.transpose();
  if (r.by_start != 0) {
    Eigen::RowVectorXd begins;
    carried_start(r.problem, values, &begins);
    more += r.by_start * begins.head(parameters()).transpose();
  }
  return r.problem;
}

}  // namespace costate
