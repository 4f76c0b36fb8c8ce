#include "figure.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

namespace costate::app {

namespace {

class FigureMaker {
 public:
  FigureMaker(const Mechanism& m, const SceneNumbers& scene, const Eigen::VectorXd& q, const Eigen::VectorXd& v,
              const Eigen::VectorXd& z, double t)
      : m_(m), scene_(scene), q_(q), v_(v), z_(z), t_(t), numbers_(m.base_numbers()) {
    for (std::size_t i = 0; i < m.numbers().size(); ++i) paths_[m.numbers()[i].path] = static_cast<int>(i);
    for (int i = 0; i < m.coordinate_count(); ++i) {
      const std::string& name = m.coordinates()[i].name;
      indices_[name] = i;
      owners_.push_back(name.substr(0, name.rfind('.')));
    }
    for (const auto& owner : std::set<std::string>(owners_.begin(), owners_.end())) find_frame(owner);
    for (const auto& p : m.points()) add_point(p);
    for (const auto& p : m.spatial_points()) add_point(p);
    find_size();
    for (std::size_t k = 0; k < points_.size(); ++k) figure_.places.push_back(points_[k].place);
    const auto gravity = [&](const char* axis) { return number(fmt::format("gravity.{}_m_per_s2", axis)).value_or(0); };
    if (figure_.spatial && gravity("z") == 0 && (gravity("y") != 0 || gravity("x") != 0))
      figure_.up = std::abs(gravity("y")) >= std::abs(gravity("x")) ? 1 : 0;
  }

  Figure make() {
    for (const auto& b : m_.bodies()) add_body(*b);
    for (std::size_t i = 0; i < m_.constraints().size(); ++i) add_constraint(*m_.constraints()[i]);
    for (std::size_t i = 0; i < m_.forces().size(); ++i) add_force(*m_.forces()[i], m_.state_offsets()[i]);
    return std::move(figure_);
  }

 private:
  struct Point {
    Place place;
    std::vector<int> coordinates, numbers;
    bool free = false;
  };

  std::optional<double> number(const std::string& path) const {
    const auto at = paths_.find(path);
    return at == paths_.end() ? scene_(path) : std::optional(numbers_[at->second]);
  }
  std::optional<double> coordinate(const std::string& name) const {
    const auto at = indices_.find(name);
    return at == indices_.end() ? std::nullopt : std::optional(q_[at->second]);
  }

  /// Of a body in the sense of the coordinates NAME.x, NAME.y and NAME.angle or NAME.z, NAME.e0, ...
  void find_frame(const std::string& owner) {
    const auto x = coordinate(owner + ".x"), y = coordinate(owner + ".y"), z = coordinate(owner + ".z"),
               e0 = coordinate(owner + ".e0"), angle = coordinate(owner + ".angle");
    const bool natural = coordinate(owner + ".u1x").has_value();
    BodyFrame f;
    if (!x || !y || (!angle && !e0 && !natural)) return;
    f.origin = {*x, *y, z.value_or(0)};
    if (e0) {
      const auto e = [&](const char* i) { return coordinate(owner + i).value_or(0); };
      f.rotation = Eigen::Quaterniond(*e0, e(".e1"), e(".e2"), e(".e3")).normalized().toRotationMatrix();
    } else if (natural) {  // unit vectors as coordinates
      for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k)
          f.rotation(k, i) = coordinate(fmt::format("{}.u{}{}", owner, i + 1, "xyz"[k])).value_or(0);
    } else {
      f.rotation = Eigen::AngleAxisd(*angle, Vector3d::UnitZ()).toRotationMatrix();
    }
    if (!angle) figure_.spatial = true;
    frames_[owner] = f;
  }

  template <class P>
  void add_point(const P& p) {
    std::vector<double> q, n;
    for (const int i : p.coordinates()) q.push_back(q_[i]);
    for (const int k : p.numbers()) n.push_back(numbers_[k]);
    Vector3d r = Vector3d::Zero();
    if constexpr (P::Vector::RowsAtCompileTime == 2) {
      p.position(q.data(), n.data(), r[0], r[1]);
    } else {
      p.position(q.data(), n.data(), r.data());
      figure_.spatial = true;
    }
    points_.push_back({{p.name(), r, p.coordinates().empty()}, p.coordinates(), p.numbers(), p.numbers().empty()});
  }

