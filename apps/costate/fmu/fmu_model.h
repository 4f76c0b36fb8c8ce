// A scene as an FMU sees it: variables by number, the explicit equations y' = f(t, y, rho) with their outputs, and the
// derivatives of both, exact. The command that writes an FMU and the library inside it share this.
#pragma once

#include <algorithm>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "costate/integrator/segmented_run.h"
#include "costate/scene/scene.h"

namespace costate::app {

struct FmuVariable {
  enum class Kind { time, parameter, state, derivative, output };
  Kind kind = Kind::time;
  std::size_t index = 0;  // among those of its kind
  std::string name, unit, description;
  bool is_output = false;      // outputs, and states by whose names an output is asked for
  bool differentiable = true;  // an output without derivatives is a local variable
};

/// The instantiation token of an FMU with this scene: a digest of the file's bytes.
std::string fmu_token(const std::filesystem::path& scene);

class FmuModel {
 public:
  /// Throws CapabilityError for scenes whose formulation has no explicit form in positions and velocities, and as
  /// make_problem does.
  explicit FmuModel(const Scene& scene);

  /// The value reference of a variable is its place here.
  const std::vector<FmuVariable>& variables() const { return variables_; }
  const ParameterSelection& parameters() const { return problem_.parameters; }
  const SolverOptions& solver() const { return problem_.solver; }
  std::size_t size() const { return y_.size(); }
  /// Empty, or why an importer's integrator cannot carry it: events that only a run of our own finds.
  std::string no_model_exchange() const;

  /// Whether the products below are there: along runs with such events the equations change.
  bool has_derivatives() const { return no_model_exchange().empty(); }

  /// Parameters as in the scene; nothing has begun.
  void reset();
  /// Before start().
  void set_parameter(std::size_t index, double value);
  double parameter(std::size_t index) const { return rho_[index]; }
  /// The consistent start at t for the parameters, with its derivative.
  void start(double t);

  double time() const { return t_; }
  /// Not before the last jump; at it the time is that behind it.
  void set_time(double t) { t_ = std::max(t, behind_jump_); }
  std::vector<double>& state() { return y_; }
  /// Of any variable at the present state.
  double value(std::size_t variable);
  void derivatives(double* f) { system_->rhs(t_, y_.data(), f); }

  /// The next time at which velocities jump (a driver's kink), or infinity; and the jump there.
  double next_jump() const { return system_->segment_limit(t_); }
  void jump();

  /// Products of d(unknowns)/d(knowns) with a seed: J seed, and seed^T J. Unknowns are derivatives of states and
  /// outputs, knowns are states and parameters; `of_start`: at the start, where states are unknowns that follow from
  /// the parameters. Throw Error for others.
  std::vector<double> directional(const std::vector<std::size_t>& unknowns, const std::vector<std::size_t>& knowns,
                                  const double* seed, bool of_start);
  std::vector<double> adjoint(const std::vector<std::size_t>& unknowns, const std::vector<std::size_t>& knowns,
                              const double* seed, bool of_start);

  /// Co-simulation: runs from the start to t by CVODES, up to `t_end` at most.
  void begin_run(double t_end, double tolerance);
  void advance(double t);

 private:
  struct Row {
    std::vector<double> y, rho;  // an output's derivatives
  };
  Row output_row(std::size_t index);
  void require(const std::vector<std::size_t>& variables, bool known, bool of_start) const;
  void make_run();

  Problem problem_;
  std::vector<FmuVariable> variables_;
  std::vector<std::shared_ptr<const Output>> outputs_;
  std::unique_ptr<OdeSystem> system_;
  std::vector<std::unique_ptr<OdeSystem>> row_systems_;  // with an output as their terminal cost; made when asked for
  std::vector<double> rho_, y_;
  Eigen::MatrixXd y_rho_;
  double t_ = 0, t_start_ = 0, behind_jump_ = -std::numeric_limits<double>::infinity();
  SolverOptions run_options_;
  std::unique_ptr<OdeSystem> run_system_;
  std::unique_ptr<CvodeRun> run_;
};

}  // namespace costate::app
