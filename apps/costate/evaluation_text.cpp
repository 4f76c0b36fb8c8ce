#include "evaluation_text.h"

#include <fmt/format.h>

#include <algorithm>

#include "command.h"
#include "digits.h"

namespace costate::app {

Json evaluation_json(const OptimizerEvaluation& e, const std::vector<std::string>& names,
                     const std::vector<DesignBound>& bounds) {
  Json j;
  j["index"] = e.index;
  if (e.rtol > 0) j["rtol"] = e.rtol;
  j["parameters"] = named(names, e.rho);
  if (e.failed()) {
    j["psi"] = j["gradient"] = j["projected_gradient"] = nullptr;
    j["failure"] = e.failure;
    j["counters"] = counters_json(e.counters);
    j["wall_s"] = e.wall_s;
    return j;
  }
  j["psi"] = e.psi;
  j["gradient"] = named(names, e.gradient);
  if (!e.cases.empty()) j["cases"] = e.cases;
  if (!bounds.empty()) {
    j["constraints"] = Json::object();
    for (std::size_t c = 0; c < bounds.size(); ++c) j["constraints"][bounds[c].name] = e.constraints[c];
  }
  j["projected_gradient"] = e.projected_gradient;
  j["counters"] = counters_json(e.counters);
  j["wall_s"] = e.wall_s;
  return j;
}

std::string evaluation_line(const OptimizerEvaluation& e, const std::vector<std::string>& names, double relative,
                            bool verbose) {
  std::string line =
      e.failed()
          ? fmt::format("  {:>4}  failed, the step is rejected:", e.index)
          : fmt::format("  {:>4}  psi = {:<18} |projected gradient| = {:<10.3g}", e.index,
                        known_digits(e.psi, std::max(e.psi_error, uncertainty_of(e.psi, std::max(relative, e.rtol)))),
                        e.projected_gradient);
  for (std::size_t j = 0; j < names.size() && j < 6; ++j) line += fmt::format(" {} = {:.9g}", names[j], e.rho[j]);
  if (names.size() > 6) line += " ...";
  if (verbose && !e.failed())
    line += fmt::format(" steps = {} + {} backward, {:.3g} s", e.counters.steps, e.counters.backward_steps, e.wall_s);
  if (e.rtol > 0) line += fmt::format(" (rtol {:.0e})", e.rtol);
  if (e.replayed) line += " (from the journal)";
  if (e.failed()) line += "\n        " + e.failure;
  return line;
}

Json adaptation_json(const Adaptation& a) {
  Json tolerances = Json::array();
  for (const ToleranceShare& t : a.tolerances)
    tolerances.push_back({{"rtol", t.rtol}, {"evaluations", t.evaluations}, {"wall_s", t.wall_s}});
  return {{"tolerances", tolerances}, {"again", a.again}, {"spent_s", a.spent_s}, {"fixed_s", a.fixed_s}};
}

std::string adaptation_text(const Json& a) {
  std::string text;
  for (const Json& t : a.at("tolerances"))
    text += fmt::format("{}{} at rtol {:.0e}", text.empty() ? "" : ", ", t.at("evaluations").get<int>(),
                        t.at("rtol").get<double>());
  return fmt::format("{}: {:.3g} s; the last tolerance throughout, about {:.3g} s", text, a.at("spent_s").get<double>(),
                     a.at("fixed_s").get<double>());
}

}  // namespace costate::app
