// The Python module costate._costate: scenes, problems and what the tool's commands say, with numpy arrays. The package
// around it (costate/__init__.py) has the words that users write; its types are in costate/__init__.pyi.
#include <fmt/format.h>
#include <pybind11/eigen.h>
#include <pybind11/functional.h>
#include <pybind11/stl.h>

#include <cmath>
#include <csignal>
#include <filesystem>

#include "costate/base/notice.h"
#include "costate/base/version.h"
#include "costate/command.h"
#include "costate/design_setup.h"
#include "costate/digits.h"
#include "costate/integrator/simulate.h"
#include "costate/objective/all_outputs.h"
#include "costate/optimize/optimizer.h"
#include "costate/problem/redundant_rows.h"
#include "costate/scene/scene_files.h"
#include "costate/sensitivity/difference_hessian.h"
#include "costate/sensitivity/error_estimate.h"
#include "costate/sensitivity/hessian.h"
#include "costate/tradeoff/motion_confirmation.h"
#include "costate/trajectory.h"
#include "problem.h"
#include "signals.h"

namespace costate::python {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

namespace {

py::array_t<double> array(const Numbers& x) {
  return py::array_t<double>(static_cast<py::ssize_t>(x.size()), x.data());
}

py::dict counters_of(const Counters& c) {
  py::dict d;
  for (const auto& [name, value] : counter_list(c)) d[py::str(name)] = value;
  return d;
}

py::list events_of(const Simulation& r) {
  py::list events;
  for (const RunEvent& e : r.events) events.append(py::make_tuple(e.t, e.name));
  return events;
}

void require_times(const Numbers& times, double begin, double end) {
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (!(begin <= times[i] && times[i] <= end))
      throw CapabilityError(
          fmt::format("times[{}] is {:.9g} s; the run is from {:.9g} to {:.9g} s ('t_end_s' in [run], "
                      "or t_end).",
                      i, times[i], begin, end));
    if (i > 0 && !(times[i - 1] < times[i]))
      throw CapabilityError(
          fmt::format("times[{}] is {:.9g} s, not later than the one before it, {:.9g} s: give them in "
                      "increasing order.",
                      i, times[i], times[i - 1]));
  }
}

/// What is known of psi's error, where that is more than the digits that rtol cannot hold; else None.
py::object error_of_psi(double rtol, double psi, const std::optional<KnownError>& known) {
  if (!known || !(known->psi > app::uncertainty_of(psi, rtol))) return py::none();
  return py::float_(known->psi);
}

py::dict simulate_problem(const PyProblem& p, const std::optional<Numbers>& rho, const std::optional<Numbers>& times,
                          const std::optional<std::vector<std::string>>& names, bool confirm) {
  const Numbers values = p.values(rho);
  Numbers at, t;
  std::vector<double> data;
  std::vector<std::unique_ptr<Output>> outputs;
  Simulation r;
  double rtol = 0;
  p.run([&](Problem& problem) {
    rtol = problem.solver.rtol;
    at = times ? *times : app::TrajectoryRecorder(p.setup(), values, {}).times();
    require_times(at, problem.solver.t_start, problem.solver.t_end);
    const Mechanism& m = *problem.mechanism;
    if (names)
      for (const auto& name : *names) outputs.push_back(make_output(m, name));
    else
      outputs = make_all_outputs(m);
    OpenReactions open(problem, values, outputs, false);
    const auto keep = [&](const MechanismState& s, System& system) {
      // The end of a run that ends by an event is in 'end'.
      const auto asked = [&](double x) { return std::abs(x - s.t) <= 1e-9 * std::max(1.0, std::abs(x)); };
      if (times && std::none_of(at.begin(), at.end(), asked)) return;
      t.push_back(s.t);
      open.look(s);
      for (const auto& o : outputs) data.push_back(o->value(s, system.assembly()));
    };
    problem.solver.confirm = confirm;
    r = confirmed_simulation(problem, values, {at, keep},
                             names ? *names : all_that_is_told(problem, values, p.setup().scene.run.outputs));
    open.tell();
  });
  if (times && r.end && !at.empty() && at.back() > r.end->t)
    notice(fmt::format("The run ends at t = {:.9g} s ({}): there is nothing at the times behind it.", r.end->t,
                       r.end->name));
  const auto rows = static_cast<py::ssize_t>(t.size()), columns = static_cast<py::ssize_t>(outputs.size());
  py::dict d, units;
  py::list words;
  for (const auto& o : outputs) {
    words.append(o->name());
    units[py::str(o->name())] = o->unit();
  }
  d["psi"] = r.psi;
  d["psi_error"] = error_of_psi(rtol, r.psi, r.known_error);
  d["t"] = array(t);
  d["names"] = words;
  d["units"] = units;
  d["data"] = py::array_t<double>({rows, columns}, data.data());
  d["counters"] = counters_of(r.counters);
  d["events"] = events_of(r);
  d["end"] = r.end ? py::object(py::make_tuple(r.end->t, r.end->name)) : py::none();
  d["warnings"] = take_notices();
  return d;
}

py::dict gradient_of(const PyProblem& p, const std::optional<Numbers>& rho, const std::string& method, bool estimate) {
  const Numbers values = p.values(rho);
  GradientResult r;
  double rtol = 0;
  p.run([&](Problem& problem) {
    rtol = problem.solver.rtol;
    r = gradient(problem, p.method(method), values);
    if (estimate) r.gradient_error = estimate_gradient_error(problem, p.method(method), values, r);
  });
  py::dict d;
  d["psi"] = r.psi;
  d["psi_error"] = error_of_psi(rtol, r.psi, r.known_error);
  d["gradient"] = array(r.gradient);
  d["error"] = r.gradient_error.empty() ? py::object(py::none()) : py::object(array(r.gradient_error));
  d["counters"] = counters_of(r.counters);
  d["events"] = events_of(r);
  d["warnings"] = take_notices();
  return d;
}

Eigen::MatrixXd hessian_times(const PyProblem& p, const Eigen::MatrixXd& directions,
                              const std::optional<Numbers>& rho) {
  if (directions.rows() != p.parameters().size())
    throw Error(fmt::format("Directions have a row for each of the {} parameters, found {}.", p.parameters().size(),
                            directions.rows()));
  const Numbers values = p.values(rho);
  HessianProducts h;
  p.run([&](Problem& problem) { h = products_of(problem, values, directions); });
  return h.products;
}

/// Of its largest entry: from here on what a Hessian is off by is said, as in certificates.
constexpr double kHessianSaid = 1e-3;

py::dict hessian_of(const PyProblem& p, const std::optional<Numbers>& rho) {
  const Numbers values = p.values(rho);
  Hessian h;
  p.run([&](Problem& problem) {
    try {
      h = confirmed_hessian(problem, values);
      if (h.error > kHessianSaid)
        notice(std::isfinite(h.error)
                   ? fmt::format("The Hessian is known to some {:.0e} of its largest entry, by what a tenth of rtol "
                                 "changes of a product with it. A smaller rtol tells more.",
                                 h.error)
                   : "What the Hessian is known to was not found: the run at a tenth of rtol failed.");
    } catch (const CapabilityError& e) {
      const std::string method = p.method("");
      h = hessian_by_differences(problem, method, values);
      notice(
          fmt::format("The Hessian is made of differences of gradients by {}, and known to some {:.0e} of its largest "
                      "entry: {}",
                      method, h.error, e.what()));
    }
  });
  py::dict d;
  d["matrix"] = h.matrix;
  d["warnings"] = take_notices();
  return d;
}

py::dict evaluation_of(const OptimizerEvaluation& e) {
  py::dict d;
  d["index"] = e.index;
  d["parameters"] = array(e.rho);
  d["psi"] = e.psi;
  d["gradient"] = array(e.gradient);
  d["constraints"] = array(e.constraints);
  d["projected_gradient"] = e.projected_gradient;
  d["failure"] = e.failed() ? py::object(py::str(e.failure)) : py::none();
  return d;
}

py::dict optimize_problem(const PyProblem& p, const std::optional<py::function>& callback, const py::dict& settings) {
  const Setup& setup = p.setup();
  OptimizerOptions options(setup.scene.optimize);
  for (const auto& [key, value] : settings) {
    const auto name = key.cast<std::string>();
    if (name == "algorithm") {
      options.algorithm = value.cast<std::string>();
      options.algorithm_chosen = true;
    } else if (name == "max_evaluations")
      options.max_evaluations = value.cast<int>();
    else if (name == "stop_value")
      options.stop_value = value.cast<double>();
    else if (name == "relative_tolerance")
      options.relative_tolerance = value.cast<double>();
    else if (name == "gradient_tolerance")
      options.gradient_tolerance = value.cast<double>();
    else
      throw py::type_error("optimize() has no option '" + name + "'.");
  }
  std::vector<OptimizerConstraint> constraints;
  for (const auto& c : setup.scene.constraints()) constraints.push_back({c.name, c.objective, c.upper});
  if (!constraints.empty() && !options.algorithm_chosen) options.algorithm = kConstrainedAlgorithm;
  OptimizerResult r;
  bool stopped = false;
  p.run([&](Problem& problem) {
    require_algorithm(options.algorithm, !constraints.empty());
    if (options.max_evaluations < 1) throw Error("max_evaluations is a positive number.");
    const auto record = [&](const OptimizerEvaluation& e) {
      if (!callback) return;
      with_lock([&] {
        try {
          (*callback)(evaluation_of(e));
        } catch (py::error_already_set& error) {
          stopped = error.matches(PyExc_StopIteration);
          if (!stopped) throw;
        }
      });
      if (stopped) throw Interrupted(SIGINT);
    };
    Design design = single_design(problem, p.method(""), constraints);
    design.cases.front().admit = [&](const Numbers& rho) { app::require_scene(setup, rho); };
    r = optimize(design, options, {}, record);
  });
  if (r.error && !stopped) std::rethrow_exception(r.error);
  const OptimizerEvaluation& best = r.evaluations.at(r.best);
  py::dict d;
  d["parameters"] = array(best.rho);
  d["psi"] = best.psi;
  d["gradient"] = array(best.gradient);
  d["stop_reason"] = stopped ? std::string("the callback: it raised StopIteration") : r.stop_reason;
  d["converged"] = r.converged;
  py::list evaluations;
  for (const auto& e : r.evaluations) evaluations.append(evaluation_of(e));
  d["evaluations"] = evaluations;
  d["warnings"] = take_notices();
  return d;
}

/// A command of the tool on a scene; its summary as JSON text.
std::string run_command(const Scene* scene, const std::vector<std::string>& words) {
  std::optional<app::Json> summary;
  run_unlocked([&] {
    take_notices();
    app::CommandLine line;
    try {
      line.parse(words);
    } catch (const app::UsageError& e) {
      throw Error(e.what());
    }
    if (!line.action()) throw Error("A command is expected that runs, not its help.");
    if (scene) line.common().ready = std::make_shared<const Scene>(*scene);
    line.common().quiet = true;
    line.common().hand_over = [&](const app::Json& j) { summary = j; };
    line.action()();
  });
  return summary ? app::json_text(*summary) : "null";
}

std::vector<std::string> options_of(const std::string& command) { return app::CommandLine().option_names(command); }

void define_errors(py::module_& m) {
  static py::exception<Error> error(m, "Error", PyExc_RuntimeError);
  static py::exception<SceneError> scene_error(m, "SceneError", error.ptr());
  static py::exception<ModelError> model_error(m, "ModelError", error.ptr());
  static py::exception<SolverError> solver_error(m, "SolverError", error.ptr());
  static py::exception<CapabilityError> capability_error(m, "CapabilityError", error.ptr());
  py::register_exception_translator([](std::exception_ptr p) {
    try {
      if (p) std::rethrow_exception(p);
    } catch (const SceneError& e) {
      py::object x = py::reinterpret_borrow<py::object>(scene_error)(e.what());
      x.attr("file") = e.where().file;
      x.attr("line") = e.where().line;
      x.attr("column") = e.where().column;
      PyErr_SetObject(scene_error.ptr(), x.ptr());
    } catch (const ModelError& e) {
      model_error(e.what());
    } catch (const SolverError& e) {
      solver_error(e.what());
    } catch (const CapabilityError& e) {
      capability_error(e.what());
    } catch (const Error& e) {
      error(e.what());
    } catch (const Interrupted& e) {
      PyErr_SetString(PyExc_KeyboardInterrupt, e.what());
    }
  });
}

/// A scene outlives the working directory that it was read in: the file from which those that it names count is
/// absolute.
std::string absolute(const std::string& path) { return std::filesystem::absolute(path).lexically_normal().string(); }

Scene parsed(const std::string& text, const std::string& name, const std::vector<std::string>& overrides) {
  const SceneFileLog files(name);
  Scene scene = Scene::parse(text, name, overrides);
  return files.files().empty() ? scene : Scene::parse(text, absolute(name), overrides);
}

/// The scene's text for a file in `directory`, or, where that is empty, anywhere.
std::string text_for(const Scene& scene, const std::string& directory) {
  const Unsaid reading;
  const SceneFileLog files(scene.file_name());
  Scene::parse(scene.dump(), scene.file_name());
  return scene_text_for(scene, files.files(), directory);
}

}  // namespace

