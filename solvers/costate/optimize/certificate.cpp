#include "costate/optimize/certificate.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "costate/base/error.h"
#include "costate/optimize/active_rows.h"
#include "costate/optimize/certificate_terms.h"
#include "costate/optimize/certificate_verdict.h"
#include "costate/optimize/curvature.h"
#include "costate/optimize/on_bound.h"
#include "costate/problem/scaled_gradient.h"

namespace costate {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// A gradient of this times the Hessian's largest entry is gone after moves of about this times the
// parameters' scales.
constexpr double kStationary = 1e-4;
// A constraint is a candidate for being active this near its bound, relative to the larger of 1 and the
// bound: optimizers stop some way inside.
constexpr double kNear = 1e-3;
// So many times psi's slopes are what constraints do to each other.
constexpr double kThemselves = 1e3;
// The Hessian's run is of the optimum's motion where its psi agrees to this fraction of itself or of the first one, and
// its gradient to this fraction of the first one's: as far as formulations may differ (penalty: O(1/alpha)), and far
// below what a verdict depends on. A psi that vanishes is held to no fraction of itself, see compare().
constexpr double kSame = 1e-4;
// Outputs that are zero are zero to this many absolute tolerances of the integrators.
constexpr double kZero = 10;
// Of what constraints hold the gradient with, at most, what may be left of it.
constexpr double kOfHeld = 1e-2;
// A unit direction that leads out of a bound by less than this goes along it.
constexpr double kAlong = 1e-6;
// Of the largest derivative's error, what may be in one that is far smaller.
constexpr double kOfOthers = 1e-3;
// Errors of second derivatives against the tolerance of the integrators.
constexpr double kSteps = 1e3;
// A verdict needs few digits: at this tolerance it is looked for first.
constexpr double kFirstTolerance = 1e-6;
// And holds where the Hessian is known to this part of its largest entry.
constexpr double kSettled = 1e-2;
// Of its largest entry, that of rtol 1e-8; and times what its own error is.
constexpr double kFirmly = 1e-5, kOfError = 100;

using Quantity = CertificateTerms::Quantity;
using Row = CertificateTerms::Row;

class Certifier {
 public:
  /// `loosest`: a tolerance of the Hessian's run, where it is larger than the design's.
  Certifier(const Design& design, const OptimizerEvaluation& first, const OptimizerEvaluation& best, double loosest)
      : design_(design),
        first_(first),
        best_(best),
        n_(design.parameters.size()),
        loosest_(loosest),
        scale_(scales(design.parameters)),
        terms_(certificate_terms(design, first, best, scale_)) {
    for (const DesignCase& c : design.cases) rtol_ = std::max(rtol_, c.problem.solver.rtol);
    hessian_rtol_ = std::max(rtol_, loosest);
  }

  /// Behind run(): whether a tighter run of the Hessian would say the same.
  bool is_settled() const {
    if (result_.formulation.empty() || !differences_.empty()) return false;
    // Where nothing is free the Hessian's size alone is asked for, by which multipliers are judged.
    if (result_.eigenvalues.empty()) return true;
    return relative_error_ <= kSettled &&
           std::all_of(result_.eigenvalues.begin(), result_.eigenvalues.end(),
                       [&](double e) { return std::abs(e) > result_.curvature_tolerance; });
  }

  Certificate run() {
    result_.projected_gradient = best_.projected_gradient;
    g_ = scaled(best_.gradient);
    active_ = find_active_rows(
        terms_.rows, g_, [this](int j, double slope) { return held(j, slope); }, kNear);
    const std::optional<MatrixXd> curvature = find_hessian();
    const MatrixXd H = curvature.value_or(MatrixXd());
    set_tolerance(H);
    sort_parameters(H);
    measure();
    if (curvature) compare(H);
    if (!differences_.empty()) {
      result_.kind = Certificate::Kind::none;
      const std::string what = fmt::format("{}", fmt::join(differences_, "; "));
      result_.verdict =
          kinks_ == differences_.size()
              ? "no verdict: psi has a kink here (abs, max, contacts): of two runs side by side " + what +
                    ". There are no second derivatives; slopes of both signs meet in a minimum or a maximum, which "
                    "values beside it tell."
              : "no verdict: the run of the Hessian found another motion than the optimum's: " + what +
                    ". Check both with 'costate check', a smaller rtol or another formulation.";
      return result_;
    }
    if (curvature) analyse(H);
    judge(result_, curvature.has_value());
    tell_of_constraints_alone();
    return result_;
  }

