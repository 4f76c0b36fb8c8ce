#include "costate/analysis/equilibrium.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "costate/analysis/first_guess.h"
#include "costate/analysis/given_by_itself.h"
#include "costate/analysis/mechanism_size.h"
#include "costate/analysis/not_finite.h"
#include "costate/analysis/rest_system.h"
#include "costate/analysis/start.h"
#include "costate/analysis/start_errors.h"
#include "costate/assembly/rolling_rows.h"
#include "costate/base/error.h"
#include "costate/base/stop.h"
#include "costate/mechanism/guarded_forces.h"
#include "costate/objective/output.h"

namespace costate {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kMaxIterations = 400;
constexpr int kCloseIterations = 60;
constexpr int kPatience = 100;     // steps of the pseudo-transient before an equilibrium that is not stable will do
constexpr double kSettled = 1e-9;  // a Newton step of this size, relative to the mechanism's: rounding is one step away
constexpr double kLongestTurn = 0.3;
constexpr double kLongestMove = 0.2;  // of the mechanism's size

class Search {
 public:
  Search(Assembly& assembly, double t, const std::vector<HeldPosition>& held, const EquilibriumGuess* guess)
      : assembly_(assembly), held_(held), x_(assembly, t, held) {
    const Mechanism& m = assembly.mechanism();
    VectorXd q = first_guess(assembly, t), z(assembly.nz());
    calc_initial_states(assembly, z, nullptr);
    if (guess) {
      q = guess->q;
      for (int i = 0; i < assembly.nz(); ++i)
        if (!m.held_states()[static_cast<std::size_t>(i)]) z[i] = guess->z[i];
    }
    const VectorXd rest = VectorXd::Zero(assembly.n());
    StateView s;
    s.t = t;
    s.q = q.data();
    s.v = rest.data();
    s.z = z.data();
    assembly.calc_dynamics(s);
    require_finite(assembly, s);
    x_.move_to(q, z);
    measure_size();
  }

  void run(Equilibrium& e) {
    close();
    int settled = 0, transient = 0;
    bool newton = true;
    for (; iterations_ < kMaxIterations && settled < 2; ++iterations_) {
      check_stop();
      x_.linearize();
      const bool stable = x_.lowest_stiffness() > 0 || x_.freedom() == 0;
      newton = (stable || transient >= kPatience) && newton_step(settled);
      if (newton) continue;
      settled = 0;
      ++transient;
      // An exact balance that is not stable stays where it is.
      if (transient_step() < 1e-12 * size_ && x_.step_size(x_.newton(0)) < kSettled * size_) break;
    }
    x_.linearize();
    require_determined();
    if (iterations_ >= kMaxIterations) throw_unbalanced();
    e.q = x_.q();
    e.z = x_.z();
    e.lambda = x_.multipliers().head(assembly_.m());
    e.held = x_.multipliers().tail(static_cast<Eigen::Index>(held_.size()));
    e.iterations = iterations_;
    e.residual = x_.unbalanced().size() == 0 ? 0 : x_.unbalanced().cwiseAbs().maxCoeff();
    e.constraint_residual = x_.gap().size() == 0 ? 0 : x_.gap().cwiseAbs().maxCoeff();
    e.lowest_stiffness = x_.lowest_stiffness();
    e.degrees_of_freedom = x_.freedom();
  }

  void differentiate(Equilibrium& e) { x_.differentiate(e.q_rho, e.z_rho, e.lambda_rho, e.held_rho); }

 private:
  std::vector<std::string> held_names() const {
    std::vector<std::string> r;
    for (const auto& h : held_) r.push_back(assembly_.mechanism().coordinates()[h.coordinate].name);
    return r;
  }

  void measure_size() {
    const VectorXd& q = x_.q();
    size_ = std::max(1e-3, q.cwiseAbs().maxCoeff());
    extent_ = extent_of(assembly_, q).value_or(extent_);
  }

