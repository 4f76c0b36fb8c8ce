#include "costate/event/idle_contact_watch.h"

#include <algorithm>
#include <cmath>

#include "costate/event/first_rows.h"

namespace costate {

namespace {
// Of the largest of all forces and multipliers: what stabilizations and rounding leave in one that is zero.
constexpr double kNothing = 1e-9;
}  // namespace

IdleContactWatch::IdleContactWatch(const Mechanism& mechanism) {
  std::map<const Constraint*, int> rows;  // of a mechanism without contacts not asked for
  for (std::size_t f = 0; f < mechanism.forces().size(); ++f) {
    const Force& force = *mechanism.forces()[f];
    const auto* contact = dynamic_cast<const UnilateralForce*>(&force);
    if (!contact || contact->closed_state() < 0) continue;
    if (rows.empty()) rows = first_rows(mechanism);
    if (const auto own = rows.find(contact->rows()); own != rows.end())
      contacts_.push_back({&force, mechanism.state_offsets()[f] + contact->closed_state(), own->second});
  }
}

bool IdleContactWatch::asks(const double* z) const {
  return std::any_of(contacts_.begin(), contacts_.end(),
                     [&](const Contact& c) { return z[c.state] > 0.5 ? !(c.closed && c.bears) : c.closed; });
}

void IdleContactWatch::look(const StateView& s, const Assembly& assembly) {
  double largest = 0;
  for (int i = 0; i < assembly.m(); ++i) largest = std::max(largest, std::abs(s.lambda[i]));
  for (const double Q : assembly.Q) largest = std::max(largest, std::abs(Q));
  for (Contact& c : contacts_) {
    if (!(s.z[c.state] > 0.5)) {
      c.closed = false;
      continue;
    }
    if (!c.closed) {
      c.closed = true;
      c.bears = false;
      c.from = s.t;
    }
    c.bears = c.bears || std::abs(s.lambda[c.row]) > kNothing * largest;
    if (c.bears && first_ && first_->contact == c.force->path() && first_->from == c.from) first_.reset();
    if (!c.bears && s.t > c.from) {
      if (!first_) first_ = Idle{c.force->path(), c.from, s.t};
      if (first_->contact == c.force->path()) first_->to = s.t;
    }
  }
}

}  // namespace costate
