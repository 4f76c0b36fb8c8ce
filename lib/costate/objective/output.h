// Named scalar outputs of a mechanism: coordinates and their rates, points, element measures (length, force,
// tension), multipliers, force states, energies and time. Costs, files and reports refer to them by name:
//   P2.x  P2.x_dot  P2.x_ddot   a coordinate or a point's component, its velocity, its acceleration
//   S1.length  S1.force  A1.tension  J.reaction_x   what an element measures
//   lambda.ROW   z.STATE   energy.kinetic  energy.potential  energy.total   time
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/assembly/variation.h"

namespace costate {

/// Accumulated first derivatives of a scalar with respect to everything it may depend on.
struct ScalarGradient {
  Eigen::VectorXd q, v, a, lambda, z;  // n, n, n, m, nz
  Eigen::VectorXd rho;                 // np
  void resize(const Assembly& assembly);
  void set_zero();
  /// Adds factor * other.
  void add(double factor, const ScalarGradient& other);
  /// rho += x d(number)/d(rho).
  void add_number(const Assembly& assembly, int number, double x);
};

class Output {
 public:
  Output(std::string name, std::string unit) : name_(std::move(name)), unit_(std::move(unit)) {}
  virtual ~Output() = default;
  const std::string& name() const { return name_; }
  const std::string& unit() const { return unit_; }
  /// Mechanism::signature() of what make_output() made it for; 0 of any other.
  std::size_t made_for() const { return made_for_; }
  void set_made_for(std::size_t signature) { made_for_ = signature; }

  virtual double value(const StateView& s, Assembly& assembly) const = 0;
  /// gradient += factor * d(value); throws CapabilityError for outputs without derivatives.
  virtual void add_gradient(const StateView& s, Assembly& assembly, double factor, ScalarGradient& g) const;
  /// Whether the value depends on accelerations or multipliers.
  virtual bool needs_accelerations() const { return false; }
  /// The coordinates whose positions or velocities it depends on; null: perhaps on all.
  virtual std::optional<std::vector<int>> depends_on() const { return std::nullopt; }

  // For Hessians, second-order adjoints and ends of runs by an event; both throw CapabilityError where they are not
  // available.
  /// The change of the value along the variation d: y_t dt + y_q dq + y_v dv + ...; also where it depends on
  /// accelerations or multipliers and d has none.
  virtual double change(const StateView& s, Assembly& assembly, const Variation& d) const;
  /// gradient += factor * the change of d(value) along the variation d.
  virtual void add_gradient_change(const StateView& s, Assembly& assembly, const Variation& d, double factor,
                                   ScalarGradient& g) const;

 protected:
  /// Throws CapabilityError where the value depends on accelerations or multipliers and d says nothing of them.
  void require_rates(const Variation& d) const;

 private:
  std::string name_, unit_;
  std::size_t made_for_ = 0;
};

/// Throws ModelError with near names when the mechanism has no such output.
std::unique_ptr<Output> make_output(const Mechanism& mechanism, const std::string& name);

/// All names that make_output accepts, in the order of the mechanism.
std::vector<std::string> output_names(const Mechanism& mechanism);

}  // namespace costate