  void find_size() {
    Eigen::AlignedBox3d box;
    for (const auto& p : points_) box.extend(p.place.at);
    for (const auto& [name, f] : frames_) box.extend(f.origin);
    if (!box.isEmpty()) figure_.size = box.sizes().maxCoeff();
    if (!(figure_.size > 0)) figure_.size = 1;
  }

  /// The points that an element joins: those whose numbers it has, and free ones whose coordinates it has
  /// besides.
  std::vector<const Point*> points_of(const Element& e) const {
    const std::set<int> numbers(e.numbers().begin(), e.numbers().end());
    std::multiset<int> coordinates(e.coordinates().begin(), e.coordinates().end());
    const auto take = [&](const Point& p) {
      for (const int c : p.coordinates)
        if (const auto at = coordinates.find(c); at != coordinates.end()) coordinates.erase(at);
    };
    std::vector<const Point*> r;
    for (const auto& p : points_)
      if (!p.free && std::all_of(p.numbers.begin(), p.numbers.end(), [&](int k) { return numbers.count(k) > 0; })) {
        take(p);
        r.push_back(&p);
      }
    for (const auto& p : points_)
      if (p.free && !p.coordinates.empty() &&
          std::all_of(p.coordinates.begin(), p.coordinates.end(), [&](int c) { return coordinates.count(c) > 0; })) {
        take(p);
        r.push_back(&p);
      }
    // In the element's own order, as far as numbers tell it.
    const auto first = [&](const Point* p) {
      return p->free ? e.numbers().end() : std::find(e.numbers().begin(), e.numbers().end(), p->numbers.front());
    };
    std::stable_sort(r.begin(), r.end(), [&](const Point* a, const Point* b) { return first(a) < first(b); });
    return r;
  }

  void add_body(const Body& e) {
    BodyShape shape{e.name(), {}, false, {}};
    const auto frame = frames_.find(e.name());
    if (frame == frames_.end() || e.coordinates().size() < 3 || owners_[e.coordinates()[0]] != e.name()) {
      // Between points, or at one: not a frame of its own.
      for (const Point* p : points_of(e)) shape.corners.push_back(p->place.at);
      shape.slender = shape.corners.size() == 2;
      if (!shape.corners.empty()) figure_.bodies.push_back(shape);
      return;
    }
    shape.frame = frame->second;
    for (const auto& p : points_)
      if (!p.coordinates.empty() && p.coordinates[0] == e.coordinates()[0]) shape.corners.push_back(p.place.at);
    double extent = 0;
    for (const auto& c : shape.corners) extent = std::max(extent, (c - shape.corners[0]).norm());
    if (extent < 0.02 * figure_.size) add_box(e, frame->second, shape.corners);
    figure_.bodies.push_back(shape);
  }

  /// The uniform box with the body's moments of inertia, if it has some; else a small cube.
  void add_box(const Body& e, const BodyFrame& f, std::vector<Vector3d>& corners) const {
    const auto value = [&](const char* key) { return number(e.path() + "." + key).value_or(0); };
    const double m = value("mass_kg");
    const Vector3d J(value("inertia_xx_kg_m2"), value("inertia_yy_kg_m2"), value("inertia_zz_kg_m2"));
    const Vector3d c(value("center_x_m"), value("center_y_m"), value("center_z_m"));
    Vector3d side = Vector3d::Constant(0.08 * figure_.size);
    if (m > 0 && J.maxCoeff() > 0)
      for (int k = 0; k < 3; ++k) side[k] = std::sqrt(std::max(1e-4, 6 * (J.sum() - 2 * J[k]) / m));
    const bool planar = !number(e.path() + ".inertia_xx_kg_m2");
    for (int k = 0; k < (planar ? 4 : 8); ++k) {
      Vector3d s((k & 1) != 0 ? 1 : -1, (k & 2) != 0 ? 1 : -1, planar ? 0 : (k & 4) != 0 ? 1 : -1);
      corners.push_back(f.origin + f.rotation * (c + 0.5 * s.cwiseProduct(side)));
    }
  }

