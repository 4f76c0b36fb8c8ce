// The functions of FMI 3.0 on a scene: model exchange and co-simulation, with directional and adjoint derivatives. The
// scene is scene.toml among the resources of the FMU.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/fmu/fmu_model.h"
#include "fmi3.h"

using namespace costate;
using costate::app::FmuModel;
using costate::app::FmuVariable;

namespace {

enum class Phase { instantiated, initialization, event, continuous, step, terminated };

class Instance {
 public:
  Instance(const std::string& scene, bool co_simulation, fmi3InstanceEnvironment environment,
           fmi3LogMessageCallback log, bool logging)
      : co_simulation_(co_simulation), logging_(logging), environment_(environment), log_(log) {
    model = std::make_unique<FmuModel>(Scene::load(scene));
    if (!co_simulation && !model->no_model_exchange().empty())
      throw Error("The scene cannot be exchanged as a model: " + model->no_model_exchange() + ". Use co-simulation.");
  }

  void say(fmi3Status status, const char* category, const std::string& text) const {
    if (log_ && (logging_ || status >= fmi3Error)) log_(environment_, status, category, text.c_str());
  }
  /// What computations have had to say.
  void say_notices() const {
    for (const std::string& sentence : take_notices()) say(fmi3Warning, "logStatusWarning", sentence);
  }
  bool at_start() const { return phase == Phase::initialization; }
  bool co_simulation() const { return co_simulation_; }
  void set_logging(bool on) { logging_ = on; }

  /// In initialization mode the state follows from the parameters; found where it is first asked for. Before it there
  /// is none.
  void settle() {
    if (phase == Phase::instantiated)
      throw Error("What follows from the parameters is known from fmi3EnterInitializationMode on, not before.");
    if (phase == Phase::initialization && !started) {
      model->start(start_time);
      started = true;
    }
  }

  std::unique_ptr<FmuModel> model;
  Phase phase = Phase::instantiated;
  double start_time = 0, stop_time = std::numeric_limits<double>::quiet_NaN(), tolerance = 0;
  bool started = false;

 private:
  bool co_simulation_, logging_;
  fmi3InstanceEnvironment environment_;
  fmi3LogMessageCallback log_;
};

/// Runs f on the instance; an exception is told and becomes a status.
fmi3Status guarded(fmi3Instance instance, const std::function<void(Instance&)>& f, fmi3Status failed = fmi3Error) {
  if (!instance) return fmi3Error;
  auto& self = *static_cast<Instance*>(instance);
  try {
    f(self);
    self.say_notices();
    return fmi3OK;
  } catch (const std::exception& e) {
    self.say_notices();
    self.say(failed, failed == fmi3Discard ? "logStatusDiscard" : "logStatusError", e.what());
  } catch (...) {
    self.say(failed, "logStatusError", "An unknown error.");
  }
  return failed;
}

std::vector<std::size_t> places(const Instance& self, const fmi3ValueReference* references, std::size_t count) {
  std::vector<std::size_t> r;
  for (std::size_t i = 0; i < count; ++i) {
    if (references[i] >= self.model->variables().size())
      throw Error("There is no variable with value reference " + std::to_string(references[i]) + "; there are " +
                  std::to_string(self.model->variables().size()) + " variables, counted from 0.");
    r.push_back(references[i]);
  }
  return r;
}

void require_count(std::size_t found, std::size_t expected, const char* what) {
  if (found != expected)
    throw Error(std::string(what) + ": " + std::to_string(expected) + " numbers were expected, found " +
                std::to_string(found) + ".");
}

void require_phase(bool right, const char* function) {
  if (!right) throw Error(std::string(function) + " was called in a state of the FMU that does not allow it.");
}

fmi3Instance instantiate(fmi3String token, fmi3String resources, bool co_simulation, bool logging,
                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log) {
  try {
    if (!resources || !token) throw Error("fmi3Instantiate needs a token and the path of the resources.");
    std::string folder = resources;
    if (folder.rfind("file://", 0) == 0) folder = folder.substr(7);
    const auto scene = std::filesystem::path(folder) / "scene.toml";
    const std::string expected = app::fmu_token(scene);
    if (token != expected)
      throw Error("The instantiation token '" + std::string(token) + "' is not that of the scene in this FMU, '" +
                  expected + "': its parts do not belong together.");
    return new Instance(scene.string(), co_simulation, environment, log, logging);
  } catch (const std::exception& e) {
    if (log) log(environment, fmi3Error, "logStatusError", e.what());
    return nullptr;
  }
}

void products(Instance& self, bool adjoint, const fmi3ValueReference* unknowns, std::size_t unknown_count,
              const fmi3ValueReference* knowns, std::size_t known_count, const double* seed, std::size_t seed_count,
              double* sensitivity, std::size_t sensitivity_count) {
  self.settle();
  const auto u = places(self, unknowns, unknown_count), k = places(self, knowns, known_count);
  require_count(seed_count, adjoint ? unknown_count : known_count, "seed");
  require_count(sensitivity_count, adjoint ? known_count : unknown_count, "sensitivity");
  const auto r =
      adjoint ? self.model->adjoint(u, k, seed, self.at_start()) : self.model->directional(u, k, seed, self.at_start());
  std::copy(r.begin(), r.end(), sensitivity);
}

}  // namespace

