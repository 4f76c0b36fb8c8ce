#include "costate/assembly/assembly.h"

#include <algorithm>
#include <cstring>

#include "costate/assembly/applied_forces.h"
#include "costate/assembly/slip_directions.h"
#include "costate/base/error.h"
#include "costate/element/switched_rows.h"

namespace costate {

namespace {
constexpr int kBlock = kMaxLocal * kMaxLocal;

void zero(std::vector<double>& x) { std::fill(x.begin(), x.end(), 0.0); }
}  // namespace

Assembly::Assembly(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters)
    : mechanism_(std::move(mechanism)), parameters_(std::move(parameters)) {
  const Mechanism& mech = *mechanism_;
  n_ = mech.coordinate_count();
  m_ = mech.row_count();
  nz_ = mech.state_count();
  columns_ = parameters_.columns(mech.numbers().size());

  using Entries = std::vector<std::pair<int, int>>;
  Entries square, jacobian, force_state, state_force, state_state;
  std::size_t number_offset = 0;
  const auto common = [&](const Element& e, int row_offset) {
    if (e.coordinates().size() > static_cast<std::size_t>(kMaxLocal))
      throw ModelError(e.path(), "This element has more coordinates than the kernels provide for.");
    Slots s;
    s.element = &e;
    s.row_offset = row_offset;
    s.number_offset = number_offset;
    number_offset += e.numbers().size();
    for (std::size_t k = 0; k < e.numbers().size(); ++k)
      if (!columns_[e.numbers()[k]].empty()) s.active.push_back(static_cast<int>(k));
    for (int j : e.coordinates())
      for (int i : e.coordinates()) square.emplace_back(i, j);
    return s;
  };
  for (int i = 0; i < n_; ++i) square.emplace_back(i, i);
  for (const auto& b : mech.bodies()) bodies_.push_back(common(*b, 0));
  for (std::size_t c = 0; c < mech.constraints().size(); ++c) {
    const Constraint& e = *mech.constraints()[c];
    constraints_.push_back(common(e, mech.row_offsets()[c]));
    for (int j : e.coordinates())
      for (int r = 0; r < e.rows(); ++r) jacobian.emplace_back(mech.row_offsets()[c] + r, j);
  }
  for (std::size_t f = 0; f < mech.forces().size(); ++f) {
    const Force& e = *mech.forces()[f];
    const int z0 = mech.state_offsets()[f];
    forces_.push_back(common(e, z0));
    if (e.may_rest()) forces_.back().rest.emplace(e, z0);
    for (int k = 0; k < e.states(); ++k) {
      for (int i : e.coordinates()) {
        force_state.emplace_back(i, z0 + k);
        state_force.emplace_back(z0 + k, i);
      }
      for (int l = 0; l < e.states(); ++l) state_state.emplace_back(z0 + k, z0 + l);
    }
  }
  square_ = SparsePattern::from_entries(n_, n_, std::move(square));
  jacobian_ = SparsePattern::from_entries(m_, n_, std::move(jacobian));
  force_state_ = SparsePattern::from_entries(n_, nz_, std::move(force_state));
  state_force_ = SparsePattern::from_entries(nz_, n_, std::move(state_force));
  state_state_ = SparsePattern::from_entries(nz_, nz_, std::move(state_state));

  for (auto* list : {&bodies_, &constraints_, &forces_})
    for (Slots& s : *list)
      for (int j : s.element->coordinates())
        for (int i : s.element->coordinates()) s.square.push_back(square_.find(i, j));
  for (std::size_t c = 0; c < constraints_.size(); ++c)
    for (int j : constraints_[c].element->coordinates())
      for (int r = 0; r < mech.constraints()[c]->rows(); ++r)
        constraints_[c].jacobian.push_back(jacobian_.find(constraints_[c].row_offset + r, j));
  for (std::size_t f = 0; f < forces_.size(); ++f) {
    Slots& s = forces_[f];
    const int k = mech.forces()[f]->states(), z0 = s.row_offset;
    for (int l = 0; l < k; ++l)
      for (int i : s.element->coordinates()) s.force_state.push_back(force_state_.find(i, z0 + l));
    for (int i : s.element->coordinates())
      for (int l = 0; l < k; ++l) s.state_force.push_back(state_force_.find(z0 + l, i));
    for (int l2 = 0; l2 < k; ++l2)
      for (int l = 0; l < k; ++l) s.state_state.push_back(state_state_.find(z0 + l, z0 + l2));
  }
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const bool mass = !mech.bodies()[b]->constant_mass(), force = !mech.bodies()[b]->constant_force();
    if (mass) varying_mass_.push_back(b);
    if (force) varying_force_.push_back(b);
    if (mass || force) varying_bodies_.push_back(b);
    if (!mass && !force && !bodies_[b].active.empty()) varies_constant_bodies_ = true;
  }