PYBIND11_MODULE(_costate, m) {
  m.attr("__version__") = std::string(version);
  define_errors(m);
  py::class_<Scene>(m, "Scene")
      .def_static("load",
                  [](const std::string& path, const std::vector<std::string>& overrides) {
                    std::optional<Scene> scene;
                    run_unlocked([&] { scene = Scene::load(absolute(path), overrides); });
                    return *scene;
                  })
      .def_static("parse",
                  [](const std::string& text, const std::string& name, const std::vector<std::string>& overrides) {
                    std::optional<Scene> scene;
                    run_unlocked([&] { scene = parsed(text, name, overrides); });
                    return *scene;
                  })
      .def_readonly("title", &Scene::title)
      .def_property_readonly("file_name", &Scene::file_name)
      .def(
          "dump",
          [](const Scene& scene, const std::string& directory) {
            std::string text;
            run_unlocked([&] { text = text_for(scene, directory); });
            return text;
          },
          py::arg("directory") = "")
      .def("with_overrides", &Scene::with_overrides)
      .def_property_readonly("coordinates", [](const Scene& s) { return s.mechanism()->coordinate_names(); })
      .def_property_readonly("outputs", [](const Scene& s) { return output_names(*s.mechanism()); })
      .def_property_readonly("numbers",
                             [](const Scene& s) {
                               py::dict d;
                               const auto values = s.mechanism()->base_numbers();
                               for (std::size_t i = 0; i < values.size(); ++i)
                                 d[py::str(s.mechanism()->numbers()[i].path)] = values[i];
                               return d;
                             })
      .def(py::pickle(
          [](const Scene& s) { return py::make_tuple(text_for(s, ""), s.file_name()); },
          [](const py::tuple& t) { return Scene::parse(t[0].cast<std::string>(), t[1].cast<std::string>()); }));
  const auto each = [](auto member) {
    return [member](const PyProblem& p) {
      Numbers x;
      for (const Parameter& one : p.parameters().parameters) x.push_back(one.*member);
      return array(x);
    };
  };
  py::class_<PyProblem>(m, "Problem")
      .def(py::init<const Scene&, const py::dict&>())
      .def_property_readonly("scene", [](const PyProblem& p) { return p.setup().scene; })
      .def_property_readonly("parameters", [](const PyProblem& p) { return p.parameters().names(); })
      .def_property_readonly("values", each(&Parameter::value))
      .def_property_readonly("lower", each(&Parameter::lower))
      .def_property_readonly("upper", each(&Parameter::upper))
      .def_property_readonly("scale", each(&Parameter::scale))
      .def_property_readonly("formulation", [](const PyProblem& p) { return p.setup().problem.formulation; })
      .def_property_readonly("method", [](const PyProblem& p) { return p.setup().method; })
      .def_property_readonly("t_start", [](const PyProblem& p) { return p.setup().problem.solver.t_start; })
      .def_property_readonly("t_end", [](const PyProblem& p) { return p.setup().problem.solver.t_end; })
      .def("simulate", &simulate_problem)
      .def("gradient", &gradient_of)
      .def("hessian_product", &hessian_times)
      .def("hessian", &hessian_of)
      .def("optimize", &optimize_problem)
      .def("scene_at", [](const PyProblem& p, const Numbers& rho) {
        return p.setup().scene.with_parameters(p.parameters(), p.values(rho));
      });
  m.def("run_command", &run_command);
  m.def("options_of", &options_of);
}

}  // namespace costate::python
