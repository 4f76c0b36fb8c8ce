// The page of costate explain.
#include <fmt/format.h>

#include <algorithm>

#include "bars.h"
#include "command_pages.h"
#include "costate/page_parts.h"

namespace costate::app {

std::string explain_page(const Setup& setup, const Json& j, const std::string& text) {
  HtmlPage page(title_of(setup));
  add_warnings(page, j);
  if (!setup.scene.description.empty()) page.paragraph(setup.scene.description);
  page.heading("What is built");
  add_text(page, text);
  page.heading("Share of a run's processor time");
  std::vector<std::pair<std::string, double>> shares;
  double rest = 100;
  for (const Json& k : j.at("kinds")) {
    shares.emplace_back(k.at("kind").get<std::string>(), 100 * k.at("share").get<double>());
    rest -= shares.back().second;
  }
  shares.emplace_back("the rest", std::max(0.0, rest));
  page.paragraph(
      "In percent, of the kernels of each kind; the rest is assembling, factorizations, the integrator and "
      "the cost.");
  page.part("<div class=\"plots\">\n" + bars("share of the time in percent", shares) + "</div>\n", "");
  std::vector<std::vector<std::string>> unneeded;
  for (const Json& p : j.at("parts")) {
    if (p.at("needed").get<bool>()) continue;
    const auto joined = [](const Json& names) {
      std::string all;
      for (const Json& n : names) all += (all.empty() ? "" : ", ") + n.get<std::string>();
      return all;
    };
    unneeded.push_back({joined(p.at("coordinates")), joined(p.at("elements"))});
  }
  const Json& unmet = j.at("never_met");
  if (unneeded.empty() && unmet.empty()) return page.text();
  page.heading("What could be left out");
  for (const Json& name : unmet) page.paragraph(name.get<std::string>() + " is never met in this run.");
  if (!unneeded.empty()) page.table({"coordinates that no output or cost needs", "their elements"}, unneeded);
  return page.text();
}

}  // namespace costate::app
