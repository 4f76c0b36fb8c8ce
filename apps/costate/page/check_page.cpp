// The page of costate check.
#include <fmt/format.h>

#include "command_pages.h"
#include "costate/digits.h"
#include "costate/page_parts.h"

namespace costate::app {

namespace {

/// "DISAGREES in d(psi)/d(L01) (remark)", or why there is no result.
std::string said(const Json& row, const char* where) {
  for (const char* why : {"refused", "failure", "failed", "cut"})
    if (row.contains(why)) return row.at(why).get<std::string>();
  std::string text =
      row.at(where).is_string() && row.at("status") != "ok" ? "in " + row.at(where).get<std::string>() : "";
  if (row.contains("remark")) text += (text.empty() ? "(" : " (") + row.at("remark").get<std::string>() + ")";
  return text;
}

std::string short_number(const Json& x, const char* format) {
  return x.is_number() ? fmt::format(fmt::runtime(format), x.get<double>()) : "-";
}

std::vector<std::string> cells_of(const Setup& setup, const Json& r) {
  const Json& c = r.at("counters");
  const auto count = [&](const char* key) { return c.at(key).get<long>(); };
  const Json& integrator = r.at("integrator");
  std::vector<std::string> cells = {r.at("formulation").get<std::string>(), r.at("method").get<std::string>(),
                                    integrator.is_string() ? integrator.get<std::string>() : "-",
                                    r.at("status").get<std::string>()};
  if (!r.at("psi").is_number()) {
    cells.insert(cells.end(), 7, "-");
  } else {
    const double psi = r.at("psi").get<double>();
    const double relative =
        precision_of(setup.problem.solver, r.at("integrator").get<std::string>(), count("steps")).relative;
    cells.insert(
        cells.end(),
        {known_digits(psi, uncertainty_of(psi, relative)), short_number(r.at("error"), "{:.1e}"),
         std::to_string(count("steps")), std::to_string(count("backward_steps")),
         std::to_string(count("residuals") + count("backward_residuals") + count("sensitivity_residuals")),
         fmt::format("{:.2f}", 1e3 * r.at("wall_s").get<double>()), short_number(r.at("time_ratio"), "{:.2f}")});
  }
  cells.push_back(said(r, "worst"));
  return cells;
}

void add_list(HtmlPage& page, const Json& list, const std::string& title) {
  if (list.empty()) return;
  page.heading(title);
  page.list(list.get<std::vector<std::string>>());
}

}  // namespace

std::string check_page(const Setup& setup, const Json& j, const std::string& verdict) {
  HtmlPage page(title_of(setup));
  page.heading("Verdict");
  const std::size_t wrong = j.at("disagreements").size();
  page.paragraph(!verdict.empty() ? verdict
                                  : fmt::format("DISAGREEMENT: {} {} not agree within what the tolerances allow", wrong,
                                                wrong == 1 ? "result does" : "results do"),
                 true);
  add_list(page, j.at("disagreements"), "Disagreements");
  add_list(page, j.at("failures"), "Failed");
  add_list(page, j.at("inaccurate"), "Inaccurate");
  add_list(page, j.at("cut"), "Cut");
  const Json& y = j.at("reference");
  if (y.contains("note")) page.paragraph(y.at("note").get<std::string>());
  for (const char* note : {"motions_note", "cycles_note"})
    if (j.contains(note)) page.paragraph(j.at(note).get<std::string>());
  add_warnings(page, j);
  page.heading("Gradients");
  const std::size_t count = setup.rho.size();
  page.paragraph(fmt::format(
      "{}, rtol {:g}, {} parameter{}. Reference: {} x {}, {}.", setup.scene.file_name(), setup.problem.solver.rtol,
      count, count == 1 ? "" : "s", y.at("formulation").get<std::string>(), y.at("method").get<std::string>(),
      y.at("distance_to_differences").is_number()
          ? fmt::format("{:.1e} from differences (own estimate {:.1e})", y.at("distance_to_differences").get<double>(),
                        y.at("differences_own_estimate").get<double>())
          : "not proven by differences"));
  std::vector<std::vector<std::string>> rows;
  for (const Json& r : j.at("rows")) rows.push_back(cells_of(setup, r));
  page.table({"formulation", "method", "integrator", "verdict", "#psi", "#error", "#steps", "#backward", "#callbacks",
              "#time [ms]", "#ratio", ""},
             rows);
  if (j.contains("cycles") && !j.at("cycles").empty()) {
    page.heading("Cycles");
    rows.clear();
    for (const Json& c : j.at("cycles"))
      rows.push_back({c.at("formulation").get<std::string>(), c.at("integrator").get<std::string>(),
                      c.at("status").get<std::string>(), short_number(c.at("period_s"), "{:.9g}"),
                      short_number(c.at("multiplier"), "{:.7g}"), short_number(c.at("error"), "{:.1e}"),
                      c.at("quantity").is_string() ? c.at("quantity").get<std::string>() : "-", said(c, "quantity")});
    page.table({"cycle", "integrator", "verdict", "#period [s]", "#multiplier", "#error", "farthest", ""}, rows);
  }
  if (j.at("motions").empty()) return page.text();
  page.heading("Motions");
  rows.clear();
  for (const Json& m : j.at("motions"))
    rows.push_back({m.at("formulation").get<std::string>(), m.at("integrator").get<std::string>(),
                    m.at("status").get<std::string>(), short_number(m.at("error"), "{:.1e}"),
                    short_number(m.at("equations_error"), "{:.1e}"),
                    m.at("quantity").is_string()
                        ? fmt::format("{} at {:.6g} s", m.at("quantity").get<std::string>(), m.at("t_s").get<double>())
                        : "-",
                    said(m, "quantity")});
  page.table({"motion", "integrator", "verdict", "#error", "#equations", "farthest", ""}, rows);
  return page.text();
}

}  // namespace costate::app
