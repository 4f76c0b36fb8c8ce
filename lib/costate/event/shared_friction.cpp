// Several contacts of one body that stick: who bears how much of its friction is not determined. Where friction falls
// as sliding begins, such a contact does not begin alone: its guard is what is left to the limits of all,
//   h = sum_c (mu_s,c N_c -+ T_c),
// which is determined where the weights w of its multipliers are orthogonal to all changes of these that move nothing,
// Phi_q^T dlambda = 0. What sticks without such a fall may reach its own limit before, and goes on to bear that.
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "costate/event/guard_value.h"
#include "costate/event/motion_events.h"
#include "costate/event/spatial_slip.h"
#include "costate/linear/to_dense.h"

namespace costate {

namespace {
// What is left of a row, or of weights, beside those that it depends on.
constexpr double kDependent = 1e-9;
}  // namespace

const std::vector<int>& MotionEvents::sharing(const GuardOf& g, const StateView& s) {
  static const std::vector<int> none;
  if (contacts_.size() < 2 || !impact_ || !s.lambda || !friction_falls(g)) return none;
  SharedFriction& shared = shared_[static_cast<std::size_t>(&g - guards_.data())];
  thread_local std::vector<double> modes;
  modes.clear();
  for (const ContactOf& c : contacts_) {
    if (c.part != contacts_[static_cast<std::size_t>(g.contact)].part) continue;
    for (const int state : {c.closed_state, c.sliding_state}) modes.push_back(state < 0 ? 0 : s.z[state]);
  }
  if (shared.modes != modes) {
    shared.modes = modes;
    shared.guards = find_sharing(g, s);
  }
  return shared.guards;
}

std::vector<int> MotionEvents::find_sharing(const GuardOf& g, const StateView& s) {
  const ContactOf& own = contacts_[static_cast<std::size_t>(g.contact)];
  std::vector<const ContactOf*> others;
  for (const ContactOf& c : contacts_)
    if (&c != &own && c.part == own.part && c.sliding_state >= 0 && !slides_in_space(c) && s.z[c.closed_state] > 0.5 &&
        s.z[c.sliding_state] == 0)
      others.push_back(&c);
  if (others.empty()) return {};
  impact_->balance().prepare(s);
  const Eigen::MatrixXd rows = to_dense(assembly_.jacobian(), assembly_.reaction_jacobian().data()).transpose();
  const auto friction_row = [](const ContactOf& c) { return c.first_row + 1; };
  std::vector<int> there, held{friction_row(own)};  // the others' friction left out
  for (int i = 0; i < assembly_.m(); ++i) {
    if (!assembly_.is_there(i)) continue;
    there.push_back(i);
    if (i != friction_row(own) &&
        std::none_of(others.begin(), others.end(), [&](const ContactOf* c) { return i == friction_row(*c); }))
      held.push_back(i);
  }
  const Eigen::MatrixXd A = rows(Eigen::all, held);
  const auto solver = A.completeOrthogonalDecomposition();
  std::vector<int> found;
  for (const ContactOf* c : others) {
    const Eigen::VectorXd b = rows.col(friction_row(*c)), x = solver.solve(b);
    if (!((A * x - b).norm() <= kDependent * b.norm()) || !(std::abs(std::abs(x[0]) - 1) <= kDependent)) continue;
    using Guard = UnilateralForce::Guard;
    const bool forward = (own.contact->guard_kind(g.k) == Guard::slip_forward) == (x[0] > 0);
    for (std::size_t i = 0; i < guards_.size(); ++i)
      if (guards_[i].contact == c - contacts_.data() &&
          c->contact->guard_kind(guards_[i].k) == (forward ? Guard::slip_forward : Guard::slip_backward))
        found.push_back(static_cast<int>(i));
  }
  // Whether the sum is determined.
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(assembly_.m());
  const auto add = [&](const GuardOf& of) {
    load(of, s);
    weights += by_multipliers_of(of);
  };
  add(g);
  for (const int i : found) add(guards_[static_cast<std::size_t>(i)]);
  const Eigen::MatrixXd by_motion = rows(Eigen::all, there).transpose();
  const Eigen::VectorXd w = weights(there), y = by_motion.completeOrthogonalDecomposition().solve(w);
  return (by_motion * y - w).norm() <= kDependent * w.norm() ? found : std::vector<int>{};
}

bool MotionEvents::sticks_within_limits(const ContactOf& c, const StateView& s, double beyond) {
  return std::none_of(guards_.begin(), guards_.end(), [&](const GuardOf& g) {
    using Guard = UnilateralForce::Guard;
    if (g.contact != &c - contacts_.data()) return false;
    const Guard kind = c.contact->guard_kind(g.k);
    return (kind == Guard::slip_forward || kind == Guard::slip_backward) && guard(g, s) < -beyond;
  });
}

double MotionEvents::guard(const GuardOf& g, const StateView& s) {
  if (const auto* together = held(g, s))
    return g.guarded->guard_name(g.k) == "release" ? together->weight() : together->margin();
  const auto own = [&](const GuardOf& of) {
    return guard_value(*of.force, *of.guarded, of.k, of.first_state, of.first_row, s, assembly_, gathered_);
  };
  double h = own(g);
  for (const int i : sharing(g, s)) h += own(guards_[static_cast<std::size_t>(i)]);
  return h;
}

Eigen::VectorXd MotionEvents::linearize_all(const GuardOf& g, const StateView& before, const Side& minus,
                                            bool columns) {
  // Guards of multipliers depend on these and on numbers alone.
  Eigen::VectorXd by_multipliers = Eigen::VectorXd::Zero(assembly_.m());
  std::vector<double> by_numbers(static_cast<std::size_t>(assembly_.np()), 0);
  for (const int i : sharing(g, before)) {
    linearize(guards_[static_cast<std::size_t>(i)], before, minus, columns);
    by_multipliers += by_multipliers_of(guards_[static_cast<std::size_t>(i)]);
    for (std::size_t j = 0; j < by_numbers.size(); ++j) by_numbers[j] += h_rho_[j];
  }
  linearize(g, before, minus, columns);
  if (const auto* together = held(g, before)) return linearize_held(*together);
  for (std::size_t j = 0; j < by_numbers.size(); ++j) h_rho_[j] += by_numbers[j];
  if (!lambda_.empty()) by_multipliers += by_multipliers_of(g);
  return by_multipliers;
}

}  // namespace costate