 private:
  const Parameter& parameter(int j) const { return design_.parameters.parameters[static_cast<std::size_t>(j)]; }
  VectorXd scaled(const std::vector<double>& gradient) const {
    return scale_.cwiseProduct(Eigen::Map<const VectorXd>(gradient.data(), n_));
  }
  double rho(int j) const { return best_.rho[static_cast<std::size_t>(j)]; }
  bool at_lower(int j) const { return on_lower(parameter(j), rho(j)); }
  bool at_upper(int j) const { return on_upper(parameter(j), rho(j)); }
  /// Pushed out of its bounds by the slope s of L (before the bounds' own terms).
  bool held(int j, double s) const { return (at_lower(j) && s > 0) || (at_upper(j) && s < 0); }

  static bool violated(const Row& r) { return !r.of_worst && r.value > kNear * r.size; }

  /// Of L, in scaled parameters; each case's by its own run.
  std::optional<MatrixXd> find_hessian() {
    CertificateTerms::Terms terms = terms_.psi;
    for (std::size_t i = 0; i < active_.near.size(); ++i)
      for (const auto& [q, factor] : terms_.rows[active_.near[i]].terms)
        terms.emplace_back(q, factor * active_.mu[static_cast<Index>(i)]);
    std::vector<std::string> formulations, notes;
    bool all = true;
    for (std::size_t i = 0; i < design_.cases.size() && all; ++i) {
      const DesignCase& c = design_.cases[i];
      std::vector<std::size_t> wanted;
      std::vector<const Objective*> objectives;
      for (std::size_t q = 0; q < terms_.quantities.size(); ++q)
        if (terms_.quantities[q].of == i &&
            std::any_of(terms.begin(), terms.end(), [&](const auto& t) { return t.first == q; })) {
          wanted.push_back(q);
          objectives.push_back(terms_.quantities[q].objective);
        }
      if (wanted.empty()) continue;
      Curvature found;
      const auto find = [&] { found = find_curvature(c.problem, c.method, c.own(best_.rho), objectives, loosest_); };
      c.located ? c.located(find) : find();
      all = !found.of.empty();
      if (!found.note.empty()) notes.push_back(c.title() + found.note);
      if (std::find(formulations.begin(), formulations.end(), found.formulation) == formulations.end())
        formulations.push_back(found.formulation);
      for (std::size_t k = 0; k < found.of.size(); ++k) take(terms_.quantities[wanted[k]], c, found.of[k]);
    }
    result_.note = fmt::format("{}", fmt::join(notes, " "));
    if (!all) return {};
    result_.formulation = fmt::format("{}", fmt::join(formulations, ", "));
    MatrixXd H = MatrixXd::Zero(n_, n_);
    for (const auto& [q, factor] : terms) H += factor * terms_.quantities[q].second;
    return H;
  }

  void take(Quantity& q, const DesignCase& c, const Hessian& h) {
    q.hessian = q.weight * h.psi;
    q.g_hessian = q.weight * scaled(c.spread(h.gradient, static_cast<std::size_t>(n_)));
    q.second = MatrixXd::Zero(n_, n_);
    for (std::size_t a = 0; a < c.places.size(); ++a)
      for (std::size_t b = 0; b < c.places.size(); ++b) {
        const auto i = static_cast<Index>(c.places[a]), j = static_cast<Index>(c.places[b]);
        q.second(i, j) = q.weight * scale_[i] * scale_[j] * h.matrix(static_cast<Index>(a), static_cast<Index>(b));
      }
    result_.asymmetry = std::max(result_.asymmetry, h.asymmetry);
    relative_error_ = std::max(relative_error_, h.error);
  }

