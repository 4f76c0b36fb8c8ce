#include "fmu_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "costate/base/error.h"
#include "costate/named_outputs.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/key_reference.h"
#include "costate/scene/scene_files.h"
#include "units.h"

namespace costate::app {

namespace {

/// The value of an output, as a cost.
class OutputItself final : public CostTerm {
 public:
  explicit OutputItself(std::shared_ptr<const Output> output) : output_(std::move(output)) {}
  double value(const StateView& s, Assembly& assembly) const override { return output_->value(s, assembly); }
  void add_gradient(const StateView& s, Assembly& assembly, double factor, ScalarGradient& g) const override {
    output_->add_gradient(s, assembly, factor, g);
  }
  bool needs_accelerations() const override { return output_->needs_accelerations(); }

 private:
  std::shared_ptr<const Output> output_;
};

/// Parameters of the scene, and numbers that [run] names besides.
Problem problem_of(const Scene& scene) {
  std::vector<std::string> names;
  for (const Parameter& p : scene.mechanism()->parameters()) names.push_back(p.name);
  for (const std::string& name : scene.run.parameters)
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  Problem problem = make_problem(scene, names);
  problem.objective = {};
  problem.ends_when = nullptr;
  problem.cycle = nullptr;
  return problem;
}

std::string binding_text(const Mechanism& m, const Parameter& p) {
  std::string text;
  for (const auto& [number, factor] : p.bindings)
    text += (text.empty() ? "" : ", ") + m.numbers()[static_cast<std::size_t>(number)].path;
  return text;
}

/// Of the numbers that a parameter acts on, by the ends of their keys; empty where they have none, or several, or the
/// factors between them and the parameter may have some.
std::string unit_of(const Mechanism& m, const Parameter& p) {
  std::set<std::string> units;
  for (const auto& [number, factor] : p.bindings) {
    if (std::abs(factor) != 1) return "";
    const std::string& path = m.numbers()[static_cast<std::size_t>(number)].path;
    units.insert(unit_of_key(path.substr(path.rfind('.') + 1)));
  }
  return units.size() == 1 ? *units.begin() : "";
}

}  // namespace

std::string fmu_token(const std::filesystem::path& scene) { return "costate-" + file_digest(scene.string()); }

FmuModel::FmuModel(const Scene& scene) : problem_(problem_of(scene)) {
  system_ = problem_.make_ode();
  const Mechanism& m = *problem_.mechanism;
  // States that are charts of their own, or integrals, mean nothing to another program.
  const auto motion = static_cast<std::size_t>(2 * m.coordinate_count() + m.state_count());
  if (!system_->begins_with_motion() || static_cast<std::size_t>(system_->size()) != motion)
    throw CapabilityError(
        fmt::format("The formulation '{}' has unknowns besides positions, velocities and force states, which an FMU "
                    "cannot have; choose '{}' with --formulation.",
                    problem_.formulation, kDefaultFormulation));
  y_.assign(motion, 0);
  using Kind = FmuVariable::Kind;
  const auto add = [&](Kind kind, std::size_t index, const std::string& name, const std::string& unit,
                       const std::string& description) {
    variables_.push_back({kind, index, name, unit, description});
  };
  add(Kind::time, 0, "time", "s", "");
  const auto& parameters = problem_.parameters.parameters;
  for (std::size_t i = 0; i < parameters.size(); ++i)
    add(Kind::parameter, i, "parameter." + parameters[i].name, unit_of(m, parameters[i]),
        binding_text(m, parameters[i]));
  const std::vector<std::string> asked = outputs_of_interest(scene);
  std::set<std::string> left(asked.begin(), asked.end());
  left.erase("time");
  for (std::size_t i = 0; i < motion; ++i) {
    const Unknown& u = system_->unknowns()[i];
    add(Kind::state, i, u.name, u.unit, "");
    variables_.back().is_output = left.erase(u.name) > 0;
  }
  for (std::size_t i = 0; i < motion; ++i) {
    const Unknown& u = system_->unknowns()[i];
    add(Kind::derivative, i, fmt::format("der({})", u.name), unit_of_rate(u.unit), "");
  }
  for (const std::string& name : asked) {
    if (!left.contains(name)) continue;
    std::shared_ptr<const Output> output = make_output(m, name);
    add(Kind::output, outputs_.size(), name, output->unit() == "1" ? "" : output->unit(), "");
    variables_.back().is_output = true;
    outputs_.push_back(std::move(output));
  }
  row_systems_.resize(outputs_.size());
  reset();
  // What has no derivative says so at any state; where nothing has one, outputs are what they are all the same.
  start(problem_.solver.t_start);
  for (FmuVariable& v : variables_)
    if (v.kind == Kind::output && has_derivatives()) try {
        output_row(v.index);
      } catch (const CapabilityError&) {
        v.is_output = v.differentiable = false;
      }
  reset();
}

std::string FmuModel::no_model_exchange() const {
  return system_->has_events() ? "its contacts close and open, at times that only a run of its own finds" : "";
}

void FmuModel::reset() {
  rho_ = problem_.parameters.values();
  run_.reset();
  run_system_.reset();
  t_ = t_start_ = problem_.solver.t_start;
  run_options_ = problem_.solver;
}

void FmuModel::set_parameter(std::size_t index, double value) {
  if (!std::isfinite(value))
    throw Error(fmt::format("{} must be a finite number, found {}.", variables_[1 + index].name, value));
  rho_[index] = value;
}

void FmuModel::start(double t) {
  t_ = t_start_ = t;
  behind_jump_ = -std::numeric_limits<double>::infinity();
  system_->set_parameters(rho_.data());
  for (auto& s : row_systems_)
    if (s) s->set_parameters(rho_.data());
  system_->start(t, y_.data(), &y_rho_);
}

double FmuModel::value(std::size_t variable) {
  const FmuVariable& v = variables_[variable];
  switch (v.kind) {
    case FmuVariable::Kind::time:
      return t_;
    case FmuVariable::Kind::parameter:
      return rho_[v.index];
    case FmuVariable::Kind::state:
      return y_[v.index];
    case FmuVariable::Kind::derivative: {
      std::vector<double> f(y_.size());
      derivatives(f.data());
      return f[v.index];
    }
    case FmuVariable::Kind::output:
      break;
  }
  OdeSystem& system = run_ ? *run_system_ : *system_;  // contacts are there as the run has them
  return outputs_[v.index]->value(system.mechanism_state(t_, y_.data()), system.assembly());
}

void FmuModel::jump() {
  system_->jump(t_, y_.data());
  t_ = behind_jump_ = system_->segment_start(t_);
}

FmuModel::Row FmuModel::output_row(std::size_t index) {
  auto& system = row_systems_[index];
  if (!system) {
    Problem p = problem_;
    p.objective.terminal = {std::make_shared<OutputItself>(outputs_[index])};
    system = p.make_ode();
    system->set_parameters(rho_.data());
  }
  Row row{std::vector<double>(y_.size()), std::vector<double>(rho_.size())};
  system->terminal_adjoint(t_, y_.data(), row.y.data(), row.rho.data());
  return row;
}

void FmuModel::require(const std::vector<std::size_t>& variables, bool known, bool of_start) const {
  using Kind = FmuVariable::Kind;
  if (!has_derivatives()) throw Error("There are no derivatives: " + no_model_exchange() + ".");
  for (const std::size_t i : variables) {
    const FmuVariable& v = variables_[i];
    const bool allowed =
        known ? v.kind == Kind::parameter || (v.kind == Kind::state && !of_start)
              : v.kind == Kind::derivative || (v.kind == Kind::output && v.differentiable) || v.kind == Kind::state;
    if (!allowed)
      throw Error(
          fmt::format("There is no derivative {} '{}'{}: it is known of derivatives and outputs by states and "
                      "parameters{}.",
                      known ? "by" : "of", v.name, of_start ? " at the start" : "",
                      of_start ? ", at the start by parameters, of which the states are functions" : ""));
  }
}

std::vector<double> FmuModel::directional(const std::vector<std::size_t>& unknowns,
                                          const std::vector<std::size_t>& knowns, const double* seed, bool of_start) {
  require(unknowns, false, of_start);
  require(knowns, true, of_start);
  using Kind = FmuVariable::Kind;
  const std::size_t n = y_.size(), np = rho_.size();
  Eigen::VectorXd dy = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(n)),
                  dp = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(np));
  for (std::size_t i = 0; i < knowns.size(); ++i) {
    const FmuVariable& v = variables_[knowns[i]];
    (v.kind == Kind::state ? dy : dp)[static_cast<Eigen::Index>(v.index)] += seed[i];
  }
  if (of_start && np > 0) dy += y_rho_ * dp;
  std::vector<double> df;  // f_y dy + f_rho dp
  const auto calc_df = [&] {
    df.assign(n, 0);
    const double* in = dy.data();
    double* out = df.data();
    system_->tangent(t_, y_.data(), &in, &out, 1, false);
    if (dp.isZero(0)) return;
    const std::vector<double> zero(n, 0.0);
    std::vector<double> columns(n * np);
    std::vector<const double*> from(np, zero.data());
    std::vector<double*> to;
    for (std::size_t j = 0; j < np; ++j) to.push_back(columns.data() + j * n);
    system_->tangent(t_, y_.data(), from.data(), to.data(), static_cast<int>(np), true);
    for (std::size_t j = 0; j < np; ++j)
      for (std::size_t i = 0; i < n; ++i) df[i] += columns[j * n + i] * dp[static_cast<Eigen::Index>(j)];
  };
  std::vector<double> r;
  for (const std::size_t u : unknowns) {
    const FmuVariable& v = variables_[u];
    if (v.kind == Kind::state) {
      r.push_back(dy[static_cast<Eigen::Index>(v.index)]);
    } else if (v.kind == Kind::derivative) {
      if (df.empty()) calc_df();
      r.push_back(df[v.index]);
    } else {
      const Row row = output_row(v.index);
      r.push_back(std::inner_product(row.y.begin(), row.y.end(), dy.data(), 0.0) +
                  std::inner_product(row.rho.begin(), row.rho.end(), dp.data(), 0.0));
    }
  }
  return r;
}

