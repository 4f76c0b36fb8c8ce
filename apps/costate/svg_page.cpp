#include "svg_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace costate::app {

namespace {

std::string escaped(const std::string& text) {
  std::string r;
  for (const char c : text) {
    if (c == '&')
      r += "&amp;";
    else if (c == '<')
      r += "&lt;";
    else if (c == '>')
      r += "&gt;";
    else
      r += c;
  }
  return r;
}

std::string xy(const Vector2d& p) { return fmt::format("{:.1f} {:.1f}", p[0], p[1]); }

}  // namespace

SvgPage::SvgPage(double width, double height, double font) : width_(width), height_(height), font_(font) {}

void SvgPage::line(const Vector2d& a, const Vector2d& b, const std::string& style) {
  shapes_ += fmt::format("<path d=\"M{} L{}\" {}/>\n", xy(a), xy(b), style);
  keep_clear(a, b);
}

void SvgPage::polygon(const std::vector<Vector2d>& corners, const std::string& style) {
  std::string d;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    d += fmt::format("{}{} ", i == 0 ? "M" : "L", xy(corners[i]));
    keep_clear(corners[i], corners[(i + 1) % corners.size()]);
  }
  shapes_ += fmt::format("<path d=\"{}z\" {}/>\n", d, style);
}

void SvgPage::circle(const Vector2d& at, double radius, const std::string& style) {
  shapes_ += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" {}/>\n", at[0], at[1], radius, style);
  const Vector2d r(radius, 0);
  keep_clear(at - r, at + r);
}

void SvgPage::arrow(const Vector2d& from, const Vector2d& to, const std::string& color, double width) {
  const double length = (to - from).norm();
  if (length < 1) return;
  const Vector2d u = (to - from) / length, n(-u[1], u[0]);
  const Vector2d neck = to - 9 * u;
  shapes_ += fmt::format("<path d=\"M{} L{}\" stroke=\"{}\" stroke-width=\"{}\"/>\n", xy(from), xy(neck), color, width);
  shapes_ +=
      fmt::format("<path d=\"M{} L{} L{} z\" fill=\"{}\"/>\n", xy(to), xy(neck + 4.5 * n), xy(neck - 4.5 * n), color);
  keep_clear(from, to);
}

void SvgPage::spring(const Vector2d& a, const Vector2d& b, const std::string& style) {
  const double length = (b - a).norm();
  if (length < 1) return;
  const Vector2d u = (b - a) / length, n(-u[1], u[0]);
  const double wave = std::min(7.0, 0.12 * length);
  std::string d = "M" + xy(a);
  for (int k = 0; k <= 12; ++k) {
    const double side = k == 0 || k == 12 ? 0 : k % 2 != 0 ? wave : -wave;
    d += " L" + xy(a + (0.15 + 0.7 * k / 12) * length * u + side * n);
  }
  shapes_ += fmt::format("<path d=\"{} L{}\" fill=\"none\" {}/>\n", d, xy(b), style);
  keep_clear(a + wave * n, b + wave * n);
  keep_clear(a - wave * n, b - wave * n);
}

void SvgPage::turn(const Vector2d& at, double radius, const std::string& color) {
  const Vector2d from = at + Vector2d(0, radius), to = at + Vector2d(radius, 0);
  shapes_ +=
      fmt::format("<path d=\"M{} A{r:.1f} {r:.1f} 0 1 1 {}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2.5\"/>\n",
                  xy(from), xy(to), color, fmt::arg("r", radius));
  shapes_ += fmt::format("<path d=\"M{} l-5.5 -8 h11 z\" fill=\"{}\"/>\n", xy(to + Vector2d(0, 7)), color);
  keep_clear(at - Vector2d(radius, radius), at + Vector2d(radius, radius));
  keep_clear(at - Vector2d(radius, -radius), at + Vector2d(radius, -radius));
}

void SvgPage::ground(const Vector2d& at) {
  shapes_ +=
      fmt::format("<path d=\"M{} l-10 17 h20 z\" fill=\"#eeeeee\" stroke=\"#555555\" stroke-width=\"1.5\"/>\n", xy(at));
  std::string d;
  for (int k = -2; k <= 2; ++k) d += fmt::format("M{} l-5 6", xy(at + Vector2d(5 * k + 2, 17)));
  shapes_ += fmt::format("<path d=\"{}\" stroke=\"#555555\" stroke-width=\"1.2\"/>\n", d);
  keep_clear(at, at + Vector2d(-10, 20));
  keep_clear(at, at + Vector2d(10, 20));
  keep_clear(at + Vector2d(-12, 20), at + Vector2d(12, 20));
}