COSTATE_FMI const char* fmi3GetVersion() { return "3.0"; }

COSTATE_FMI fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean on, std::size_t, const fmi3String*) {
  return guarded(instance, [&](Instance& self) { self.set_logging(on); });
}

COSTATE_FMI fmi3Instance fmi3InstantiateModelExchange(fmi3String, fmi3String token, fmi3String resources, fmi3Boolean,
                                                      fmi3Boolean logging, fmi3InstanceEnvironment environment,
                                                      fmi3LogMessageCallback log) {
  return instantiate(token, resources, false, logging, environment, log);
}

COSTATE_FMI fmi3Instance fmi3InstantiateCoSimulation(fmi3String, fmi3String token, fmi3String resources, fmi3Boolean,
                                                     fmi3Boolean logging, fmi3Boolean, fmi3Boolean,
                                                     const fmi3ValueReference*, std::size_t,
                                                     fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                                     fmi3IntermediateUpdateCallback) {
  return instantiate(token, resources, true, logging, environment, log);
}

COSTATE_FMI void fmi3FreeInstance(fmi3Instance instance) { delete static_cast<Instance*>(instance); }

COSTATE_FMI fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean tolerance_defined,
                                                   fmi3Float64 tolerance, fmi3Float64 start_time,
                                                   fmi3Boolean stop_time_defined, fmi3Float64 stop_time) {
  return guarded(instance, [&](Instance& self) {
    require_phase(self.phase == Phase::instantiated, "fmi3EnterInitializationMode");
    self.start_time = start_time;
    self.stop_time = stop_time_defined ? stop_time : std::max(start_time, self.model->solver().t_end);
    self.tolerance = tolerance_defined ? tolerance : 0;
    self.phase = Phase::initialization;
    self.started = false;
  });
}

COSTATE_FMI fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
  return guarded(instance, [&](Instance& self) {
    require_phase(self.phase == Phase::initialization, "fmi3ExitInitializationMode");
    self.settle();
    if (self.co_simulation()) self.model->begin_run(self.stop_time, self.tolerance);
    self.phase = self.co_simulation() ? Phase::step : Phase::event;
  });
}

COSTATE_FMI fmi3Status fmi3EnterEventMode(fmi3Instance instance) {
  return guarded(instance, [&](Instance& self) {
    require_phase(self.phase == Phase::continuous, "fmi3EnterEventMode");
    self.phase = Phase::event;
  });
}

COSTATE_FMI fmi3Status fmi3Terminate(fmi3Instance instance) {
  return guarded(instance, [&](Instance& self) { self.phase = Phase::terminated; });
}

COSTATE_FMI fmi3Status fmi3Reset(fmi3Instance instance) {
  return guarded(instance, [&](Instance& self) {
    self.model->reset();
    self.phase = Phase::instantiated;
    self.started = false;
  });
}

COSTATE_FMI fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference* references, std::size_t count,
                                      fmi3Float64* values, std::size_t value_count) {
  return guarded(instance, [&](Instance& self) {
    require_count(value_count, count, "fmi3GetFloat64");
    const auto at = places(self, references, count);
    for (const std::size_t i : at)
      if (self.model->variables()[i].kind != FmuVariable::Kind::parameter) self.settle();
    for (std::size_t i = 0; i < count; ++i) values[i] = self.model->value(at[i]);
  });
}

COSTATE_FMI fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference* references, std::size_t count,
                                      const fmi3Float64* values, std::size_t value_count) {
  return guarded(instance, [&](Instance& self) {
    require_count(value_count, count, "fmi3SetFloat64");
    const auto at = places(self, references, count);
    for (std::size_t i = 0; i < count; ++i) {
      const FmuVariable& v = self.model->variables()[at[i]];
      const bool before = self.phase == Phase::instantiated || self.phase == Phase::initialization;
      const bool parameter = v.kind == FmuVariable::Kind::parameter && before;
      const bool state = v.kind == FmuVariable::Kind::state && !self.co_simulation() &&
                         (self.phase == Phase::continuous || self.phase == Phase::event);
      if (!parameter && !state)
        throw Error("'" + v.name + "' cannot be set now: parameters can before the end of the initialization, " +
                    "states of a model in exchange behind it.");
      if (parameter) {
        self.model->set_parameter(v.index, values[i]);
        self.started = false;
      } else {
        self.model->state()[v.index] = values[i];
      }
    }
  });
}

COSTATE_FMI fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference* unknowns,
                                                    std::size_t unknown_count, const fmi3ValueReference* knowns,
                                                    std::size_t known_count, const fmi3Float64* seed,
                                                    std::size_t seed_count, fmi3Float64* sensitivity,
                                                    std::size_t sensitivity_count) {
  return guarded(instance, [&](Instance& self) {
    products(self, false, unknowns, unknown_count, knowns, known_count, seed, seed_count, sensitivity,
             sensitivity_count);
  });
}