  /// Two runs of one motion differ as two motions of parameters do that are kStationary of their scales apart, which no
  /// verdict tells from each other: delta psi = |g| delta + |H| delta^2 / 2, delta g = |H| delta. And a psi of outputs
  /// that are zero is an integral of the squares of what the integrators leave of them.
  void compare(const MatrixXd& H) {
    const double size = H.size() > 0 ? H.cwiseAbs().maxCoeff() : 0;
    for (const Quantity& f : terms_.quantities) {
      if (f.second.size() == 0) continue;
      const SolverOptions& solver = design_.cases[f.of].problem.solver;
      const double left = kZero * solver.absolute(),
                   rounding = f.weight * (solver.t_end - solver.t_start) * left * left;
      const double slope = n_ > 0 ? std::max(f.g_run.cwiseAbs().maxCoeff(), f.g_hessian.cwiseAbs().maxCoeff()) : 0;
      const double of_psi = kSame * std::max(std::abs(f.run), std::abs(f.first)) +
                            (slope + size * kStationary / 2) * kStationary + rounding;
      if (!(std::abs(f.run - f.hessian) <= of_psi))
        differences_.push_back(fmt::format("{} is {:.9g} there and {:.9g} here", f.what, f.hessian, f.run));
      if (n_ == 0) continue;
      const double of_gradient = std::max(kStationary * size, kSame * f.g_first.cwiseAbs().maxCoeff()) + rounding;
      Index worst = 0;
      const double difference = (f.g_run - f.g_hessian).cwiseAbs().maxCoeff(&worst);
      if (!(difference <= of_gradient)) {
        kinks_ += f.g_run[worst] * f.g_hessian[worst] < 0;
        differences_.push_back(fmt::format("d({})/d({}) is {:.9g} there and {:.9g} here", f.what,
                                           parameter(static_cast<int>(worst)).name, f.g_hessian[worst] / scale_[worst],
                                           f.g_run[worst] / scale_[worst]));
      }
    }
  }

  void set_tolerance(const MatrixXd& H) {
    const double size = H.size() > 0 ? H.cwiseAbs().maxCoeff() : scaled(first_.gradient).cwiseAbs().maxCoeff();
    const double error = std::isfinite(relative_error_) ? relative_error_ : result_.asymmetry;
    result_.tolerance = kStationary * size;
    if (H.size() > 0 && active_.mu.size() > 0) {
      // Constraints' curvature explains a residual as long as moves of kStationary change little of what they hold.
      MatrixXd of_psi = MatrixXd::Zero(n_, n_);
      for (const auto& [q, factor] : terms_.psi) of_psi += factor * terms_.quantities[q].second;
      const double held = held_size();
      result_.tolerance = kStationary * of_psi.cwiseAbs().maxCoeff() +
                          std::min(kStationary * (H - of_psi).cwiseAbs().maxCoeff(), kOfHeld * held) +
                          kSteps * rtol_ * held;
    }
    result_.eigenvalue_error = H.size() > 0 ? error * size : 0;
    // At loose tolerances a Hessian may be known far better than these promise.
    const double steps = std::min(kSteps * hessian_rtol_, std::max(kFirmly, kOfError * error));
    result_.curvature_tolerance = H.size() > 0 ? std::max(steps, error) * size : 0;
  }

  /// What the slope along a unit direction may be at a minimum that is found to kStationary of the scales: psi may
  /// curve little along this one, whatever it does along others.
  double slope_of_place(const VectorXd& along, const MatrixXd& H) const {
    if (H.size() == 0) return result_.tolerance;
    return kStationary * (H * along).cwiseAbs().maxCoeff() + slope_error(along);
  }
  /// What is known of how far the slope along a unit direction is off: of what it was at first, and of what little the
  /// others' errors leave in it. A psi that was steep elsewhere, far away, says nothing of this one.
  double slope_error(const VectorXd& along) const {
    const VectorXd first = scaled(first_.gradient).cwiseAbs();
    const double own = std::max(std::abs(best_.psi), along.cwiseAbs().dot(first));
    return kSteps * rtol_ * std::max(own, kOfOthers * first.maxCoeff());
  }

