#include "costate/cycle/behind_impact.h"

#include <Eigen/Dense>
#include <utility>

#include "costate/event/motion_events.h"
#include "costate/level/velocity_jump.h"

namespace costate {

namespace {

/// The events of an assembly of its own, as those who ask are in the midst of evaluations of theirs.
class Striking {
 public:
  explicit Striking(const Assembly& of)
      : assembly_(with_numbers(of)), level_(assembly_, {}), jump_(assembly_, level_), events_(assembly_) {
    events_.use(jump_.balance());
  }
  MotionEvents& events() { return events_; }

 private:
  static Assembly with_numbers(const Assembly& of) {
    Assembly own(of.mechanism_ptr(), of.parameters());
    own.set_parameters(of.rho().data());
    return own;
  }
  Assembly assembly_;
  AccelerationLevel level_;
  VelocityJump jump_;
  MotionEvents events_;
};

class BehindImpact : public Output {
 public:
  BehindImpact(const NamedEvent& impact, std::string name, std::string unit)
      : Output(std::move(name), std::move(unit)), event_(impact.index) {}

  double value(const StateView& s, Assembly& assembly) const final {
    Striking strikes(assembly);
    std::vector<double> v(s.v, s.v + assembly.n()), z(s.z, s.z + assembly.nz());
    strikes.events().cross(event_, s, v.data(), z.data());
    return read(s.q, v.data(), z.data());
  }

 protected:
  virtual double read(const double* q, const double* v, const double* z) const = 0;
  int event() const { return event_; }

 private:
  int event_;
};

class RateBehind final : public BehindImpact {
 public:
  RateBehind(const NamedEvent& impact, std::string name, std::string unit, std::vector<GivenStart::Term> terms)
      : BehindImpact(impact, std::move(name), std::move(unit)), terms_(std::move(terms)) {}

  void add_gradient(const StateView& s, Assembly& assembly, double factor, ScalarGradient& g) const override {
    const Weights w = weights(s, assembly);
    const int n = assembly.n();
    for (int i = 0; i < n; ++i) {
      g.q[i] += factor * w.state[static_cast<std::size_t>(i)];
      g.v[i] += factor * w.state[static_cast<std::size_t>(n + i)];
    }
    for (std::size_t j = 0; j < w.rho.size(); ++j) g.rho[static_cast<Eigen::Index>(j)] += factor * w.rho[j];
  }
  double change(const StateView& s, Assembly& assembly, const Variation& d) const override {
    const Weights w = weights(s, assembly);
    const int n = assembly.n();
    double sum = w.time * d.t;
    for (int i = 0; i < n; ++i)
      sum += w.state[static_cast<std::size_t>(i)] * d.q[i] + w.state[static_cast<std::size_t>(n + i)] * d.v[i];
    const Eigen::VectorXd drho = parameters_along(d, assembly);
    for (Eigen::Index j = 0; j < drho.size(); ++j) sum += w.rho[static_cast<std::size_t>(j)] * drho[j];
    return sum;
  }
  void add_gradient_change(const StateView& s, Assembly& assembly, const Variation& d, double c,
                           ScalarGradient& g) const override {
    Striking strikes(assembly);
    const int n = assembly.n(), nz = assembly.nz();
    std::vector<double> v(s.v, s.v + n), z(s.z, s.z + nz);
    strikes.events().cross(event(), s, v.data(), z.data());
    // Where a gap closes is a matter of positions and velocities: what accelerations are does not count.
    strikes.events().begin_second(
        event(), s,
        {std::vector<double>(static_cast<std::size_t>(n), 0), std::vector<double>(static_cast<std::size_t>(nz), 0)});
    const Eigen::VectorXd drho = parameters_along(d, assembly);
    const auto of = [&](const Eigen::VectorXd& mu) { return strikes.events().transition_gradient(mu.data()); };
    const auto along = [&](const MotionEvents::Gradient& of_one) {
      return of_one.x.head(n).dot(Eigen::Map<const Eigen::VectorXd>(d.q, n)) +
             of_one.x.segment(n, n).dot(Eigen::Map<const Eigen::VectorXd>(d.v, n)) + of_one.rho.dot(drho) +
             of_one.t * d.t;
    };
    Eigen::VectorXd mu = Eigen::VectorXd::Zero(2 * n + nz), dmu = mu;
    for (const auto& [i, j, factor] : terms_) {
      mu[n + j] += factor * (i < 0 ? 1 : s.q[i]);
      if (i < 0) continue;
      dmu[n + j] += factor * d.q[i];
      Eigen::VectorXd one = Eigen::VectorXd::Zero(mu.size());
      one[n + j] = 1;
      g.q[i] += c * factor * along(of(one));
    }
    const MotionEvents::Gradient change = strikes.events().gradient_change(mu.data(), 0, d, drho), moved = of(dmu);
    g.q += c * (change.x.head(n) + moved.x.head(n));
    g.v += c * (change.x.segment(n, n) + moved.x.segment(n, n));
    g.rho += c * (change.rho + moved.rho);
  }

