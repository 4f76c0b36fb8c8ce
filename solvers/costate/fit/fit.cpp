#include "costate/fit/fit.h"

#include <ceres/ceres.h>
#include <fmt/format.h>
#include <glog/logging.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <map>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/base/unsaid.h"
#include "costate/integrator/simulate.h"

namespace costate {

namespace {

/// All residuals of all problems over the union of their parameters.
class Residuals {
 public:
  explicit Residuals(const std::vector<Problem>& problems) : problems_(problems) {
    if (problems.empty()) throw Error("There is no problem to fit.");
    for (const Problem& p : problems) {
      std::vector<std::size_t> places;
      for (const Parameter& parameter : p.parameters.parameters) {
        const auto [found, is_new] = place_.try_emplace(parameter.name, parameters_.size());
        places.push_back(found->second);
        if (is_new) {
          parameters_.push_back(parameter);
          continue;
        }
        Parameter& of = parameters_[found->second];
        if (of.value != parameter.value)
          throw Error(
              fmt::format("The parameter '{}' starts at {} in one scene and at {} in another; it is one and the "
                          "same to the fit.",
                          of.name, of.value, parameter.value));
        of.lower = std::max(of.lower, parameter.lower);
        of.upper = std::min(of.upper, parameter.upper);
      }
      places_.push_back(places);
    }
    if (parameters_.empty())
      throw Error("There is no parameter to fit: list some in [run] parameters, or by --parameters.");
    for (const Parameter& p : parameters_)
      if (!(p.lower < p.upper))
        throw Error(
            fmt::format("The parameter '{}' has nowhere to go between its bounds {} and {}: leave it out of the "
                        "parameters, so that it stays at its value, or widen them.",
                        p.name, p.lower, p.upper));
  }

  const std::vector<Parameter>& parameters() const { return parameters_; }
  SampleResiduals at(const std::vector<double>& rho, bool derivatives) const {
    SampleResiduals all;
    for (std::size_t k = 0; k < problems_.size(); ++k) {
      std::vector<double> own;
      for (const std::size_t place : places_[k]) own.push_back(rho[place]);
      const SampleResiduals one = sample_residuals(problems_[k], own, derivatives);
      const Eigen::Index before = all.r.size();
      all.r.conservativeResize(before + one.r.size());
      all.r.tail(one.r.size()) = one.r;
      if (derivatives) {
        all.r_rho.conservativeResizeLike(
            Eigen::MatrixXd::Zero(before + one.r.size(), static_cast<Eigen::Index>(rho.size())));
        for (std::size_t j = 0; j < own.size(); ++j)
          all.r_rho.col(static_cast<Eigen::Index>(places_[k][j])).tail(one.r.size()) =
              one.r_rho.col(static_cast<Eigen::Index>(j));
      }
      for (const auto& term : one.terms) all.terms.push_back(fmt::format("{}:{}", k, term));
      all.times.insert(all.times.end(), one.times.begin(), one.times.end());
      all.counters += one.counters;
    }
    return all;
  }

 private:
  const std::vector<Problem>& problems_;
  std::map<std::string, std::size_t> place_;
  std::vector<Parameter> parameters_;
  std::vector<std::vector<std::size_t>> places_;  // of each problem's parameters among all
};

// In scales: so near a parameter is at its bound.
constexpr double kAtBound = 1e-6;
// Of the sum of squares: what a search that has not moved may have changed it by.
constexpr double kUnmoved = 1e-12;
// Of the tolerance, what the run that tells its errors has; and the tightest one.
constexpr double kTighter = 0.03, kTightest = 1e-13;

/// In parameters per scale, so that the method's norms mean something.
class Cost final : public ceres::CostFunction {
 public:
  Cost(const Residuals& residuals, int rows, const FitSink& sink, FitResult& result)
      : residuals_(residuals), sink_(sink), result_(result) {
    set_num_residuals(rows);
    mutable_parameter_block_sizes()->push_back(static_cast<int>(residuals.parameters().size()));
  }
  bool Evaluate(const double* const* x, double* r, double** r_x) const override {
    const auto& parameters = residuals_.parameters();
    std::vector<double> rho;
    for (std::size_t j = 0; j < parameters.size(); ++j) rho.push_back(x[0][j] * parameters[j].scale);
    ++result_.evaluations;
    try {
      const bool derivatives = r_x && r_x[0];
      const SampleResiduals at = residuals_.at(rho, derivatives);
      Eigen::Map<Eigen::VectorXd>(r, at.r.size()) = at.r;
      for (Eigen::Index j = 0; derivatives && j < at.r_rho.cols(); ++j)
        for (Eigen::Index i = 0; i < at.r_rho.rows(); ++i)
          r_x[0][i * at.r_rho.cols() + j] = at.r_rho(i, j) * parameters[static_cast<std::size_t>(j)].scale;
      result_.counters += at.counters;
      if (sink_) sink_(result_.evaluations, at.r.squaredNorm(), rho);
      return true;
    } catch (const SolverError&) {  // a shorter step may do
      ++result_.failed_evaluations;
      failure = std::current_exception();
    } catch (...) {
      other = std::current_exception();
    }
    return false;
  }
  mutable std::exception_ptr failure, other;

