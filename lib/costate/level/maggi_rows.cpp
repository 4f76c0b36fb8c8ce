#include "costate/level/maggi_rows.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <iterator>

#include "costate/analysis/start.h"
#include "costate/assembly/slip_directions.h"
#include "costate/base/error.h"
#include "costate/element/switched_rows.h"
#include "costate/linear/to_dense.h"

namespace costate {

namespace {

// Of a row of length 1: what elimination leaves of one that depends on others.
constexpr double kDependent = 1e-9;

/// A state of which nothing but constraints is asked.
struct Bare {
  Bare(const Assembly& assembly, const StateView& s)
      : zero(static_cast<std::size_t>(std::max(assembly.n(), assembly.m())), 0), state(s) {
    if (!state.v) state.v = zero.data();
    state.a = state.lambda = zero.data();
  }
  std::vector<double> zero;
  StateView state;
};

/// Who bears how much decides what friction that turns does: its moments are not those of its sum.
void refuse_undetermined_slips(const Assembly& assembly, const std::vector<int>& left_out) {
  if (!slips_in_space(assembly)) return;
  for (const int r : left_out)
    if (assembly.holds_position(r))
      throw CapabilityError(fmt::format(
          "Row '{}' depends on those of other contacts that are closed, and some slide in space: who bears how much of "
          "the weight decides how they turn, which Maggi's equations do not know. Take index1 or baumgarte, or fewer "
          "contacts on one body.",
          assembly.mechanism().row_names()[static_cast<std::size_t>(r)]));
}

}  // namespace

std::vector<int> find_switched_rows(const Assembly& assembly) {
  const Mechanism& mech = assembly.mechanism();
  std::vector<int> rows;
  for (std::size_t c = 0; c < mech.constraints().size(); ++c)
    if (dynamic_cast<const SwitchedRows*>(mech.constraints()[c].get()))
      for (int r = 0; r < mech.constraints()[c]->rows(); ++r) rows.push_back(mech.row_offsets()[c] + r);
  return rows;
}

MaggiRows rows_there(const Assembly& assembly, const std::vector<int>& switched) {
  MaggiRows rows;
  std::copy_if(switched.begin(), switched.end(), std::back_inserter(rows.there),
               [&](int r) { return assembly.is_there(r); });
  const auto& slides = assembly.sliding_rows();
  for (std::size_t i = 0; i < slides.size(); ++i)
    rows.slides.emplace_back(slides[i].along, slips_in_space(assembly, i) ? 0 : slides[i].direction);
  return rows;
}

void leave_out(const std::vector<int>& left_out, const std::vector<int>& switched, MaggiRows& rows) {
  const auto holds = [](const std::vector<int>& all, int r) {
    return std::find(all.begin(), all.end(), r) != all.end();
  };
  rows.left_out = left_out;
  rows.closed.clear();
  rows.absent.clear();
  for (const int r : switched) (holds(rows.there, r) && !holds(left_out, r) ? rows.closed : rows.absent).push_back(r);
}

// Gram and Schmidt's elimination: rows that stay first, then gaps, then what sticks.
void find_dependent_rows(const Assembly& assembly, const std::vector<int>& switched, MaggiRows& rows) {
  std::vector<int> left_out;
  if (!rows.there.empty()) {
    const Eigen::MatrixXd J = to_dense(assembly.jacobian(), assembly.phi_q.data());
    std::vector<int> order;
    for (int r = 0; r < assembly.m(); ++r)
      if (std::find(switched.begin(), switched.end(), r) == switched.end()) order.push_back(r);
    for (const bool gaps : {true, false})
      for (const int r : rows.there)
        if (assembly.holds_position(r) == gaps) order.push_back(r);
    std::vector<Eigen::VectorXd> basis;
    for (const int r : order) {
      Eigen::VectorXd rest = J.row(r).transpose();
      const double size = rest.norm();
      for (int pass = 0; pass < 2; ++pass)
        for (const Eigen::VectorXd& b : basis) rest -= b.dot(rest) * b;
      if (rest.norm() > kDependent * size)
        basis.push_back(rest.normalized());
      else
        left_out.push_back(r);
    }
    std::sort(left_out.begin(), left_out.end());
    refuse_undetermined_slips(assembly, left_out);
  }
  leave_out(left_out, switched, rows);
}

int open_freedoms(Assembly& assembly) {
  if (!assembly.has_switched_rows()) return degrees_of_freedom(assembly);
  const Start start = find_start(assembly, 0, false);
  Assembly open(assembly.mechanism_ptr(), ParameterSelection{});  // no row that comes and goes is there yet
  const ConstraintRank rank = constraint_rank(open, 0, start.q.data());
  const int kept = assembly.m() - static_cast<int>(find_switched_rows(assembly).size());
  if (rank.rank < kept)
    throw CapabilityError(
        "This scene has rigid contacts that close, and other rows that depend on each other: Maggi's formulations "
        "carry one or the other. Take penalty or augmented-lagrangian, or remove what is redundant.");
  return assembly.n() - rank.rank;
}

void read_places(Assembly& assembly, const StateView& s, const std::vector<int>& closed, double* places) {
  if (closed.empty()) return;
  assembly.switch_rows(s.z);
  StateView at = s;
  at.z = nullptr;
  assembly.calc_constraints(at);
  for (std::size_t k = 0; k < closed.size(); ++k)
    places[k] = assembly.holds_position(closed[k]) ? 0 : assembly.phi[static_cast<std::size_t>(closed[k])];
}

void push_places(Assembly& assembly, const StateView& s, const std::vector<int>& closed, const double* const* dq,
                 double* const* out, int count) {
  if (closed.empty()) return;
  const Bare bare(assembly, s);
  Assembly::ParameterColumns columns;
  assembly.calc_parameter_columns(bare.state, columns);
  assembly.calc_jacobian(s);
  std::vector<double> rate(static_cast<std::size_t>(assembly.m()));
  for (int j = 0; j < count; ++j) {
    std::fill(rate.begin(), rate.end(), 0.0);
    add_product(assembly.jacobian(), assembly.phi_q.data(), 1, dq[j], rate.data());
    for (std::size_t k = 0; k < closed.size(); ++k) {
      const int r = closed[k];
      out[j][k] = assembly.holds_position(r) ? 0 : rate[static_cast<std::size_t>(r)] + columns.phi(r, j);
    }
  }
}

void pull_places(Assembly& assembly, const StateView& s, const std::vector<int>& closed, const double* mu, double* w_q,
                 double* gradient) {
  if (closed.empty()) return;
  std::vector<double> weight(static_cast<std::size_t>(assembly.m()), 0);
  for (std::size_t k = 0; k < closed.size(); ++k)
    if (!assembly.holds_position(closed[k])) weight[static_cast<std::size_t>(closed[k])] = mu[k];
  const Bare bare(assembly, s);
  Assembly::ParameterWeights w;
  w.row_phi = weight.data();
  assembly.add_parameter_gradient(bare.state, w, 1, gradient);
  assembly.calc_jacobian(s);
  add_transposed_product(assembly.jacobian(), assembly.phi_q.data(), 1, weight.data(), w_q);
}

}  // namespace costate