 protected:
  double read(const double* q, const double* v, const double*) const override {
    double sum = 0;
    for (const auto& [i, j, factor] : terms_) sum += factor * (i < 0 ? 1 : q[i]) * v[j];
    return sum;
  }

 private:
  /// What the parameters change by where they change the numbers so; of several that do the same any.
  static Eigen::VectorXd parameters_along(const Variation& d, const Assembly& assembly) {
    const auto& columns = assembly.number_columns();
    const auto count = static_cast<Eigen::Index>(columns.size());
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(count, assembly.np());
    for (std::size_t k = 0; k < columns.size(); ++k)
      for (const auto& [j, factor] : columns[k]) A(static_cast<Eigen::Index>(k), j) += factor;
    if (A.cols() == 0) return Eigen::VectorXd::Zero(0);
    return A.completeOrthogonalDecomposition().solve(Eigen::Map<const Eigen::VectorXd>(d.numbers, count));
  }

  struct Weights {
    std::vector<double> state, rho;  // of (q, v, z) before the impact, and of the parameters
    double time;
  };
  Weights weights(const StateView& s, Assembly& assembly) const {
    Striking strikes(assembly);
    const auto n = static_cast<std::size_t>(assembly.n());
    std::vector<double> v(s.v, s.v + n), z(s.z, s.z + assembly.nz());
    strikes.events().cross(event(), s, v.data(), z.data());
    Weights w{std::vector<double>(2 * n + z.size(), 0), std::vector<double>(static_cast<std::size_t>(assembly.np()), 0),
              0};
    for (const auto& [i, j, factor] : terms_) {
      w.state[n + static_cast<std::size_t>(j)] += factor * (i < 0 ? 1 : s.q[i]);
      if (i >= 0) w.state[static_cast<std::size_t>(i)] += factor * v[static_cast<std::size_t>(j)];
    }
    w.time = strikes.events().adjoint_of_impact(event(), s, w.state.data(), w.rho.data());
    return w;
  }

  std::vector<GivenStart::Term> terms_;
};

/// It is set by what happens, and does not change with what was before.
class ModeBehind final : public BehindImpact {
 public:
  ModeBehind(const NamedEvent& impact, std::string name, std::string unit, int i)
      : BehindImpact(impact, std::move(name), std::move(unit)), i_(i) {}
  void add_gradient(const StateView&, Assembly&, double, ScalarGradient&) const override {}
  double change(const StateView&, Assembly&, const Variation&) const override { return 0; }

 protected:
  double read(const double*, const double*, const double* z) const override { return z[i_]; }

 private:
  int i_;
};

}  // namespace

std::unique_ptr<Output> make_rate_behind(const NamedEvent& impact, std::string name, std::string unit,
                                         std::vector<GivenStart::Term> terms) {
  return std::make_unique<RateBehind>(impact, std::move(name), std::move(unit), std::move(terms));
}

std::unique_ptr<Output> make_mode_behind(const NamedEvent& impact, std::string name, std::string unit, int i) {
  return std::make_unique<ModeBehind>(impact, std::move(name), std::move(unit), i);
}

}  // namespace costate
