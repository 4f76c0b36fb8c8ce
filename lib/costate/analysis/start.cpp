#include "costate/analysis/start.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "costate/analysis/closing_path.h"
#include "costate/analysis/equilibrium.h"
#include "costate/analysis/first_guess.h"
#include "costate/analysis/given_system.h"
#include "costate/analysis/not_finite.h"
#include "costate/analysis/start_errors.h"
#include "costate/assembly/gathered_state.h"
#include "costate/assembly/rolling_rows.h"
#include "costate/base/error.h"
#include "costate/base/run_epoch.h"
#include "costate/base/stop.h"
#include "costate/element/gap_element.h"

namespace costate {

namespace {

constexpr int kMaxIterations = 60;

bool same_coordinates(const std::vector<GivenStart>& a, const std::vector<GivenStart>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const GivenStart& x, const GivenStart& y) {
    return x.coordinate == y.coordinate && x.coordinate >= 0;
  });
}

std::vector<std::string> names_of(const Mechanism& m, const std::vector<GivenStart>& given) {
  std::vector<std::string> r;
  for (const auto& g : given) r.push_back(g.coordinate >= 0 ? m.coordinates()[g.coordinate].name : g.name);
  return r;
}

}  // namespace

int degrees_of_freedom(Assembly& assembly) {
  const Mechanism& m = assembly.mechanism();
  if (!m.starts_at_equilibrium()) return static_cast<int>(m.given_positions().size());
  const Start start = find_start(assembly, 0, false);
  return assembly.n() - constraint_rank(assembly, 0, start.q.data()).rank;
}

void calc_initial_states(const Assembly& assembly, Eigen::VectorXd& z, Eigen::MatrixXd* z_rho) {
  const Mechanism& m = assembly.mechanism();
  z.setZero(assembly.nz());
  if (z_rho) z_rho->setZero(assembly.nz(), assembly.np());
  for (std::size_t k = 0; k < m.forces().size(); ++k)
    for (int i = 0; i < m.forces()[k]->states(); ++i) {
      const int local = m.forces()[k]->initial_state_number(i), row = m.state_offsets()[k] + i;
      if (local < 0) continue;
      const int number = m.forces()[k]->numbers()[local];
      z[row] = assembly.numbers()[number];
      if (!z_rho) continue;
      for (const auto& [column, f] : assembly.number_columns()[number]) (*z_rho)(row, column) += f;
    }
}

namespace {

/// Positions and force states as given, the rest of the positions by the constraints.
class GivenPositions {
 public:
  GivenPositions(Assembly& assembly, double t)
      : assembly_(assembly),
        t_(t),
        given_(assembly.mechanism().given_positions()),
        system_(assembly, given_, GivenSystem::Of::positions) {}

  void solve(Start& start);
  void differentiate(Start& start, const Assembly::ParameterColumns& c) const;
  const GivenSystem& system() const { return system_; }

 private:
  /// Newton's iteration from start.q; whether it closed the mechanism. By short, contracting steps alone, if asked to.
  bool iterate(Start& start, bool only_short_steps);

