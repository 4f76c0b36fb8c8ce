// The start's derivative applied from the left, for adjoint methods: with A_q = [Phi_q; B_q] of the given positions and
// A_v = [Phi_q; B_v] of the given velocities,
//   A_v^T y_v = w_v, A_q^T y_q = w_q - Phid_q^T y_v (and the share of rates that are given),
//   gradient += y_q^T [-Phi_rho; z0_rho] + y_v^T [-Phid_rho; zd0_rho] + w_z^T z_rho.
// Memory and work do not grow with the product of coordinates and parameters, as q_rho and v_rho do.
#include <algorithm>

#include "costate/analysis/given_system.h"
#include "costate/analysis/start.h"

namespace costate {

namespace {
using Eigen::VectorXd;
using ConstVector = Eigen::Map<const VectorXd>;

void add_given(const Assembly& assembly, const std::vector<GivenStart>& given, const VectorXd& y, double* gradient) {
  for (std::size_t g = 0; g < given.size(); ++g)
    for (const auto& [column, factor] : assembly.number_columns()[static_cast<std::size_t>(given[g].number)])
      gradient[column] += factor * y[assembly.m() + static_cast<Eigen::Index>(g)];
}
}  // namespace

bool needs_start_columns(const Assembly& assembly, StartDerivative wanted) {
  if (wanted != StartDerivative::adjoint || assembly.np() == 0) return wanted == StartDerivative::columns;
  return assembly.mechanism().starts_at_equilibrium();
}

void add_start_gradient(Assembly& assembly, double t, const Start& start, const double* w_q, const double* w_v,
                        const double* w_z, double* gradient) {
  const int n = assembly.n(), nz = assembly.nz(), np = assembly.np();
  if (np == 0) return;
  if (start.q_rho.cols() == np) {
    Eigen::Map<VectorXd>(gradient, np) += start.q_rho.transpose() * ConstVector(w_q, n) +
                                          start.v_rho.transpose() * ConstVector(w_v, n) +
                                          start.z_rho.transpose() * ConstVector(w_z, nz);
    return;
  }
  const Mechanism& m = assembly.mechanism();
  const std::vector<double> rest(static_cast<std::size_t>(n), 0), unloaded(static_cast<std::size_t>(assembly.m()), 0);
  const StateView s{t, start.q.data(), start.v.data(), rest.data(), unloaded.data(), start.z.data()};
  assembly.calc_dynamics(s);
  assembly.calc_partials(s);
  GivenSystem velocities(assembly, m.given_velocities(), GivenSystem::Of::velocities),
      positions(assembly, m.given_positions(), GivenSystem::Of::positions);
  velocities.factor(start.q.data());
  const VectorXd y_v = velocities.solve_transposed(ConstVector(w_v, n));
  VectorXd rest_q = ConstVector(w_q, n);
  add_transposed_product(assembly.jacobian(), assembly.phid_q.data(), -1, y_v.data(), rest_q.data());
  for (std::size_t g = 0; g < m.given_velocities().size(); ++g)
    for (const auto& [i, j, factor] : m.given_velocities()[g].terms)
      rest_q[i] -= y_v[assembly.m() + static_cast<Eigen::Index>(g)] * factor * start.v[j];
  positions.factor(start.q.data());
  const VectorXd y_q = positions.solve_transposed(rest_q);
  Assembly::ParameterWeights w;
  w.row_phi = y_q.data();
  w.row_phid = y_v.data();
  assembly.add_parameter_gradient(s, w, -1, gradient);
  add_given(assembly, m.given_positions(), y_q, gradient);
  add_given(assembly, m.given_velocities(), y_v, gradient);
  for (std::size_t k = 0; k < m.forces().size(); ++k)
    for (int i = 0; i < m.forces()[k]->states(); ++i) {
      const int local = m.forces()[k]->initial_state_number(i), state = m.state_offsets()[k] + i;
      if (local < 0 || std::find(start.open_states.begin(), start.open_states.end(), state) != start.open_states.end())
        continue;
      const auto number = static_cast<std::size_t>(m.forces()[k]->numbers()[static_cast<std::size_t>(local)]);
      for (const auto& [column, factor] : assembly.number_columns()[number]) gradient[column] += factor * w_z[state];
    }
}

}  // namespace costate