void SvgPage::name(const Vector2d& at, const Vector2d& away, double clear, const std::string& text,
                   const std::string& color, bool bold) {
  names_.push_back({at, away.norm() > 0 ? Vector2d(away.normalized()) : Vector2d(0, 0), clear, text, color, bold});
}

double SvgPage::cost(const Box& b, const Name& name) const {
  double sum = 0;
  if (b.left < 2 || b.top < 2 || b.right > width_ - 2 || b.bottom > height_ - 2) sum += 5000;
  for (const auto& o : boxes_) {
    const double w = std::min(b.right, o.right) - std::max(b.left, o.left),
                 h = std::min(b.bottom, o.bottom) - std::max(b.top, o.top);
    if (w > 0 && h > 0) sum += 60 + w * h;
  }
  // The part of each line that lies inside the box.
  for (const auto& [p, q] : obstacles_) {
    double from = 0, to = 1;
    const Vector2d d = q - p;
    // Lines have a width.
    const double low[2] = {b.left - 3, b.top - 3}, high[2] = {b.right + 3, b.bottom + 3};
    for (int k = 0; k < 2; ++k) {
      if (std::abs(d[k]) < 1e-9) {
        if (p[k] < low[k] || p[k] > high[k]) to = -1;
        continue;
      }
      const double s = (low[k] - p[k]) / d[k], e = (high[k] - p[k]) / d[k];
      from = std::max(from, std::min(s, e));
      to = std::min(to, std::max(s, e));
    }
    if (to > from) sum += 12 + 1.5 * (to - from) * d.norm();
  }
  const Vector2d center(0.5 * (b.left + b.right), 0.5 * (b.top + b.bottom));
  const Vector2d off = center - name.at;
  sum += 0.35 * off.norm();
  if (off.norm() > 0 && name.away.norm() > 0) sum += 6 * (1 - off.normalized().dot(name.away));
  return sum;
}

void SvgPage::place(const Name& n) {
  const double w = (n.bold ? 0.68 : 0.60) * font_ * static_cast<double>(n.text.size()) + 4, h = font_ + 2;
  Box best{};
  double least = 1e300, distance = 0;
  const auto attempt = [&](const Vector2d& center, double off) {
    const Box b{center[0] - w / 2, center[1] - h / 2, center[0] + w / 2, center[1] + h / 2};
    const double c = cost(b, n);
    if (c >= least) return;
    least = c;
    best = b;
    distance = off;
  };
  if (n.clear == 0) attempt(n.at, 0);
  for (const double off : {2.0, 8.0, 16.0, 26.0, 40.0, 60.0})
    for (int k = 0; k < 24; ++k) {
      const double angle = 2 * std::numbers::pi * k / 24;
      const Vector2d u(std::cos(angle), std::sin(angle));
      // The box's nearest point in that direction stands at the distance wanted.
      const double reach = std::min(std::abs(u[0]) > 1e-9 ? w / 2 / std::abs(u[0]) : 1e9,
                                    std::abs(u[1]) > 1e-9 ? h / 2 / std::abs(u[1]) : 1e9);
      attempt(n.at + (n.clear + off + reach) * u, off);
    }
  boxes_.push_back(best);
  if (distance > 30) {
    const Vector2d end(std::clamp(n.at[0], best.left, best.right), std::clamp(n.at[1], best.top, best.bottom));
    const Vector2d start = n.at + std::max(n.clear - 2, 0.0) * (end - n.at).normalized();
    names_text_ +=
        fmt::format("<path d=\"M{} L{}\" stroke=\"{}\" stroke-width=\"0.7\"/>\n", xy(start), xy(end), n.color);
  }
  names_text_ += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\" fill=\"{}\"{}>{}</text>\n",
                             0.5 * (best.left + best.right), best.bottom - 4, n.color,
                             n.bold ? " font-weight=\"bold\"" : "", escaped(n.text));
}

std::string SvgPage::head() const {
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {w:.0f} {h:.0f}\" width=\"{w:.0f}\" "
      "height=\"{h:.0f}\" "
      "font-family=\"Helvetica, Arial, sans-serif\" font-size=\"{}\">\n<rect width=\"{w:.0f}\" "
      "height=\"{h:.0f}\" "
      "fill=\"#ffffff\"/>\n",
      font_, fmt::arg("w", width_), fmt::arg("h", height_));
}

std::string SvgPage::text() {
  for (const auto& n : names_) place(n);
  names_.clear();
  return head() + shapes_ + names_text_ + "</svg>\n";
}

}  // namespace costate::app
