#include "costate/optimize/certificate.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "costate/analysis/start.h"
#include "costate/base/error.h"
#include "costate/sensitivity/difference_hessian.h"

namespace costate {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// A gradient of this times the Hessian's largest entry is gone after moves of about this times the
// parameters' scales.
constexpr double kStationary = 1e-4;
// Newton's step to a minimum, in scaled parameters, up to which it is taken for reached.
constexpr double kNewton = 1e-2;
// A constraint is a candidate for being active this near its bound, relative to the larger of 1 and the
// bound: optimizers stop some way inside.
constexpr double kNear = 1e-3;
// A parameter this near its bound, in parts of its scale, is on it: SLSQP and MMA stop a rounding inside.
constexpr double kOnBound = 1e-8;
// The Hessian's run is of the optimum's motion where its psi agrees to this fraction of itself or of the first one, and
// its gradient to this fraction of the first one's: as far as formulations may differ (penalty: O(1/alpha)), and far
// below what a verdict depends on. A psi that vanishes is held to no fraction of itself, see compare().
constexpr double kSame = 1e-4;
// Outputs that are zero are zero to this many absolute tolerances of the integrators.
constexpr double kZero = 10;
// Errors of second derivatives against the tolerance of the integrators.
constexpr double kSteps = 1e3;

/// The second derivatives of psi and of some constraints, in scaled parameters.
struct Curvature {
  MatrixXd psi;
  std::vector<MatrixXd> constraints;  // in the order asked for
};

class Certifier {
 public:
  Certifier(const Problem& problem, const std::vector<OptimizerConstraint>& constraints,
            const OptimizerEvaluation& first, const OptimizerEvaluation& best, const std::string& method)
      : problem_(problem),
        constraints_(constraints),
        first_(first),
        best_(best),
        method_(method),
        n_(problem.parameters.size()) {
    scale_.resize(n_);
    for (int j = 0; j < n_; ++j) scale_[j] = parameter(j).scale;
  }

  Certificate run() {
    result_.projected_gradient = best_.projected_gradient;
    g_ = scaled(best_.gradient);
    find_active_constraints();
    const std::optional<Curvature> curvature = find_curvature();
    MatrixXd H;
    if (curvature) {
      H = curvature->psi;
      for (std::size_t i = 0; i < near_.size(); ++i) H += mu_[static_cast<Index>(i)] * curvature->constraints[i];
    }
    set_tolerance(H);
    sort_parameters();
    measure();
    if (curvature) compare(H);
    if (!differences_.empty()) {
      result_.kind = Certificate::Kind::none;
      result_.verdict = fmt::format(
          "no verdict: the run of the Hessian found another motion than the optimum's: {}. Check "
          "both with 'costate check', a smaller rtol or another formulation.",
          fmt::join(differences_, "; "));
      return result_;
    }
    if (curvature) analyse(H);
    judge(curvature.has_value());
    return result_;
  }

 private:
  const Parameter& parameter(int j) const { return problem_.parameters.parameters[static_cast<std::size_t>(j)]; }
  VectorXd scaled(const std::vector<double>& gradient) const {
    return scale_.cwiseProduct(Eigen::Map<const VectorXd>(gradient.data(), n_));
  }
  double rho(int j) const { return best_.rho[static_cast<std::size_t>(j)]; }
  bool at_lower(int j) const { return rho(j) <= parameter(j).lower + kOnBound * parameter(j).scale; }
  bool at_upper(int j) const { return rho(j) >= parameter(j).upper - kOnBound * parameter(j).scale; }
  /// Pushed out of its bounds by the slope s of L (before the bounds' own terms).
  bool held(int j, double s) const { return (at_lower(j) && s > 0) || (at_upper(j) && s < 0); }

  /// The constraints near their bounds and mu >= 0 for them: the least |dL/dx|, those that would be negative
  /// left out.
  void find_active_constraints() {
    for (std::size_t c = 0; c < constraints_.size(); ++c)
      if (best_.constraints[c] >= -kNear * std::max(1.0, std::abs(constraints_[c].upper))) near_.push_back(c);
    slope_ = g_;
    const int turns = 2 * (n_ + static_cast<int>(near_.size()));
    for (int turn = 0; turn < turns && !near_.empty(); ++turn) {
      A_.resize(n_, static_cast<Index>(near_.size()));
      for (std::size_t i = 0; i < near_.size(); ++i)
        A_.col(static_cast<Index>(i)) = scaled(best_.constraint_gradients[near_[i]]);
      // Bounds take what pushes out of them; the rest is to vanish.
      MatrixXd rows = A_;
      VectorXd right = -g_;
      for (int j = 0; j < n_; ++j)
        if (held(j, slope_[j])) {
          rows.row(j).setZero();
          right[j] = 0;
        }
      mu_ = rows.completeOrthogonalDecomposition().solve(right);
      Index worst = 0;
      if (mu_.minCoeff(&worst) < 0) {
        near_.erase(near_.begin() + worst);
        slope_ = g_;
        continue;
      }
      const VectorXd next = g_ + A_ * mu_;
      bool same = true;
      for (int j = 0; j < n_; ++j) same = same && held(j, next[j]) == held(j, slope_[j]);
      slope_ = next;
      if (same) return;
    }
    near_.clear();  // none, or no choice of them settles
    A_.resize(n_, 0);
    mu_.resize(0);
    slope_ = g_;
  }

