#include "drawing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "svg_page.h"

namespace costate::app {

namespace {

constexpr const char* kBody = "#4a6fa5";
constexpr const char* kBodyName = "#2c4a77";
constexpr const char* kSpring = "#c8641e";
constexpr const char* kSpringName = "#a34d12";
constexpr const char* kLoad = "#a3195b";
constexpr const char* kJoint = "#1f6f4a";
constexpr const char* kPoint = "#222222";

/// Orthographic: right and up on the page, and towards the viewer.
struct View {
  Vector3d right, up, near;
};

View view_of(const std::string& name, int up) {
  if (name == "xy") return {Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ()};
  if (name == "xz") return {Vector3d::UnitX(), Vector3d::UnitZ(), -Vector3d::UnitY()};
  if (name == "yz") return {Vector3d::UnitY(), Vector3d::UnitZ(), Vector3d::UnitX()};
  // The two horizontal axes come towards the viewer, to the left and to the right; turned a little from the
  // symmetric view, in which edges of cubes hide each other.
  const Vector3d z = Vector3d::Unit(up), x = Vector3d::Unit((up + 1) % 3), y = Vector3d::Unit((up + 2) % 3);
  View v;
  v.near = (x * 0.75 + y * 0.52 + z * 0.45).normalized();
  v.right = z.cross(v.near).normalized();
  v.up = v.near.cross(v.right);
  return v;
}

std::vector<Vector2d> hull(std::vector<Vector2d> p) {
  std::sort(p.begin(), p.end(), [](const auto& a, const auto& b) { return a[0] != b[0] ? a[0] < b[0] : a[1] < b[1]; });
  std::vector<Vector2d> h;
  for (int pass = 0; pass < 2; ++pass) {
    const std::size_t start = h.size();
    for (const auto& c : p) {
      while (h.size() >= start + 2) {
        const Vector2d a = h[h.size() - 1] - h[h.size() - 2], b = c - h[h.size() - 1];
        if (a[0] * b[1] - a[1] * b[0] > 1e-9) break;
        h.pop_back();
      }
      h.push_back(c);
    }
    h.pop_back();
    std::reverse(p.begin(), p.end());
  }
  return h;
}

class Drawing {
 public:
  /// On a page that has room for all of `room`.
  Drawing(const Figure& figure, const std::vector<Figure>& room, const DrawOptions& options)
      : figure_(figure),
        names_(!options.no_names),
        view_(view_of(options.view.empty() ? (figure.spatial ? "isometric" : "xy") : options.view, figure.up)),
        page_(layout(room, options)) {}

  SvgPage page() {
    draw_bodies();
    for (const auto& l : figure_.links) draw_line(l);
    for (const auto& p : figure_.places)
      if (p.ground) page_.ground(at(p.at));
    for (const auto& l : figure_.links) draw_mark(l);
    draw_points();
    if (figure_.spatial) draw_axes();
    return std::move(page_);
  }

 private:
  SvgPage layout(const std::vector<Figure>& room, const DrawOptions& options) {
    Eigen::AlignedBox2d box;
    const auto extend = [&](const Vector3d& r) { box.extend(flat(r)); };
    for (const auto& f : room) {
      for (const auto& p : f.places) extend(p.at);
      for (const auto& b : f.bodies)
        for (const auto& c : b.corners) extend(c);
      for (const auto& l : f.links)
        for (const auto& c : l.at)
          for (const double r : {-l.radius, l.radius}) {
            extend(c + r * view_.up);
            extend(c + r * view_.right);
          }
    }
    if (box.isEmpty()) box.extend(Vector2d::Zero());
    const double margin = 70;
    const double span = std::max(box.sizes().maxCoeff(), 1e-6 * figure_.size);
    scale_ = (options.width - 2 * margin) / span;
    const Vector2d sizes = box.sizes() * scale_;
    const double width = std::max(sizes[0], 200.0) + 2 * margin, height = std::max(sizes[1], 100.0) + 2 * margin;
    center_ = box.center();
    middle_ = Vector2d(width / 2, height / 2);
    corner_ = Vector2d(44, height - 40);
    return SvgPage(width, height, figure_.places.size() > 30 ? 11 : 14);  // many names are small
  }
  Vector2d flat(const Vector3d& r) const { return {view_.right.dot(r), -view_.up.dot(r)}; }
  Vector2d at(const Vector3d& r) const { return middle_ + scale_ * (flat(r) - center_); }
  Vector2d away(const Vector2d& p) const { return p - middle_; }
  void name(const Vector2d& p, double clear, const std::string& text, const char* color, bool bold = false) {
    if (names_) page_.name(p, away(p), clear, text, color, bold);
  }
  static Vector2d mean(const std::vector<Vector2d>& p) {
    Vector2d sum = Vector2d::Zero();
    for (const auto& x : p) sum += x;
    return sum / static_cast<double>(p.size());
  }

