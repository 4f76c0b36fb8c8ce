#include "certificate_report.h"

#include <fmt/format.h>

#include <algorithm>

#include "costate/optimize/certificate_verdict.h"

namespace costate::app {

Json certificate_json(const Certificate& c, double wall_s) {
  Json j;
  j["verdict"] = c.verdict;
  j["projected_gradient"] = c.projected_gradient;
  j["kkt_residual"] = c.kkt_residual;
  j["kkt_tolerance"] = c.tolerance;
  j["active"] = c.active;
  j["violated"] = Json::object();
  for (const auto& [name, excess] : c.violated) j["violated"][name] = excess;
  j["free"] = c.free;
  j["multipliers"] = Json::object();
  for (const auto& [name, value] : c.multipliers) j["multipliers"][name] = value;
  const bool hessian = !c.formulation.empty(), any = !c.eigenvalues.empty(), definite = c.newton_step >= 0;
  j["hessian_formulation"] = hessian ? Json(c.formulation) : Json();
  j["hessian_note"] = c.note.empty() ? Json() : Json(c.note);
  j["hessian_eigenvalues"] = hessian ? Json(c.eigenvalues) : Json();
  j["smallest_eigenvalue"] = any ? Json(c.eigenvalues.front()) : Json();
  j["largest_eigenvalue"] = any ? Json(c.eigenvalues.back()) : Json();
  j["condition"] = definite ? Json(c.eigenvalues.back() / c.eigenvalues.front()) : Json();
  j["eigenvalue_tolerance"] = hessian ? Json(c.curvature_tolerance) : Json();
  j["eigenvalue_error"] = hessian ? Json(c.eigenvalue_error) : Json();
  j["newton_step"] = definite ? Json(c.newton_step) : Json();
  j["predicted_decrease"] = definite ? Json(c.predicted_decrease) : Json();
  j["hessian_asymmetry"] = hessian ? Json(c.asymmetry) : Json();
  j["wall_s"] = wall_s;
  return j;
}

std::string certificate_text(const Certificate& c) {
  std::string text = fmt::format("  {}\n", c.verdict);
  for (const auto& [name, value] : c.multipliers)
    if (std::none_of(c.violated.begin(), c.violated.end(), [&](const auto& v) { return v.first == name; }))
      text += fmt::format("  {} is active: multiplier {:.6g}\n", name, value);
  if (c.eigenvalues.size() == 1)
    text += fmt::format("  Hessian in scaled parameters: {}\n", known_eigenvalue(c, c.eigenvalues[0]));
  if (c.eigenvalues.size() > 1)
    text += fmt::format("  Hessian in scaled parameters: eigenvalues {} to {}\n",
                        known_eigenvalue(c, c.eigenvalues.front()), known_eigenvalue(c, c.eigenvalues.back()));
  if (c.newton_step >= 0)
    text += fmt::format("  Newton's step from here: {:.3g} of the scales, psi would fall by {:.3g}\n", c.newton_step,
                        c.predicted_decrease);
  if (!c.note.empty()) text += fmt::format("  {}\n", c.note);
  return text;
}

}  // namespace costate::app