  for (std::size_t c = 0; c < constraints_.size(); ++c) {
    const auto* switched = dynamic_cast<const SwitchedRows*>(mech.constraints()[c].get());
    if (!switched) continue;
    row_there_.resize(static_cast<std::size_t>(m_), 1);
    row_holds_.resize(static_cast<std::size_t>(m_), 1);
    for (int r = 0; r < mech.constraints()[c]->rows(); ++r) {
      row_there_[static_cast<std::size_t>(constraints_[c].row_offset + r)] = 0;
      row_holds_[static_cast<std::size_t>(constraints_[c].row_offset + r)] = switched->holds_position(r);
    }
    constraints_[c].there = false;
    bool placed = true;
    for (int r = 0; r < mech.constraints()[c]->rows(); ++r) placed = placed && switched->has_place(r);
    if (!placed) without_place_.push_back(c);
    for (std::size_t f = 0; f < forces_.size(); ++f)
      if (forces_[f].element == &switched->switched_by()) {
        const int first = forces_[f].row_offset, sliding = switched->sliding_state();
        switches_.push_back(
            {c, first + switched->switching_state(), sliding < 0 ? -1 : first + sliding, switched->friction_number()});
        for (int r = 1; sliding >= 0 && r < mech.constraints()[c]->rows(); ++r)
          slidable_.emplace_back(constraints_[c].row_offset + r, constraints_[c].row_offset);
      }
  }

  M.assign(square_.row.size(), 0);
  K = C = M_constant_ = M;
  phi_q.assign(jacobian_.row.size(), 0);
  phid_q = phidd_q = phi_q;
  Q.assign(n_, 0);
  Q_constant_ = Q;
  phi.assign(m_, 0);
  phi_t = bias = phi;
  zdot.assign(nz_, 0);
  Q_z.assign(force_state_.row.size(), 0);
  f_q.assign(state_force_.row.size(), 0);
  f_v = f_q;
  f_z.assign(state_state_.row.size(), 0);
  local_numbers_.assign(number_offset, 0);
  scratch_.assign(6 * kBlock, 0);
  numbers_ = mech.base_numbers();
  const auto values = parameters_.values();
  set_parameters(values.data());
}

void Assembly::set_parameters(const double* rho) {
  point_of_numbers_ = last_point_;
  dynamics_at_ = mass_at_ = jacobian_at_ = partials_at_ = 0;
  rho_.assign(rho, rho + np());
  parameters_.apply(rho, numbers_);
  for (auto* list : {&bodies_, &constraints_, &forces_})
    for (const Slots& s : *list) {
      double* p = local_numbers_.data() + s.number_offset;
      for (int k : s.element->numbers()) *p++ = numbers_[k];
    }
  for (Slots& force : forces_)
    if (force.rest) force.rest->clear();
  zero(M_constant_);
  zero(Q_constant_);
  const std::vector<double> origin(static_cast<std::size_t>(n_), 0.0);
  StateView s;
  s.q = s.v = origin.data();
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const Body& body = *mechanism_->bodies()[b];
    const int k = static_cast<int>(body.coordinates().size());
    const LocalState local = gather(bodies_[b], s);
    if (body.constant_mass()) {
      LocalMatrix block(scratch_.data(), k, k);
      block.setZero();
      body.calc_mass(local, block);
      scatter_square(bodies_[b], scratch_.data(), 1, M_constant_);
    }
    if (body.constant_force()) {
      double f[kMaxLocal] = {};
      body.calc_force(local, f);
      for (int i = 0; i < k; ++i) Q_constant_[body.coordinates()[i]] += f[i];
    }
  }
}

LocalState Assembly::gather(const Slots& s, const StateView& x) {
  const auto& c = s.element->coordinates();
  LocalState l;
  l.t = x.t;
  l.p = local_numbers_.data() + s.number_offset;
  for (std::size_t i = 0; i < c.size(); ++i) lq_[i] = x.q[c[i]];
  l.q = lq_;
  if (x.v) {
    for (std::size_t i = 0; i < c.size(); ++i) lv_[i] = x.v[c[i]];
    l.v = lv_;
  }
  if (x.a) {
    for (std::size_t i = 0; i < c.size(); ++i) la_[i] = x.a[c[i]];
    l.a = la_;
  }
  if (x.lambda) l.lambda = x.lambda + s.row_offset;
  if (x.z) l.z = x.z + s.row_offset;
  return l;
}

