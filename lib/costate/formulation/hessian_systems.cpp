#include "costate/formulation/hessian_systems.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/adjoint/second_tangents.h"
#include "costate/base/error.h"
#include "costate/element/force/rigid_contact.h"
#include "costate/level/unknown_names.h"

namespace costate {

namespace {

// Of the clock beside what is steep: 1e-6 of the layer, whose part of the integral, down to 1e-3 of it, is then right
// to as much; the depth has seven digits there.
// From this power on what is steep is not told from the rest.
constexpr double kNearest = 0.0316, kAlikePowers = 2.95;
// What has just begun from rest has the speed of its offset.
constexpr double kAtRest = 2 * kSlidingOffset;

[[noreturn]] void no_sensitivities() {
  throw CapabilityError("The passes of a Hessian have no sensitivities of their own; ask for the Hessian instead.");
}

/// `column` is "d1." and so on: the unknowns of one column after those of the motion.
void append_column(const Mechanism& mechanism, const std::string& column, std::vector<Unknown>& unknowns) {
  std::vector<Unknown> of_motion;
  append_differential_unknowns(mechanism, of_motion);
  for (Unknown& u : of_motion) {
    u.name = column + u.name;
    unknowns.push_back(std::move(u));
  }
}

std::shared_ptr<const Mechanism> mechanism_of(const HessianEquations& e) { return e.assembly().mechanism_ptr(); }

}  // namespace

HessianPass::HessianPass(HessianEquations& equations)
    : OdeSystem(mechanism_of(equations), equations.assembly().parameters(), {}),
      equations_(equations),
      newton_(mechanism_of(equations), equations.assembly().parameters(), {}, equations.stabilization()),
      columns_(1 + equations.directions()) {}

void HessianPass::set_parameters(const double* rho) {
  OdeSystem::set_parameters(rho);
  newton_.set_parameters(rho);
}

void HessianPass::append_columns(const std::string& first, const std::string& others) {
  append_column(assembly_.mechanism(), first, unknowns_);
  for (int k = 1; k < columns_; ++k) append_column(assembly_.mechanism(), fmt::format("{}{}.", others, k), unknowns_);
}

void HessianPass::solve_columns(double* b, bool transposed) {
  for (int k = 0; k < columns_; ++k, b += equations_.state_size())
    transposed ? newton_.solve_transposed(b) : newton_.solve(b);
}

void HessianPass::tangent(double, const double*, const double* const*, double* const*, int, bool) {
  no_sensitivities();
}
void HessianPass::tangent_running_cost(double, const double*, const double* const*, double*, int) {
  no_sensitivities();
}
void HessianPass::tangent_terminal_cost(double, const double*, const double* const*, double*, int) {
  no_sensitivities();
}
void HessianPass::running_cost_gradient(double, const double*, double*) { no_sensitivities(); }
void HessianPass::adjoint_rhs(double, const double*, const double*, double*) { no_sensitivities(); }
void HessianPass::adjoint_integrand(double, const double*, const double*, double*) { no_sensitivities(); }
void HessianPass::terminal_adjoint(double, const double*, double*, double*) { no_sensitivities(); }

TangentMotion::TangentMotion(HessianEquations& equations)
    : HessianPass(equations),
      level_(assembly_, equations.stabilization()),
      velocity_jump_(assembly_, level_),
      instant_(assembly_, velocity_jump_.balance()) {
  append_columns("", "d");
  move_bends();
  if (!events_) return;
  events_->use(velocity_jump_.balance());
  events_->differentiate_between_steps();  // as the way back does
  events_->carry_slips_from_rest();
}

void TangentMotion::end_segments_at(const std::vector<double>& times) {
  smooth_ends_ = times;
  add_kinks(times);
}

void TangentMotion::jump(double t, double* y) {
  const double behind = segment_start(t);
  const bool event = pending_event_ >= 0;
  if (!event && std::find(smooth_ends_.begin(), smooth_ends_.end(), behind) != smooth_ends_.end()) return;
  HessianEquations::Event& e = met_.emplace_back();
  e.t = t;
  e.behind = event ? t : behind;
  e.event = pending_event_;
  e.before.assign(y, y + size());
  if (event) {
    const int n = assembly_.n();
    e.after = e.before;
    events_->cross(e.event, newton_.kinematic_state(t, e.before.data()), e.after.data() + n, e.after.data() + 2 * n);
    e.rigid = events_->is_rigid(e.event);
    e.bends = events_->bends(e.event);
    if (e.bends && !events_->changes_alone(e.event, e.before.data() + 2 * n, e.after.data() + 2 * n))
      refuse(t, fmt::format("other contacts change in the instant of '{}'", events_->name(e.event)));
    if (begins_from_rest(e) && !e.bends)
      refuse(t, fmt::format("'{}' lets a slip in space begin from rest, in a direction that it decides",
                            events_->name(e.event)));
  } else {
    refuse_sliding(t, y);
    e.by = Eigen::VectorXd::Zero(parameter_count());
    if (const std::vector<double>* by = moved_by(behind)) std::copy(by->begin(), by->end(), e.by.data());
  }
  equations_.cross_tangents(jumps(), e);
  std::copy(e.after.begin(), e.after.end(), y);
}

// Along a row along which a contact slides the impulse of a driver is none that balances like the constraints'.
void TangentMotion::refuse_sliding(double t, const double* y) {
  assembly_.switch_rows(y + 2 * assembly_.n());
  const auto& constraints = assembly_.mechanism().constraints();
  if (!assembly_.sliding_rows().empty() &&
      std::any_of(constraints.begin(), constraints.end(), [](const auto& c) { return c->rheonomic(); }))
    refuse(t, "a contact slides where a law jumps");
}

void TangentMotion::refuse(double t, const std::string& why) {
  throw CapabilityError(fmt::format(
      "At t = {:.9g} s {}: second derivatives are not carried across. Differences of gradients tell them.", t, why));
}

bool TangentMotion::begins_from_rest(const HessianEquations::Event& e) {
  return e.event >= 0 && events_->may_slip_in_space() &&
         events_->slowest_in_space(newton_.kinematic_state(e.behind, e.after.data())).speed <= kAtRest;
}

bool TangentMotion::stops_slip(const HessianEquations::Event& e) const {
  return e.event >= 0 && events_->stops_slip(e.event, e.before.data() + 2 * assembly_.n());
}

std::string TangentMotion::name_of(const HessianEquations::Event& event) const {
  return event.event < 0 ? "a jump of a law" : events_->name(event.event);
}

void TangentMotion::rhs(double t, const double* y, double* f) {
  const int N = equations_.state_size();
  equations_.motion(t, y, y + N, f, f + N);
}

void TangentMotion::start(double t, double* y, Eigen::MatrixXd*) {
  met_.clear();
  equations_.start(t, y, y + equations_.state_size());
}

HessianAdjoint::HessianAdjoint(HessianEquations& equations, Motion motion, double t_end, double scale)
    : HessianPass(equations), motion_(std::move(motion)), t_end_(t_end), scale_(scale) {
  for (const Parameter& p : assembly_.parameters().parameters) parameter_scale_.push_back(p.scale);
  append_columns("mu.", "dmu");
  events_.reset();  // they are the motion's, at times of its own
  for (int k = 0; k < columns_; ++k)
    for (const auto& name : assembly_.parameters().names())
      unknowns_.push_back(
          {(k == 0 ? "gradient." : fmt::format("product{}.", k)) + name, "1", Unknown::Role::force_state, true, true});
  const auto size = static_cast<std::size_t>(this->size());
  point_.assign(static_cast<std::size_t>(columns_ * equations.state_size()), 0);
  unscaled_.assign(size, 0);
  rates_.assign(size, 0);
}

// Without those of the base: kinks are times of the motion, not of tau, and the motion has none.
void HessianAdjoint::set_parameters(const double* rho) {
  assembly_.set_parameters(rho);
  newton_.set_parameters(rho);
}

double HessianAdjoint::from_steep(double clock) const {
  const double x = std::clamp((clock - begin_) / (end_ - begin_), 0.0, 1.0);
  return steep_ == Steep::at_begin ? x : 1 - x;
}

double HessianAdjoint::left_at(double clock) const {
  return steep_ == Steep::nowhere ? clock : left_from(std::max(kNearest, from_steep(clock)));
}

double HessianAdjoint::left_from(double x) const {
  const double way = (end_ - begin_) * x * x * x * x;
  return steep_ == Steep::at_begin ? begin_ + way : end_ - way;
}

double HessianAdjoint::clock_rate(double clock) const {
  if (steep_ == Steep::nowhere) return 1;
  const double x = std::max(kNearest, from_steep(clock));
  return 4 * x * x * x;
}

double HessianAdjoint::at(double tau) { return at_time(t_end_ - left_at(tau)); }

double HessianAdjoint::at_time(double time) {
  const double t = std::clamp(time, from_, to_);
  motion_(t, point_.data());
  return t;
}

MechanismState HessianAdjoint::mechanism_state(double tau, const double*) {
  const double t = at(tau);
  return newton_.mechanism_state(t, point_.data());
}

void HessianAdjoint::rhs(double tau, const double* y, double* f) {
  const double near = steep_ == Steep::nowhere ? kNearest : from_steep(tau);
  rates(t_end_ - left_at(tau), clock_rate(tau), y, f);
  if (!(near < kNearest)) return;
  const double u = near / kNearest, cube = u * u * u, steep = std::pow(2, power_);
  if (power_ > kAlikePowers) {
    for (int i = 0; i < size(); ++i) f[i] *= cube;
    return;
  }
  further_.resize(static_cast<std::size_t>(size()));
  rates(t_end_ - left_from(2 * kNearest), 8 * clock_rate(tau), y, further_.data());
  for (int i = 0; i < size(); ++i) {
    const double a = (8 * f[i] - further_[static_cast<std::size_t>(i)]) / (8 - steep);
    f[i] = a * std::pow(u, power_) + (f[i] - a) * cube;
  }
}

void HessianAdjoint::rates(double time, double clock, const double* y, double* f) {
  const int N = equations_.state_size(), np = equations_.parameter_count(), all = columns_ * N;
  const double t = at_time(time);
  equations_.evaluate(t, point_.data(), point_.data() + N);
  for (int i = 0; i < all; ++i) unscaled_[static_cast<std::size_t>(i)] = scale_ * y[i];
  double *r = rates_.data(), *q = r + all;
  equations_.adjoint(unscaled_.data(), unscaled_.data() + N, r, r + N, q, q + np);
  const double rate = clock / scale_;
  for (int i = 0; i < all; ++i) f[i] = -r[i] * rate;
  for (int k = 0; k < columns_; ++k)
    for (int j = 0; j < np; ++j)
      f[all + k * np + j] = q[k * np + j] * parameter_scale_[static_cast<std::size_t>(j)] * rate;
}

void HessianAdjoint::factor(double tau, const double*, double gamma) {
  const double t = at(tau);
  newton_.factor(t, point_.data(), gamma * clock_rate(tau));
}

void HessianAdjoint::cross(double* y, const std::function<void(double* mu, double* added)>& carry) {
  const int np = equations_.parameter_count(), all = columns_ * equations_.state_size();
  for (int i = 0; i < all; ++i) unscaled_[static_cast<std::size_t>(i)] = scale_ * y[i];
  std::vector<double> added(static_cast<std::size_t>(columns_ * np), 0);
  carry(unscaled_.data(), added.data());
  for (int i = 0; i < all; ++i) y[i] = unscaled_[static_cast<std::size_t>(i)] / scale_;
  for (std::size_t i = 0; i < added.size(); ++i)
    y[all + static_cast<int>(i)] += added[i] * parameter_scale_[i % static_cast<std::size_t>(np)] / scale_;
}

void HessianAdjoint::cross(const HessianEquations::Bend& bend, double* y) {
  cross(y, [&](double* mu, double* added) {
    equations_.cross_bend(bend, mu, mu + equations_.state_size(), added + equations_.parameter_count());
  });
}

void HessianAdjoint::cross(const HessianEquations::Jumps& jumps, const HessianEquations::Event& event, double* y) {
  cross(y, [&](double* mu, double* added) {
    equations_.cross_event(jumps, event, mu, mu + equations_.state_size(), added, added + equations_.parameter_count());
  });
}

void HessianAdjoint::cross(const SecondStretchMap& map, double* y) {
  cross(y, [&](double* mu, double* added) {
    map.pull(mu, mu + equations_.state_size(), added, added + equations_.parameter_count());
  });
}

void HessianAdjoint::start(double tau, double* y, Eigen::MatrixXd*) {
  const int N = equations_.state_size(), np = equations_.parameter_count(), all = columns_ * N;
  const double t = at(tau);
  equations_.evaluate(t, point_.data(), point_.data() + N);
  double* q = y + all;
  std::fill(q, q + columns_ * np, 0.0);
  equations_.end(y, y + N, q, q + np);
  for (int i = 0; i < all; ++i) y[i] /= scale_;
  for (int k = 0; k < columns_; ++k)
    for (int j = 0; j < np; ++j) q[k * np + j] *= parameter_scale_[static_cast<std::size_t>(j)] / scale_;
}

void HessianAdjoint::finish(double t, const double* y, double* gradient, double* products) {
  const int N = equations_.state_size(), np = equations_.parameter_count(), all = columns_ * N;
  for (int i = 0; i < all; ++i) unscaled_[static_cast<std::size_t>(i)] = scale_ * y[i];
  for (int k = 0; k < columns_; ++k)
    for (int j = 0; j < np; ++j)
      (k == 0 ? gradient : products + static_cast<std::ptrdiff_t>(k - 1) * np)[j] =
          y[all + k * np + j] * scale_ / parameter_scale_[static_cast<std::size_t>(j)];
  for (Eigen::Index i = 0; i < start_weights_.size(); ++i) unscaled_[static_cast<std::size_t>(i)] += start_weights_[i];
  equations_.begin(t, unscaled_.data(), unscaled_.data() + N, gradient, products);
}

}  // namespace costate
