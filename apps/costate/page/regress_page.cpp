// The page of costate regress.
#include <fmt/format.h>

#include "command_pages.h"
#include "costate/page_parts.h"

namespace costate::app {

std::string regress_page(const Json& j, const std::string& text) {
  HtmlPage page("Baselines in " + j.at("directory").get<std::string>());
  if (j.contains("error")) page.paragraph(j.at("error").get<std::string>(), true);
  page.paragraph(text, true);
  std::vector<std::vector<std::string>> failed, moved, all;
  const auto number = [](const Json& x, const char* format) {
    return x.is_number() ? fmt::format(fmt::runtime(format), x.get<double>()) : "-";
  };
  for (const Json& c : j.at("cases")) {
    const std::string name = c.at("name").get<std::string>();
    all.push_back({name, c.at("status").get<std::string>(), c.at("command").get<std::string>(),
                   std::to_string(c.at("quantities").size()), number(c.at("wall_s"), "{:.3g}"),
                   c.at("scene").get<std::string>()});
    if (c.contains("error")) failed.push_back({name, c.at("error").get<std::string>()});
    for (const Json& q : c.at("quantities"))
      if (q.at("moved").get<bool>() || q.at("updated").get<bool>())
        moved.push_back({name, q.at("name").get<std::string>(), number(q.at("expected"), "{:.12g}"),
                         number(q.at("found"), "{:.12g}"), number(q.at("difference"), "{:.2e}"),
                         number(q.at("allowed"), "{:.1e}"), q.at("updated").get<bool>() ? "updated" : "MOVED",
                         q.at("reason").get<std::string>()});
  }
  if (!failed.empty()) {
    page.heading("Failed");
    page.table({"baseline", "why"}, failed);
  }
  if (!moved.empty()) {
    page.heading("Moved beyond the tolerance, or new");
    page.table({"baseline", "quantity", "#stored", "#found", "#by", "#allowed", "", "what the tolerance is for"},
               moved);
  }
  page.heading("All");
  page.table({"baseline", "status", "command", "#quantities", "#time [s]", "scene"}, all);
  return page.text();
}

}  // namespace costate::app