LocalState Assembly::gather(const Element& e, std::size_t, const StateView& x) {
  for (auto* list : {&bodies_, &constraints_, &forces_})
    for (const Slots& s : *list)
      if (s.element == &e) return gather(s, x);
  throw Error("Assembly::gather: this element is not part of the mechanism.");
}

void Assembly::calc_mass(const StateView& s, long point) {
  if (dynamics_at_ != point) dynamics_at_ = 0;
  mass_at_ = 0;  // while it may throw
  calc_mass(s, M);
  mass_at_ = point;
}

void Assembly::calc_mass(const StateView& s, std::vector<double>& out) {
  std::copy(M_constant_.begin(), M_constant_.end(), out.begin());
  for (const std::size_t b : varying_mass_) {
    const Body& body = *mechanism_->bodies()[b];
    const int k = static_cast<int>(body.coordinates().size());
    LocalMatrix block(scratch_.data(), k, k);
    block.setZero();
    body.calc_mass(gather(bodies_[b], s), block);
    scatter_square(bodies_[b], scratch_.data(), 1, out);
  }
}

void Assembly::calc_constraints(const StateView& s) {
  read_switches(s);
  jacobian_at_ = dynamics_at_ = 0;
  zero(phi_q);
  zero(phi);
  zero(phi_t);
  for (std::size_t c = 0; c < constraints_.size(); ++c) {
    if (!constraints_[c].there) continue;
    const Constraint& e = *mechanism_->constraints()[c];
    const Slots& slots = constraints_[c];
    const LocalState l = gather(slots, s);
    LocalMatrix J(scratch_.data(), e.rows(), static_cast<int>(e.coordinates().size()));
    J.setZero();
    e.calc_phi_q(l, J);
    e.calc_phi(l, phi.data() + slots.row_offset);
    if (e.rheonomic()) e.calc_phi_t(l, phi_t.data() + slots.row_offset);
    for (std::size_t k = 0; k < slots.jacobian.size(); ++k) phi_q[slots.jacobian[k]] += scratch_[k];
  }
  part_sliding_rows();
}

void Assembly::calc_jacobian(const StateView& s, long point) {
  if (dynamics_at_ != point) dynamics_at_ = 0;
  jacobian_at_ = 0;  // while it may throw
  read_switches(s);
  StateView x = s;
  x.v = x.a = x.lambda = nullptr;
  zero(phi_q);
  for (std::size_t c = 0; c < constraints_.size(); ++c) {
    if (!constraints_[c].there) continue;
    const Constraint& e = *mechanism_->constraints()[c];
    const Slots& slots = constraints_[c];
    LocalMatrix J(scratch_.data(), e.rows(), static_cast<int>(e.coordinates().size()));
    J.setZero();
    e.calc_phi_q(gather(slots, x), J);
    for (std::size_t k = 0; k < slots.jacobian.size(); ++k) phi_q[slots.jacobian[k]] += scratch_[k];
  }
  part_sliding_rows();
  turn_slips(*this, s, sliding_);
  jacobian_at_ = point;
}

void Assembly::calc_dynamics(const StateView& s, long point) {
  ++counters_.dynamics;
  read_switches(s);
  dynamics_at_ = mass_at_ = jacobian_at_ = 0;  // while it may throw
  calc_mass(s, M);
  std::copy(Q_constant_.begin(), Q_constant_.end(), Q.begin());
  zero(zdot);
  zero(phi_t);
  zero(bias);
  zero(phi_q);
  zero(phi);
  for_each_varying_force(s, zdot.data(), [&](const std::vector<int>& c, const double* f) {
    for (std::size_t i = 0; i < c.size(); ++i) Q[c[i]] += f[i];
  });
  for (std::size_t c = 0; c < constraints_.size(); ++c) {
    if (!constraints_[c].there) continue;
    const Constraint& e = *mechanism_->constraints()[c];
    const Slots& slots = constraints_[c];
    const LocalState l = gather(slots, s);
    LocalMatrix J(scratch_.data(), e.rows(), static_cast<int>(e.coordinates().size()));
    J.setZero();
    e.calc_phi_q(l, J);
    for (std::size_t k = 0; k < slots.jacobian.size(); ++k) phi_q[slots.jacobian[k]] += scratch_[k];
    e.calc_phi(l, phi.data() + slots.row_offset);
    if (e.rheonomic()) e.calc_phi_t(l, phi_t.data() + slots.row_offset);
    e.calc_bias(l, bias.data() + slots.row_offset);
  }
  part_sliding_rows();
  turn_slips(*this, s, sliding_);
  dynamics_at_ = mass_at_ = jacobian_at_ = point;
}

