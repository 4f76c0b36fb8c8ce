#include "costate/discrete/radau_step.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "costate/base/error.h"

namespace costate {

namespace {
constexpr double kUnitRounding = std::numeric_limits<double>::epsilon();
// Corrections whose followers are below this part of the unknowns end the iteration, and below kStageNoise such as no
// longer fall: rounding is what remains.
constexpr double kStageRounding = kUnitRounding, kStageNoise = 1e-12, kStageFalls = 0.3;
// Near singular positions rounding is larger: below this, corrections that do not fall at all are such.
constexpr double kLargeStageNoise = 1e-9;
constexpr int kMostStageIterations = 25;
// Where corrections do not fall by this, the step is too long for one Jacobian.
constexpr double kSlowStages = 0.7;
// What the estimate of an error keeps of its digits, in parts of the unknowns.
constexpr double kEstimateRounding = 16 * kUnitRounding;
// A step of this part of another is an instant.
constexpr double kInstantOfStep = 1e-12;
// Corrections of this part of the absolute tolerance are nothing.
constexpr double kNoCorrection = 1e-9;
// The last polynomial is not extrapolated over more than so many of its steps.
constexpr double kFarExtrapolation = 4;

std::vector<char> stage_differential(const DaeSystem& system) {
  std::vector<char> r;
  for (const Unknown& u : system.unknowns()) r.push_back(u.differential ? 1 : 0);
  return r;
}

/// Of the polynomial of Lagrange through `nodes`: what the value at node j weighs at x.
double lagrange(const std::vector<double>& nodes, std::size_t j, double x) {
  double w = 1;
  for (std::size_t k = 0; k < nodes.size(); ++k)
    if (k != j) w *= (x - nodes[k]) / (nodes[j] - nodes[k]);
  return w;
}

/// The same with a node at 0 more.
double lagrange_with_start(const std::vector<double>& nodes, std::size_t j, double x) {
  return lagrange(nodes, j, x) * x / nodes[j];
}
}  // namespace

RadauStep::RadauStep(const RadauScheme& scheme, DaeSystem& system, bool has_cost, std::vector<double> atol,
                     Residual residual)
    : scheme_(scheme),
      system_(system),
      n_(system.size()),
      size_(system.size() + (has_cost ? 1 : 0)),
      has_cost_(has_cost),
      atol_(std::move(atol)),
      residual_(std::move(residual)),
      matrix_(std::make_shared<StageMatrix>(scheme, system.jacobian_pattern(), stage_differential(system))) {
  const auto n = static_cast<std::size_t>(n_), s = static_cast<std::size_t>(scheme.stages);
  y_.assign((s + 1) * static_cast<std::size_t>(size_), 0);
  z_.assign(s * n, 0);
  old_ = right_ = z_;
  for (auto* x : {&rates_, &start_residual_, &stage_rates_, &sizes_, &zero_}) x->assign(n, 0);
  jacobian_.assign(system.jacobian_pattern().row.size(), 0);
  costs_.assign(s + 1, 0);
  role_size_.assign(static_cast<std::size_t>(Unknown::Role::stabilizer) + 1, 0);
}

RadauStep::~RadauStep() = default;

void RadauStep::evaluate_start() {
  ++evaluations_;
  residual_(t_, start(), zero_.data(), start_residual_.data());
  for (std::size_t e = 0; e < rates_.size(); ++e) rates_[e] = matrix_->differential()[e] ? -start_residual_[e] : 0;
  if (has_cost_) costs_[0] = system_.running_cost(t_, start());
}

void RadauStep::begin(double t, const double* y) {
  t_ = t_end_ = t;
  h_ = 0;
  known_ = false;
  std::copy(y, y + size_, y_.data());
  evaluate_start();
}

void RadauStep::go_on() {
  t_ = t_end_;
  old_h_ = h_;
  h_ = 0;
  known_ = old_start_known_ = true;
  old_ = z_;
  std::copy(end(), end() + size_, y_.data());
  evaluate_start();
}

void RadauStep::resume(const RadauStages& stages) {
  t_ = t_end_ = stages.t_end;
  old_h_ = stages.h;
  h_ = 0;
  known_ = true;
  // Without what it began with; of increments from anywhere the differences are extrapolated.
  old_start_known_ = false;
  for (int i = 0; i < scheme_.stages; ++i)
    std::copy_n(stages.y + i * stages.stride, n_, old_.data() + static_cast<std::ptrdiff_t>(i) * n_);
  const double* last = stages.y + (scheme_.stages - 1) * stages.stride;
  std::copy(last, last + n_, y_.data());
  evaluate_start();
}

void RadauStep::extrapolate(const std::vector<double>& from, const std::vector<double>& at, bool from_end,
                            bool start_known) {
  const auto s = static_cast<std::size_t>(scheme_.stages), n = static_cast<std::size_t>(n_);
  for (std::size_t i = 0; i < s; ++i) {
    double* z = increment(static_cast<int>(i));
    std::fill(z, z + n, 0.0);
    for (std::size_t j = 0; j < s; ++j) {
      // Algebraic unknowns at the beginning of a step need not be those of its stages.
      const double end = from_end && j + 1 == s ? 1 : 0, stages_only = lagrange(scheme_.c, j, at[i]) - end,
                   with_start = lagrange_with_start(scheme_.c, j, at[i]) - end;
      const double w[2] = {stages_only, start_known ? with_start : stages_only};
      const double* zj = from.data() + j * n;
      for (std::size_t e = 0; e < n; ++e) z[e] += w[matrix_->differential()[e] ? 1 : 0] * zj[e];
    }
  }
}

void RadauStep::form_stage(int i) {
  const double *z = increment(i), *y0 = start();
  double* y = stage(i);
  for (int e = 0; e < n_; ++e) y[e] = y0[e] + z[e];
  Eigen::Map<Eigen::ArrayXd> rates(stage_rates_.data(), n_);
  rates.setZero();
  for (int j = 0; j < scheme_.stages; ++j)
    rates += scheme_.w(i, j) / h_ * Eigen::Map<const Eigen::ArrayXd>(increment(j), n_);
  for (std::size_t e = 0; e < stage_rates_.size(); ++e)
    if (!matrix_->differential()[e]) stage_rates_[e] = 0;
}

void RadauStep::set_sizes() {
  std::fill(role_size_.begin(), role_size_.end(), 0.0);
  const auto& unknowns = system_.unknowns();
  const auto role = [&](std::size_t e) { return static_cast<std::size_t>(unknowns[e].role); };
  for (int i = -1; i < scheme_.stages; ++i) {
    const double* y = stage(i);
    for (std::size_t e = 0; e < sizes_.size(); ++e) role_size_[role(e)] = std::max(role_size_[role(e)], std::abs(y[e]));
  }
  // What moves the positions by no more than their rounding is rounding, too.
  auto& velocity = role_size_[static_cast<std::size_t>(Unknown::Role::velocity)];
  velocity = std::max(velocity, role_size_[static_cast<std::size_t>(Unknown::Role::position)]);
  for (std::size_t e = 0; e < sizes_.size(); ++e) {
    const double tolerated = e < atol_.size() ? kNoCorrection / kUnitRounding * atol_[e] : 0;
    sizes_[e] = unknowns[e].differential ? std::max({role_size_[role(e)], tolerated, 1e-300}) : 0;
  }
}

double RadauStep::correction_size(const double* corrections) const {
  double largest = 0;
  for (int i = 0; i < scheme_.stages; ++i)
    for (std::size_t e = 0; e < sizes_.size(); ++e) {
      const double x = corrections[static_cast<std::size_t>(i) * sizes_.size() + e];
      // NaN is the largest.
      if (sizes_[e] > 0 ? !(std::abs(x) / sizes_[e] <= largest) : !std::isfinite(x))
        largest = sizes_[e] > 0 ? std::abs(x) / sizes_[e] : HUGE_VAL;
    }
  return largest;
}

void RadauStep::factor() {
  // Near the middle of the step.
  const int i = scheme_.stages / 2;
  form_stage(i);
  system_.jacobian(scheme_.time(i, t_, h_, t_end_), stage(i), stage_rates_.data(), 0, jacobian_.data());
  if (const int bad = matrix_->factor(jacobian_.data(), h_); bad >= 0)
    throw StepError(
        fmt::format("The matrix of a step of {:.3g} s of '{}' is singular at t = {:.9g} s, at '{}'. Redundant "
                    "joints or a singular configuration: penalty and augmented-lagrangian carry both, maggi the "
                    "former.",
                    h_, scheme_.name, t_, system_.unknowns()[static_cast<std::size_t>(bad)].name));
}

void RadauStep::iterate() {
  const int s = scheme_.stages;
  double before = 0;
  contraction_ = 0;
  for (int k = 0;; ++k) {
    for (int i = 0; i < s; ++i) {
      form_stage(i);
      double* r = right_.data() + static_cast<std::ptrdiff_t>(i) * n_;
      ++evaluations_;
      residual_(scheme_.time(i, t_, h_, t_end_), stage(i), stage_rates_.data(), r);
      for (int e = 0; e < n_; ++e) r[e] = -r[e];
    }
    set_sizes();
    matrix_->solve(right_.data());
    const double size = correction_size(right_.data());
    for (std::size_t e = 0; e < z_.size(); ++e) z_[e] += right_[e];
    if (size <= kStageRounding) break;
    if (k > 0) {
      const double rate = size / before;
      if (size > kStageNoise) contraction_ = rate;
      if (rate < 1 && size * rate / (1 - rate) <= kStageRounding) break;
      if (size < kStageNoise && rate > kStageFalls) break;
      if (size < kLargeStageNoise && rate > kSlowStages) break;
      if (k > 2 && rate > kSlowStages) k = kMostStageIterations;
    }
    if (!std::isfinite(size) || k >= kMostStageIterations)
      throw StepError(
          fmt::format("Newton's iteration of a step of {:.3g} s of '{}' from t = {:.9g} s does not converge.", h_,
                      scheme_.name, t_));
    before = size;
  }
  for (int i = 0; i < s; ++i) form_stage(i);
}

void RadauStep::attempt(double h, double t_end) {
  h_ = h;
  t_end_ = t_end;
  const int s = scheme_.stages;
  if (known_ && h <= kFarExtrapolation * old_h_) {
    std::vector<double> at;
    for (const double c : scheme_.c) at.push_back(1 + c * h / old_h_);
    extrapolate(old_, at, true, old_start_known_);
  } else {
    for (int i = 0; i < s; ++i)
      for (int e = 0; e < n_; ++e)
        increment(i)[e] = scheme_.c[static_cast<std::size_t>(i)] * h * rates_[static_cast<std::size_t>(e)];
  }
  finish();
}

void RadauStep::finish() {
  const int s = scheme_.stages;
  for (int i = 0; i < s; ++i) form_stage(i);
  factor();
  iterate();
  if (!has_cost_) return;
  double sum = 0;
  for (int i = 0; i < s; ++i) {
    const double g = system_.running_cost(scheme_.time(i, t_, h_, t_end_), stage(i));
    costs_[static_cast<std::size_t>(i) + 1] = g;
    sum += scheme_.weight(i) * g;
  }
  stage(s - 1)[n_] = start()[n_] + h_ * sum;
}

// The Jacobian's change over a step makes corrections fall by c h^2; as many of them as rounding wants over the length
// of the step, -1/(h log(c h^2)), are the fewest where that is exp(-2).
double RadauStep::growth() const {
  constexpr double kBest = 0.135;
  return contraction_ > 0 ? std::sqrt(kBest / contraction_) : HUGE_VAL;
}

void RadauStep::end_rates(double* yp) const {
  for (int e = 0; e < n_; ++e) {
    yp[e] = 0;
    if (!matrix_->differential()[static_cast<std::size_t>(e)]) continue;
    for (int j = 0; j < scheme_.stages; ++j) yp[e] += scheme_.w(scheme_.stages - 1, j) / h_ * increment(j)[e];
  }
}

StepEstimate RadauStep::estimate(double rtol, const double* atol) {
  const auto& unknowns = system_.unknowns();
  const int s = scheme_.stages;
  // E sum of error_i y'_i over the first weight, with h Y' = w Z.
  std::vector<double>& change = right_;
  for (int e = 0; e < n_; ++e) {
    double sum = -start_residual_[static_cast<std::size_t>(e)];
    if (matrix_->differential()[static_cast<std::size_t>(e)])
      for (int j = 0; j < s; ++j) {
        double w = 0;
        for (int i = 0; i < s; ++i) w += scheme_.error[static_cast<std::size_t>(i) + 1] * scheme_.w(i, j);
        sum += w / (scheme_.error[0] * h_) * increment(j)[e];
      }
    change[static_cast<std::size_t>(e)] = sum;
  }
  matrix_->filter(change.data());
  const auto tolerance = [&](int e) { return atol[e] + rtol * std::max(std::abs(start()[e]), std::abs(end()[e])); };
  double off = 0, moved = 0, rounding = 0, velocity = 0;
  int count = 0;
  for (int e = 0; e < n_; ++e) {
    const auto k = static_cast<std::size_t>(e);
    if (!unknowns[k].differential || !unknowns[k].in_norm) continue;
    const double x = change[k] / tolerance(e), d = (end()[e] - start()[e]) / tolerance(e),
                 u = kEstimateRounding * start()[e] / tolerance(e);
    off += x * x;
    if (unknowns[k].role == Unknown::Role::velocity) velocity = std::max(velocity, std::abs(change[k]));
    moved += d * d;
    rounding += u * u;
    ++count;
  }
  off = count > 0 ? std::sqrt(off / count) : 0;
  moved = count > 0 ? std::sqrt(moved / count) : 0;
  // Of a short step the estimate is the rounding of what it is made of, which no shorter one makes less.
  StepEstimate r{off, moved > 1 && off * off * count > rounding ? off / moved : 0};
  if (has_cost_) {
    double cost = 0;
    for (int i = 0; i <= s; ++i)
      cost += scheme_.error[static_cast<std::size_t>(i)] * costs_[static_cast<std::size_t>(i)];
    cost = std::abs(h_ * cost);
    r.error = std::max(r.error, cost / tolerance(n_));
    r.rate_error =
        std::max(r.rate_error, cost_pace_.rate_error(cost, h_, costs_.front(), costs_.back(), tolerance(n_)));
  }
  r.error /= scheme_.estimate_factor(rtol);
  r.velocity = velocity / scheme_.estimate_factor(rtol);
  return r;
}

double RadauStep::first_step(double rtol, const double* atol, double span) const {
  // A part of the time in which the state changes by its size.
  double size = 0, rate = 0;
  for (int e = 0; e < n_; ++e) {
    const auto k = static_cast<std::size_t>(e);
    if (!matrix_->differential()[k]) continue;
    const double w = 1 / (atol[e] + rtol * std::abs(start()[e]));
    size += w * start()[e] * w * start()[e];
    rate += w * rates_[k] * w * rates_[k];
  }
  constexpr double kPart = 1e-3, kOtherwise = 1e-6;
  const double h = size > 0 && rate > 0 ? kPart * std::sqrt(size / rate) : kOtherwise;
  return std::min(std::clamp(h, kOtherwise * span, kPart * span), span);
}

void RadauStep::dense(double x, double* y) const {
  const auto s = static_cast<std::size_t>(scheme_.stages);
  std::copy(start(), start() + size_, y);
  for (std::size_t j = 0; j < s; ++j) {
    const double w[2] = {lagrange(scheme_.c, j, x), lagrange_with_start(scheme_.c, j, x)};
    const double* zj = increment(static_cast<int>(j));
    for (int e = 0; e < n_; ++e) y[e] += w[matrix_->differential()[static_cast<std::size_t>(e)] ? 1 : 0] * zj[e];
  }
  if (has_cost_) y[n_] += x * (end()[n_] - start()[n_]);
}

void RadauStep::within(double x, double* y) {
  // Of no length: the polynomial is as good.
  if (x * h_ <= kInstantOfStep * h_ + 8 * kUnitRounding * std::abs(t_)) return dense(x, y);
  if (!inner_) inner_ = std::make_unique<RadauStep>(scheme_, system_, has_cost_, atol_, residual_);
  RadauStep& inner = *inner_;
  inner.t_ = t_;
  std::copy(start(), start() + size_, inner.y_.data());
  inner.h_ = x * h_;
  inner.t_end_ = t_ + x * h_;
  std::vector<double> at;
  for (const double c : scheme_.c) at.push_back(x * c);
  inner.extrapolate(z_, at, false, true);
  try {
    inner.finish();
  } catch (const StepError&) {
    // At a singular position, where the whole step found its way: the polynomial through its stages is left.
    return dense(x, y);
  }
  std::copy(inner.end(), inner.end() + size_, y);
}

}  // namespace costate