  /// The axis of a joint or a force, fixed in the body of its first point.
  std::optional<Vector3d> axis_of(const Element& e, const std::vector<const Point*>& points) const {
    for (const char* key : {"axis_first", "axis"}) {
      Vector3d a;
      bool there = true;
      for (int k = 0; k < 3; ++k) {
        const auto x = number(fmt::format("{}.{}[{}]", e.path(), key, k));
        there = there && x.has_value();
        a[k] = x.value_or(0);
      }
      if (!there || a.norm() == 0) continue;
      if (!points.empty() && !points[0]->coordinates.empty())
        if (const auto f = frames_.find(owners_[points[0]->coordinates[0]]); f != frames_.end())
          a = f->second.rotation * a;
      return a.normalized();
    }
    return {};
  }

  /// Of a coordinate x, y or z.
  std::optional<Vector3d> direction_of(int coordinate) const {
    const std::string& name = m_.coordinates()[coordinate].name;
    const auto axis = std::string("xyz").find(name.substr(name.rfind('.') + 1));
    if (axis == std::string::npos) return {};
    return Vector3d(Vector3d::Unit(static_cast<Eigen::Index>(axis)));
  }

  /// Where something on coordinates alone stands.
  std::optional<Vector3d> anchor(int coordinate) const {
    const std::string& owner = owners_[coordinate];
    if (const auto f = frames_.find(owner); f != frames_.end()) return f->second.origin;
    for (const auto& p : points_)
      if (p.place.name == owner) return p.place.at;
    for (const auto& c : m_.constraints())  // an angle of a line, the angle of a joint
      if (c->name() == owner && defines(*c))
        if (const auto points = points_of(*c); !points.empty()) return points[0]->place.at;
    return {};
  }
  /// Whether a constraint says what a coordinate of its own is.
  bool defines(const Constraint& c) const {
    return std::any_of(c.coordinates().begin(), c.coordinates().end(), [&](int i) { return owners_[i] == c.name(); });
  }

  Eigen::Matrix3d turned(const std::vector<const Point*>& points) const {
    for (const Point* p : points)
      if (!p->coordinates.empty())
        if (const auto f = frames_.find(owners_[p->coordinates[0]]); f != frames_.end()) return f->second.rotation;
    return Eigen::Matrix3d::Identity();
  }

  static std::vector<Vector3d> positions(const std::vector<const Point*>& points) {
    std::vector<Vector3d> r;
    for (const Point* p : points) r.push_back(p->place.at);
    return r;
  }

  void add_constraint(const Constraint& c) {
    if (defines(c) || drawn_as_body(c)) return;
    const auto points = points_of(c);
    LinkShape shape{c.name(), LinkRole::guide, positions(points), axis_of(c, points)};
    if (points.empty()) {
      const auto at = anchor(c.coordinates().back());
      if (!at) return;
      shape.at = {*at};
      shape.role = LinkRole::couple;
      shape.direction = direction_of(c.coordinates().back());
    } else if (shape.at.size() == 2) {
      const bool apart = (shape.at[1] - shape.at[0]).norm() > 1e-4 * figure_.size;
      shape.role = c.rheonomic()   ? LinkRole::driver
                   : !apart        ? LinkRole::joint
                   : c.rows() == 1 ? LinkRole::rod
                                   : LinkRole::guide;
    } else if (shape.at.size() == 1) {
      shape.role = LinkRole::joint;
    }
    // A joint of several constraints is drawn once.
    if (!links_.insert(c.path()).second) {
      for (auto& other : figure_.links)
        if (other.name == c.name() && !other.direction) other.direction = shape.direction;
      return;
    }
    figure_.links.push_back(shape);
  }
  bool drawn_as_body(const Constraint& c) const {
    return std::any_of(m_.bodies().begin(), m_.bodies().end(), [&](const auto& b) { return b->path() == c.path(); });
  }

