#include "costate/candidate/candidate_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "costate/base/error.h"
#include "costate/candidate/candidate_layout.h"
#include "costate/level/fixed_times.h"
#include "costate/problem/scaled_gradient.h"
#include "costate/sensitivity/method.h"

namespace costate {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Section = AdjointTerm::Section;

constexpr double kAgreement = 1e-6;  // of gradients, relative
constexpr int kMaxRefinements = 3;

std::vector<double> to_std(const VectorXd& x) { return {x.data(), x.data() + x.size()}; }

double distance(const VectorXd& x, const std::vector<double>& reference, const ParameterSelection& p) {
  const double size = largest_scaled(p, reference), error = largest_scaled_change(p, to_std(x), reference);
  return size > 0 ? error / size : error;
}

class Checker {
 public:
  Checker(const CandidateAdjoint& candidate, const CandidateReference& reference, const CandidateStage& stage)
      : candidate_(candidate),
        ref_(reference),
        stage_(stage),
        source_(reference.problem.mechanism, reference.problem.parameters, reference.problem.objective,
                reference.problem.formulation, reference.problem.formulation_options),
        motion_([this](double t, double* y) { ref_.motion.trajectory.evaluate(t, y); }),
        cache_(source_, motion_) {}

  CandidateReport run(bool terms_only) {
    report_.formulation = ref_.problem.formulation;
    report_.method = ref_.method;
    report_.reference = ref_.gradient;
    source_.set_parameters(ref_.rho.data());
    t0_ = ref_.problem.solver.t_start;
    t1_ = ref_.problem.solver.t_end;
    const Trajectory& trajectory = ref_.motion.trajectory;
    std::vector<double> ends{trajectory.t_begin()};
    for (std::size_t i = 0; i < trajectory.steps(); ++i) ends.push_back(trajectory.step_end(i));
    changes_ = source_.plan(ends, motion_);
    const Start s = source_.start(t0_);
    source_.set_parameters(ref_.rho.data());
    start_ = {s.q_rho, s.v_rho, s.z_rho};
    end_ = source_.with_rates(t1_, motion_);
    stage_("unknowns()");
    std::string why;
    layout_ = CandidateLayout::make(candidate_, end_, why);
    if (!why.empty()) report_.notes.push_back(why);
    if (!terms_only) integrate();
    if (layout_) {
      if (!terms_only) find_first_disagreement();
      compare_terms();
    }
    if (terms_only) {
      report_.agrees = report_.failure.empty() && report_.findings.empty();
      return report_;
    }
    report_.error = report_.failure.empty() ? distance(gradient_, ref_.gradient, ref_.problem.parameters) : HUGE_VAL;
    report_.agrees =
        report_.failure.empty() && report_.error <= kAgreement + 20 * report_.own_error && report_.findings.empty();
    return report_;
  }

 private:
  void integrate() {
    const Trajectory& trajectory = ref_.motion.trajectory;
    grid_ = with_times(with_looks(grid_of(trajectory, std::max<std::size_t>(1, trajectory.steps() / 40)), ref_.motion),
                       changes_);
    const auto& p = ref_.problem.parameters;
    for (int level = 0; level <= kMaxRefinements; ++level) {
      if (level > 0) grid_ = refined(grid_);
      cache_.clear();
      double change = 0;
      if (layout_) {
        CandidateRun run =
            integrate_candidate(layout_->model(), cache_, end_, start_, grid_, [](const std::string&) {});
        if (level > 0) change = distance(run.gradient, to_std(exact_.gradient), p);
        exact_ = std::move(run);
      }
      if (report_.failure.empty()) {
        try {
          CandidateRun run = integrate_candidate(candidate_, cache_, end_, start_, grid_, stage_);
          if (level > 0) change = std::max(change, distance(run.gradient, to_std(gradient_), p));
          gradient_ = run.gradient;
          found_ = std::move(run.mu);
        } catch (const Error& e) {
          report_.failure = e.what();
        }
      }
      if (level > 0 && change <= 1e-8) break;
    }
    if (layout_) report_.own_error = distance(exact_.gradient, ref_.gradient, p);
    if (report_.failure.empty()) report_.gradient = to_std(gradient_);
    if (report_.own_error > 1e-4)
      report_.notes.push_back(
          fmt::format("The exact equations themselves come only to {:.1e} of the reference on this "
                      "scene; smaller errors are not seen in the gradient.",
                      report_.own_error));
  }