 private:
  const Residuals& residuals_;
  const FitSink& sink_;
  FitResult& result_;
};

/// Ends a fit whose evaluation threw what no shorter step mends.
class StopOnError final : public ceres::IterationCallback {
 public:
  explicit StopOnError(const Cost& cost) : cost_(cost) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    return cost_.other ? ceres::SOLVER_ABORT : ceres::SOLVER_CONTINUE;
  }

 private:
  const Cost& cost_;
};

/// Ends a search that has come to a bound and hardly gets on: its steps are cut there, and get shorter and shorter.
class EndAtBound final : public ceres::IterationCallback {
 public:
  EndAtBound(const std::vector<Parameter>& parameters, const std::vector<double>& x) : parameters_(parameters), x_(x) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& s) override {
    constexpr double kHardly = 0.3;  // of the sum of squares, in one step
    const bool crawls = s.step_is_successful && s.iteration > 0 && s.cost_change < kHardly * s.cost;
    return enabled && crawls && is_at_bound() ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }
  bool enabled = true;
  std::vector<int> held;  // these do not count

 private:
  bool is_at_bound() const {
    for (std::size_t j = 0; j < x_.size(); ++j) {
      const Parameter& p = parameters_[j];
      if (std::find(held.begin(), held.end(), static_cast<int>(j)) != held.end()) continue;
      if (x_[j] - p.lower / p.scale <= kAtBound || p.upper / p.scale - x_[j] <= kAtBound) return true;
    }
    return false;
  }
  const std::vector<Parameter>& parameters_;
  const std::vector<double>& x_;
};

std::vector<FitResult::Set> sets_of(const SampleResiduals& start, const SampleResiduals& end) {
  std::vector<FitResult::Set> sets;
  for (std::size_t i = 0; i < end.terms.size(); ++i) {
    const std::size_t colon = end.terms[i].find(':');
    const std::size_t problem = std::stoul(end.terms[i].substr(0, colon));
    const std::string term = end.terms[i].substr(colon + 1);
    auto at =
        std::find_if(sets.begin(), sets.end(), [&](const auto& s) { return s.problem == problem && s.term == term; });
    if (at == sets.end()) at = sets.insert(at, {problem, term, 0, 0, 0});
    ++at->count;
    const auto k = static_cast<Eigen::Index>(i);
    at->start_rms += start.r[k] * start.r[k];
    at->rms += end.r[k] * end.r[k];
    at->times.push_back(end.times[i]);
    at->residuals.push_back(end.r[k]);
  }
  for (auto& s : sets) {
    s.start_rms = std::sqrt(s.start_rms / s.count);
    s.rms = std::sqrt(s.rms / s.count);
  }
  return sets;
}

/// Those at a bound, to which they are set, beyond which the sum of squares would fall.
std::vector<int> held_by_bounds(const Residuals& residuals, std::vector<double>& x) {
  std::vector<int> near;
  std::vector<double> rho;
  for (std::size_t j = 0; j < x.size(); ++j) {
    const Parameter& p = residuals.parameters()[j];
    const double lower = p.lower / p.scale, upper = p.upper / p.scale;
    if (x[j] - lower <= kAtBound || upper - x[j] <= kAtBound) {
      x[j] = x[j] - lower <= upper - x[j] ? lower : upper;
      near.push_back(static_cast<int>(j));
    }
    rho.push_back(x[j] * p.scale);
  }
  if (near.empty()) return {};
  const SampleResiduals at = residuals.at(rho, true);
  std::vector<int> held;
  for (const int j : near) {
    const Parameter& p = residuals.parameters()[static_cast<std::size_t>(j)];
    const double slope = at.r_rho.col(j).dot(at.r);
    const bool at_lower = x[static_cast<std::size_t>(j)] == p.lower / p.scale;
    if (at_lower ? slope > 0 : slope < 0) held.push_back(j);
  }
  return held;
}

/// At two tighter tolerances, the first with tangents, or looser ones where that fails: what errors of integration are.
std::vector<SampleResiduals> residuals_with_other_errors(const std::vector<Problem>& problems,
                                                         const std::vector<double>& rho, FitResult& result) {
  const auto at = [&](double part, bool derivatives) {
    std::vector<Problem> others = problems;
    for (Problem& p : others) p.solver.set_rtol(std::max(p.solver.rtol * part, kTightest));
    const Unsaid another;
    SampleResiduals r = Residuals(others).at(rho, derivatives);
    result.counters += r.counters;
    return r;
  };
  const auto both = [&](double part) { return std::vector{at(part, true), at(std::sqrt(part), false)}; };
  const bool tight = std::all_of(problems.begin(), problems.end(),
                                 [](const Problem& p) { return p.solver.rtol * kTighter < kTightest; });
  if (tight) return both(1 / kTighter);
  try {
    return both(kTighter);
  } catch (const SolverError&) {
    return both(1 / kTighter);
  }
}

}  // namespace

