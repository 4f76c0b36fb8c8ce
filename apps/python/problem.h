// The problem that Python holds: a scene with the choices of a run, what the tool makes of a file and its options.
#pragma once

#include <pybind11/stl.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/base/unsaid.h"
#include "costate/command.h"
#include "signals.h"

namespace costate::python {

namespace py = pybind11;
using app::CommonOptions;
using app::Setup;
using Numbers = std::vector<double>;

class PyProblem {
 public:
  PyProblem(const Scene& scene, const py::dict& choices) : setup_(make(scene, choices)) {
    setup_->problem.monitor = signal_monitor();
  }

  const ParameterSelection& parameters() const { return setup_->problem.parameters; }
  const Setup& setup() const { return *setup_; }

  /// The parameters' values, or as many as there are in their order.
  Numbers values(const std::optional<Numbers>& rho) const {
    if (!rho) return setup_->rho;
    setup_->problem.check_values(*rho);
    require_scene_at(*rho);
    return *rho;
  }
  /// That the scene may have these numbers: no mass below zero. Within the box of those that it may it is not read
  /// again.
  void require_scene_at(const Numbers& rho) const {
    if (low_.empty()) low_ = high_ = setup_->rho;
    bool within = true;
    for (std::size_t j = 0; j < rho.size(); ++j) within = within && low_[j] <= rho[j] && rho[j] <= high_[j];
    if (within) return;
    run_unlocked([&] {
      const Unsaid reading;
      setup_->scene.with_parameters(setup_->problem.parameters, rho);
    });
    for (std::size_t j = 0; j < rho.size(); ++j) {
      low_[j] = std::min(low_[j], rho[j]);
      high_[j] = std::max(high_[j], rho[j]);
    }
  }
  std::string method(const std::string& other) const { return other.empty() ? setup_->method : other; }

  /// Runs f on this problem, without Python's lock; errors of the mechanism are told at their place in the scene.
  void run(const std::function<void(Problem&)>& f) const {
    run_unlocked([&] {
      take_notices();
      setup_->located([&] {
        Problem problem = setup_->problem;
        f(problem);
      });
    });
  }

 private:
  static std::unique_ptr<Setup> make(const Scene& scene, const py::dict& choices) {
    CommonOptions o;
    o.ready = std::make_shared<const Scene>(scene);
    o.scene = scene.file_name();
    o.no_files = o.quiet = true;
    for (const auto& [key, value] : choices) {
      const auto name = key.cast<std::string>();
      if (value.is_none()) continue;
      if (name == "parameters") {
        o.parameters = value.cast<std::vector<std::string>>();
        if (o.parameters.empty()) throw Error("'parameters' is empty: leave it out for those of the scene.");
      } else if (name == "formulation")
        o.formulation = value.cast<std::string>();
      else if (name == "method")
        o.method = value.cast<std::string>();
      else if (name == "integrator")
        o.integrator = value.cast<std::string>();
      else if (name == "rtol")
        o.rtol = value.cast<double>();
      else if (name == "atol")
        o.atol = value.cast<double>();
      else if (name == "t_end")
        o.t_end = value.cast<double>();
      else if (name == "step")
        o.step = value.cast<double>();
      else
        throw py::type_error("Problem has no option '" + name + "'.");
    }
    std::unique_ptr<Setup> setup;
    run_unlocked([&] { setup = std::make_unique<Setup>(o, app::Purpose::differentiate); });
    return setup;
  }
  std::unique_ptr<Setup> setup_;
  mutable Numbers low_, high_;
};

}  // namespace costate::python
