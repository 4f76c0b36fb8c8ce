// The page of costate equilibrium.
#include <fmt/format.h>

#include "command_pages.h"
#include "costate/drawing.h"
#include "costate/page_parts.h"

namespace costate::app {

std::string equilibrium_page(const Scene& scene, const Json& j, const std::string& head, const Figure& figure,
                             const std::vector<std::pair<std::string, Listing>>& lists) {
  HtmlPage page(scene.title.empty() ? scene.file_name() : scene.title);
  if (!j.at("stable").get<bool>()) page.paragraph("NOT STABLE: a small push leads away from this position.", true);
  add_warnings(page, j);
  if (!scene.description.empty()) page.paragraph(scene.description);
  page.heading("Equilibrium");
  add_text(page, head);
  if (figure.places.size() + figure.bodies.size() + figure.links.size() <= 500)
    page.part("<div class=\"plots\">\n" + drawing(figure, {}) + "</div>\n", "");
  else
    page.paragraph("The mechanism is too large for a drawing here; 'costate draw' makes one.");
  for (const auto& [title, list] : lists) {
    if (list.empty()) continue;
    page.heading(title);
    page.table({"name", "#value", "unit"}, list.rows());
  }
  return page.text();
}

}  // namespace costate::app