  /// Whether the bound of j holds psi by more than that, with the others where they are or along a valley.
  bool holds_up(int j, const MatrixXd& H) const {
    const VectorXd& slope = active_.slope;
    if (!held(j, slope[j])) return false;
    if (std::abs(slope[j]) > slope_of_place(VectorXd::Unit(n_, j), H)) return true;
    if (H.size() == 0 || !active_.near.empty()) return false;
    std::vector<Index> free;
    for (int i = 0; i < n_; ++i)
      if (i != j && !held(i, slope[i])) free.push_back(i);
    const VectorXd u = valley(H, j, free);
    return slope.dot(u) * (slope[j] > 0 ? 1 : -1) > slope_of_place(u, H);
  }
  /// On bounds that hold the parameter, or free.
  void sort_parameters(const MatrixXd& H) {
    for (int j = 0; j < n_; ++j) {
      if (!holds_up(j, H)) {
        free_.push_back(j);
        result_.free.push_back(parameter(j).name);
        continue;
      }
      const std::string name = parameter(j).name + (active_.slope[j] > 0 ? ".lower" : ".upper");
      result_.active.push_back(name);
      result_.multipliers.emplace_back(name, std::abs(active_.slope[j]) / scale_[j]);
    }
    for (std::size_t i = 0; i < active_.near.size(); ++i) {
      const Row& row = terms_.rows[active_.near[i]];
      if (!violated(row)) result_.active.push_back(row.name);
      result_.multipliers.emplace_back(row.name, active_.mu[static_cast<Index>(i)] + 0.0);  // no -0
      if (row.of_worst) of_worst_ -= active_.mu[static_cast<Index>(i)];
    }
    if (design_.minimax()) result_.multipliers.emplace_back("worst." + design_.targets[terms_.worst].name, of_worst_);
  }

  /// Where constraints' gradients nearly depend on each other their multipliers balance themselves, and not psi.
  void tell_of_constraints_alone() {
    const double of_psi = n_ > 0 ? g_.cwiseAbs().maxCoeff() : 0, held = held_size();
    if (!(held > kThemselves * of_psi) || !(held > kThemselves * result_.kkt_residual) ||
        !(result_.tolerance > 0.1 * of_psi) || result_.kind == Certificate::Kind::not_feasible)
      return;
    result_.kind = Certificate::Kind::none;
    result_.verdict = fmt::format(
        "no verdict: constraints and bounds hold each other, with up to {:.1g} times psi's own slopes, as their "
        "gradients nearly depend on each other here (no constraint qualification): the KKT conditions say little, and "
        "psi may have further to go.",
        held / of_psi);
  }
  double held_size() const {
    return active_.mu.size() > 0 ? (active_.A * active_.mu.asDiagonal()).cwiseAbs().maxCoeff() : 0;
  }

  void measure() {
    double r = 0;
    for (int j = 0; j < n_; ++j)
      if (!held(j, active_.slope[j])) r = std::max(r, std::abs(active_.slope[j]));
    for (std::size_t i = 0; i < active_.near.size(); ++i)
      r = std::max(r, std::abs(active_.mu[static_cast<Index>(i)] * terms_.rows[active_.near[i]].value));
    for (const Row& row : terms_.rows) {
      r = std::max(r, row.value / row.size);
      if (violated(row)) result_.violated.emplace_back(row.name, row.value);
    }
    if (of_worst_ < 0 && n_ > 0) r = std::max(r, -of_worst_ * g_.cwiseAbs().maxCoeff());
    result_.kkt_residual = r;
  }

