// A force that integrates the work which it has done on the mechanism since the start, as its last state:
//   W' = Q.v,  W(0) = 0.
// It is the force Base in everything else; its blocks follow from those of Base, whatever that is.
#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "costate/element/element.h"

namespace costate {

template <class Base>
class WithWork final : public Base {
 public:
  using Base::Base;

  int states() const override { return Base::states() + 1; }
  std::string state_name(int i) const override { return i == work() ? "work" : Base::state_name(i); }
  std::string state_unit(int i) const override { return i == work() ? "J" : Base::state_unit(i); }
  int initial_state_number(int i) const override { return i == work() ? -1 : Base::initial_state_number(i); }

  void force(const PathDual& t, const PathDual* q, const PathDual* v, const PathDual* z, const PathDual* p, PathDual* Q,
             PathDual* zdot) const override {
    Base::force(t, q, v, z, p, Q, zdot);
    zdot[work()] = power(Q, v);
  }
  void calc_force(const LocalState& s, double* Q, double* zdot) const override {
    Base::calc_force(s, Q, zdot);
    zdot[work()] = power(Q, s.v);
  }
  /// W'_q = v^T Q_q, W'_v = v^T Q_v + Q^T, W'_z = v^T Q_z.
  void calc_partials(const LocalState& s, ForcePartials out) const override {
    Base::calc_partials(s, out);
    double Q[kMaxLocal] = {}, zdot[kMaxLocal] = {};
    Base::calc_force(s, Q, zdot);
    const Eigen::Map<const Eigen::RowVectorXd> v(s.v, size()), force(Q, size());
    out.f_q.row(work()) = v * out.Q_q;
    out.f_v.row(work()) = v * out.Q_v + force;
    out.f_z.row(work()) = v * out.Q_z;
  }
  void calc_number_partial(const LocalState& s, int number, double* Q_p, double* f_p) const override {
    Base::calc_number_partial(s, number, Q_p, f_p);
    f_p[work()] = power(Q_p, s.v);
  }
  /// w_W W'_p = (w_W v)^T Q_p: the weight of W' is one of Q along v.
  void add_number_gradient(const LocalState& s, const double* w_Q, const double* w_f, const int* numbers, int count,
                           double* out) const override {
    if (!w_f) return Base::add_number_gradient(s, w_Q, w_f, numbers, count, out);
    double of_Q[kMaxLocal], of_f[kMaxLocal];
    for (int i = 0; i < size(); ++i) of_Q[i] = (w_Q ? w_Q[i] : 0) + w_f[work()] * s.v[i];
    std::copy(w_f, w_f + work(), of_f);
    of_f[work()] = 0;
    Base::add_number_gradient(s, of_Q, of_f, numbers, count, out);
  }

  std::vector<Measure> measures() const override {
    std::vector<Measure> m = Base::measures();
    m.push_back({"work", "J", false});
    return m;
  }
  PathDual measure(int i, const MeasureArguments& x) const override {
    return i == static_cast<int>(Base::measures().size()) ? x.z[work()] : Base::measure(i, x);
  }
  bool measure_value(int i, const ValueArguments& x, double& value) const override {
    if (i != static_cast<int>(Base::measures().size())) return Base::measure_value(i, x, value);
    value = x.z[work()];
    return true;
  }

 private:
  int work() const { return Base::states(); }
  int size() const { return static_cast<int>(this->coordinates().size()); }
  template <class S>
  S power(const S* Q, const S* v) const {
    S sum(0.0);
    for (int i = 0; i < size(); ++i) sum += Q[i] * v[i];
    return sum;
  }
};

/// A force of this class, with its work where that is asked for.
template <class F, class... Arguments>
std::unique_ptr<Force> make_force(bool with_work, Arguments&&... arguments) {
  if (with_work) return std::make_unique<WithWork<F>>(std::forward<Arguments>(arguments)...);
  return std::make_unique<F>(std::forward<Arguments>(arguments)...);
}

}  // namespace costate
