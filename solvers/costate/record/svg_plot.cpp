#include "costate/record/svg_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/base/error.h"

namespace costate {

namespace {

/// The length in bytes of the valid character of UTF-8 at `at` that XML allows, or 0.
std::size_t character_at(const std::string& text, std::size_t at) {
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u; };
  const unsigned first = byte(at);
  if (first < 0x80) return first >= 0x20 || first == '\t' || first == '\n' || first == '\r' ? 1 : 0;
  const std::size_t length = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
  if (first < 0xc2 || first > 0xf4) return 0;
  unsigned code = first & (0xffu >> (length + 1));
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(at + i) & 0xc0) != 0x80) return 0;
    code = code << 6 | (byte(at + i) & 0x3f);
  }
  const unsigned least[] = {0, 0, 0x80, 0x800, 0x10000};
  const bool forbidden = (code >= 0xd800 && code < 0xe000) || code == 0xfffe || code == 0xffff;
  return code < least[length] || code > 0x10ffff || forbidden ? 0 : length;
}

/// 10, 20 or 50 ...: the round step of at least (high - low) / count.
double round_step(double low, double high, int count) {
  const double rough = (high - low) / std::max(count, 1), power = std::pow(10, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (factor * power >= rough * (1 - 1e-9)) return factor * power;
  return 10 * power;
}

/// A tick's number with the digits that tell it from its neighbours.
std::string tick_label(double value, double step, double largest) {
  if (std::abs(value) < 1e-6 * step) return "0";
  const int decimals = static_cast<int>(std::max(0.0, -std::floor(std::log10(step) + 1e-9)));
  if (largest >= 1e-3 && largest < 1e6) return fmt::format("{:.{}f}", value, decimals);
  const int places =
      static_cast<int>(std::floor(std::log10(std::abs(value)) + 1e-9) - std::floor(std::log10(step) + 1e-9));
  const std::string text = fmt::format("{:.{}e}", value, std::max(0, places));
  const std::size_t e = text.find('e');
  return fmt::format("{}e{}", text.substr(0, e), std::stoi(text.substr(e + 1)));
}

/// One axis: from values to pixels.
struct Axis {
  double low = std::numeric_limits<double>::infinity(), high = -low;  // of the values, or their logarithms
  double from = 0, to = 1;                                            // pixels
  bool logarithmic = false;
  std::vector<std::pair<double, std::string>> ticks;

  double transformed(double x) const {
    const bool drawable = std::abs(x) <= 1e300 && (!logarithmic || x > 0);
    return !drawable ? std::numeric_limits<double>::quiet_NaN() : logarithmic ? std::log10(x) : x;
  }
  void include(double x) {
    const double t = transformed(x);
    if (!std::isfinite(t)) return;
    low = std::min(low, t);
    high = std::max(high, t);
  }
  /// Makes the span one that can be drawn; `margin` is what it grows by at each end, relative.
  void settle(double margin) {
    if (!(low <= high)) low = 0, high = 1;
    const double size = std::max(std::abs(low), std::abs(high));
    if (high - low <= 1e-9 * size || high - low < 1e-290) {
      const double pad = size > 1e-280 ? 0.05 * size : 1;
      low -= pad;
      high += pad;
    } else {
      const double pad = margin * (high - low);
      low -= pad;
      high += pad;
    }
  }
  void place_ticks(int count, bool whole) {
    if (logarithmic) {
      const double step = std::max(1.0, std::ceil((high - low) / count - 1e-9));
      for (double k = std::ceil(low / step - 1e-9) * step; k <= high + 1e-9; k += step)
        ticks.emplace_back(k, fmt::format("1e{:.0f}", k == 0 ? 0 : k));
      return;
    }
    double step = round_step(low, high, count);
    if (whole) step = std::max(1.0, step);
    const double largest = std::max(std::abs(low), std::abs(high));
    for (double k = std::ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k)
      ticks.emplace_back(k * step, tick_label(k * step, step, largest));
  }
  /// What a pixel is, for programs that read the plot: from and to in pixels, low and high there, how they are told.
  std::string text() const {
    return fmt::format("{:.3f} {:.3f} {:.9g} {:.9g} {}", from, to, low, high, logarithmic ? "log10" : "linear");
  }
  double pixel(double transformed_value) const { return from + (to - from) * (transformed_value - low) / (high - low); }
};

struct Pixel {
  double x, y;
};

/// Of points in the same column of pixels, the first, the least, the largest and the last are enough.
std::vector<Pixel> thinned(const std::vector<Pixel>& line) {
  if (line.size() < 1500) return line;
  std::vector<Pixel> kept;
  for (std::size_t begin = 0; begin < line.size();) {
    std::size_t end = begin;
    const double column = std::floor(line[begin].x);
    while (end < line.size() && std::floor(line[end].x) == column) ++end;
    const auto [low, high] = std::minmax_element(line.begin() + static_cast<std::ptrdiff_t>(begin),
                                                 line.begin() + static_cast<std::ptrdiff_t>(end),
                                                 [](const Pixel& a, const Pixel& b) { return a.y < b.y; });
    std::size_t order[] = {begin, static_cast<std::size_t>(low - line.begin()),
                           static_cast<std::size_t>(high - line.begin()), end - 1};
    std::sort(std::begin(order), std::end(order));
    for (std::size_t i = 0; i < 4; ++i)
      if (i == 0 || order[i] != order[i - 1]) kept.push_back(line[order[i]]);
    begin = end;
  }
  return kept;
}

std::string style_of(const SvgCurve& c) {
  if (!c.color.empty())
    return fmt::format("stroke=\"{}\" stroke-width=\"1.4\"{}", xml_escaped(c.color),
                       c.dashes.empty() ? "" : fmt::format(" stroke-dasharray=\"{}\"", xml_escaped(c.dashes)));
  switch (c.stroke) {
    case SvgCurve::Stroke::light:
      return R"(stroke="#e3a45c" stroke-width="2.6")";
    case SvgCurve::Stroke::dashed:
      return R"(stroke="#555555" stroke-width="1" stroke-dasharray="5 4")";
    case SvgCurve::Stroke::dark:
      break;
  }
  return R"(stroke="#14316e" stroke-width="1.2")";
}

std::string text_at(double x, double y, const char* anchor, const std::string& text) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>\n", x, y, anchor, xml_escaped(text));
}

