// Contacts whose friction falls as sliding begins, from mu_s N of sticking to mu N: accelerations jump in an instant
// that depends on multipliers, (19.13) of lib/README.md.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/base/error.h"
#include "costate/event/contact_gap.h"
#include "costate/event/crossing_rate.h"
#include "costate/event/motion_events.h"

namespace costate {

namespace {
// Along the ground, of the largest acceleration, or what forces alone would make: less is none.
constexpr double kHeld = 1e-9;
}  // namespace

bool MotionEvents::friction_falls(const GuardOf& g) const {
  if (!by_multipliers(g)) return false;
  const ContactOf& own = contacts_[static_cast<std::size_t>(g.contact)];
  return own.contact->guard_kind(g.k) != UnilateralForce::Guard::release && friction_falls(own);
}

void MotionEvents::require_falling(int event, const StateView& before, const StateView& behind) {
  const ContactOf& own = *contact_of(event);
  if (!friction_falls(of(event)) || behind.z[own.closed_state] < 0.5 || behind.z[own.sliding_state] == 0) return;
  std::vector<double> x(static_cast<std::size_t>(assembly_.n() + assembly_.m()));
  solve_motion(behind, x.data());
  // Of what is held all accelerations are rounding.
  const double largest = std::max(acceleration_by_forces(behind), largest_of(x.data()));
  double along = 0;
  for (int row = 1; row < own.contact->row_count(); ++row)
    along = std::hypot(along, row_of(*own.force, *own.contact, row, behind, assembly_, x.data()).c2);
  if (along > kHeld * largest) return;
  throw CapabilityError(fmt::format(
      "At t = {:.9g} s the friction of {} reaches its limit while other contacts hold its body: who bears how much is "
      "not determined, and with static_coefficient above friction_coefficient the motion is not, either. Give one "
      "coefficient, one such contact, or take kind = \"compliant\".",
      before.t, own.force->path()));
}

Eigen::VectorXd MotionEvents::by_multipliers_of(const GuardOf& g) {
  Eigen::VectorXd h = Eigen::VectorXd::Zero(assembly_.m());
  for (std::size_t i = 0; i < lambda_.size(); ++i) {
    lambda_[i].d[0] = Taylor2(1.0);
    h[g.first_row + static_cast<int>(i)] = g.guarded->guard(g.k, arguments()).d[0].c0;
    lambda_[i].d[0] = Taylor2();
  }
  return h;
}

void MotionEvents::linearize_with_reactions(const GuardOf& g, const StateView& before, const Side& minus,
                                            bool columns) {
  if (!friction_falls(g)) return linearize(g, before, minus, columns);
  if (!reactions_) reactions_ = std::make_unique<ReactionSlope>(assembly_);
  // What is between an integrator's steps of multipliers is interpolated, and no error test has seen it.
  StateView own = before;
  own.lambda = reactions_->solve(before, assembly_.rho());
  const ReactionSlope::Slope slope = reactions_->slope(linearize_all(g, own, minus, columns));
  for (std::size_t i = 0; i < h_x_.size(); ++i) h_x_[i] += slope.x[static_cast<Eigen::Index>(i)];
  for (std::size_t j = 0; j < h_rho_.size(); ++j) h_rho_[j] += slope.rho[static_cast<Eigen::Index>(j)];
  hdot_ += slope.rate;
  require_crossing(before.t, g.name, hdot_, slope.terms);
}

}  // namespace costate
