#include "costate/assembly/pulled_partials.h"

#include <algorithm>

namespace costate {

namespace {
constexpr std::size_t kPulledBlock = static_cast<std::size_t>(kMaxLocal) * kMaxLocal;

/// out_j += factor block_ij w_i, i < rows, j < columns.
void pull_block(const double* block, int rows, int columns, double factor, const double* w, double* out) {
  for (int j = 0; j < columns; ++j, block += rows) {
    double sum = 0;
    for (int i = 0; i < rows; ++i) sum += block[i] * w[i];
    out[j] += factor * sum;
  }
}
}  // namespace

PulledPartials::PulledPartials(Assembly& assembly) : assembly_(assembly), scratch_(6 * kPulledBlock, 0.0) {
  const Mechanism& mech = assembly.mechanism();
  for (const auto& b : mech.bodies())
    if (!b->constant_mass() || !b->constant_force()) append(*b, 0, bodies_);
  for (std::size_t f = 0; f < mech.forces().size(); ++f) {
    append(*mech.forces()[f], mech.state_offsets()[f], forces_);
    if (mech.forces()[f]->may_rest()) forces_.back().rest.emplace(*mech.forces()[f], mech.state_offsets()[f]);
  }
  for (std::size_t c = 0; c < mech.constraints().size(); ++c)
    append(*mech.constraints()[c], mech.row_offsets()[c], constraints_);
}

template <class Kind>
void PulledPartials::append(const Kind& element, int first, std::vector<Part<Kind>>& to) {
  to.push_back({&element, numbers_.size(), first, {}});
  numbers_.resize(numbers_.size() + element.numbers().size());
}

template <class Kind>
void PulledPartials::take_numbers(std::vector<Part<Kind>>& parts) {
  for (Part<Kind>& part : parts) {
    double* p = numbers_.data() + part.numbers;
    for (const auto k : part.element->numbers()) *p++ = assembly_.numbers()[static_cast<std::size_t>(k)];
    if (part.rest) part.rest->clear();
  }
}

template <class Kind>
LocalState PulledPartials::gather(const Part<Kind>& part, const StateView& s) {
  const std::vector<int>& c = part.element->coordinates();
  for (std::size_t i = 0; i < c.size(); ++i) {
    q_[i] = s.q[c[i]];
    v_[i] = s.v[c[i]];
    a_[i] = s.a[c[i]];
  }
  LocalState l;
  l.t = s.t;
  l.q = q_;
  l.v = v_;
  l.a = a_;
  if (s.lambda) l.lambda = s.lambda + part.first;
  if (s.z) l.z = s.z + part.first;
  l.p = numbers_.data() + part.numbers;
  return l;
}

void PulledPartials::begin(const std::vector<int>& coordinates) {
  for (std::size_t i = 0; i < coordinates.size(); ++i) {
    weights_[i] = force_weights_[coordinates[i]];
    of_q_[i] = of_v_[i] = 0;
  }
}

void PulledPartials::end(const std::vector<int>& coordinates) {
  for (std::size_t i = 0; i < coordinates.size(); ++i) {
    to_q_[coordinates[i]] += factor_ * of_q_[i];
    to_v_[coordinates[i]] += factor_ * of_v_[i];
  }
}

void PulledPartials::pull_bodies(const StateView& s) {
  double *b0 = scratch_.data(), *b1 = b0 + kPulledBlock;
  for (const auto& part : bodies_) {
    const auto& c = part.element->coordinates();
    const int k = static_cast<int>(c.size());
    LocalMatrix r_q(b0, k, k), r_v(b1, k, k);
    for (LocalMatrix* x : {&r_q, &r_v}) x->setZero();
    part.element->calc_partials(gather(part, s), r_q, r_v);
    begin(c);
    pull_block(b0, k, k, 1, weights_, of_q_);
    pull_block(b1, k, k, 1, weights_, of_v_);
    end(c);
  }
}

void PulledPartials::pull_forces(const StateView& s, const double* of_states, double factor, double* to_z) {
  double *b0 = scratch_.data(), *b1 = b0 + kPulledBlock, *b2 = b1 + kPulledBlock, *b3 = b2 + kPulledBlock,
         *b4 = b3 + kPulledBlock, *b5 = b4 + kPulledBlock;
  for (auto& part : forces_) {
    if (part.rest && (part.rest->holds(s.q, s.z) || (part.rest->is_due() && part.rest->find(gather(part, s)))))
      continue;
    const auto& c = part.element->coordinates();
    const int k = static_cast<int>(c.size()), z = part.element->states();
    LocalMatrix Qq(b0, k, k), Qv(b1, k, k), Qz(b2, k, z), fq(b3, z, k), fv(b4, z, k), fz(b5, z, z);
    for (LocalMatrix* x : {&Qq, &Qv}) x->setZero();
    if (z > 0)
      for (LocalMatrix* x : {&Qz, &fq, &fv, &fz}) x->setZero();
    part.element->calc_partials(gather(part, s), ForcePartials{Qq, Qv, Qz, fq, fv, fz});
    begin(c);
    pull_block(b0, k, k, -1, weights_, of_q_);
    pull_block(b1, k, k, -1, weights_, of_v_);
    if (z > 0) pull_block(b2, k, z, -factor, weights_, to_z + part.first);
    if (z > 0 && of_states) {
      pull_block(b3, z, k, -1, of_states + part.first, of_q_);
      pull_block(b4, z, k, -1, of_states + part.first, of_v_);
      pull_block(b5, z, z, -factor, of_states + part.first, to_z + part.first);
    }
    end(c);
  }
}

void PulledPartials::pull_constraints(const StateView& s, const Assembly::ParameterWeights& w) {
  double *b0 = scratch_.data(), *b1 = b0 + kPulledBlock, *b2 = b1 + kPulledBlock, *b3 = b2 + kPulledBlock;
  const bool with_phi = w.c0 != 0 || w.c1 != 0;
  for (const auto& part : constraints_) {
    const auto& c = part.element->coordinates();
    const int k = static_cast<int>(c.size()), rows = part.element->rows();
    LocalMatrix H(b0, k, k), phid(b1, rows, k), phidd(b2, rows, k), phi(b3, rows, k);
    std::fill(b0, b0 + k * k, 0.0);
    for (double* b : {b1, b2, b3}) std::fill(b, b + rows * k, 0.0);
    const LocalState l = gather(part, s);
    part.element->calc_partials(l, H, phid, phidd);
    if (with_phi) part.element->calc_phi_q(l, phi);
    begin(c);
    pull_block(b0, k, k, 1, weights_, of_q_);
    const double* of_rows = w.row + part.first;
    for (int j = 0, at = 0; j < k; ++j)
      for (int i = 0; i < rows; ++i, ++at) {
        of_q_[j] += of_rows[i] * (w.c2 * b2[at] + w.c1 * b1[at] + w.c0 * b3[at]);
        of_v_[j] += of_rows[i] * (2 * w.c2 * b1[at] + w.c1 * b3[at]);
      }
    end(c);
  }
}

void PulledPartials::add(const StateView& s, const Assembly::ParameterWeights& w, double factor, double* q, double* v,
                         double* z) {
  if (numbers_at_ == 0 || !assembly_.knows(numbers_at_)) {
    numbers_at_ = assembly_.new_point();
    take_numbers(bodies_);
    take_numbers(forces_);
    take_numbers(constraints_);
  }
  force_weights_ = w.force;
  factor_ = factor;
  to_q_ = q;
  to_v_ = v;
  pull_bodies(s);
  pull_forces(s, w.state, factor, z);
  pull_constraints(s, w);
}

}  // namespace costate