/// Thousandths of a pixel: what programs read back is right to some 1e-5 of an axis.
std::string drawn(const SvgCurve& c, const Axis& x, const Axis& y) {
  const std::string of = c.name.empty() ? "" : fmt::format(" data-name=\"{}\"", xml_escaped(c.name));
  std::string out;
  for (std::size_t i = 0; !c.joined && i < c.x.size(); ++i) {
    const double a = x.transformed(c.x[i]), b = y.transformed(c.y[i]);
    if (!std::isfinite(a) || !std::isfinite(b)) continue;
    const std::string name = i < c.names.size() ? "<title>" + xml_escaped(c.names[i]) + "</title>" : "";
    out += fmt::format("<circle cx=\"{:.3f}\" cy=\"{:.3f}\" r=\"3\" fill=\"{}\"{}{}\n", x.pixel(a), y.pixel(b),
                       c.color.empty() ? "#14316e" : xml_escaped(c.color), of,
                       name.empty() ? "/>" : ">" + name + "</circle>");
  }
  if (!c.joined) return out;
  std::vector<Pixel> line;
  const auto flush = [&] {
    if (line.size() > 1) {
      out += fmt::format("<polyline{} fill=\"none\" {} stroke-linejoin=\"round\" points=\"", of, style_of(c));
      for (const Pixel& p : thinned(line)) out += fmt::format("{:.3f},{:.3f} ", p.x, p.y);
      out.back() = '"';
      out += "/>\n";
    }
    if (c.markers)
      for (const Pixel& p : line)
        out += fmt::format("<circle cx=\"{:.3f}\" cy=\"{:.3f}\" r=\"2.2\" fill=\"{}\"{}/>\n", p.x, p.y,
                           c.color.empty() ? "#14316e" : xml_escaped(c.color),
                           line.size() > 1 ? " data-markers=\"1\"" : of);
    line.clear();
  };
  for (std::size_t i = 0; i < c.x.size(); ++i) {
    const double a = x.transformed(c.x[i]), b = y.transformed(c.y[i]);
    if (std::isfinite(a) && std::isfinite(b))
      line.push_back({x.pixel(a), y.pixel(b)});
    else
      flush();
  }
  flush();
  return out;
}

constexpr double kLetter = 6.6;  // pixels, about the mean width of a letter

std::string legend_mark(const SvgCurve& c, double left, double y) {
  if (!c.joined)
    return fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\" fill=\"{}\"/>\n", left + 11, y,
                       c.color.empty() ? "#14316e" : xml_escaped(c.color));
  return fmt::format("<line x1=\"{0:.1f}\" y1=\"{2:.1f}\" x2=\"{1:.1f}\" y2=\"{2:.1f}\" {3}/>\n", left, left + 22, y,
                     style_of(c));
}