  Assembly& assembly_;
  const double t_;
  const std::vector<GivenStart>& given_;
  GivenSystem system_;
  Eigen::VectorXd residual_;
};

bool GivenPositions::iterate(Start& start, bool only_short_steps) {
  const auto& numbers = assembly_.numbers();
  const int n = assembly_.n(), rows = assembly_.m();
  StateView s;
  s.t = t_;
  s.q = start.q.data();
  // Damped Gauss-Newton on [Phi; B q - z0].
  const auto residual = [&] {
    assembly_.calc_constraints(s);
    Eigen::VectorXd r(system_.rows());
    for (int i = 0; i < rows; ++i) r[i] = assembly_.phi[i];
    for (const int i : rows_without_place(assembly_)) r[i] = 0;
    for (std::size_t g = 0; g < given_.size(); ++g)
      r[rows + static_cast<int>(g)] = start.q[given_[g].coordinate] - numbers[given_[g].number];
    return r;
  };
  const StepLength length(assembly_, start.q);
  Eigen::VectorXd& r = residual_;
  r = residual();
  require_finite(assembly_, s);
  const double scale = std::max(1e-300, start.q.cwiseAbs().maxCoeff());
  bool converged = false;
  int settled = 0;
  double last = HUGE_VAL;
  for (int k = 0; k < kMaxIterations && !converged; ++k, ++start.iterations) {
    check_stop();
    system_.factor(start.q.data());
    const Eigen::VectorXd step = system_.solve(-r);
    const Eigen::VectorXd before = start.q;
    const double norm = r.norm();
    // Steps that are short and contract stay near the guess.
    const double longest = length(step);
    if (only_short_steps && !(longest <= 1 && (longest < 1e-6 || longest <= 0.5 * last))) return false;
    last = longest;
    double fraction = 1;
    for (int halving = 0; halving < 12; ++halving, fraction /= 2) {
      start.q = before + fraction * step;
      r = residual();
      if (r.norm() <= norm || step.norm() < 1e-12 * scale) break;
      if (only_short_steps && longest > 1e-6) return false;
    }
    // Quadratic convergence: one step after the size of rounding is enough.
    if (step.norm() < 1e-9 * scale) ++settled;
    converged = settled >= 2 || (step.norm() < 1e-15 * scale);
    if (!r.allFinite()) return false;
  }
  // A row's residual of rounding size is some eps times its terms, of size |phi_q||q|.
  double row_scale = 0;
  for (double x : assembly_.phi_q) row_scale = std::max(row_scale, std::abs(x));
  const double worst = r.size() == 0 ? 0 : r.cwiseAbs().maxCoeff();
  return n > 0 && converged && worst < 1e-10 * scale * std::max(1.0, row_scale);
}

void GivenPositions::solve(Start& start) {
  const Mechanism& m = assembly_.mechanism();
  const auto& numbers = assembly_.numbers();
  const int n = assembly_.n();
  const Eigen::VectorXd guess = first_guess(assembly_, t_);
  Eigen::VectorXd z0(static_cast<Eigen::Index>(given_.size()));
  for (std::size_t g = 0; g < given_.size(); ++g) z0[static_cast<Eigen::Index>(g)] = numbers[given_[g].number];
  calc_initial_states(assembly_, start.z, nullptr);
  start.q = guess;
  bool found = iterate(start, true);
  ClosingPath path(assembly_, t_, given_, z0);
  Eigen::VectorXd end = guess;
  if (!found) {
    const bool through = path.follow(end);
    start.q = end;
    found = iterate(start, through);
  }
  if (!found) {
    // Past a dead position there is no one branch of the guess: the one nearest to it of those that are found.
    const StepLength length(assembly_, guess);
    Eigen::VectorXd nearest, least = residual_, least_q = start.q;
    for (int way = 0; way < 3; ++way) {
      Eigen::VectorXd q = way == 1 ? end : guess;
      if (way < 2 && !path.descend(q)) continue;
      start.q = q;
      const bool closed = iterate(start, false);
      if (closed && (nearest.size() == 0 || length(start.q - guess) < length(nearest - guess))) nearest = start.q;
      if (!closed && residual_.allFinite() && !(residual_.norm() >= least.norm())) {
        least = residual_;
        least_q = start.q;
      }
    }
    found = nearest.size() > 0;
    start.q = found ? nearest : least_q;
    residual_ = path.residual(start.q);
  }
  if (!found) {
    require_given_count(assembly_, t_, guess.data(), names_of(m, given_), "positions");
    throw_unreachable(assembly_, residual_, names_of(m, given_));
  }
  system_.factor(start.q.data());
  if (!system_.determines()) require_given_count(assembly_, t_, start.q.data(), names_of(m, given_), "positions");
  if (system_.rank() < n) {
    const int at = system_.undetermined();
    throw ModelError("start", fmt::format("The given positions ({}) do not determine the configuration{}: with the "
                                          "constraints they depend on each other here. Give other coordinates.",
                                          fmt::join(names_of(m, given_), ", "),
                                          at < 0 ? "" : fmt::format(" ('{}' stays free)", m.coordinates()[at].name)));
  }
}

void GivenPositions::differentiate(Start& start, const Assembly::ParameterColumns& c) const {
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(system_.rows(), assembly_.np());
  right.topRows(assembly_.m()) = -c.phi;
  for (std::size_t g = 0; g < given_.size(); ++g)
    for (const auto& [column, f] : assembly_.number_columns()[given_[g].number])
      right(assembly_.m() + static_cast<int>(g), column) += f;
  start.q_rho = system_.solve(right);
  calc_initial_states(assembly_, start.z, &start.z_rho);
}

/// Velocities at the positions of the start, from the given ones and the constraints.
class GivenVelocities {
 public:
  GivenVelocities(Assembly& assembly, double t)
      : assembly_(assembly),
        t_(t),
        given_(assembly.mechanism().given_velocities()),
        system_(assembly, given_, GivenSystem::Of::velocities) {}