  /// Eigenvalues on the free parameters' directions that keep the active constraints to first order, and the step.
  void analyse(const MatrixXd& H) {
    const auto f = static_cast<Index>(free_.size());
    MatrixXd Z = MatrixXd::Zero(n_, f);
    for (Index a = 0; a < f; ++a) Z(free_[static_cast<std::size_t>(a)], a) = 1;
    // Rows that are active without a multiplier hold nothing: psi may fall away from them.
    std::vector<Index> holding, weak;
    for (Index i = 0; i < active_.A.cols(); ++i)
      (active_.mu[i] * active_.A.col(i).norm() > slope_of_place(active_.A.col(i).normalized(), H) ? holding : weak)
          .push_back(i);
    if (!holding.empty() && f > 0) {
      const Eigen::ColPivHouseholderQR<MatrixXd> qr(Z.transpose() * active_.A(Eigen::all, holding));
      const MatrixXd Q = qr.householderQ() * MatrixXd::Identity(f, f);
      Z = (Z * Q.rightCols(f - qr.rank())).eval();
    }
    if (Z.cols() == 0) return;
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(Z.transpose() * H * Z);
    const VectorXd& e = solver.eigenvalues();
    result_.eigenvalues.assign(e.data(), e.data() + e.size());
    if (e[0] < -result_.curvature_tolerance) {
      result_.falls_outward = true;
      for (Index k = 0; k < e.size() && e[k] < -result_.curvature_tolerance; ++k) {
        const VectorXd v = Z * solver.eigenvectors().col(k);
        if (leads_inward(v, weak) || leads_inward(-v, weak)) result_.falls_outward = false;
      }
    }
    VectorXd slope = active_.slope;
    for (const int j : free_)
      if (held(j, slope[j])) slope[j] = 0;  // psi falls beyond the bound
    const VectorXd along = solver.eigenvectors().transpose() * (Z.transpose() * slope);
    // Where psi does not curve a slope is one, whatever it curves by elsewhere and was at the start.
    const double gradient = scaled(first_.gradient).cwiseAbs().maxCoeff(),
                 left = kSame * std::min(gradient, std::abs(best_.psi));
    for (Index k = 0; k < e.size(); ++k)
      if (std::abs(e[k]) <= result_.curvature_tolerance) {
        const VectorXd down = Z * solver.eigenvectors().col(k) * (along[k] > 0 ? -1 : 1);
        if (std::abs(along[k]) > std::max(left / room(down) + slope_error(down), result_.flat_slope))
          result_.flat_slope = std::abs(along[k]);
      }
    if (!(e[0] > result_.curvature_tolerance)) return;
    result_.predicted_decrease = 0.5 * along.cwiseAbs2().cwiseQuotient(e).sum();
    result_.newton_step = (Z * (solver.eigenvectors() * along.cwiseQuotient(e))).cwiseAbs().maxCoeff();
  }

  /// How far bounds let one go that way, in scales: one where they do not say, at least.
  double room(const VectorXd& v) const {
    double r = std::numeric_limits<double>::infinity();
    for (int j = 0; j < n_; ++j)
      if (std::abs(v[j]) > kAlong) {
        const double bound = v[j] > 0 ? parameter(j).upper : parameter(j).lower;
        r = std::min(r, (bound - rho(j)) / (v[j] * parameter(j).scale));
      }
    return std::isfinite(r) ? std::max(r, 1.0) : 1;
  }

  /// To first order, across none of the bounds that are touched without a multiplier.
  bool leads_inward(const VectorXd& v, const std::vector<Index>& weak) const {
    for (const int j : free_)
      if ((at_lower(j) && v[j] < -kAlong) || (at_upper(j) && v[j] > kAlong)) return false;
    return std::all_of(weak.begin(), weak.end(),
                       [&](Index i) { return active_.A.col(i).dot(v) <= kAlong * active_.A.col(i).norm(); });
  }

  const Design& design_;
  const OptimizerEvaluation &first_, &best_;
  int n_;
  double loosest_, rtol_ = 0, hessian_rtol_ = 0, relative_error_ = 0;  // the last one of the Hessian
  VectorXd scale_, g_;
  ActiveRows active_;
  CertificateTerms terms_;
  double of_worst_ = 1;  // its multiplier
  std::vector<int> free_;
  std::vector<std::string> differences_;
  std::size_t kinks_ = 0;  // of them: slopes of both signs, of one psi
  Certificate result_;
};

}  // namespace

Certificate certify(const Design& of, const OptimizerEvaluation& first, const OptimizerEvaluation& best) {
  Design design = of;  // of the tolerances that its psi was resolved with
  for (std::size_t c = 0; c < best.tolerances.size(); ++c)
    if (best.tolerances[c].atol > 0) design.cases[c].problem.solver.set_absolute(best.tolerances[c]);
  const auto tightest = std::min_element(
      design.cases.begin(), design.cases.end(),
      [](const DesignCase& a, const DesignCase& b) { return a.problem.solver.rtol < b.problem.solver.rtol; });
  if (tightest != design.cases.end() && tightest->problem.solver.rtol < kFirstTolerance) {
    Certifier quick(design, first, best, kFirstTolerance);
    const Certificate certificate = quick.run();
    if (quick.is_settled()) return certificate;
  }
  return Certifier(design, first, best, 0).run();
}

Certificate certify(const Problem& problem, const std::vector<OptimizerConstraint>& constraints,
                    const OptimizerEvaluation& first, const OptimizerEvaluation& best, const std::string& method) {
  return certify(single_design(problem, method, constraints), first, best);
}

}  // namespace costate