std::vector<double> FmuModel::adjoint(const std::vector<std::size_t>& unknowns, const std::vector<std::size_t>& knowns,
                                      const double* seed, bool of_start) {
  require(unknowns, false, of_start);
  require(knowns, true, of_start);
  using Kind = FmuVariable::Kind;
  const std::size_t n = y_.size(), np = rho_.size();
  Eigen::VectorXd gy = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(n)),
                  gp = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(np));
  std::vector<double> mu(n, 0.0);
  bool of_derivatives = false;
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    const FmuVariable& v = variables_[unknowns[i]];
    if (v.kind == Kind::state) {
      gy[static_cast<Eigen::Index>(v.index)] += seed[i];
    } else if (v.kind == Kind::derivative) {
      mu[v.index] += seed[i];
      of_derivatives = true;
    } else {
      const Row row = output_row(v.index);
      for (std::size_t k = 0; k < n; ++k) gy[static_cast<Eigen::Index>(k)] += seed[i] * row.y[k];
      for (std::size_t k = 0; k < np; ++k) gp[static_cast<Eigen::Index>(k)] += seed[i] * row.rho[k];
    }
  }
  if (of_derivatives) {
    // Of a system without cost: mu' = -f_y^T mu, and mu^T f_rho.
    std::vector<double> mup(n, 0.0), of_rho(np, 0.0);
    system_->adjoint_rhs(t_, y_.data(), mu.data(), mup.data());
    for (std::size_t k = 0; k < n; ++k) gy[static_cast<Eigen::Index>(k)] -= mup[k];
    if (np > 0) system_->adjoint_integrand(t_, y_.data(), mu.data(), of_rho.data());
    for (std::size_t k = 0; k < np; ++k) gp[static_cast<Eigen::Index>(k)] += of_rho[k];
  }
  if (of_start && np > 0) gp += y_rho_.transpose() * gy;
  std::vector<double> r;
  for (const std::size_t k : knowns) {
    const FmuVariable& v = variables_[k];
    r.push_back((v.kind == Kind::state ? gy : gp)[static_cast<Eigen::Index>(v.index)]);
  }
  return r;
}

void FmuModel::begin_run(double t_end, double tolerance) {
  run_options_ = problem_.solver;
  run_options_.t_start = t_start_;
  run_options_.t_end = t_end;
  if (tolerance > 0) run_options_.rtol = tolerance;
  make_run();
}

void FmuModel::make_run() {
  run_.reset();  // it refers to the system
  run_system_ = problem_.make_ode();
  run_system_->set_parameters(rho_.data());
  run_ = std::make_unique<CvodeRun>(*run_system_, run_options_, Monitor(), StartDerivative::none);
}

void FmuModel::advance(double t) {
  const double end = run_options_.t_end;
  if (t > end + 1e-9 * std::abs(end - t_start_))
    throw Error(
        fmt::format("The run ends at {:g} s, found a step to {:g} s; give fmi3EnterInitializationMode a later "
                    "stop time.",
                    end, t));
  try {
    run_->advance(std::min(t, end));
  } catch (const StiffError&) {
    run_options_.cvodes_method = "bdf";
    make_run();
    run_->advance(std::min(t, end));
  }
  std::copy(run_->y(), run_->y() + y_.size(), y_.begin());
  t_ = t;
}

}  // namespace costate::app
