// The velocity w = J v + o along the ground of a contact that slides in space (element/switched_rows.h), its change
// along a direction, and its derivatives.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/assembly/variation.h"
#include "costate/element/switched_rows.h"

namespace costate {

/// Of the contact whose first row is `normal`, at (q, v, z) of s on the line along d, which has q and v at least.
class SlipOnLine {
 public:
  SlipOnLine(const Assembly& assembly, const StateView& s, const Variation& d, int normal) {
    const Mechanism& m = assembly.mechanism();
    std::size_t c = 0;
    const SwitchedRows* switched = nullptr;
    for (; !switched; ++c) {
      rows_ = m.constraints()[c].get();
      if (m.row_offsets()[c] == normal) switched = dynamic_cast<const SwitchedRows*>(rows_);
    }
    for (std::size_t f = 0; f < m.forces().size(); ++f)
      if (m.forces()[f].get() == &switched->switched_by())
        for (int k = 0; k < 2; ++k) {
          const int o = m.state_offsets()[f] + switched->sliding_state() + 1 + k;
          w[k] = s.z[o];
          dw[k] = d.z ? d.z[o] : 0;
        }
    for (std::size_t i = 0; i < coordinates().size(); ++i) {
      const int k = coordinates()[i];
      q_[i] = DirectedPathDual(PathDual(Taylor2(s.q[k], s.v[k], 0)));
      q_[i].d[0] = PathDual(Taylor2(d.q[k], d.v[k], 0));
    }
    for (const int k : numbers()) {
      p_.emplace_back(assembly.numbers()[static_cast<std::size_t>(k)]);
      if (d.numbers) p_.back().d[0] = PathDual(d.numbers[k]);
    }
    evaluate();
    for (int k = 0; k < 2; ++k) {
      w[k] += along(k).v.v.c1;
      dw[k] += along(k).d[0].v.c1;
    }
  }
  const std::vector<int>& coordinates() const { return rows_->coordinates(); }
  const std::vector<int>& numbers() const { return rows_->numbers(); }
  /// The change of w_x^T g along d, where g changes by dg; x is local coordinate, its velocity, or number i.
  double by_coordinate(std::size_t i, const Eigen::Vector2d& g, const Eigen::Vector2d& dg) {
    return seeded(q_[i], Taylor2(1.0), g, dg);
  }
  double by_velocity(std::size_t i, const Eigen::Vector2d& g, const Eigen::Vector2d& dg) {
    return seeded(q_[i], Taylor2(0, 1, 0), g, dg);
  }
  double by_number(std::size_t i, const Eigen::Vector2d& g, const Eigen::Vector2d& dg) {
    return seeded(p_[i], Taylor2(1.0), g, dg);
  }

  Eigen::Vector2d w, dw;

 private:
  const DirectedPathDual& along(int k) const { return phi_[static_cast<std::size_t>(1 + k)]; }
  void evaluate() {
    phi_.fill(DirectedPathDual());
    rows_->phi_directed(DirectedPathDual(), q_.data(), p_.data(), phi_.data());
  }
  double seeded(DirectedPathDual& x, const Taylor2& seed, const Eigen::Vector2d& g, const Eigen::Vector2d& dg) {
    x.v.d[0] = seed;
    evaluate();
    x.v.d[0] = Taylor2();
    double sum = 0;
    for (int k = 0; k < 2; ++k) sum += g[k] * along(k).d[0].d[0].c1 + dg[k] * along(k).v.d[0].c1;
    return sum;
  }

  const Constraint* rows_;
  std::array<DirectedPathDual, kMaxLocal> q_, phi_;
  std::vector<DirectedPathDual> p_;
};

}  // namespace costate
