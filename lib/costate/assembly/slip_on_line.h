// The velocity w = J v + o along the ground of a contact that slides in space (element/switched_rows.h), its change
// along a direction, and its derivatives.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/assembly/slip_directions.h"
#include "costate/assembly/variation.h"

namespace costate {

/// Of the contact whose first row is `normal`, at (q, v, z) of s on the line along d, which has q and v at least.
class SlipOnLine {
 public:
  SlipOnLine(const Assembly& assembly, const StateView& s, const Variation& d, int normal) {
    const Mechanism& m = assembly.mechanism();
    int state = -1;
    for (std::size_t c = 0; state < 0; ++c) {
      rows_ = m.constraints()[c].get();
      if (m.row_offsets()[c] == normal) state = sliding_state(m, *rows_);
    }
    for (int k = 0; k < 2; ++k) {
      w[k] = s.z[state + 1 + k];
      dw[k] = d.z ? d.z[state + 1 + k] : 0;
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

  /// w_x by coordinates and by their velocities, 2 x coordinates, and by parameters, 2 x np.
  struct Partials {
    Eigen::MatrixXd by_q, by_v, by_rho;
  };
  Partials partials(const Assembly& assembly) {
    const auto count = static_cast<Eigen::Index>(coordinates().size());
    Partials x{{2, count}, {2, count}, Eigen::MatrixXd::Zero(2, assembly.np())};
    const Eigen::Vector2d none = Eigen::Vector2d::Zero();
    for (int r = 0; r < 2; ++r) {
      const Eigen::Vector2d unit = Eigen::Vector2d::Unit(r);
      for (Eigen::Index j = 0; j < count; ++j) {
        x.by_q(r, j) = by_coordinate(static_cast<std::size_t>(j), none, unit);
        x.by_v(r, j) = by_velocity(static_cast<std::size_t>(j), none, unit);
      }
      for (std::size_t i = 0; i < numbers().size(); ++i) {
        const auto& columns = assembly.number_columns()[static_cast<std::size_t>(numbers()[i])];
        if (columns.empty()) continue;
        const double by = by_number(i, none, unit);
        for (const auto& [column, f] : columns) x.by_rho(r, column) += f * by;
      }
    }
    return x;
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