  void find_first_disagreement() {
    if (!report_.failure.empty()) return;
    const auto names = unknown_names(layout_->model(), *ref_.problem.mechanism, end_.f);
    VectorXd scale = VectorXd::Zero(layout_->size());
    for (std::size_t i = 0; i < grid_.size(); ++i)
      for (const auto& k : layout_->blocks()) {
        const double x = exact_.mu[i].segment(k.first, k.count).cwiseAbs().maxCoeff();
        for (int j = 0; j < k.count; ++j) scale[k.first + j] = std::max(scale[k.first + j], x);
      }
    for (std::size_t i = grid_.size(); i-- > 0;) {
      const VectorXd found = layout_->from_candidate(found_[i]);
      double worst = 1e-5;
      for (const auto& k : layout_->blocks()) {
        if (!k.present || (!k.differential && i + 1 == grid_.size())) continue;
        // Algebraic unknowns of high index are less exact.
        const double allowed = k.differential ? 1 : 100;
        for (int j = k.first; j < k.first + k.count; ++j) {
          const double error = std::abs(found[j] - exact_.mu[i][j]) / (scale[j] > 0 ? scale[j] : 1) / allowed;
          if (!(error <= worst)) {
            worst = error;
            report_.first =
                CandidateReport::Disagreement{grid_[i], names[static_cast<std::size_t>(j)], exact_.mu[i][j], found[j]};
          }
        }
      }
      if (report_.first) return;
    }
  }

  double span(double fraction) const { return t0_ + fraction * (t1_ - t0_); }

  void compare_terms() {
    try {
      sample();
      compare(flow_comparison());
    } catch (const Error& e) {
      fail(e);
    }
    try {
      compare(terminal_comparison());
    } catch (const Error& e) {
      fail(e);
    }
    try {
      compare(start_comparison());
    } catch (const Error& e) {
      fail(e);
    }
  }

  void fail(const Error& e) {
    if (report_.failure.empty()) report_.failure = e.what();
  }

  void compare(const CandidateComparison& c) {
    const CandidateDiagnosis d = diagnose(layout_->model(), c);
    layout_->model().alter({});
    report_.findings.insert(report_.findings.end(), d.findings.begin(), d.findings.end());
    report_.blind.insert(report_.blind.end(), d.blind.begin(), d.blind.end());
  }

  /// Points of the trajectory and random mu of the size that they have on it.
  void sample() {
    std::mt19937 random(20240607);
    std::normal_distribution<double> normal;
    VectorXd scale = VectorXd::Ones(layout_->size());
    for (const auto& k : layout_->blocks()) {
      double x = 0;
      for (const auto& mu : exact_.mu) x = std::max(x, mu.segment(k.first, k.count).cwiseAbs().maxCoeff());
      if (std::isfinite(x) && x > 0) scale.segment(k.first, k.count).setConstant(x);
    }
    for (const double f : {0.97, 0.78, 0.53, 0.29, 0.08}) {
      points_.push_back(cache_.at(span(f)));
      MatrixXd x = MatrixXd::Zero(layout_->size(), 4);
      for (Eigen::Index j = 0; j < 3; ++j)
        for (Eigen::Index i = 0; i < x.rows(); ++i) x(i, j) = scale[i] * normal(random);
      mu_.push_back(x);
    }
  }

  double tolerance() const {
    // With penalties solved for in reduced form, candidates lose digits to alpha.
    const AdjointBlocks& b = points_[0];
    if (b.inverse_alpha == 0) return 1e-9;
    return 1e-9 + 1e-14 / (b.inverse_alpha * std::max(1e-300, b.M.cwiseAbs().maxCoeff()));
  }

  std::vector<std::string> parameter_names() const { return ref_.problem.parameters.names(); }

  std::vector<std::string> names_of(const CandidateLayout::Block& k) const {
    const auto names = unknown_names(layout_->model(), *ref_.problem.mechanism, end_.f);
    return {names.begin() + k.first, names.begin() + k.first + k.count};
  }