  void draw_bodies() {
    std::vector<const BodyShape*> order;
    for (const auto& b : figure_.bodies) order.push_back(&b);
    const auto depth = [&](const BodyShape* b) {
      double sum = 0;
      for (const auto& c : b->corners) sum += view_.near.dot(c);
      return b->corners.empty() ? 0 : sum / static_cast<double>(b->corners.size());
    };
    std::stable_sort(order.begin(), order.end(), [&](auto* a, auto* b) { return depth(a) < depth(b); });
    for (const auto* b : order) draw_body(*b);
  }

  void draw_body(const BodyShape& b) {
    std::vector<Vector2d> p;
    for (const auto& c : b.corners) p.push_back(at(c));
    if (p.empty()) return;
    double extent = 0;
    std::pair<Vector2d, Vector2d> ends(p[0], p[0]);
    for (const auto& x : p)
      for (const auto& y : p)
        if ((x - y).norm() > extent) {
          extent = (x - y).norm();
          ends = {x, y};
        }
    if (extent < 6) {  // a mass at a point
      page_.circle(p[0], 11, fmt::format("fill=\"{}\"", kBody));
      return name(p[0], 11, b.name, kBodyName);
    }
    const auto h = hull(p);
    double area = 0;
    for (std::size_t i = 0; i < h.size(); ++i) {
      const Vector2d &x = h[i], &y = h[(i + 1) % h.size()];
      area += 0.5 * (x[0] * y[1] - x[1] * y[0]);
    }
    if (std::abs(area) < 4 * extent) {
      page_.line(ends.first, ends.second,
                 fmt::format("stroke=\"{}\" stroke-width=\"7\" stroke-linecap=\"round\"", kBody));
      name(0.55 * ends.first + 0.45 * ends.second, 5, b.name, kBodyName);
    } else {
      page_.polygon(h, fmt::format("fill=\"#c9d8ea\" fill-opacity=\"0.6\" stroke=\"{}\" stroke-width=\"2.5\" "
                                   "stroke-linejoin=\"round\"",
                                   kBody));
      name(mean(h), 0, b.name, kBodyName);
    }
  }

  /// What lies below the joints: springs, rods, guides.
  void draw_line(const LinkShape& l) {
    std::vector<Vector2d> p;
    for (const auto& r : l.at) p.push_back(at(r));
    if (p.size() < 2 || l.role == LinkRole::joint || l.role == LinkRole::contact || l.role == LinkRole::pair) return;
    const char* color = kBodyName;
    if (l.role == LinkRole::spring) {
      color = kSpringName;
      for (std::size_t i = 1; i < p.size(); ++i)
        page_.spring(p[i - 1], p[i],
                     fmt::format("stroke=\"{}\" stroke-width=\"2\" stroke-linejoin=\"round\"", kSpring));
    } else if (l.role == LinkRole::rod) {
      page_.line(p[0], p[1], fmt::format("stroke=\"{}\" stroke-width=\"3\"", kBody));
    } else if (l.role == LinkRole::driver) {
      color = kLoad;
      page_.arrow(0.5 * (p[0] + p[1]), p[1], kLoad);
      page_.arrow(0.5 * (p[0] + p[1]), p[0], kLoad);
    } else {
      color = kJoint;
      // Pairs of points are lines that are compared; of three points the first belongs to both lines.
      const bool pairs = p.size() % 2 == 0;
      for (std::size_t i = 0; i + 1 < p.size(); i += pairs ? 2 : 1)
        page_.line(p[pairs ? i : 0], p[i + 1],
                   fmt::format("stroke=\"{}\" stroke-width=\"1.5\" stroke-dasharray=\"6 4\"", kJoint));
    }
    // Constraints of one name are one thing to the reader: a rod and the plane that it stays in.
    if (l.role == LinkRole::spring || lines_.insert(l.name).second)
      name(0.5 * (p[0] + p[1]), l.role == LinkRole::spring ? 9 : 4, l.name, color);
  }

