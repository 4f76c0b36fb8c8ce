// What contacts in space do that rest together on what they hold, and let go in one instant (lib/README.md (19.14)).
#include <algorithm>
#include <cmath>

#include "costate/event/contact_gap.h"
#include "costate/event/contact_ways.h"
#include "costate/event/motion_events.h"
#include "costate/event/spatial_slip.h"

namespace costate {

namespace {
// What is at its limit where best shares are has more than this part in that.
constexpr double kTakesPart = 1e-4;
}  // namespace

const ContactShares::Held* MotionEvents::held(const GuardOf& g, const StateView& s, bool anyhow) {
  return by_multipliers(g) && impact_ ? shares_->find(g.contact, s, impact_->balance(), velocity_error(), anyhow)
                                      : nullptr;
}

std::vector<const WatchedContact*> MotionEvents::let_go(const GuardOf& g, const StateView& sticking,
                                                        std::vector<double>& z) {
  const ContactOf& own = contacts_[static_cast<std::size_t>(g.contact)];
  const UnilateralForce::Guard kind = own.contact->guard_kind(g.k);
  const auto state = [&](int at) -> double& { return z[static_cast<std::size_t>(at)]; };
  const auto open = [&](const ContactOf& c) {
    state(c.closed_state) = 0;
    if (c.sliding_state >= 0) state(c.sliding_state) = 0;
    if (slides_in_space(c)) clear_slip(c.sliding_state, z.data());
  };
  std::vector<const ContactOf*> begin;
  // Against friction, which goes on as it was: lambda_k = mu N sigma_k.
  const auto slide = [&](const ContactOf& c, double direction, const double* lambda_t) {
    state(c.sliding_state) = direction;
    if (slides_in_space(c)) offset_slip(c.sliding_state, lambda_t, z.data());
    begin.push_back(&c);
  };
  std::vector<double> x(static_cast<std::size_t>(assembly_.n() + assembly_.m()));
  StateView solved = sticking;
  if (slides_in_space(own)) {
    solve_motion(sticking, x.data());
    solved.lambda = x.data() + assembly_.n();
  }
  if (const auto* together = slides_in_space(own) ? held(g, solved, true) : nullptr) {
    const RestingShares& shares = together->shares;
    const double size = shares.forces.cwiseAbs().maxCoeff();
    const auto bears = [&](const RestingCone& cone) { return shares.forces[cone.first] > kSameMotion * size; };
    const auto at_limit = [&](std::size_t i) { return shares.at_limit[static_cast<Eigen::Index>(i)] > kTakesPart; };
    const std::vector<RestingCone>& cones = together->group->cones;
    bool any_slides = false;
    for (std::size_t i = 0; i < cones.size(); ++i)
      any_slides = any_slides || (at_limit(i) && cones[i].count > 2 && bears(cones[i]));
    for (std::size_t i = 0; i < cones.size(); ++i) {
      const ContactOf& c = contacts_[static_cast<std::size_t>(together->group->contacts[i])];
      if (!at_limit(i)) continue;
      if (!any_slides && !bears(cones[i])) open(c);
      if (!any_slides || cones[i].count < 3) continue;
      // What bears nothing slides with the others: weights are how all of them move.
      const double part = bears(cones[i]) ? -1 : 1;
      const Eigen::VectorXd& of = bears(cones[i]) ? shares.forces : shares.weights;
      const double lambda_t[2] = {part * of[cones[i].first + 1], part * of[cones[i].first + 2]};
      slide(c, 1, lambda_t);
      // Its speed, a drift that not all feet can be without, has no say in where it slides.
      for (int k = 0; k < 2; ++k)
        state(c.sliding_state + 1 + k) -= row_of(*c.force, *c.contact, 1 + k, sticking, assembly_, nullptr).c1;
    }
  } else if (kind == UnilateralForce::Guard::release) {
    open(own);
  } else {
    slide(own, kind == UnilateralForce::Guard::slip_forward ? 1 : -1, x.data() + assembly_.n() + own.first_row + 1);
  }
  return begin;
}

Eigen::VectorXd MotionEvents::linearize_held(const ContactShares::Held& together) {
  Eigen::VectorXd by_multipliers = Eigen::VectorXd::Zero(assembly_.m());
  // Best shares: what the others bear changes them by nothing.
  std::fill(h_rho_.begin(), h_rho_.end(), 0.0);
  const auto& [contacts, cones, rows, none] = *together.group;
  for (std::size_t i = 0; i < rows.size(); ++i)
    by_multipliers[rows[i]] = -together.shares.weights[static_cast<Eigen::Index>(i)];
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const ContactOf& of = contacts_[static_cast<std::size_t>(contacts[c])];
    if (cones[c].count < 2) continue;
    const int number = of.force->numbers()[static_cast<std::size_t>(of.contact->sticking_number())];
    for (const auto& [j, factor] : assembly_.number_columns()[static_cast<std::size_t>(number)])
      h_rho_[static_cast<std::size_t>(j)] +=
          factor * together.shares.at_limit[static_cast<Eigen::Index>(c)] * together.shares.forces[cones[c].first];
  }
  return by_multipliers;
}

}  // namespace costate