  /// `same`: the system of the positions where it is that of the velocities, too, or null.
  void solve(Start& start, const GivenSystem* same);
  void differentiate(Start& start, const Assembly::ParameterColumns& c) const;

 private:
  const GivenSystem& system() const { return same_ ? *same_ : system_; }

  Assembly& assembly_;
  const double t_;
  const std::vector<GivenStart>& given_;
  GivenSystem system_;
  const GivenSystem* same_ = nullptr;
  bool rests_ = false;
};

void GivenVelocities::solve(Start& start, const GivenSystem* same) {
  const Mechanism& m = assembly_.mechanism();
  const int rows = assembly_.m();
  same_ = same;
  if (!same_) system_.factor(start.q.data());
  Eigen::VectorXd b(system().rows());
  for (int i = 0; i < rows; ++i) b[i] = -assembly_.phi_t[i];
  for (std::size_t g = 0; g < given_.size(); ++g) b[rows + static_cast<int>(g)] = assembly_.numbers()[given_[g].number];
  // Where nothing is said to move, what has come to rest rests.
  start.rests = rests_ = m.starts_at_equilibrium() && b.isZero(0) && system().rank() < assembly_.n();
  if (rests_) {
    start.v.setZero();
    return;
  }
  if (!system().determines()) {
    try {
      require_given_count(assembly_, t_, start.q.data(), names_of(m, given_), "velocities");
    } catch (const ModelError& e) {
      if (!m.starts_at_equilibrium()) throw;
      throw ModelError(e.subject(), e.bare_message() +
                                        " (Only a mechanism that no driver and no given velocity moves "
                                        "starts at rest by itself.)");
    }
  }
  if (system().rank() < assembly_.n())
    throw ModelError("start", fmt::format("The given velocities ({}) do not determine the motion: with the constraints "
                                          "they depend on each other here. Give other coordinates.",
                                          fmt::join(names_of(m, given_), ", ")));
  start.v = system().solve(b);
}

void GivenVelocities::differentiate(Start& start, const Assembly::ParameterColumns& c) const {
  const int rows = assembly_.m(), np = assembly_.np();
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(system().rows(), np);
  right.topRows(rows) = -c.phid;
  for (int j = 0; j < np; ++j)
    add_product(assembly_.jacobian(), assembly_.phid_q.data(), -1, start.q_rho.col(j).data(), right.col(j).data());
  for (std::size_t g = 0; g < given_.size(); ++g) {
    for (const auto& [column, f] : assembly_.number_columns()[given_[g].number])
      right(rows + static_cast<int>(g), column) += f;
    for (const auto& [i, j, factor] : given_[g].terms)
      right.row(rows + static_cast<int>(g)) -= factor * start.v[j] * start.q_rho.row(i);
  }
  if (rests_) {
    Eigen::Index row, column;
    start.v_rho.setZero(assembly_.n(), np);
    if (right.size() == 0 || right.cwiseAbs().maxCoeff(&row, &column) == 0) return;
    throw ModelError("start", fmt::format("Parameter '{}' sets the mechanism in motion, which starts at rest: list in "
                                          "given_velocities as many velocities as it has degrees of freedom.",
                                          assembly_.parameters().parameters[static_cast<std::size_t>(column)].name));
  }
  start.v_rho = system().solve(right);
}

/// With zero, whatever number they have.
void begin_open(Start& start) {
  for (const int i : start.open_states) {
    start.z[i] = 0;
    if (start.z_rho.size() > 0) start.z_rho.row(i).setZero();
  }
}

/// Points of a patch that are not on the ground at the start are open, whatever the patch begins with.
void open_points(const Assembly& assembly, double t, Start& start) {
  const Mechanism& m = assembly.mechanism();
  GatheredState gathered;
  std::vector<int> own;
  const StateView s{t, start.q.data(), start.v.data(), nullptr, nullptr, start.z.data()};
  for (std::size_t k = 0; k < m.forces().size(); ++k) {
    const auto* gaps = dynamic_cast<const GapElement*>(m.forces()[k].get());
    if (!gaps || m.forces()[k]->states() == 0) continue;
    own.clear();
    LocalState local = gathered.of(*m.forces()[k], s, assembly.numbers());
    local.z = start.z.data() + m.state_offsets()[k];
    gaps->add_open_at_start(local, own);
    for (const int i : own) start.open_states.push_back(m.state_offsets()[k] + i);
  }
  begin_open(start);
}

}  // namespace