  /// What lies above: joints with their axes, loads, couples.
  void draw_mark(const LinkShape& l) {
    const Vector2d p = at(l.at[0]);
    if (l.role == LinkRole::joint) {
      if (l.direction) {
        const Vector2d axis = Vector2d(view_.right.dot(*l.direction), -view_.up.dot(*l.direction));
        page_.line(p - 24 * axis, p + 24 * axis,
                   fmt::format("stroke=\"{}\" stroke-width=\"1.6\" stroke-dasharray=\"9 3 2 3\"", kJoint));
      }
      page_.circle(p, 6.5, fmt::format("fill=\"#ffffff\" stroke=\"{}\" stroke-width=\"2\"", kJoint));
      name(p, 9, l.name, kJoint);
    } else if (l.role == LinkRole::load) {
      Vector2d u(1, 0);
      if (l.direction) u = Vector2d(view_.right.dot(*l.direction), -view_.up.dot(*l.direction));
      if (u.norm() < 0.2) u = Vector2d(0.2, 0);
      page_.arrow(p, p + 44 * u, kLoad);
      name(p + 40 * u, 7, l.name, kLoad);
    } else if (l.role == LinkRole::wheel) {
      draw_wheel(l);
    } else if (l.role == LinkRole::contact) {
      draw_contact(l);
    } else if (l.role == LinkRole::pair) {
      for (const auto& [place, radius] : {std::pair(l.at[0], l.radius), std::pair(l.at[1], l.other_radius)})
        if (radius > 0)
          page_.circle(at(place), radius * scale_, "fill=\"#888888\" fill-opacity=\"0.12\" stroke=\"#555555\"");
    } else if (l.role == LinkRole::couple && l.direction) {
      Vector2d u(view_.right.dot(*l.direction), -view_.up.dot(*l.direction));
      if (u.norm() < 0.2) u = Vector2d(0.2, 0);
      page_.arrow(p, p + 32 * u, kLoad);
      page_.arrow(p, p - 32 * u, kLoad);
      name(p, 12, l.name, kLoad);
    } else if (l.role == LinkRole::couple) {
      page_.turn(p, 16, kLoad);
      name(p, 19, l.name, kLoad);
    }
  }

  void draw_contact(const LinkShape& l) {
    for (std::size_t i = 0; i + 1 < l.at.size() && l.radius > 0; ++i)
      page_.circle(at(l.at[i]), l.radius * scale_, "fill=\"#888888\" fill-opacity=\"0.12\" stroke=\"#555555\"");
    const Vector3d reach = 0.25 * figure_.size * *l.direction;
    page_.line(at(l.at.back() - reach), at(l.at.back() + reach), "stroke=\"#555555\" stroke-width=\"1.5\"");
    name(at(l.at.back()), 9, l.name, kLoad);
  }

  void draw_wheel(const LinkShape& l) {
    const Vector3d a = l.direction->unitOrthogonal(), b = l.direction->cross(a);
    std::vector<Vector2d> rim;
    for (int k = 0; k < 48; ++k) {
      const double angle = 2 * std::numbers::pi * k / 48;
      rim.push_back(at(l.at[0] + l.radius * (std::cos(angle) * a + std::sin(angle) * b)));
    }
    page_.polygon(rim, "fill=\"#888888\" fill-opacity=\"0.15\" stroke=\"#555555\" stroke-width=\"2\"");
    name(at(l.at[0]), 9, l.name, kLoad);
  }