void Assembly::calc_force_partials(const StateView& s) {
  ++counters_.partials;
  read_switches(s);
  partials_at_ = 0;
  for (auto* x : {&K, &C, &Q_z, &f_q, &f_v, &f_z}) zero(*x);
  add_body_and_force_partials(s);
  add_hessians(s, K);
}

void Assembly::add_hessians(const StateView& s, std::vector<double>& out) {
  StateView x = s;  // only q and lambda count
  x.v = x.a = nullptr;
  for (std::size_t c = 0; c < constraints_.size(); ++c) {
    if (!constraints_[c].there) continue;
    const Constraint& e = *mechanism_->constraints()[c];
    const int k = static_cast<int>(e.coordinates().size());
    LocalMatrix H(scratch_.data(), k, k);
    H.setZero();
    e.calc_hessian(gather(constraints_[c], x), H);
    scatter_square(constraints_[c], scratch_.data(), 1, out);
  }
}

void Assembly::add_body_and_force_partials(const StateView& s) {
  double *b0 = scratch_.data(), *b1 = b0 + kBlock, *b2 = b1 + kBlock, *b3 = b2 + kBlock, *b4 = b3 + kBlock,
         *b5 = b4 + kBlock;
  for (const std::size_t b : varying_bodies_) {
    const Body& body = *mechanism_->bodies()[b];
    const int k = static_cast<int>(body.coordinates().size());
    LocalMatrix r_q(b0, k, k), r_v(b1, k, k);
    r_q.setZero();
    r_v.setZero();
    body.calc_partials(gather(bodies_[b], s), r_q, r_v);
    scatter_square(bodies_[b], b0, 1, K);
    scatter_square(bodies_[b], b1, 1, C);
  }
  for (std::size_t i = 0; i < forces_.size(); ++i) {
    if (rests(forces_[i], s)) continue;
    const Force& force = *mechanism_->forces()[i];
    const Slots& slots = forces_[i];
    const int k = static_cast<int>(force.coordinates().size()), z = force.states();
    LocalMatrix Qq(b0, k, k), Qv(b1, k, k), Qz(b2, k, z), fq(b3, z, k), fv(b4, z, k), fz(b5, z, z);
    Qq.setZero();
    Qv.setZero();
    if (z > 0) {
      Qz.setZero();
      fq.setZero();
      fv.setZero();
      fz.setZero();
    }
    force.calc_partials(gather(slots, s), ForcePartials{Qq, Qv, Qz, fq, fv, fz});
    scatter_square(slots, b0, -1, K);
    scatter_square(slots, b1, -1, C);
    for (std::size_t e = 0; e < slots.force_state.size(); ++e) Q_z[slots.force_state[e]] += b2[e];
    for (std::size_t e = 0; e < slots.state_force.size(); ++e) {
      f_q[slots.state_force[e]] += b3[e];
      f_v[slots.state_force[e]] += b4[e];
    }
    for (std::size_t e = 0; e < slots.state_state.size(); ++e) f_z[slots.state_state[e]] += b5[e];
  }
}

void Assembly::calc_partials(const StateView& s, long point) {
  ++counters_.partials;
  read_switches(s);
  partials_at_ = 0;  // while it may throw
  for (auto* x : {&K, &C, &phid_q, &phidd_q, &Q_z, &f_q, &f_v, &f_z}) zero(*x);
  add_body_and_force_partials(s);
  double *b0 = scratch_.data(), *b1 = b0 + kBlock, *b2 = b1 + kBlock;
  for (std::size_t c = 0; c < constraints_.size(); ++c) {
    if (!constraints_[c].there) continue;
    const Constraint& e = *mechanism_->constraints()[c];
    const Slots& slots = constraints_[c];
    const int k = static_cast<int>(e.coordinates().size());
    LocalMatrix H(b0, k, k), d1(b1, e.rows(), k), d2(b2, e.rows(), k);
    H.setZero();
    d1.setZero();
    d2.setZero();
    e.calc_partials(gather(slots, s), H, d1, d2);
    scatter_square(slots, b0, 1, K);
    for (std::size_t j = 0; j < slots.jacobian.size(); ++j) {
      phid_q[slots.jacobian[j]] += b1[j];
      phidd_q[slots.jacobian[j]] += b2[j];
    }
  }
  turn_slips(*this, s, sliding_);
  part_sliding_partials(*this, s, phid_q, phidd_q);
  partials_at_ = point;
}

}  // namespace costate