  void add_force(const Force& f, int state) {
    const auto points = points_of(f);
    LinkShape shape{f.name(), LinkRole::spring, positions(points), {}};
    shape.turned = turned(points);
    if (const auto angle = number(f.path() + ".ground_angle_rad"); angle && !points.empty()) {
      add_contact(f, points, *angle);
      return;
    }
    if (const auto other = number(f.path() + ".other_radius_m"); other && points.size() == 2) {
      shape.role = LinkRole::pair;
      shape.radius = number(f.path() + ".radius_m").value_or(0);
      shape.other_radius = *other;
    } else if (points.empty()) {
      if (f.coordinates().empty()) return;
      const auto at = anchor(f.coordinates().back());
      if (!at) return;
      shape.at = {*at};
      shape.role = LinkRole::couple;
      shape.direction = direction_of(f.coordinates().back());
    } else if (points.size() == 1) {
      shape.role = LinkRole::load;
      const Vector3d force = resultant(f, state);
      if (force.norm() > 0) shape.direction = force.normalized();
      const auto radius = number(f.path() + ".radius_m");
      if (const auto axis = axis_of(f, points); axis && radius) {
        shape.role = LinkRole::wheel;
        shape.direction = axis;
        shape.radius = *radius;
      }
    }
    figure_.links.push_back(shape);
  }

  /// Its points on the first body, and the ground below the first of them.
  void add_contact(const Force& f, const std::vector<const Point*>& points, double angle) {
    const int up = figure_.spatial ? 2 : 1;
    const Vector3d along = std::cos(angle) * Vector3d::UnitX() + std::sin(angle) * Vector3d::Unit(up);
    const Vector3d normal = std::cos(angle) * Vector3d::Unit(up) - std::sin(angle) * Vector3d::UnitX();
    LinkShape shape{f.name(), LinkRole::contact, {}, along, number(f.path() + ".radius_m").value_or(0)};
    for (const Point* p : points)
      if (!p->coordinates.empty() && owners_[p->coordinates[0]] == owners_[f.coordinates().front()])
        shape.at.push_back(p->place.at);
    if (shape.at.empty()) return;
    shape.turned = turned(points);
    const Vector3d origin = number(f.path() + ".ground_height_m").value_or(0) * Vector3d::Unit(up) +
                            number(f.path() + ".ground_x_m").value_or(0) * Vector3d::UnitX();
    shape.at.push_back(shape.at.front() - normal.dot(shape.at.front() - origin) * normal);
    figure_.links.push_back(shape);
  }

  /// The sum of the generalized forces on coordinates x, y and z.
  Vector3d resultant(const Force& f, int state) const {
    std::vector<double> q, v, p, Q(f.coordinates().size() + 1), zdot(static_cast<std::size_t>(f.states()) + 1);
    for (const int i : f.coordinates()) {
      q.push_back(q_[i]);
      v.push_back(v_[i]);
    }
    for (const int k : f.numbers()) p.push_back(numbers_[k]);
    LocalState s;
    s.t = t_;
    s.q = q.data();
    s.v = v.data();
    s.z = z_.data() + state;
    s.p = p.data();
    f.calc_force(s, Q.data(), zdot.data());
    Vector3d sum = Vector3d::Zero();
    for (std::size_t i = 0; i < q.size(); ++i) {
      if (const auto axis = direction_of(f.coordinates()[i])) sum += Q[i] * *axis;
    }
    return sum;
  }

  const Mechanism& m_;
  const SceneNumbers& scene_;
  const Eigen::VectorXd &q_, &v_, &z_;
  double t_;
  std::vector<double> numbers_;
  std::map<std::string, int> paths_, indices_;
  std::vector<std::string> owners_;  // of each coordinate: what stands before its last dot
  std::map<std::string, BodyFrame> frames_;
  std::vector<Point> points_;
  std::set<std::string> links_;
  Figure figure_;
};

}  // namespace

Figure make_figure(const Mechanism& mechanism, const SceneNumbers& numbers, const Eigen::VectorXd& q,
                   const Eigen::VectorXd& v, const Eigen::VectorXd& z, double t) {
  return FigureMaker(mechanism, numbers, q, v, z, t).make();
}

}  // namespace costate::app