  std::optional<Curvature> find_curvature() {
    const Formulation& own = find_formulation(problem_.formulation);
    std::vector<std::string> candidates{own.name};
    std::vector<std::string> notes;
    if (const std::string refused = hessian_refusal(own); !refused.empty()) {
      notes.push_back(fmt::format("formulation '{}' has no Hessian-vector products", own.name));
      candidates.clear();
      const std::string rows = redundant_rows();
      std::vector<std::string> left_out;
      for (const Formulation* f : stand_ins(false)) {
        if (!f->make_hessian) continue;
        const bool takes = f->carries_redundancy || rows.empty();
        (takes ? candidates : left_out).push_back(takes ? f->name : "'" + f->name + "'");
      }
      if (!left_out.empty())
        notes.push_back(fmt::format("{} cannot carry its redundant rows ({})", fmt::join(left_out, " and "), rows));
    }
    const auto exact = [](Problem p, const std::vector<double>& at) {
      p.solver.integrator.clear();
      return hessian(p, at);
    };
    for (const std::string& name : candidates) try {
        Curvature c = curvature_of(name, exact);
        result_.formulation = name;
        if (!notes.empty())
          result_.note =
              fmt::format("The Hessian is that of '{}' at the same tolerance: {}.", name, fmt::join(notes, "; "));
        return c;
      } catch (const CapabilityError& e) {
        notes.emplace_back(e.what());
        if (auto c = curvature_by_differences(notes)) return c;
        break;  // the cost's doing, whatever the formulation
      } catch (const SolverError& e) {
        notes.push_back(fmt::format("'{}' could not continue: {}", name, e.what()));
      } catch (const ModelError& e) {
        notes.push_back(fmt::format("'{}' could not start: {}", name, e.what()));
      }
    result_.note = fmt::format("There is no Hessian: {}", fmt::join(notes, "; "));
    return {};
  }

  /// By the run's own gradients, where nobody has products.
  std::optional<Curvature> curvature_by_differences(std::vector<std::string>& notes) {
    try {
      Curvature c = curvature_of(problem_.formulation, [&](const Problem& p, const std::vector<double>& at) {
        return hessian_by_differences(p, method_, at);
      });
      result_.formulation = problem_.formulation;
      result_.note = fmt::format(
          "The Hessian is made of differences of gradients by {}, and known to some {:.0e} of its largest entry: {}",
          method_, result_.asymmetry, fmt::join(notes, "; "));
      return c;
    } catch (const SolverError& e) {
      notes.push_back(fmt::format("differences of gradients do not give it, as one failed: {}", e.what()));
    } catch (const CapabilityError& e) {
      notes.emplace_back(e.what());
    }
    return {};
  }

  /// Names of the constraint rows that depend on the others at the start.
  std::string redundant_rows() const {
    Assembly assembly(problem_.mechanism, problem_.parameters);
    assembly.set_parameters(best_.rho.data());
    const Start start = find_start(assembly, problem_.solver.t_start, false);
    const auto rows = problem_.mechanism->row_names();
    std::vector<std::string> names;
    for (const int i : constraint_rank(assembly, problem_.solver.t_start, start.q.data()).dependent_rows)
      names.push_back(rows[static_cast<std::size_t>(i)]);
    return fmt::format("{}", fmt::join(names, ", "));
  }

