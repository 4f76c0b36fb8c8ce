#include "costate/discrete/stage_rows.h"

#include <algorithm>

namespace costate {

StageRows::StageRows(const Assembly& assembly) : any_(!assembly.slidable_rows().empty()), slips_(assembly) {
  by_q_.assign(assembly.jacobian().row.size(), 0);
  by_v_ = by_q_;
  phi_.assign(static_cast<std::size_t>(assembly.m()), 0);
  phid_ = slides_ = phi_;
}

void StageRows::calc(Assembly& assembly, const StateView& s, const StepCoefficients& c) {
  if (any_)
    assembly.calc_partials(s);
  else
    assembly.calc_force_partials(s);
  for (std::size_t k = 0; k < by_q_.size(); ++k) {
    const bool rate = any_ && keeps_rate(assembly, static_cast<int>(assembly.jacobian().row[k]));
    by_q_[k] = rate ? assembly.phid_q[k] / c.G : assembly.phi_q[k] / c.B;
    by_v_[k] = rate ? assembly.phi_q[k] / c.G : 0;
  }
  if (!slips_.possible()) return;
  slips_.linearize(assembly, s, &c);
  slips_.set_partials(assembly.jacobian(), by_q_, by_v_);
}

void StageRows::subtract(const Assembly& assembly, const StepCoefficients& c, const StateView& s, double* out) {
  const double* lambda = s.lambda;
  std::fill(out, out + assembly.m(), 0.0);
  if (any_) add_product(assembly.jacobian(), assembly.phi_q.data(), -1, s.v, out);
  for (int i = 0; i < assembly.m(); ++i) {
    const auto row = static_cast<std::size_t>(i);
    out[i] = !assembly.is_there(i)             ? lambda[i]
             : any_ && keeps_rate(assembly, i) ? (out[i] - assembly.phi_t[row]) / c.G
                                               : -assembly.phi[row] / c.B;
  }
  for (int i = 0; level_ && i < assembly.m(); ++i)
    if (assembly.is_there(i)) out[i] += level_->inverse_alpha(i) * lambda[i];
  for (const Assembly::SlidingRow& r : assembly.sliding_rows()) out[r.along] += assembly.friction(r) * lambda[r.normal];
  if (!slips_.possible()) return;
  slips_.look(assembly, s, &c);
  slips_.subtract_rows(out);
}

void StageRows::subtract_columns(const Assembly& assembly, const StepCoefficients& c,
                                 const Assembly::ParameterColumns& columns, int j, double* out) const {
  for (int i = 0; i < assembly.m(); ++i)
    out[i] -= any_ && keeps_rate(assembly, i) ? columns.phid(i, j) / c.G : columns.phi(i, j) / c.B;
  for (const Assembly::SlidingRow& r : assembly.sliding_rows())
    if (!slips_.has(r.along)) out[r.along] -= columns.phidd(r.along, j);
  slips_.subtract_columns(j, out);
}

void StageRows::weigh(const Assembly& assembly, const StepCoefficients& c, const double* s2,
                      Assembly::ParameterWeights& w) {
  for (int i = 0; i < assembly.m(); ++i) {
    const auto row = static_cast<std::size_t>(i);
    const bool rate = any_ && keeps_rate(assembly, i);
    phi_[row] = rate ? 0 : s2[i] / c.B;
    phid_[row] = rate ? s2[i] / c.G : 0;
    slides_[row] = 0;
  }
  for (const Assembly::SlidingRow& r : assembly.sliding_rows())
    if (!slips_.has(r.along)) slides_[static_cast<std::size_t>(r.along)] = s2[r.along];
  w.row_phi = phi_.data();
  if (!any_) return;
  w.row_phid = phid_.data();
  w.row = slides_.data();  // R2's own derivative by mu
  w.c2 = 1;
}

}  // namespace costate