Start find_start(Assembly& assembly, double t, bool with_derivatives) {
  ++run_epoch();
  const Mechanism& m = assembly.mechanism();
  const bool balanced = m.starts_at_equilibrium();
  Start start;
  start.q.setZero(assembly.n());
  start.v.setZero(assembly.n());
  start.z.setZero(assembly.nz());
  calc_initial_states(assembly, start.z, nullptr);
  assembly.switch_rows(start.z.data());
  GivenPositions positions(assembly, t);
  if (balanced) {
    Equilibrium e = find_equilibrium(assembly, t, held_by_start(assembly), with_derivatives);
    start.q = e.q;
    start.z = e.z;
    start.q_rho = std::move(e.q_rho);
    start.z_rho = std::move(e.z_rho);
    start.lambda = e.lambda;
    start.lambda_rho = std::move(e.lambda_rho);
    start.iterations = e.iterations;
  } else {
    positions.solve(start);
  }
  require_angles(assembly, t, start.q);
  open_points(assembly, t, start);
  StateView s = start.state(t);
  assembly.calc_dynamics(s);
  GivenVelocities velocities(assembly, t);
  const bool same =
      !balanced && rows_without_place(assembly).empty() && same_coordinates(m.given_positions(), m.given_velocities());
  velocities.solve(start, same ? &positions.system() : nullptr);
  // Of forces at the velocities that there are: v/abs(v) is nothing at rest.
  assembly.calc_dynamics(s);
  require_finite(assembly, s);
  if (!with_derivatives) return start;

  Assembly::ParameterColumns c;
  const std::vector<double> zero_a(static_cast<std::size_t>(assembly.n()), 0.0),
      zero_lambda(static_cast<std::size_t>(assembly.m()), 0.0);
  s.a = zero_a.data();
  s.lambda = zero_lambda.data();
  assembly.calc_dynamics(s);
  assembly.calc_partials(s);
  assembly.calc_parameter_columns(s, c);
  if (!balanced) positions.differentiate(start, c);
  begin_open(start);
  velocities.differentiate(start, c);
  return start;
}

}  // namespace costate