  /// Constraints and held positions alone, by the shortest steps.
  void close() {
    int settled = 0;
    for (int i = 0; i < kCloseIterations && settled < 2; ++i) {
      check_stop();
      const VectorXd q = x_.q(), step = x_.closing_step();
      const double before = x_.gap().norm();
      double fraction = 1;
      for (int halving = 0; halving < 12; ++halving, fraction /= 2) {
        x_.move_to(q + fraction * step, x_.z());
        if (x_.gap().norm() <= before || step.norm() < 1e-12 * size_) break;
      }
      if (step.norm() < kSettled * size_) ++settled;
      if (!x_.gap().allFinite()) break;
    }
    const double worst = x_.gap().size() == 0 ? 0 : x_.gap().cwiseAbs().maxCoeff();
    if (settled >= 2 && worst < 1e-10 * size_ * std::max(1.0, x_.row_scale())) return;
    require_given_count(assembly_, x_.state().t, x_.q().data(), held_names(), "positions", true);
    throw_unreachable(assembly_, x_.gap(), held_names());
  }

  /// Whether a step as long as the natural monotonicity test allows was found; `settled` counts steps of
  /// rounding size.
  bool newton_step(int& settled) {
    const RestStep step = x_.newton(0);
    if (!step.q.allFinite() || !step.z.allFinite()) return false;
    const double length = x_.step_size(step);
    const VectorXd q = x_.q(), z = x_.z();
    if (length < kSettled * size_) {
      x_.move_to(q + step.q, z + step.z);
      ++settled;
      return true;
    }
    double fraction = std::min(1.0, longest(step));
    for (int halving = 0; halving < 6; ++halving, fraction /= 2) {
      x_.move_to(q + fraction * step.q, z + fraction * step.z);
      const RestStep next = x_.newton(0);  // with the old matrices
      const double left = x_.step_size(next);
      if (std::isfinite(left) && left <= (1 - fraction / 4) * length) return true;
    }
    x_.move_to(q, z);
    x_.linearize();
    return false;
  }

  /// Fraction of a step that moves nothing by more than the longest turn or move.
  double longest(const RestStep& step) const {
    double worst = 0;
    const auto& coordinates = assembly_.mechanism().coordinates();
    for (int i = 0; i < assembly_.n(); ++i)
      worst =
          std::max(worst, std::abs(step.q[i]) / (coordinates[i].unit == "m" ? kLongestMove * extent_ : kLongestTurn));
    return worst > 0 ? 1 / worst : 1;
  }

  /// Returns its length.
  double transient_step() {
    double sigma = x_.lowest_stiffness() > 0 ? 0.1 * x_.lowest_stiffness() : -2 * x_.lowest_stiffness();
    sigma = std::max(sigma, 1e-9 * std::max(1e-6, x_.highest_stiffness()));
    RestStep step = x_.newton(sigma);
    for (int k = 0; k < 200 && !(longest(step) >= 1); ++k) {
      sigma *= 2;
      step = x_.newton(sigma);
      // What closes the constraints is not shortened by masses.
      if (k > 60 && step.q.allFinite()) break;
    }
    const double fraction = std::min(1.0, longest(step));
    x_.move_to(x_.q() + fraction * step.q, x_.z() + fraction * step.z);
    return fraction * x_.step_size(step);
  }

  void require_determined() {
    const std::vector<std::string> loose = x_.undetermined();
    require_given_count(assembly_, x_.state().t, x_.q().data(), held_names(), "positions", true);
    if (const std::vector<int> twice = x_.held_twice(); !twice.empty()) {
      const std::string name = held_names()[static_cast<std::size_t>(twice.front())];
      throw ModelError(
          "start", fmt::format("'{}' is held, and constraints, drivers or the other positions held fix it already: "
                               "what each of them bears is not determined. Take it from the positions held ('given' "
                               "in [start], --hold); constraints keep it where they have it.",
                               name));
    }
    if (loose.empty()) return;
    const char* them = loose.size() == 1 ? "it" : "them";
    throw ModelError(
        "start", fmt::format("No equilibrium is determined: nothing holds {} (no stiffness acts "
                             "against {} motion{}). Give {} in "
                             "[start], or add the spring, contact or constraint that holds {}.{}",
                             fmt::join(loose, ", "), loose.size() == 1 ? "this" : "these", loose.size() == 1 ? "" : "s",
                             them, them,
                             has_guarded_forces(assembly_.mechanism())
                                 ? " A contact whose law keeps the speed of its touch is closed at the start only "
                                   "with an 'approach_speed_m_per_s'."
                                 : ""));
  }