  template <class Second>
  Curvature curvature_of(const std::string& formulation, const Second& second) {
    Problem p = problem_;
    p.formulation = formulation;
    Curvature c;
    result_.asymmetry = 0;
    found_.clear();
    const auto of = [&](const Objective& objective, Found f) {
      p.objective = objective;
      const Hessian h = second(p, best_.rho);
      f.hessian += h.psi;
      f.g_hessian = scaled(h.gradient);
      found_.push_back(std::move(f));
      result_.asymmetry = std::max(result_.asymmetry, h.asymmetry);
      return MatrixXd(scale_.asDiagonal() * h.matrix * scale_.asDiagonal());
    };
    c.psi = of(problem_.objective, {"psi", best_.psi, 0, first_.psi, g_, {}, scaled(first_.gradient)});
    for (const std::size_t i : near_)  // an evaluation keeps psi_c - upper
      c.constraints.push_back(of(constraints_[i].objective, {"constraint." + constraints_[i].name,
                                                             best_.constraints[i] + constraints_[i].upper,
                                                             0,
                                                             first_.constraints[i] + constraints_[i].upper,
                                                             scaled(best_.constraint_gradients[i]),
                                                             {},
                                                             scaled(first_.constraint_gradients[i])}));
    return c;
  }

  /// Of psi (the constraint's, where c is one), of its gradient in scaled parameters, found by the run and by the
  /// Hessian's.
  struct Found {
    std::string what;
    double run, hessian, first;
    VectorXd g_run, g_hessian, g_first;
  };
  /// Two runs of one motion differ as two motions of parameters do that are kStationary of their scales apart, which no
  /// verdict tells from each other: delta psi = |g| delta + |H| delta^2 / 2, delta g = |H| delta. And a psi of outputs
  /// that are zero is an integral of the squares of what the integrators leave of them.
  void compare(const MatrixXd& H) {
    const double size = H.size() > 0 ? H.cwiseAbs().maxCoeff() : 0;
    const SolverOptions& solver = problem_.solver;
    const double left = kZero * solver.absolute(), rounding = (solver.t_end - solver.t_start) * left * left;
    for (const Found& f : found_) {
      const double slope = n_ > 0 ? std::max(f.g_run.cwiseAbs().maxCoeff(), f.g_hessian.cwiseAbs().maxCoeff()) : 0;
      const double of_psi = kSame * std::max(std::abs(f.run), std::abs(f.first)) +
                            (slope + size * kStationary / 2) * kStationary + rounding;
      if (!(std::abs(f.run - f.hessian) <= of_psi))
        differences_.push_back(fmt::format("{} is {:.9g} there and {:.9g} here", f.what, f.hessian, f.run));
      if (n_ == 0) continue;
      const double of_gradient = std::max(kStationary * size, kSame * f.g_first.cwiseAbs().maxCoeff()) + rounding;
      Index worst = 0;
      const double difference = (f.g_run - f.g_hessian).cwiseAbs().maxCoeff(&worst);
      if (!(difference <= of_gradient))
        differences_.push_back(fmt::format("d({})/d({}) is {:.9g} there and {:.9g} here", f.what,
                                           parameter(static_cast<int>(worst)).name, f.g_hessian[worst] / scale_[worst],
                                           f.g_run[worst] / scale_[worst]));
    }
  }

  void set_tolerance(const MatrixXd& H) {
    const double size = H.size() > 0 ? H.cwiseAbs().maxCoeff() : scaled(first_.gradient).cwiseAbs().maxCoeff();
    result_.tolerance = kStationary * size;
    result_.curvature_tolerance = H.size() > 0 ? std::max(kSteps * problem_.solver.rtol, result_.asymmetry) * size : 0;
  }

  /// On bounds that hold the parameter by more than the tolerance, or free.
  void sort_parameters() {
    for (int j = 0; j < n_; ++j) {
      if (!held(j, slope_[j]) || std::abs(slope_[j]) <= result_.tolerance) {
        free_.push_back(j);
        result_.free.push_back(parameter(j).name);
        continue;
      }
      const std::string name = parameter(j).name + (slope_[j] > 0 ? ".lower" : ".upper");
      result_.active.push_back(name);
      result_.multipliers.emplace_back(name, std::abs(slope_[j]) / scale_[j]);
    }
    for (std::size_t i = 0; i < near_.size(); ++i) {
      const std::string name = "constraint." + constraints_[near_[i]].name;
      result_.active.push_back(name);
      result_.multipliers.emplace_back(name, mu_[static_cast<Index>(i)]);
    }
  }

  void measure() {
    double r = 0;
    for (int j = 0; j < n_; ++j)
      if (!held(j, slope_[j])) r = std::max(r, std::abs(slope_[j]));
    for (std::size_t i = 0; i < near_.size(); ++i)
      r = std::max(r, std::abs(mu_[static_cast<Index>(i)] * best_.constraints[near_[i]]));
    for (std::size_t c = 0; c < constraints_.size(); ++c)
      r = std::max(r, best_.constraints[c] / std::max(1.0, std::abs(constraints_[c].upper)));
    result_.kkt_residual = r;
  }

