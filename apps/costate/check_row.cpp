#include "check_row.h"

#include <fmt/format.h>

#include "digits.h"

namespace costate::app {

std::string row_text(const Setup& setup, const CheckRow& r, std::size_t label_width) {
  const std::string begin = fmt::format("  {:<22} {:<{}} ", r.formulation, r.label(), label_width);
  if (r.refused()) return begin + "-- " + r.why + "\n";
  if (r.verdict() == Verdict::failed) return begin + "FAILED: " + r.why + "\n";
  if (r.verdict() == Verdict::cut) return begin + "cut: " + r.why + "\n";
  const Counters& c = r.result.counters;
  const double relative = precision_of(setup.problem.solver, r.result.integrator, c.steps).relative;
  return begin + fmt::format("{:>18} {:>9.1e} {:>7} {:>8} {:>9} {:>9.2f} {:>7}{}{}\n",
                             known_digits(r.result.psi, uncertainty_of(r.result.psi, relative)), r.judged.error,
                             c.steps, c.backward_steps, c.residuals + c.backward_residuals + c.sensitivity_residuals,
                             1e3 * r.wall_s, r.time_ratio ? fmt::format("{:.2f}", *r.time_ratio) : "-",
                             r.verdict() == Verdict::disagreement ? "  DISAGREES in " + r.judged.worst
                             : r.verdict() == Verdict::inaccurate ? "  INACCURATE in " + r.judged.worst
                                                                  : "",
                             r.judged.remark.empty() ? "" : "  (" + r.judged.remark + ")");
}

std::string row_sentence(const CheckRow& r) {
  const std::string name = fmt::format("{} x {}", r.formulation, r.label());
  if (r.verdict() == Verdict::failed) return fmt::format("{}: {}", name, r.why);
  if (r.verdict() == Verdict::cut) return fmt::format("{} was cut {}", name, r.why);
  return fmt::format("{}, {}: {:.2e} relative, {:.9g} where the reference has {:.9g}{}", name, r.judged.worst,
                     r.judged.error, r.judged.found, r.judged.expected,
                     r.judged.remark.empty() ? "" : " (" + r.judged.remark + ")");
}

Json row_json(const Setup& setup, const CheckRow& r) {
  Json e;
  const auto names = setup.problem.parameters.names();
  const bool ended = r.ended();
  e["formulation"] = r.formulation;
  e["method"] = r.method;
  e["psi"] = ended ? Json(r.result.psi) : Json(nullptr);
  e["parameters"] = named(names, setup.rho);
  e["gradient"] = ended ? named(names, r.result.gradient) : Json(nullptr);
  e["gradient_error"] = nullptr;
  e["error"] = ended ? Json(r.judged.error) : Json(nullptr);
  e["worst"] = ended ? Json(r.judged.worst) : Json(nullptr);
  e["integrator"] = ended ? Json(r.result.integrator) : r.integrator.empty() ? Json(nullptr) : Json(r.integrator);
  e["rtol"] = setup.problem.solver.rtol;
  e["counters"] = counters_json(r.result.counters);
  e["wall_s"] = r.wall_s;
  e["time_ratio"] = r.time_ratio ? Json(*r.time_ratio) : Json(nullptr);
  e["status"] = name_of(r.verdict());
  if (r.refused()) e["refused"] = r.why;
  if (r.verdict() == Verdict::failed) e["failure"] = r.why;
  if (r.verdict() == Verdict::cut) e["cut"] = r.why;
  if (!r.judged.remark.empty()) e["remark"] = r.judged.remark;
  return e;
}

}  // namespace costate::app
