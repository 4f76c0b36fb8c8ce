#include "costate/discrete/step_cut.h"

#include <fmt/format.h>

#include <cmath>

#include "costate/base/error.h"
#include "costate/event/crossing_rate.h"

namespace costate {

namespace {
/// What begins to slide from rest at a cut does so along the multipliers before it.
class BeginsFromRest {
 public:
  BeginsFromRest(DiscreteScheme& scheme, const StepCut& cut) : slips_(scheme.stage_rows().slips()) {
    if (cut.begins_from_rest >= 0)
      slips_.begin_from_rest(cut.begins_from_rest,
                             scheme.state_of(cut.before.data()).lambda + cut.begins_from_rest + 1);
  }
  ~BeginsFromRest() { slips_.begin_from_rest(-1, nullptr); }

 private:
  StepSlips& slips_;
};

/// A kink that nothing but explicit time moves: the columns have been moved before.
MovingTime moved_kink(const std::vector<double>& by, std::size_t size) {
  MovingTime moving;
  moving.by = by;
  moving.before.assign(size, 0);
  moving.after.assign(size, 0);
  return moving;
}
}  // namespace

MotionEvents::Side CutCrossing::side(const std::vector<double>& record) const {
  const StateView s = scheme_.state_of(record.data());
  MotionEvents::Side r;
  r.a.assign(s.a, s.a + scheme_.assembly().n());
  const double* f = scheme_.rates_of(record.data());
  r.zdot.assign(f, f + scheme_.assembly().nz());
  return r;
}

double CutCrossing::guard_gradient(const StepCut& cut, ScalarGradient& out) {
  out.resize(scheme_.assembly());
  return scheme_.events().guard_gradient(cut.event, scheme_.state_of(cut.before.data()), side(cut.before),
                                         side(cut.after), out);
}

void CutCrossing::linearize_event(StepCut& cut) {
  cut.begins_from_rest = scheme_.events().begins_from_rest(cut.event, scheme_.state_of(cut.before.data()),
                                                           scheme_.state_of(cut.after.data()).z);
  const double by_time = guard_gradient(cut, cut.condition);
  if (cut.instant && !(cut.condition.lambda.isZero(0) && cut.condition.a.isZero(0)))
    throw SolverError(
        fmt::format("At t = {:.9g} s, at '{}', contacts change in one instant, and a gradient does not "
                    "exist there.",
                    cut.t_after, cut.name));
  set_rate(cut, cut.t_after, by_time);
}

void CutCrossing::set_rate(StepCut& cut, double t, double by_time) {
  const ScalarGradient& h = cut.condition;
  const StepColumn& E = cut.by_end;
  double terms = std::abs(by_time);
  cut.condition_rate = by_time;
  const auto add = [&](const Eigen::VectorXd& w, const Eigen::VectorXd& x) {
    cut.condition_rate += w.dot(x);
    terms += w.cwiseAbs().dot(x.cwiseAbs());
  };
  add(h.q, E.q);
  add(h.v, E.v);
  add(h.z, E.z);
  add(h.a, E.a);
  add(h.lambda, E.lambda);
  require_crossing(t, cut.name, cut.condition_rate, terms);
}

Eigen::RowVectorXd CutCrossing::time_change(const StepCut& cut, const DiscreteTangent& tangent) const {
  const int np = scheme_.assembly().np();
  if (cut.kind != StepCut::Kind::kink) return -tangent.along(cut.condition) / cut.condition_rate;
  if (cut.by.empty()) return Eigen::RowVectorXd::Zero(np);
  return Eigen::Map<const Eigen::RowVectorXd>(cut.by.data(), np);
}

void CutCrossing::pass(const StepCut& cut, const Eigen::RowVectorXd& dt, DiscreteTangent& tangent) {
  const StateView before = scheme_.state_of(cut.before.data());
  tangent.change([&](double* const* columns, int count) {
    if (cut.kind == StepCut::Kind::event)
      return scheme_.events().transition_tangent(cut.event, before, columns, dt.data(), count);
    const Assembly& a = scheme_.assembly();
    const MovingTime moving = moved_kink(cut.by, static_cast<std::size_t>(2 * a.n() + a.nz()));
    scheme_.velocity_jump().tangent(before, cut.t_after, columns, count, cut.by.empty() ? nullptr : &moving);
  });
  const BeginsFromRest begins(scheme_, cut);
  tangent.begin_anew(dt);
}

double CutCrossing::pass_back(const StepCut& cut, DiscreteAdjoint& adjoint) {
  const double behind = [&] {
    const BeginsFromRest begins(scheme_, cut);
    return adjoint.begin_anew_back();
  }();
  scheme_.load(cut.index, cut.before.data());
  const StateView before = scheme_.state();
  if (cut.kind == StepCut::Kind::event) guard_gradient(cut, again_);
  return behind + adjoint.change([&](double* bars, double* gradient) {
    if (cut.kind == StepCut::Kind::event) return scheme_.events().transition_adjoint(cut.event, before, bars, gradient);
    const Assembly& a = scheme_.assembly();
    const MovingTime moving = moved_kink(cut.by, static_cast<std::size_t>(2 * a.n() + a.nz()));
    scheme_.velocity_jump().adjoint(before, cut.t_after, bars, gradient, cut.by.empty() ? nullptr : &moving);
    return 0.0;
  });
}

void CutCrossing::give_time(const StepCut& cut, double weight, DiscreteAdjoint& adjoint) {
  if (cut.kind != StepCut::Kind::kink)
    adjoint.add(-weight / cut.condition_rate, cut.condition);
  else if (!cut.by.empty())
    adjoint.add_parameters(weight, cut.by);
}

}  // namespace costate