std::string legend(const SvgPlot& plot, double right) {
  std::string out;
  for (auto c = plot.curves.rbegin(); c != plot.curves.rend(); ++c) {
    if (c->name.empty()) continue;
    double letters = 0;  // of UTF-8: continuation bytes do not count
    for (const char ch : c->name) letters += (static_cast<unsigned char>(ch) & 0xc0) != 0x80;
    right -= kLetter * letters + 4;
    out += text_at(right, 14, "start", c->name);
    out += legend_mark(*c, right - 28, 10);
    right -= 40;
  }
  return out;
}

/// One below the other, from `left` on.
std::string legend_column(const SvgPlot& plot, double left) {
  std::string out;
  double y = 36;
  for (const SvgCurve& c : plot.curves) {
    if (c.name.empty()) continue;
    out += legend_mark(c, left, y - 4);
    out += text_at(left + 28, y, "start", c.name);
    y += 15;
  }
  return out;
}

}  // namespace

std::string xml_escaped(const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = character_at(text, i);
    switch (length == 1 ? text[i] : 'x') {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += length > 0 ? text.substr(i, length) : "\xef\xbf\xbd";
    }
    i += std::max<std::size_t>(length, 1);
  }
  return out;
}

std::string svg_of(const SvgPlot& plot) {
  Axis x, y;
  x.logarithmic = plot.logarithmic_x;
  y.logarithmic = plot.logarithmic;
  for (const SvgCurve& c : plot.curves) {
    if (c.x.size() != c.y.size())
      throw Error(fmt::format("Curve '{}' of the plot of {} has {} abscissas but {} values; they must agree.", c.name,
                              plot.y_label, c.x.size(), c.y.size()));
    for (std::size_t i = 0; i < c.x.size(); ++i) {
      if (!std::isfinite(y.transformed(c.y[i])) || !std::isfinite(x.transformed(c.x[i]))) continue;
      x.include(c.x[i]);
      y.include(c.y[i]);
    }
  }
  const bool dots = std::any_of(plot.curves.begin(), plot.curves.end(), [](const auto& c) { return !c.joined; });
  x.settle(plot.counting || plot.logarithmic_x || dots ? 0.02 : 0);
  y.settle(0.04);
  x.place_ticks(plot.width / 60, plot.counting);
  y.place_ticks(std::max(3, plot.height / 32), false);
  std::size_t letters = 1;
  for (const auto& [value, label] : y.ticks) letters = std::max(letters, label.size());
  x.from = 14 + kLetter * static_cast<double>(letters);
  std::size_t longest = 0;
  for (const SvgCurve& c : plot.curves) longest = std::max(longest, c.name.size());
  const double beside = plot.legend_beside && longest > 0 ? kLetter * static_cast<double>(longest) + 44 : 0;
  x.to = plot.width - 12 - beside;
  y.from = plot.height - 38;
  y.to = 24;

  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" role=\"img\" "
      "font-family=\"sans-serif\" font-size=\"12\" fill=\"#222222\" data-across=\"{3}\" data-up=\"{4}\"{5}>\n"
      "<title>{2}</title>\n<g class=\"ticks\">\n",
      plot.width, plot.height, xml_escaped(fmt::format("{} over {}", plot.y_label, plot.x_label)), x.text(), y.text(),
      plot.counting ? " data-counting=\"1\"" : "");
  const auto grid = [&](double x1, double y1, double x2, double y2) {
    out += fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"#dddddd\"/>\n", x1, y1,
                       x2, y2);
  };
  for (const auto& [value, label] : x.ticks) {
    grid(x.pixel(value), y.from, x.pixel(value), y.to);
    out += text_at(x.pixel(value), y.from + 15, "middle", label);
  }
  for (const auto& [value, label] : y.ticks) {
    grid(x.from, y.pixel(value), x.to, y.pixel(value));
    out += text_at(x.from - 5, y.pixel(value) + 4, "end", label);
  }
  out += "</g>\n";
  for (const double mark : plot.marks)
    if (x.pixel(mark) > x.from && x.pixel(mark) < x.to)
      out += fmt::format(
          "<path class=\"mark\" data-at=\"{2:.9g}\" d=\"M{0:.2f} {1:.2f}v-7\" stroke=\"#a3195b\" "
          "stroke-width=\"1\"/>\n",
          x.pixel(mark), y.from, mark);
  out += fmt::format(
      "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"none\" "
      "stroke=\"#888888\"/>\n",
      x.from, y.to, x.to - x.from, y.from - y.to);
  out += "<g class=\"curves\">\n";
  for (const SvgCurve& c : plot.curves) out += drawn(c, x, y);
  out += "</g>\n";
  out += text_at(2, 14, "start", plot.y_label);
  out += text_at((x.from + x.to) / 2, plot.height - 6, "middle", plot.x_label);
  return out + (plot.legend_beside ? legend_column(plot, x.to + 12) : legend(plot, x.to)) + "</svg>\n";
}

}  // namespace costate