  /// Points of one place share a name on the page; one that a joint has already is left out.
  void draw_points() {
    std::set<std::string> joints;
    for (const auto& l : figure_.links)
      if (l.role == LinkRole::joint) joints.insert(l.name);
    std::map<std::pair<long, long>, std::vector<std::string>> named;
    std::vector<std::pair<Vector2d, std::pair<long, long>>> order;
    for (const auto& place : figure_.places) {
      const Vector2d p = at(place.at);
      const std::pair key(std::lround(p[0] / 3), std::lround(p[1] / 3));
      auto& names = named[key];
      if (names.empty()) {
        order.emplace_back(p, key);
        page_.circle(p, 3.6, fmt::format("fill=\"#ffffff\" stroke=\"{}\" stroke-width=\"1.5\"", kPoint));
      }
      names.push_back(joints.count(place.name) > 0 ? "" : place.name);
    }
    for (const auto& [p, key] : order) {
      std::vector<std::string> names;
      for (const auto& n : named[key])
        if (!n.empty()) names.push_back(n);
      if (names.empty()) continue;
      std::string text = names[0];
      if (names.size() > 1) text += ", " + names[1];
      if (names.size() > 2) text += ", ...";
      name(p, 7, text, kPoint, true);
    }
  }

  void draw_axes() {
    for (int k = 0; k < 3; ++k) {
      const Vector3d e = Vector3d::Unit(k);
      const Vector2d u = Vector2d(view_.right.dot(e), -view_.up.dot(e));
      if (u.norm() < 0.1) continue;
      page_.arrow(corner_, corner_ + 30 * u, "#888888", 1.5);
      page_.name(corner_ + 30 * u, u, 0, std::string(1, "xyz"[k]), "#888888");
    }
  }

  const Figure& figure_;
  bool names_;
  View view_;
  double scale_ = 1;
  Vector2d center_ = Vector2d::Zero(), middle_ = Vector2d::Zero(), corner_ = Vector2d::Zero();
  std::set<std::string> lines_;
  SvgPage page_;  // after what layout() sets
};

}  // namespace

std::string drawing(const Figure& figure, const DrawOptions& options) {
  return Drawing(figure, {figure}, options).page().text();
}

std::string moving_drawing(const std::vector<Figure>& figures, const std::vector<double>& times,
                           const DrawOptions& options, double speed) {
  const double t0 = times.front();
  const double span = std::max(times.back() - t0, 1e-9), duration = span / speed;
  std::string frames, head;
  for (std::size_t i = 0; i < figures.size(); ++i) {
    const SvgPage page = Drawing(figures[i], figures, options).page();
    if (i == 0) head = page.head();
    // Shown from its own time to the next one's; the last one is where the motion begins again.
    const double from = (times[i] - t0) / span, to = i + 1 < times.size() ? (times[i + 1] - t0) / span : 1;
    std::string shown;
    if (figures.size() > 1) {
      std::string values = from > 0 ? "hidden;visible" : "visible",
                  key_times = from > 0 ? fmt::format("0;{:.6f}", from) : "0";
      if (to < 1) {
        values += ";hidden";
        key_times += fmt::format(";{:.6f}", to);
      }
      shown = fmt::format(
          "<animate attributeName=\"visibility\" calcMode=\"discrete\" dur=\"{:.6g}s\" "
          "repeatCount=\"indefinite\" values=\"{}\" keyTimes=\"{}\"/>\n",
          duration, values, key_times);
    }
    // Viewers that play nothing show the first one.
    frames += fmt::format("<g visibility=\"{}\">\n<title>t = {:.6g} s</title>\n{}{}</g>\n",
                          i == 0 ? "visible" : "hidden", times[i], shown, page.shapes());
  }
  return head + frames + "</svg>\n";
}

}  // namespace costate::app