  [[noreturn]] void throw_unbalanced() {
    std::vector<std::pair<double, std::string>> worst;
    const VectorXd& g = x_.unbalanced();
    for (int i = 0; i < assembly_.n(); ++i)
      worst.emplace_back(std::abs(g[i]), assembly_.mechanism().coordinates()[i].name);
    std::sort(worst.rbegin(), worst.rend());
    std::vector<std::string> text;
    for (std::size_t i = 0; i < std::min<std::size_t>(3, worst.size()); ++i)
      text.push_back(fmt::format("{} by {:.3g}", worst[i].second, worst[i].first));
    throw ModelError("start", fmt::format("No equilibrium was found in {} iterations. Out of balance most (generalized "
                                          "force): {}. Bring the first guesses nearer, or give more positions.",
                                          kMaxIterations, fmt::join(text, ", ")));
  }

  Assembly& assembly_;
  const std::vector<HeldPosition>& held_;
  RestSystem x_;
  double size_ = 1, extent_ = 1;
  int iterations_ = 0;
};

}  // namespace

std::vector<HeldPosition> held_by_start(const Assembly& assembly) {
  std::vector<HeldPosition> held;
  for (const auto& g : assembly.mechanism().given_positions())
    if (!given_by_itself(g)) held.push_back({g.coordinate, assembly.numbers()[g.number], g.number});
  return held;
}

Equilibrium find_equilibrium(Assembly& assembly, double t, const std::vector<HeldPosition>& held, bool with_derivatives,
                             const EquilibriumGuess* guess) {
  Equilibrium e;
  Search search(assembly, t, held, guess);
  refuse_rolling(assembly, "An equilibrium");
  if (!assembly.sliding_rows().empty())
    throw ModelError(
        "start",
        fmt::format(
            "An equilibrium is at rest, where '{}' does not slide: leave 'sliding' out of its contact, and give "
            "its along_m (in space along_m and across_m), where it sticks, or friction = \"none\".",
            assembly.mechanism().row_names()[static_cast<std::size_t>(assembly.sliding_rows().front().along)]));
  if (const std::vector<int> free = rows_without_place(assembly); !free.empty())
    throw ModelError("start", fmt::format("An equilibrium has to know where '{}' sticks: give its along_m (in space "
                                          "along_m and across_m).",
                                          assembly.mechanism().row_names()[static_cast<std::size_t>(free.front())]));
  search.run(e);
  if (with_derivatives) search.differentiate(e);
  return e;
}

EquilibriumAdjoint equilibrium_adjoint(Assembly& assembly, double t, const VectorXd& q, const VectorXd& z,
                                       const VectorXd& weight_q, const VectorXd& weight_z) {
  const auto held = held_by_start(assembly);
  RestSystem x(assembly, t, held);
  x.move_to(q, z);
  x.linearize();
  EquilibriumAdjoint a;
  x.solve_adjoint(weight_q, weight_z, a.s, a.w, a.x);
  return a;
}

double value_at_rest(const Output& output, Assembly& assembly, double t, const Equilibrium& e) {
  const VectorXd rest = VectorXd::Zero(assembly.n());
  return output.value({t, e.q.data(), rest.data(), rest.data(), e.lambda.data(), e.z.data()}, assembly);
}

VectorXd derivative_at_rest(const Output& output, Assembly& assembly, double t, const Equilibrium& e) {
  const VectorXd rest = VectorXd::Zero(assembly.n());
  ScalarGradient g;
  g.resize(assembly);
  output.add_gradient({t, e.q.data(), rest.data(), rest.data(), e.lambda.data(), e.z.data()}, assembly, 1, g);
  return e.q_rho.transpose() * g.q + e.lambda_rho.transpose() * g.lambda + e.z_rho.transpose() * g.z + g.rho;
}

}  // namespace costate
