#include "optimize_journal.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "costate/record/json_number.h"

namespace costate::app {

namespace {

void require(bool good, const std::string& what) {
  if (!good) throw Error(what);
}

std::vector<double> numbers(const nlohmann::json& j, std::size_t count, const std::string& what) {
  std::vector<double> x = numbers_from_json(j);
  require(x.size() == count, fmt::format("{} has {} entries where {} belong", what, x.size(), count));
  for (const double v : x) require(std::isfinite(v), fmt::format("{} holds what is not finite", what));
  return x;
}

OptimizerEvaluation evaluation_of(const nlohmann::json& j, std::size_t index, const ParameterSelection& selection,
                                  std::size_t constraints, std::size_t cases) {
  OptimizerEvaluation e;
  const auto n = static_cast<std::size_t>(selection.size());
  e.index = j.at("index").get<int>();
  require(e.index == static_cast<int>(index), fmt::format("its index is {} where {} belongs", e.index, index));
  e.rho = numbers(j.at("parameters"), n, "'parameters'");
  for (std::size_t i = 0; i < n; ++i)
    require(e.rho[i] >= selection.parameters[i].lower && e.rho[i] <= selection.parameters[i].upper,
            fmt::format("{} = {} is outside of its bounds", selection.parameters[i].name, e.rho[i]));
  e.psi = number_from_json(j.at("psi"));
  e.projected_gradient = number_from_json(j.at("projected_gradient"));
  e.wall_s = number_from_json(j.at("wall_s"));
  e.failure = j.value("failure", "");
  if (j.contains("rtol")) e.rtol = number_from_json(j.at("rtol"));
  e.ending = j.value("ending", false);
  if (j.contains("warnings"))
    for (const auto& sentence : j.at("warnings")) e.warnings.push_back(sentence.get<std::string>());
  if (j.contains("absolute_by_rtol"))
    for (const auto& t : j.at("absolute_by_rtol")) {
      const std::vector<double> both = numbers(t, 2, "'absolute_by_rtol'");
      e.tolerances.push_back({both[0], both[1]});
    }
  require(e.tolerances.size() <= std::max<std::size_t>(cases, 1), "'absolute_by_rtol' has more rows than cases");
  if (e.failed()) {
    require(index > 1, "the first evaluation cannot be a failed one");
  } else {
    require(std::isfinite(e.psi) && std::isfinite(e.projected_gradient), "psi or the projected gradient is not finite");
    e.gradient = numbers(j.at("gradient"), n, "'gradient'");
    e.constraints = numbers(j.at("constraints"), constraints, "'constraints'");
    const auto& rows = j.at("constraint_gradients");
    require(rows.is_array() && rows.size() == constraints,
            fmt::format("'constraint_gradients' has {} rows where {} belong", rows.size(), constraints));
    for (const auto& g : rows) e.constraint_gradients.push_back(numbers(g, n, "'constraint_gradients'"));
    if (cases > 0) {
      e.cases = numbers(j.at("cases"), cases, "'cases'");
      const auto& of = j.at("case_gradients");
      require(of.is_array() && of.size() == cases,
              fmt::format("'case_gradients' has {} rows where {} belong", of.size(), cases));
      for (const auto& g : of) e.case_gradients.push_back(numbers(g, n, "'case_gradients'"));
    }
  }
  for (const auto& [name, count] : counter_fields(e.counters)) *count = j.at("counters").value(name, 0L);
  return e;
}

}  // namespace

std::string settings_in_words(const std::filesystem::path& journal) {
  const nlohmann::json header = Journal::header_of(journal);
  try {
    const auto& settings = header.at("settings");
    const auto integrator = settings.at("integrator").get<std::string>();
    return fmt::format("--formulation {} --method {}{} --rtol {} --atol {}{}",
                       header.at("formulation").get<std::string>(), header.at("method").get<std::string>(),
                       integrator.empty() ? "" : " --integrator " + integrator, settings.at("rtol").get<double>(),
                       settings.at("atol").get<double>(),
                       header.at("optimize").value("adapt_tolerance", false) ? " --adapt-accuracy" : "");
  } catch (const nlohmann::json::exception&) {
    return "--formulation, --method, --integrator, --rtol and --atol";
  }
}

void refuse_journal(const Journal& journal, const std::string& evaluation) {
  throw Error(
      fmt::format("{} of the journal '{}' was made at other parameters than this run asks for: it was written on "
                  "another kind of machine. Start without --resume.",
                  evaluation, journal.path().string()));
}

nlohmann::json evaluation_record(const OptimizerEvaluation& e) {
  nlohmann::json j;
  j["index"] = e.index;
  j["parameters"] = e.rho;
  j["psi"] = e.psi;
  j["gradient"] = e.gradient;
  j["constraints"] = e.constraints;
  j["constraint_gradients"] = e.constraint_gradients;
  if (!e.cases.empty()) {
    j["cases"] = e.cases;
    j["case_gradients"] = e.case_gradients;
  }
  j["projected_gradient"] = e.projected_gradient;
  for (const auto& [name, value] : counter_list(e.counters)) j["counters"][name] = value;
  j["wall_s"] = e.wall_s;
  if (e.rtol > 0) j["rtol"] = e.rtol;
  if (std::any_of(e.tolerances.begin(), e.tolerances.end(), [](const auto& t) { return t.atol > 0; }))
    for (const AbsoluteTolerances& t : e.tolerances) j["absolute_by_rtol"].push_back({t.atol, t.cost_atol});
  if (e.ending) j["ending"] = true;
  for (const std::string& sentence : e.warnings) j["warnings"].push_back(nlohmann::json::parse(json_text(sentence)));
  if (e.failed()) j["failure"] = Json::parse(json_text(e.failure));  // valid UTF-8, whatever names it quotes
  return j;
}

std::vector<OptimizerEvaluation> read_evaluations(Journal& journal, const ParameterSelection& parameters,
                                                  std::size_t constraints, std::size_t cases) {
  std::vector<OptimizerEvaluation> evaluations;
  for (const auto& r : journal.records()) try {
      evaluations.push_back(evaluation_of(r, evaluations.size() + 1, parameters, constraints, cases));
    } catch (const std::exception& e) {
      journal.keep(evaluations.size(), json_reason(e));
      break;
    }
  return evaluations;
}

std::vector<std::vector<OptimizerEvaluation>> read_searches(Journal& journal, const ParameterSelection& parameters,
                                                            std::size_t constraints, std::size_t cases) {
  std::vector<std::vector<OptimizerEvaluation>> searches;
  std::size_t read = 0;
  for (const auto& r : journal.records()) try {
      const auto search = r.at("search").get<std::size_t>();
      require(search == searches.size() || search + 1 == searches.size(),
              fmt::format("its search is {} behind {} others", search, searches.size()));
      if (search == searches.size()) searches.emplace_back();
      searches.back().push_back(evaluation_of(r, searches.back().size() + 1, parameters, constraints, cases));
      ++read;
    } catch (const std::exception& e) {
      journal.keep(read, json_reason(e));
      break;
    }
  return searches;
}

nlohmann::json journal_header(const DesignSetup& whole, const std::vector<SceneFile>& files,
                              const OptimizerOptions& o) {
  const Setup& setup = whole.setup;
  nlohmann::json header;
  header["scene"] = setup.scene.dump();
  // Every byte of the files that the scene names is part of what the run is.
  header["files"] = nlohmann::json::object();
  for (const SceneFile& f : files)
    if (!f.path.empty()) header["files"][f.path] = f.digest;
  header["parameters"] = setup.problem.parameters.names();
  header["formulation"] = setup.problem.formulation;
  header["method"] = setup.method;
  header["settings"] = nlohmann::json(settings_json(setup));
  header["settings"].erase("scene");
  header["settings"]["rtol"] = setup.problem.solver.rtol;
  header["settings"]["integrator"] = setup.problem.solver.integrator;
  header["optimize"] = {
      {"algorithm", o.algorithm},
      {"stop_value", with_nonfinite_as_text(o.stop_value.value_or(-std::numeric_limits<double>::infinity()))},
      {"relative_tolerance", o.relative_tolerance},
      {"gradient_tolerance", o.gradient_tolerance},
      {"step_limit_factor", o.step_limit_factor}};
  if (whole.several()) header["design"] = whole.identity();
  if (o.adapt_accuracy) header["optimize"]["adapt_tolerance"] = true;
  return header;
}

}  // namespace costate::app