  CandidateComparison flow_comparison() {
    CandidateComparison c;
    c.sections = {Section::solve, Section::flow, Section::integrand};
    c.tolerance = tolerance();
    std::vector<MatrixXd> flow, exact;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      stage_(fmt::format("rhs() or residual() at t = {:.9g} s", points_[i].t));
      flow.push_back(layout_->flow(candidate_, points_[i], mu_[i]));
      MatrixXd x(layout_->size(), mu_[i].cols());
      for (Eigen::Index j = 0; j < x.cols(); ++j) x.col(j) = layout_->model().rhs(points_[i], mu_[i].col(j));
      exact.push_back(x);
    }
    layout_->choose_order(flow, exact);
    const int np = points_[0].np;
    for (const auto& k : layout_->blocks()) {
      if (!k.present) continue;
      c.where.push_back(k.where);
      c.components.push_back(names_of(k));
      c.sign_free.push_back(!k.differential);
      VectorXd y(static_cast<Eigen::Index>(points_.size()) * 4 * k.count);
      for (std::size_t i = 0; i < points_.size(); ++i) {
        const MatrixXd rows = layout_->ordered(flow[i]).middleRows(k.first, k.count);
        for (Eigen::Index j = 0; j < 4; ++j)
          y.segment((static_cast<Eigen::Index>(i) * 4 + j) * k.count, k.count) = rows.col(j);
      }
      c.candidate.push_back(y);
    }
    c.where.push_back("the gradient's integrand");
    c.components.push_back(parameter_names());
    c.sign_free.push_back(0);
    VectorXd y(static_cast<Eigen::Index>(points_.size()) * 4 * np);
    for (std::size_t i = 0; i < points_.size(); ++i)
      for (Eigen::Index j = 0; j < 4; ++j) {
        c.sample_time.push_back(points_[i].t);
        stage_(fmt::format("integrand() at t = {:.9g} s", points_[i].t));
        y.segment((static_cast<Eigen::Index>(i) * 4 + j) * np, np) = checked(
            candidate_.integrand(points_[i], layout_->to_candidate(mu_[i].col(j))), np, "integrand", points_[i].t);
      }
    c.candidate.push_back(y);
    c.model = [this, np](const std::vector<Alteration>& a) {
      AdjointModel& model = layout_->model();
      model.alter(a);
      std::vector<VectorXd> out;
      const auto samples = static_cast<Eigen::Index>(points_.size()) * 4;
      for (const auto& k : layout_->blocks())
        if (k.present) out.emplace_back(samples * k.count);
      out.emplace_back(samples * np);
      Eigen::Index s = 0;
      for (std::size_t i = 0; i < points_.size(); ++i)
        for (Eigen::Index j = 0; j < 4; ++j, ++s) {
          const VectorXd x = mu_[i].col(j), r = model.rhs(points_[i], x);
          std::size_t block = 0;
          for (const auto& k : layout_->blocks())
            if (k.present) out[block++].segment(s * k.count, k.count) = r.segment(k.first, k.count);
          out[block].segment(s * np, np) = model.integrand(points_[i], x);
        }
      return out;
    };
    return c;
  }

  CandidateComparison terminal_comparison() {
    CandidateComparison c;
    c.sections = {Section::terminal};
    c.tolerance = tolerance();
    ends_ = {end_};
    for (const double f : {0.85, 0.64, 0.41, 0.17}) ends_.push_back(source_.with_rates(span(f), motion_));
    const int np = end_.np;
    std::vector<VectorXd> mu, gradient;
    for (const auto& b : ends_) {
      stage_(fmt::format("terminal() at t = {:.9g} s", b.t));
      VectorXd x = VectorXd::Zero(layout_->candidate_size()), g = VectorXd::Zero(np);
      candidate_.terminal(b, x, g);
      mu.push_back(layout_->from_candidate(checked(x, layout_->candidate_size(), "terminal", b.t)));
      gradient.push_back(checked(g, np, "terminal (gradient)", b.t));
      c.sample_time.push_back(b.t);
    }
    const auto samples = static_cast<Eigen::Index>(ends_.size());
    for (const auto& k : layout_->blocks()) {
      if (!k.present || !k.differential) continue;
      c.where.push_back("the terminal value " + k.group + "(T)");
      c.components.push_back(names_of(k));
      c.sign_free.push_back(0);
      VectorXd y(samples * k.count);
      for (Eigen::Index i = 0; i < samples; ++i)
        y.segment(i * k.count, k.count) = mu[static_cast<std::size_t>(i)].segment(k.first, k.count);
      c.candidate.push_back(y);
    }
    c.where.push_back("the gradient at T");
    c.components.push_back(parameter_names());
    c.sign_free.push_back(0);
    VectorXd y(samples * np);
    for (Eigen::Index i = 0; i < samples; ++i) y.segment(i * np, np) = gradient[static_cast<std::size_t>(i)];
    c.candidate.push_back(y);
    c.model = [this, np, samples](const std::vector<Alteration>& a) {
      AdjointModel& model = layout_->model();
      model.alter(a);
      std::vector<VectorXd> out;
      for (const auto& k : layout_->blocks())
        if (k.present && k.differential) out.emplace_back(samples * k.count);
      out.emplace_back(samples * np);
      for (Eigen::Index i = 0; i < samples; ++i) {
        VectorXd x, g = VectorXd::Zero(np);
        model.terminal(ends_[static_cast<std::size_t>(i)], x, g);
        std::size_t block = 0;
        for (const auto& k : layout_->blocks())
          if (k.present && k.differential) out[block++].segment(i * k.count, k.count) = x.segment(k.first, k.count);
        out[block].segment(i * np, np) = g;
      }
      return out;
    };
    return c;
  }

