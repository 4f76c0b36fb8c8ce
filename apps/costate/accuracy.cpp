#include "accuracy.h"

#include <fmt/format.h>

#include <algorithm>

#include "costate/base/notice.h"
#include "costate/problem/redundant_rows.h"
#include "costate/scene/scene_settings.h"
#include "start_notice.h"

namespace costate::app {

void AccuracyOption::add_to(Command& c) {
  c.option("--accuracy", value,
           "Relative accuracy of the result: formulation, method and tolerance are chosen to meet it");
}

std::optional<double> AccuracyOption::asked(const Setup& setup, const CommonOptions& common) const {
  const char* tolerance = common.rtol ? "--rtol" : common.atol ? "--atol" : common.step ? "--step" : nullptr;
  if (value && tolerance)
    throw Error(fmt::format("--accuracy chooses the tolerance itself; {} and it exclude each other.", tolerance));
  if (value && !(*value > 0 && *value < 1))
    throw Error(fmt::format("--accuracy must lie between 0 and 1 (1e-4: four digits), found {}.", *value));
  if (value) return value;
  const auto& of_scene = setup.scene.run.accuracy;
  return tolerance ? std::nullopt : of_scene;
}

void notice_accuracy_left(const Setup& setup, const std::string& why) {
  if (const auto& accuracy = setup.scene.run.accuracy)
    notice(fmt::format("The accuracy {:.1g} of [run] is not sought: {}. This runs at rtol {:.1g}.", *accuracy, why,
                       setup.problem.solver.rtol));
}

AccurateRun run_accurately(Setup& setup, const CommonOptions& common, double accuracy, bool gradient,
                           const StoredOutputs& stored, const BeginRecording& begin) {
  AccuracyRequest request;
  request.accuracy = accuracy;
  request.gradient = gradient;
  // The command line's choices stay; the scene's are among those that are tried.
  const RunSettings& run = setup.scene.run;
  if (!common.formulation.empty()) request.formulation = setup.problem.formulation;
  if (!common.integrator.empty()) request.integrator = setup.problem.solver.integrator;
  if (gradient && !common.method.empty()) request.method = setup.method;
  request.outputs = !stored.named.empty() ? stored.named
                    : run.outputs.empty() ? setup.problem.mechanism->coordinate_names()
                                          : run.outputs;
  std::erase(request.outputs, "time");
  if (stored.all) {
    request.besides = determined_outputs(setup.problem, setup.rho);
    std::erase_if(request.besides, [&](const std::string& name) {
      return name == "time" || std::find(request.outputs.begin(), request.outputs.end(), name) != request.outputs.end();
    });
  }
  AccurateRun r = started(setup, [&] {
    return run_to_accuracy(setup.problem, setup.rho, request, [&](const Problem& chosen) {
      setup.problem = chosen;
      return begin ? begin(chosen) : TradeProbe::Recording();
    });
  });
  setup.problem = r.problem;
  if (gradient) setup.method = r.what.method;
  if (!r.met)
    notice(fmt::format(
        "The accuracy {:.1g} was not reached: at rtol {:.1e} the error of {} is estimated as {:.1e}. Where errors grow "
        "along a motion, or forces jump, no tolerance may reach it; a shorter run (--t-end) shows from when on.",
        accuracy, r.problem.solver.rtol, r.worst, r.relative));
  if (!r.times_error)
    notice(fmt::format(
        "The run at rtol {:.1e} has another number of events than the result's {}: when they happen is not known.",
        r.looser, r.result.events.size()));
  if (r.besides_error > accuracy)
    notice(fmt::format(
        "The accuracy is that of {}; of what is stored besides '{}' is off by {:.1e} of its range. Name what has to be "
        "as accurate (--outputs, or 'outputs' of [run]).",
        run.outputs.empty() ? "psi and the coordinates" : "psi and the outputs of [run]", r.worst_besides,
        r.besides_error));
  return r;
}

Json pilots_json(const std::vector<AccuracyPilot>& pilots) {
  Json list = Json::array();
  for (const AccuracyPilot& p : pilots)
    list.push_back({{"formulation", p.what.formulation},
                    {"integrator", p.what.integrator},
                    {"rtol", p.rtol},
                    {"psi", p.why.empty() ? Json(p.psi) : Json()},
                    {"processor_s", p.why.empty() ? Json(p.time_s) : Json()},
                    {"status", p.why.empty() ? "ok" : p.why}});
  return list;
}

Json accuracy_json(const AccurateRun& run, double accuracy) {
  return {{"asked", accuracy},
          {"met", run.met},
          {"estimated", run.relative},
          {"worst", run.worst},
          {"outputs_error", run.outputs_error},
          {"stored_error", run.worst_besides.empty() ? Json() : Json(run.besides_error)},
          {"stored_worst", run.worst_besides.empty() ? Json() : Json(run.worst_besides)},
          {"event_times_error_s", run.times_error ? Json(*run.times_error) : Json()},
          {"rtol", run.problem.solver.rtol},
          {"atol", run.problem.solver.absolute()},
          {"compared_with_rtol", run.looser},
          {"runs", run.runs},
          {"pilots", pilots_json(run.pilots)}};
}

std::string accuracy_text(const AccurateRun& run, double accuracy) {
  return fmt::format("  accuracy {:.1g} asked for, {} {:.1e} of {}: {}\n", accuracy, run.met ? "estimated" : "reached",
                     run.relative, run.worst, text_of(run));
}

}  // namespace costate::app
