#include "html_page.h"

#include <fmt/format.h>

#include "page/plot_script.h"
#include "page_script.h"

namespace costate::app {

namespace {

constexpr const char* kStyle =
    "body { font-family: sans-serif; color: #222222; max-width: 1180px; margin: 2em auto; padding: 0 1em; }\n"
    "h1 { font-size: 1.5em; } h2 { font-size: 1.15em; margin-top: 1.8em; }\n"
    "table { border-collapse: collapse; } th, td { padding: 0.2em 0.9em 0.2em 0; text-align: left; }\n"
    "td { white-space: nowrap; vertical-align: top; } td:last-child { white-space: normal; }\n"
    "th { border-bottom: 1px solid #888888; } td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; }\n"
    ".strong { font-weight: bold; }\n"
    ".plots { display: flex; flex-wrap: wrap; gap: 1em; } .plots svg { max-width: 100%; height: auto; }\n"
    "@media print { svg, tr { break-inside: avoid; } }\n";

}  // namespace

void HtmlPage::heading(const std::string& text) { body_ += fmt::format("<h2>{}</h2>\n", xml_escaped(text)); }

void HtmlPage::paragraph(const std::string& text, bool strong) {
  body_ += fmt::format("<p{}>{}</p>\n", strong ? " class=\"strong\"" : "", xml_escaped(text));
}

void HtmlPage::list(const std::vector<std::string>& items) {
  body_ += "<ul>\n";
  for (const auto& item : items) body_ += fmt::format("<li>{}</li>\n", xml_escaped(item));
  body_ += "</ul>\n";
}

void HtmlPage::table(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows) {
  body_ += "<table>\n";
  const auto line = [&](const char* tag, const std::vector<std::string>& cells) {
    body_ += "<tr>";
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const bool numeric = !header.empty() && header[i].rfind('#', 0) == 0;
      const std::string text = &cells == &header && numeric ? cells[i].substr(1) : cells[i];
      body_ += fmt::format("<{0}{1}>{2}</{0}>", tag, numeric ? " class=\"n\"" : "", xml_escaped(text));
    }
    body_ += "</tr>\n";
  };
  if (!header.empty()) line("th", header);
  for (const auto& row : rows) line("td", row);
  body_ += "</table>\n";
}

void HtmlPage::plots(const std::vector<SvgPlot>& plots) {
  body_ += "<div class=\"plots\">\n";
  for (const SvgPlot& plot : plots) body_ += svg_of(plot);
  body_ += "</div>\n";
  plots_ = plots_ || !plots.empty();
}

void HtmlPage::part(const std::string& element, const std::string& style) {
  body_ += element;
  style_ += style;
}

std::string HtmlPage::text() const {
  const bool answering = plots_ && *plot_library() != '\0';
  return fmt::format(
      "<!DOCTYPE html>\n<html xmlns=\"http://www.w3.org/1999/xhtml\" lang=\"en\">\n<head>\n<meta "
      "charset=\"utf-8\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width\"/>\n<title>{0}</title>\n<style>\n{1}{2}{3}</style>\n"
      "</head>\n<body>\n<h1>{0}</h1>\n{4}{5}</body>\n</html>\n",
      xml_escaped(title_), kStyle, answering ? plot_style() : "", style_, body_,
      answering ? script_element(plot_library(), "chart") + script_element(plot_script()) : "");
}

}  // namespace costate::app