FitResult fit(const std::vector<Problem>& problems, const FitOptions& options, const FitSink& sink) {
  FLAGS_minloglevel = google::GLOG_FATAL;  // what failed is told here
  const Residuals residuals(problems);
  FitResult result;
  std::vector<double> x, rho;
  for (const Parameter& p : residuals.parameters()) {
    x.push_back(p.value / p.scale);
    rho.push_back(p.value);
  }
  const SampleResiduals start = residuals.at(rho, false);  // what cannot run at all says why
  result.residuals = static_cast<int>(start.r.size());
  result.start_chi_square = start.r.squaredNorm();
  ceres::Problem problem;
  auto* cost = new Cost(residuals, result.residuals, sink, result);  // the problem's own
  problem.AddResidualBlock(cost, nullptr, x.data());
  for (std::size_t j = 0; j < x.size(); ++j) {
    const Parameter& p = residuals.parameters()[j];
    if (std::isfinite(p.lower)) problem.SetParameterLowerBound(x.data(), static_cast<int>(j), p.lower / p.scale);
    if (std::isfinite(p.upper)) problem.SetParameterUpperBound(x.data(), static_cast<int>(j), p.upper / p.scale);
  }
  ceres::Solver::Options o;
  StopOnError stop(*cost);
  EndAtBound at_bound(residuals.parameters(), x);
  o.callbacks = {&stop, &at_bound};
  o.update_state_every_iteration = true;  // x, for what looks at it
  o.linear_solver_type = ceres::DENSE_QR;
  o.max_num_iterations = options.max_iterations;
  o.function_tolerance = o.parameter_tolerance = options.tolerance;
  o.gradient_tolerance = 0;
  o.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  const auto solve = [&] {
    o.max_num_iterations = std::max(0, options.max_iterations - result.iterations);
    ceres::Solve(o, &problem, &summary);
    if (cost->other) std::rethrow_exception(cost->other);
    if (summary.termination_type == ceres::FAILURE && cost->failure) std::rethrow_exception(cost->failure);
    result.iterations += std::max(0, static_cast<int>(summary.iterations.size()) - 1);
  };
  solve();
  // Steps that are cut at a bound get shorter and shorter beside it, and "converge" short of the minimum. So what a
  // bound holds is held, the others are searched on, and what would leave its bound is let go: an active set.
  std::vector<int>& held = at_bound.held;
  const auto goes_on = [&] {
    return summary.termination_type == ceres::CONVERGENCE || summary.termination_type == ceres::USER_SUCCESS;
  };
  for (std::size_t round = 0; goes_on(); ++round) {
    const std::vector<int> holds = held_by_bounds(residuals, x);
    const bool same = holds == held;
    if (same && summary.termination_type == ceres::CONVERGENCE) break;
    if (round > 3 * x.size()) {
      summary.termination_type = ceres::FAILURE;
      summary.message = "bounds are met and left in turn, and no minimum among them was settled on";
      break;
    }
    held = holds;
    at_bound.enabled = !same;  // else it goes on along a bound that does not hold it
    if (held.size() == x.size()) {
      summary.termination_type = ceres::CONVERGENCE;
      break;
    }
    problem.SetManifold(x.data(), held.empty() ? nullptr : new ceres::SubsetManifold(static_cast<int>(x.size()), held));
    solve();
  }
  result.converged = summary.termination_type == ceres::CONVERGENCE;
  result.termination = result.converged ? "converged"
                       : summary.termination_type == ceres::NO_CONVERGENCE
                           ? fmt::format("stopped after {} iterations", result.iterations)
                           : summary.message;
  for (std::size_t j = 0; j < x.size(); ++j) {
    const Parameter& p = residuals.parameters()[j];
    // At a bound to rounding it is the bound.
    double value = std::clamp(x[j] * p.scale, p.lower, p.upper);
    const double near = 1e-9 * p.scale;
    FittedParameter f{
        .name = p.name, .start = p.value, .value = value, .lower = p.lower, .upper = p.upper, .scale = p.scale};
    if (value - p.lower <= near) f.value = p.lower;
    if (p.upper - value <= near) f.value = p.upper;
    f.at_bound = f.value == p.lower || f.value == p.upper;
    rho[j] = f.value;
    result.parameters.push_back(f);
  }
  const SampleResiduals end = residuals.at(rho, true);
  result.counters += end.counters;
  result.chi_square = end.r.squaredNorm();
  if (result.converged && held.size() < x.size() && result.chi_square > 0 &&
      result.chi_square >= result.start_chi_square * (1 - kUnmoved))
    notice(
        "The search ended where it began: the start is a stationary point of the sum of squares, which a symmetric one "
        "is without being a minimum (a length that enters by its square, at zero). Another start tells.");
  result.sets = sets_of(start, end);
  judge_fit(end, residuals_with_other_errors(problems, rho, result), options, result);
  return result;
}

}  // namespace costate