COSTATE_FMI fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference* unknowns,
                                                std::size_t unknown_count, const fmi3ValueReference* knowns,
                                                std::size_t known_count, const fmi3Float64* seed,
                                                std::size_t seed_count, fmi3Float64* sensitivity,
                                                std::size_t sensitivity_count) {
  return guarded(instance, [&](Instance& self) {
    products(self, true, unknowns, unknown_count, knowns, known_count, seed, seed_count, sensitivity,
             sensitivity_count);
  });
}

COSTATE_FMI fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean* again, fmi3Boolean* terminate,
                                                fmi3Boolean* nominals_changed, fmi3Boolean* states_changed,
                                                fmi3Boolean* event_time_defined, fmi3Float64* event_time) {
  return guarded(instance, [&](Instance& self) {
    require_phase(self.phase == Phase::event, "fmi3UpdateDiscreteStates");
    FmuModel& m = *self.model;
    *again = *terminate = *nominals_changed = *states_changed = *event_time_defined = false;
    if (m.time() >= m.next_jump()) {
      m.jump();
      *states_changed = true;
    }
    if (const double next = m.next_jump(); std::isfinite(next)) {
      *event_time_defined = true;
      *event_time = next;
    }
  });
}

// Model exchange.

COSTATE_FMI fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance) {
  return guarded(instance, [&](Instance& self) {
    require_phase(self.phase == Phase::event && !self.co_simulation(), "fmi3EnterContinuousTimeMode");
    self.phase = Phase::continuous;
  });
}

COSTATE_FMI fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean, fmi3Boolean* enter_event_mode,
                                                   fmi3Boolean* terminate) {
  return guarded(instance, [&](Instance&) { *enter_event_mode = *terminate = false; });
}

COSTATE_FMI fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time) {
  return guarded(instance, [&](Instance& self) {
    require_phase(self.phase == Phase::continuous || self.phase == Phase::event, "fmi3SetTime");
    self.model->set_time(time);
  });
}

COSTATE_FMI fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64* states, std::size_t count) {
  return guarded(instance, [&](Instance& self) {
    require_phase(self.phase == Phase::continuous || self.phase == Phase::event, "fmi3SetContinuousStates");
    require_count(count, self.model->size(), "fmi3SetContinuousStates");
    std::copy(states, states + count, self.model->state().begin());
  });
}

COSTATE_FMI fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64* states, std::size_t count) {
  return guarded(instance, [&](Instance& self) {
    self.settle();
    require_count(count, self.model->size(), "fmi3GetContinuousStates");
    std::copy(self.model->state().begin(), self.model->state().end(), states);
  });
}

COSTATE_FMI fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64* derivatives,
                                                         std::size_t count) {
  return guarded(
      instance,
      [&](Instance& self) {
        self.settle();
        require_count(count, self.model->size(), "fmi3GetContinuousStateDerivatives");
        self.model->derivatives(derivatives);
        for (std::size_t i = 0; i < count; ++i)
          if (!std::isfinite(derivatives[i])) throw Error("The equations have no finite value there.");
      },
      fmi3Discard);  // an integrator may take a smaller step
}

COSTATE_FMI fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64* nominals,
                                                         std::size_t count) {
  return guarded(instance, [&](Instance&) { std::fill(nominals, nominals + count, 1.0); });
}

COSTATE_FMI fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, std::size_t* count) {
  return guarded(instance, [&](Instance& self) { *count = self.model->size(); });
}

COSTATE_FMI fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64*, std::size_t count) {
  return guarded(instance, [&](Instance&) { require_count(count, 0, "fmi3GetEventIndicators"); });
}

COSTATE_FMI fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, std::size_t* count) {
  return guarded(instance, [&](Instance&) { *count = 0; });
}

// Co-simulation.

COSTATE_FMI fmi3Status fmi3EnterStepMode(fmi3Instance instance) {
  return guarded(instance, [&](Instance& self) { require_phase(self.phase == Phase::step, "fmi3EnterStepMode"); });
}

COSTATE_FMI fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 point, fmi3Float64 step, fmi3Boolean,
                                  fmi3Boolean* event_handling, fmi3Boolean* terminate, fmi3Boolean* early_return,
                                  fmi3Float64* reached) {
  return guarded(instance, [&](Instance& self) {
    require_phase(self.phase == Phase::step, "fmi3DoStep");
    *event_handling = *terminate = *early_return = false;
    *reached = self.model->time();
    if (!(step > 0)) throw Error("fmi3DoStep: the step must be positive, found " + std::to_string(step) + ".");
    const double here = self.model->time();
    if (!(std::abs(point - here) <= 1e-9 * (std::abs(here) + step)))
      throw Error("fmi3DoStep: the FMU is at " + std::to_string(here) + " s, found a step from " +
                  std::to_string(point) + " s.");
    self.model->advance(point + step);
    *reached = self.model->time();
  });
}
