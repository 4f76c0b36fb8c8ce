// A page for a person: one HTML file that needs nothing from elsewhere, well-formed XML, with its plots inside as SVG.
// It says all of it without scripts; with them its plots are read off and zoomed with the mouse.
#pragma once

#include <string>
#include <vector>

#include "costate/record/svg_plot.h"

namespace costate::app {

class HtmlPage {
 public:
  explicit HtmlPage(const std::string& title) : title_(title) {}

  void heading(const std::string& text);
  void paragraph(const std::string& text, bool strong = false);
  void list(const std::vector<std::string>& items);
  /// Columns whose header begins with '#' hold numbers.
  void table(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows);
  void plots(const std::vector<SvgPlot>& plots);
  /// A part made elsewhere, well-formed XML, with what the page's style needs for it.
  void part(const std::string& element, const std::string& style);
  std::string text() const;

 private:
  std::string title_, body_, style_;
  bool plots_ = false;
};

}  // namespace costate::app
