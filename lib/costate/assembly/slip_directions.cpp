#include "costate/assembly/slip_directions.h"

#include <algorithm>
#include <cmath>

#include "costate/assembly/slip_turn.h"
#include "costate/element/switched_rows.h"

namespace costate {

namespace {

/// A contact that slides in space: entry of its first row along the ground among sliding rows; w.
struct SpatialSlip {
  std::size_t first;
  double w[2];
};

/// Calls visit(SpatialSlip) for all of them.
template <class Visit>
void for_each_slip(const Assembly& assembly, const StateView& s, const std::vector<Assembly::SlidingRow>& rows,
                   const Visit& visit) {
  const Mechanism& mech = assembly.mechanism();
  const SparsePattern& pattern = assembly.jacobian();
  for (std::size_t i = 0; i + 1 < rows.size(); ++i) {
    if (rows[i].normal != rows[i + 1].normal) continue;
    SpatialSlip slip{i, {0, 0}};
    for (std::size_t c = 0; c < mech.constraints().size(); ++c)
      if (mech.row_offsets()[c] == rows[i].normal)
        if (const int state = sliding_state(mech, *mech.constraints()[c]); state >= 0)
          for (int k = 0; k < 2; ++k) slip.w[k] = s.z[state + 1 + k];
    const std::vector<double>& J = assembly.reaction_jacobian();
    for (int j = 0; j < pattern.cols; ++j)
      for (std::size_t k = 0; k < 2; ++k)
        if (const std::int64_t e = pattern.find(rows[i + k].along, j); e >= 0)
          slip.w[k] += J[static_cast<std::size_t>(e)] * s.v[j];
    visit(slip);
    ++i;
  }
}

/// -mu lambda_0 T, the derivative of R2 by the rates.
Eigen::Matrix2d turning(const Assembly& assembly, const StateView& s, const SpatialSlip& slip) {
  const Assembly::SlidingRow& row = assembly.sliding_rows()[slip.first];
  const Eigen::Vector2d w(slip.w[0], slip.w[1]);
  const double size = w.norm();
  if (!(size > 0) || !s.lambda) return Eigen::Matrix2d::Zero();
  return -assembly.numbers()[static_cast<std::size_t>(row.number)] * s.lambda[row.normal] * SlipTurn(w / size, size).T;
}

/// to_k += sum_l T_kl from_l over the entries of the rows along the ground, whose columns are the same.
void add_turned(const Assembly& assembly, const SpatialSlip& slip, const Eigen::Matrix2d& T,
                const std::vector<double>& from, std::vector<double>& to) {
  const SparsePattern& pattern = assembly.jacobian();
  const auto& rows = assembly.sliding_rows();
  for (int j = 0; j < pattern.cols; ++j)
    for (std::size_t l = 0; l < 2; ++l) {
      const std::int64_t e = pattern.find(rows[slip.first + l].along, j);
      if (e < 0) continue;
      for (std::size_t k = 0; k < 2; ++k)
        to[static_cast<std::size_t>(pattern.find(rows[slip.first + k].along, j))] +=
            T(k, l) * from[static_cast<std::size_t>(e)];
    }
}

}  // namespace

bool may_slide_in_space(const Assembly& assembly) {
  const auto& rows = assembly.slidable_rows();
  for (std::size_t i = 1; i < rows.size(); ++i)
    if (rows[i].second == rows[i - 1].second) return true;
  return false;
}

int sliding_state(const Mechanism& mechanism, const Constraint& constraint) {
  const auto* switched = dynamic_cast<const SwitchedRows*>(&constraint);
  if (!switched || switched->sliding_state() < 0) return -1;
  for (std::size_t f = 0; f < mechanism.forces().size(); ++f)
    if (mechanism.forces()[f].get() == &switched->switched_by())
      return mechanism.state_offsets()[f] + switched->sliding_state();
  return -1;
}

bool begins_slip_from_rest(const Mechanism& mechanism, const double* z_before, const double* z_after) {
  for (const auto& constraint : mechanism.constraints()) {
    const int state = constraint->rows() == 3 ? sliding_state(mechanism, *constraint) : -1;
    if (state < 0 || std::abs(z_after[state]) < 0.5) continue;
    const double *was = z_before + state + 1, *offset = z_after + state + 1;
    if ((offset[0] != 0 || offset[1] != 0) && (offset[0] != was[0] || offset[1] != was[1])) return true;
  }
  return false;
}

bool slips_in_space(const Assembly& assembly) {
  for (std::size_t i = 0; i < assembly.sliding_rows().size(); ++i)
    if (slips_in_space(assembly, i)) return true;
  return false;
}

bool slips_in_space(const Assembly& assembly, std::size_t i) {
  const auto& rows = assembly.sliding_rows();
  const auto same = [&](std::size_t other) { return other < rows.size() && rows[other].normal == rows[i].normal; };
  return same(i + 1) || (i > 0 && same(i - 1));
}

void turn_slips(const Assembly& assembly, const StateView& s, std::vector<Assembly::SlidingRow>& rows) {
  if (rows.size() < 2 || !s.v || !s.z) return;
  for_each_slip(assembly, s, rows, [&](const SpatialSlip& slip) {
    const double size = std::hypot(slip.w[0], slip.w[1]);
    for (std::size_t k = 0; k < 2; ++k) rows[slip.first + k].direction = size > 0 ? slip.w[k] / size : 0;
  });
}

void part_sliding_partials(const Assembly& assembly, const StateView& s, std::vector<double>& phid_q,
                           std::vector<double>& phidd_q) {
  const auto& rows = assembly.sliding_rows();
  if (rows.empty()) return;
  const auto clear = [&](std::vector<double>& x) {
    for (const Assembly::SlidingRow& r : rows)
      for (std::size_t k = 0; k < x.size(); ++k)
        if (assembly.jacobian().row[k] == r.along) x[k] = 0;
  };
  clear(phidd_q);
  if (s.v && s.z)
    for_each_slip(assembly, s, rows, [&](const SpatialSlip& slip) {
      add_turned(assembly, slip, turning(assembly, s, slip), phid_q, phidd_q);
    });
  clear(phid_q);
}

double parts_of_slips(const Assembly& assembly, const double* v) {
  std::vector<double> J = assembly.reaction_jacobian(), speeds(v, v + assembly.n()),
                      parts(static_cast<std::size_t>(assembly.m()), 0);
  for (auto* of : {&J, &speeds})
    for (double& x : *of) x = std::abs(x);
  add_product(assembly.jacobian(), J.data(), 1, speeds.data(), parts.data());
  double largest = 0;
  for (const auto& row : assembly.sliding_rows())
    largest = std::max(largest, parts[static_cast<std::size_t>(row.along)]);
  return largest;
}

void add_slip_rates(const Assembly& assembly, const StateView& s, std::vector<double>& r2_v) {
  if (assembly.sliding_rows().size() < 2) return;
  for_each_slip(assembly, s, assembly.sliding_rows(), [&](const SpatialSlip& slip) {
    add_turned(assembly, slip, turning(assembly, s, slip), assembly.reaction_jacobian(), r2_v);
  });
}

void slip_partials(const Assembly& assembly, const StateView& s, std::vector<double>& by_q, std::vector<double>& by_v) {
  by_q.clear();
  by_v.clear();
  if (!slips_in_space(assembly)) return;
  by_q.assign(assembly.phidd_q.size(), 0);
  by_v = by_q;
  for (const Assembly::SlidingRow& r : assembly.sliding_rows())
    for (std::size_t k = 0; k < by_q.size(); ++k)
      if (assembly.jacobian().row[k] == r.along) by_q[k] = assembly.phidd_q[k];
  add_slip_rates(assembly, s, by_v);
}

void add_slip_forces(Assembly& assembly, const StateView& s, std::vector<double>& by_q, std::vector<double>& by_v) {
  slip_partials(assembly, s, by_q, by_v);
  if (by_q.empty()) return;
  const SparsePattern &pattern = assembly.jacobian(), &square = assembly.square();
  const std::vector<double>& J = assembly.reaction_jacobian();
  std::vector<std::pair<int, std::size_t>> entries;  // of a row: columns and places
  for (const Assembly::SlidingRow& r : assembly.sliding_rows()) {
    entries.clear();
    for (int j = 0; j < pattern.cols; ++j)
      if (const std::int64_t e = pattern.find(r.along, j); e >= 0) entries.emplace_back(j, static_cast<std::size_t>(e));
    for (const auto& [j, by] : entries)
      for (const auto& [i, of] : entries) {
        const auto at = static_cast<std::size_t>(square.find(i, j));
        assembly.K[at] += J[of] * by_q[by];
        assembly.C[at] += J[of] * by_v[by];
      }
  }
}

Eigen::MatrixXd slip_columns(const Assembly& assembly, const StateView& s, const Eigen::MatrixXd& phid) {
  Eigen::MatrixXd out;
  if (assembly.sliding_rows().size() < 2 || !s.v || !s.z) return out;
  for_each_slip(assembly, s, assembly.sliding_rows(), [&](const SpatialSlip& slip) {
    if (out.size() == 0) out.setZero(phid.rows(), phid.cols());
    const Eigen::Matrix2d T = turning(assembly, s, slip);
    for (std::size_t k = 0; k < 2; ++k)
      for (std::size_t l = 0; l < 2; ++l)
        out.row(assembly.sliding_rows()[slip.first + k].along) +=
            T(k, l) * phid.row(assembly.sliding_rows()[slip.first + l].along);
  });
  return out;
}

void slip_weights(const Assembly& assembly, const StateView& s, int row, double factor, const double* weight,
                  double* of_rates) {
  if (!s.v || !s.z) return;
  for_each_slip(assembly, s, assembly.sliding_rows(), [&](const SpatialSlip& slip) {
    if (assembly.sliding_rows()[slip.first].normal != row) return;
    const Eigen::Matrix2d T = turning(assembly, s, slip);
    for (int l = 0; l < 2; ++l)
      for (int k = 0; k < 2; ++k) of_rates[1 + l] += factor * T(k, l) * weight[row + 1 + k];
  });
}

}  // namespace costate