  CandidateComparison start_comparison() {
    CandidateComparison c;
    c.sections = {Section::start};
    const int np = end_.np;
    const Eigen::Index samples = mu_[0].cols() - 1;
    start_blocks_ = cache_.at(t0_);
    // P is M mu - g_a where both are unknowns: a candidate may use either.
    start_mu_ = mu_[0];
    for (const auto& k : layout_->blocks())
      if (k.group == "P")
        for (Eigen::Index j = 0; j < samples; ++j) {
          const AdjointBlocks& b = start_blocks_;
          auto P = start_mu_.col(j).segment(k.first, k.count);
          const VectorXd mu = start_mu_.col(j).segment(2 * k.count + b.nz, k.count);
          if (b.f > 0)
            P = b.My * mu - b.R.transpose() * (b.g_a - b.M * (b.S * b.g_lambda));
          else
            P = b.M * mu - b.g_a;
        }
    c.where = {"the gradient's terms at the start"};
    c.components = {parameter_names()};
    c.sign_free = {0};
    VectorXd y(samples * np);
    for (Eigen::Index j = 0; j < samples; ++j) {
      stage_("start_contribution()");
      y.segment(j * np, np) =
          checked(candidate_.start_contribution(start_blocks_, layout_->to_candidate(start_mu_.col(j)), start_.Sq0,
                                                start_.Sv0, start_.Sz0),
                  np, "start_contribution", t0_);
      c.sample_time.push_back(t0_);
    }
    c.candidate = {y};
    c.model = [this, np, samples](const std::vector<Alteration>& a) {
      AdjointModel& model = layout_->model();
      model.alter(a);
      VectorXd out(samples * np);
      for (Eigen::Index j = 0; j < samples; ++j)
        out.segment(j * np, np) =
            model.start_contribution(start_blocks_, start_mu_.col(j), start_.Sq0, start_.Sv0, start_.Sz0);
      return std::vector<VectorXd>{out};
    };
    return c;
  }

  const CandidateAdjoint& candidate_;
  const CandidateReference& ref_;
  const CandidateStage& stage_;
  CandidateBlocks source_;
  CandidateBlocks::Motion motion_;
  BlockCache cache_;
  std::unique_ptr<CandidateLayout> layout_;
  CandidateReport report_;
  CandidateStart start_;
  AdjointBlocks end_, start_blocks_;
  std::vector<double> grid_, changes_;
  CandidateRun exact_;
  VectorXd gradient_;
  std::vector<VectorXd> found_;
  std::vector<AdjointBlocks> points_, ends_;
  std::vector<MatrixXd> mu_;
  MatrixXd start_mu_;
  double t0_ = 0, t1_ = 1;
};

}  // namespace

CandidateReport check_candidate(const CandidateAdjoint& candidate, const CandidateReference& reference,
                                const CandidateStage& stage, bool terms_only) {
  candidate.tell_usual_unknowns(usual_unknowns(reference.problem.formulation));
  return Checker(candidate, reference, stage).run(terms_only);
}

}  // namespace costate
