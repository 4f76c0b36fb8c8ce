// Reads what the tool writes as XML: whether it is well-formed, and what an SVG plot shows, from its ticks and curves.
#pragma once

#include <cctype>
#include <cmath>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

namespace costate::test {

/// Why a text is no well-formed XML, or empty: tags balance, attributes are quoted and unique in an element, & begins
/// an entity that XML knows. (No comments, CDATA or processing instructions: ours have none.)
inline std::string xml_fault(const std::string& text) {
  std::vector<std::string> open;
  std::size_t at = 0;
  const auto entity_ends = [&](std::size_t i) {
    for (const char* known : {"&amp;", "&lt;", "&gt;", "&quot;", "&#39;"})
      if (text.compare(i, std::string(known).size(), known) == 0) return true;
    return false;
  };
  const auto near = [&] { return " near '" + text.substr(at, 60) + "'"; };
  const std::string doctype = "<!DOCTYPE html>";
  if (text.compare(0, doctype.size(), doctype) == 0) at = doctype.size();
  bool rooted = false;
  while (at < text.size()) {
    if (text[at] == '&' && !entity_ends(at)) return "unknown entity" + near();
    if (text[at] != '<') {
      if (open.empty() && std::isspace(static_cast<unsigned char>(text[at])) == 0)
        return "text outside the root" + near();
      ++at;
      continue;
    }
    if (text.compare(at, 9, "<![CDATA[") == 0) {  // any characters, up to its end
      at = text.find("]]>", at);
      if (at == std::string::npos || open.empty()) return "CDATA without end or element";
      at += 3;
      continue;
    }
    const bool closing = text.compare(at, 2, "</") == 0;
    std::size_t i = at + (closing ? 2 : 1);
    const auto word = [&] {
      const std::size_t begin = i;
      while (i < text.size() && (std::isalnum(static_cast<unsigned char>(text[i])) != 0 || text[i] == '-' ||
                                 text[i] == ':' || text[i] == '_'))
        ++i;
      return text.substr(begin, i - begin);
    };
    const std::string tag = word();
    if (tag.empty()) return "bare '<'" + near();
    std::vector<std::string> attributes;
    for (;;) {
      while (i < text.size() && std::isspace(static_cast<unsigned char>(text[i])) != 0) ++i;
      if (i >= text.size()) return "tag without end" + near();
      if (text[i] == '>' || text[i] == '/') break;
      const std::string name = word();
      if (name.empty() || text.compare(i, 2, "=\"") != 0) return "bad attribute" + near();
      for (const auto& other : attributes)
        if (other == name) return "attribute twice" + near();
      attributes.push_back(name);
      for (i += 2; i < text.size() && text[i] != '"'; ++i) {
        if (text[i] == '<') return "'<' in an attribute" + near();
        if (text[i] == '&' && !entity_ends(i)) return "unknown entity" + near();
      }
      ++i;
    }
    if (closing) {
      if (open.empty() || open.back() != tag) return "tag closed out of turn" + near();
      open.pop_back();
    } else {
      if (open.empty() && rooted) return "second root" + near();
      rooted = true;
      if (text[i] != '/') open.push_back(tag);
    }
    at = text.find('>', i) + 1;
    if (at == 0) return "tag without end";
  }
  return open.empty() ? rooted ? "" : "no element" : "not closed: " + open.back();
}

/// What stands between two texts, for each time that both occur.
inline std::vector<std::string> all_between(const std::string& text, const std::string& begin, const std::string& end) {
  std::vector<std::string> found;
  for (std::size_t at = text.find(begin); at != std::string::npos; at = text.find(begin, at)) {
    at += begin.size();
    const std::size_t stop = text.find(end, at);
    if (stop == std::string::npos) break;
    found.push_back(text.substr(at, stop - at));
    at = stop;
  }
  return found;
}

/// A page without the texts of three.js and Chart.js, which name addresses and could fetch (pages.cpp and plots.cpp
/// look at what is fetched).
inline std::string without_libraries(std::string page) {
  for (const char* id : {"three", "chart"}) {
    const std::size_t from = page.find("<script id=\"" + std::string(id) + "\">");
    if (from != std::string::npos) page.erase(from, page.find("</script>", from) - from);
  }
  return page;
}

/// What a page would take from elsewhere; none for pages that need nothing. Addresses may be the names of the two
/// vocabularies; programs stand in the page itself and fetch nothing.
inline std::vector<std::string> foreign_references(const std::string& whole_page) {
  const std::string page = without_libraries(whole_page);
  std::vector<std::string> found;
  for (const char* never :
       {"src=", "href=", "url(http", "@import", "<link", "<iframe", "import(", "fetch(", "XMLHttpRequest", "https:"})
    if (page.find(never) != std::string::npos) found.emplace_back(never);
  for (const auto& address : all_between(page, "http://", "\""))
    if (address != "www.w3.org/2000/svg" && address != "www.w3.org/1999/xhtml") found.push_back(address.substr(0, 60));
  return found;
}

/// A curve of one of our plots in the plot's own units, read back from the picture alone: its ticks say what a pixel
/// is.
struct ReadCurve {
  std::vector<double> x, y;
};
struct ReadPlot {
  std::string title;
  std::vector<ReadCurve> curves;
};

/// Of a plot with a linear x axis; `logarithmic` as it was drawn. At least two ticks an axis are needed.
inline ReadPlot read_plot(const std::string& svg, bool logarithmic = false) {
  struct Scale {
    double pixel[2] = {0, 0}, value[2] = {0, 0};
    int ticks = 0;
    void add(double p, double v) {
      const int slot = ticks == 0 ? 0 : 1;  // the first and the last
      pixel[slot] = p;
      value[slot] = v;
      ++ticks;
    }
    double of(double p) const { return value[0] + (value[1] - value[0]) * (p - pixel[0]) / (pixel[1] - pixel[0]); }
  } x, y;
  ReadPlot plot;
  plot.title = all_between(svg, "<title>", "</title>").at(0);
  for (const auto& text : all_between(svg, "<text ", "</text>")) {
    const std::string label = text.substr(text.find('>') + 1);
    char* rest = nullptr;
    const double value = std::strtod(label.c_str(), &rest);
    if (label.empty() || *rest != 0) continue;
    const std::string anchor = all_between(text, "text-anchor=\"", "\"").at(0);
    const double px = std::stod(all_between(text, "x=\"", "\"").at(0)),
                 py = std::stod(all_between(text, "y=\"", "\"").at(0));
    if (anchor == "middle") x.add(px, value);
    if (anchor == "end") y.add(py - 4, logarithmic ? std::log10(value) : value);
  }
  for (const auto& points : all_between(svg, "points=\"", "\"")) {
    ReadCurve curve;
    const char* at = points.c_str();
    for (char* next = nullptr; *at != 0; at = next) {
      const double px = std::strtod(at, &next);
      const double py = std::strtod(next + 1, &next);
      curve.x.push_back(x.of(px));
      curve.y.push_back(logarithmic ? std::pow(10, y.of(py)) : y.of(py));
      while (*next == ' ') ++next;
    }
    plot.curves.push_back(std::move(curve));
  }
  return plot;
}

}  // namespace costate::test
