// Hand-derived equations across the jumps of a motion: kinks of drivers (8.1), times that parameters move (8.2), and
// events (17). All go by what an adjoint or a tangent is in terms of changes of (q, v, z), which every formulation
// says of its own unknowns (of_states(), from_states()).
#include <algorithm>

#include "costate/adjoint/hand_equations.h"
#include "costate/level/fixed_times.h"

namespace costate {

namespace {
std::vector<double*> columns_of(Eigen::MatrixXd& Y) {
  std::vector<double*> columns;
  for (Eigen::Index j = 0; j < Y.cols(); ++j) columns.push_back(Y.col(j).data());
  return columns;
}

StateView at(double t, const std::vector<double>& y, int n) {
  StateView s;
  s.t = t;
  s.q = y.data();
  s.v = y.data() + n;
  s.z = y.data() + 2 * n;
  return s;
}
}  // namespace

MotionEvents::Side HandEquations::side() {
  const StateView s = state();
  MotionEvents::Side r;
  r.a.assign(s.a, s.a + n_);
  r.zdot = assembly_.zdot;
  r.cost = objective_.running.empty() ? 0 : objective_.running_value(s, assembly_);
  return r;
}

void HandEquations::cross(const MotionJump& jump, const double* qvz, Eigen::MatrixXd& X, Eigen::VectorXd& gradient) {
  if (jump.map) return cross_stretch(jump, X, gradient);
  if (jump.events.empty()) return cross_kink(jump.before, jump.after, qvz, X, gradient);
  if (direction_ == Direction::forward)
    for (const MetEvent& e : jump.events) cross_event(e, X, gradient);
  else
    for (auto e = jump.events.rbegin(); e != jump.events.rend(); ++e) cross_event(*e, X, gradient);
}

void HandEquations::cross_stretch(const MotionJump& jump, Eigen::MatrixXd& X, Eigen::VectorXd& gradient) {
  const StretchMap& map = *jump.map;
  const bool forward = direction_ == Direction::forward;
  evaluate(forward ? jump.before : jump.after, forward ? map.before.data() : map.after.data());
  Eigen::MatrixXd Y = of_states(X);
  if (forward)
    map.push(Y, gradient);
  else
    map.pull(Y.data(), gradient.data());
  evaluate(forward ? jump.after : jump.before, forward ? map.after.data() : map.before.data());
  from_states(Y, X, gradient);
}

void HandEquations::cross_kink(double t_before, double t_after, const double* qvz, Eigen::MatrixXd& X,
                               Eigen::VectorXd& gradient) {
  std::vector<double> before(qvz, qvz + 2 * n_ + nz_), after = before;
  evaluate(t_before, before.data());
  const bool forward = direction_ == Direction::forward;
  Eigen::MatrixXd Y;
  if (forward) Y = of_states(X);
  // Where parameters move this time: what the state does on either side.
  MovingTime moving;
  for (const MovingInstant& m :
       moving_instants(assembly_.mechanism(), objective_, assembly_.parameters(), assembly_.numbers()))
    if (m.t == t_after) moving.by = m.by;
  const bool moves = !moving.by.empty();
  const auto rates = [&](const std::vector<double>& y, std::vector<double>& out) {
    const MotionEvents::Side s = side();
    out.assign(y.begin() + n_, y.begin() + 2 * n_);
    out.insert(out.end(), s.a.begin(), s.a.end());
    out.insert(out.end(), s.zdot.begin(), s.zdot.end());
    return s.cost;
  };
  if (moves) moving.cost = rates(before, moving.before);
  const double* v = velocity_jump().calc(at(t_before, before, n_), t_after);
  std::copy(v, v + n_, after.begin() + n_);
  if (moves) {
    evaluate(t_after, after.data());
    moving.cost -= rates(after, moving.after);
    if (forward) evaluate(t_before, before.data());  // as the balance of impulses found it
  }
  const MovingTime* time = moves ? &moving : nullptr;
  if (forward) {
    velocity_jump().tangent(at(t_before, before, n_), t_after, columns_of(Y).data(), static_cast<int>(Y.cols()), time);
    for (std::size_t j = 0; j < moving.by.size(); ++j)
      gradient[static_cast<Eigen::Index>(j)] += moving.cost * moving.by[j];
    evaluate(t_after, after.data());
  } else {
    evaluate(t_after, after.data());
    Y = of_states(X);
    velocity_jump().adjoint(at(t_before, before, n_), t_after, Y.data(), gradient.data(), time);
    evaluate(t_before, before.data());
  }
  from_states(Y, X, gradient);
}

void HandEquations::cross_event(const MetEvent& met, Eigen::MatrixXd& X, Eigen::VectorXd& gradient) {
  if (!events_) {
    events_ = std::make_unique<MotionEvents>(assembly_);
    events_->use(velocity_jump().balance());
    events_->recall(history_);
    events_->carry_slips_from_rest();
  }
  const double t = met.t;
  std::vector<double> after = met.qvz;
  const StateView before = at(t, met.qvz, n_);
  evaluate(t, met.qvz.data());
  const MotionEvents::Side minus = side();
  Eigen::MatrixXd Y;
  const bool forward = direction_ == Direction::forward;
  if (forward) Y = of_states(X);
  events_->cross(met.event, before, after.data() + n_, after.data() + 2 * n_);
  evaluate(t, after.data());
  const MotionEvents::Side plus = side();
  if (!forward) Y = of_states(X);
  evaluate(t, met.qvz.data());  // where impulses are solved for
  if (forward) {
    std::vector<double> cost(static_cast<std::size_t>(Y.cols()), 0);
    events_->tangent(met.event, before, minus, plus, columns_of(Y).data(), static_cast<int>(Y.cols()), cost.data());
    for (std::size_t j = 0; j < cost.size(); ++j) gradient[static_cast<Eigen::Index>(j)] += cost[j];
    evaluate(t, after.data());
  } else {
    events_->adjoint(met.event, before, minus, plus, Y.data(), gradient.data());
    evaluate(t, met.qvz.data());
  }
  from_states(Y, X, gradient);
}

}  // namespace costate