  /// Eigenvalues on the free parameters' directions that keep the active constraints to first order, and the
  /// step.
  void analyse(const MatrixXd& H) {
    const auto f = static_cast<Index>(free_.size());
    MatrixXd Z = MatrixXd::Zero(n_, f);
    for (Index a = 0; a < f; ++a) Z(free_[static_cast<std::size_t>(a)], a) = 1;
    if (A_.cols() > 0 && f > 0) {
      const Eigen::ColPivHouseholderQR<MatrixXd> qr(Z.transpose() * A_);
      const MatrixXd Q = qr.householderQ() * MatrixXd::Identity(f, f);
      Z = (Z * Q.rightCols(f - qr.rank())).eval();
    }
    if (Z.cols() == 0) return;
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(Z.transpose() * H * Z);
    const VectorXd& e = solver.eigenvalues();
    result_.eigenvalues.assign(e.data(), e.data() + e.size());
    if (!(e[0] > result_.curvature_tolerance)) return;
    const VectorXd along = solver.eigenvectors().transpose() * (Z.transpose() * slope_);
    result_.predicted_decrease = 0.5 * along.cwiseAbs2().cwiseQuotient(e).sum();
    result_.newton_step = (Z * (solver.eigenvectors() * along.cwiseQuotient(e))).cwiseAbs().maxCoeff();
  }

  void judge(bool curvature) {
    using Kind = Certificate::Kind;
    const Certificate& r = result_;
    const std::string residual = fmt::format("the KKT residual is {:.3g}, {} {:.3g}", r.kkt_residual,
                                             r.kkt_residual <= r.tolerance ? "within" : "above", r.tolerance);
    if (!(r.kkt_residual <= r.tolerance)) {
      result_.kind = Kind::not_stationary;
      result_.verdict = fmt::format("not stationary: {}; more evaluations or a smaller tolerance may go on.", residual);
    } else if (!curvature) {
      result_.kind = Kind::stationary;
      result_.verdict = fmt::format("stationary: {}; of the curvature nothing is known.", residual);
    } else if (r.eigenvalues.empty()) {
      result_.kind = Kind::strict_minimum;
      result_.verdict =
          fmt::format("strict local minimum: {}, and bounds and constraints leave no direction free.", residual);
    } else if (r.newton_step > kNewton) {
      result_.kind = Kind::not_stationary;
      result_.verdict = fmt::format(
          "not stationary: Newton's step to the minimum is still {:.3g} of the parameters' scales, psi would "
          "fall by "
          "{:.3g}; more evaluations or a smaller tolerance may go on.",
          r.newton_step, r.predicted_decrease);
    } else if (const double least = r.eigenvalues.front(); least > r.curvature_tolerance) {
      result_.kind = Kind::strict_minimum;
      result_.verdict = fmt::format("strict local minimum: {}, and the smallest eigenvalue of the Hessian is {:.6g}.",
                                    residual, least);
    } else if (least >= -r.curvature_tolerance) {
      result_.kind = Kind::flat;
      const auto zeros = std::count_if(r.eigenvalues.begin(), r.eigenvalues.end(),
                                       [&](double e) { return e <= r.curvature_tolerance; });
      result_.verdict = fmt::format(
          "stationary, Hessian singular: {} of its {} eigenvalues {} zero within {:.3g}; psi is flat that "
          "way to "
          "second order.",
          zeros, r.eigenvalues.size(), zeros == 1 ? "is" : "are", r.curvature_tolerance);
    } else {
      result_.kind = Kind::indefinite;
      result_.verdict = fmt::format(
          "stationary, Hessian indefinite: the smallest of its eigenvalues is {:.6g}; psi falls "
          "along that direction, so this is no minimum.",
          least);
    }
  }

  const Problem& problem_;
  const std::vector<OptimizerConstraint>& constraints_;
  const OptimizerEvaluation &first_, &best_;
  const std::string method_;
  int n_;
  VectorXd scale_, g_, slope_, mu_;
  MatrixXd A_;                     // gradients of the active constraints, a column each
  std::vector<std::size_t> near_;  // active constraints
  std::vector<int> free_;
  std::vector<Found> found_;
  std::vector<std::string> differences_;
  Certificate result_;
};

}  // namespace

Certificate certify(const Problem& problem, const std::vector<OptimizerConstraint>& constraints,
                    const OptimizerEvaluation& first, const OptimizerEvaluation& best, const std::string& method) {
  return Certifier(problem, constraints, first, best, method).run();
}

}  // namespace costate
