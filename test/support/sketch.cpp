#include <support/sketch.h>

#include <cmath>

#include "costate/element/body/planar_bar.h"
#include "costate/element/body/planar_body.h"
#include "costate/element/body/point_mass.h"
#include "costate/element/constraint/bar_angle.h"
#include "costate/element/constraint/coincidence.h"
#include "costate/element/constraint/coordinate_driver.h"
#include "costate/element/constraint/distance.h"
#include "costate/element/constraint/distance_driver.h"
#include "costate/element/constraint/two_vectors.h"
#include "costate/element/force/point_force.h"

namespace costate::test {

namespace {
Keys prefixed(const std::string& prefix, const Keys& keys) {
  Keys r;
  for (const auto& [key, value] : keys) r.emplace_back(prefix + "." + key, value);
  return r;
}
void append(Keys& to, const Keys& more) { to.insert(to.end(), more.begin(), more.end()); }
void append(std::vector<int>& to, const std::vector<int>& more) { to.insert(to.end(), more.begin(), more.end()); }

Keys spring_keys(const Sketch::Spring& s) {
  Keys k = {{"stiffness", s.stiffness}, {"natural", s.natural}, {"damping", s.damping}, {"preload", s.preload}};
  append(k, prefixed("spring", s.spring.keys));
  append(k, prefixed("damper", s.damper.keys));
  return k;
}
}  // namespace

Law polynomial(const std::vector<double>& coefficients) {
  Keys keys;
  for (std::size_t i = 0; i < coefficients.size(); ++i) keys.emplace_back("c" + std::to_string(i), coefficients[i]);
  return {std::make_shared<PolynomialLaw>(static_cast<int>(coefficients.size())), keys};
}
Law sine(double mean, double amplitude, double omega, double phase) {
  return {std::make_shared<SineLaw>(), {{"mean", mean}, {"amplitude", amplitude}, {"omega", omega}, {"phase", phase}}};
}
Law smooth_step(double x0, double x1, double y0, double y1) {
  return {std::make_shared<SmoothStepLaw>(), {{"x0", x0}, {"x1", x1}, {"y0", y0}, {"y1", y1}}};
}
Law table(const std::vector<double>& x, const std::vector<double>& y) {
  Keys keys;
  for (std::size_t i = 0; i < y.size(); ++i) keys.emplace_back("y" + std::to_string(i), y[i]);
  return {std::make_shared<TableLaw>(x), keys};
}

PlanarVector Sketch::line(const std::string& from, const std::string& to) const {
  return {builder.point(from), builder.point(to)};
}

std::vector<int> Sketch::numbers(const std::string& path, const Keys& keys) {
  std::vector<int> r;
  for (const auto& [key, value] : keys) r.push_back(builder.add_number(path + "." + key, value));
  return r;
}

std::vector<int> Sketch::coordinates_of(const std::vector<std::string>& names) const {
  std::vector<int> r;
  for (const auto& name : names) r.push_back(builder.coordinate(name));
  return r;
}

void Sketch::parameter(const std::string& name, const std::vector<std::pair<std::string, double>>& bindings) {
  Parameter p;
  p.name = name;
  for (const auto& [path, factor] : bindings) p.bindings.emplace_back(builder.number(path), factor);
  const double value = builder.number_value(p.bindings.front().first) / p.bindings.front().second;
  p.scale = value != 0 ? std::abs(value) : 1;
  builder.add_parameter(p);
}

void Sketch::give(const std::vector<std::string>& coordinates) {
  for (const auto& c : coordinates) {
    builder.give_position(c);
    builder.give_velocity(c);
  }
}

void Sketch::ground(const std::string& name, double x, double y) {
  builder.add_point({PlanarPoint::Kind::ground, name, {}, numbers("point." + name, {{"x_m", x}, {"y_m", y}})});
}

void Sketch::point(const std::string& name, double x, double y, double vx, double vy) {
  const auto k = numbers("point." + name, {{"x_m", x}, {"y_m", y}, {"vx_m_per_s", vx}, {"vy_m_per_s", vy}});
  const int cx = builder.add_coordinate(name + ".x", "m", k[0], k[2]);
  const int cy = builder.add_coordinate(name + ".y", "m", k[1], k[3]);
  builder.add_point({PlanarPoint::Kind::free, name, {cx, cy}, {}});
}

void Sketch::attach(const std::string& name, const std::string& on, double x, double y) {
  const AttachmentFrame& frame = builder.frame(on);
  auto n = numbers("point." + name, {{"x_m", x}, {"y_m", y}});
  append(n, frame.numbers);
  builder.add_point({frame.kind, name, frame.coordinates, n});
}

void Sketch::bar(const std::string& name, const std::string& from, const std::string& to, double mass) {
  add_bar(name, from, to, {{"mass_kg", mass}});
}
void Sketch::bar(const std::string& name, const std::string& from, const std::string& to, double mass, double centre,
                 double inertia) {
  add_bar(name, from, to, {{"mass_kg", mass}, {"centre_m", centre}, {"inertia_kg_m2", inertia}});
}

void Sketch::add_bar(const std::string& name, const std::string& from, const std::string& to, Keys inertia) {
  const PlanarVector ends = line(from, to);
  const double length = (builder.first_position(ends.to()) - builder.first_position(ends.from())).norm();
  auto n = numbers("bar." + name, inertia);
  const int length_number = builder.add_number("bar." + name + ".length_m", length, NumberRule::positive);
  const bool general = n.size() > 1;
  if (general) n.insert(n.begin() + 1, length_number);
  builder.add(std::make_unique<PlanarBar>(name,
                                          general ? PlanarBar::Distribution::general : PlanarBar::Distribution::uniform,
                                          ends, n, builder.gravity_numbers()));
  builder.add(std::make_unique<DistanceConstraint>("bar", name, ends, length_number));
  AttachmentFrame frame;
  frame.ends = {ends.from(), ends.to()};
  frame.coordinates = ends.coordinates();
  frame.numbers = {length_number};
  append(frame.numbers, ends.numbers());  // of the end on the ground, if any
  frame.kind = ends.from().kind() == PlanarPoint::Kind::ground ? PlanarPoint::Kind::on_bar_from_ground
               : ends.to().kind() == PlanarPoint::Kind::ground ? PlanarPoint::Kind::on_bar_to_ground
                                                               : PlanarPoint::Kind::on_bar;
  builder.add_frame(name, frame);
}

void Sketch::body(const std::string& name, std::array<double, 3> place, std::array<double, 3> rate, double mass,
                  double inertia, double cx, double cy) {
  const std::string path = "body." + name;
  const auto q = numbers(path, {{"x_m", place[0]}, {"y_m", place[1]}, {"angle_rad", place[2]}});
  const auto v = numbers(path, {{"vx_m_per_s", rate[0]}, {"vy_m_per_s", rate[1]}, {"rate_rad_per_s", rate[2]}});
  const std::vector<int> c = {builder.add_coordinate(name + ".x", "m", q[0], v[0]),
                              builder.add_coordinate(name + ".y", "m", q[1], v[1]),
                              builder.add_coordinate(name + ".angle", "rad", q[2], v[2])};
  auto n = numbers(path, {{"mass_kg", mass}, {"inertia_kg_m2", inertia}, {"centre_x_m", cx}, {"centre_y_m", cy}});
  append(n, builder.gravity_numbers());
  builder.add(std::make_unique<PlanarBody>("body", name, c, n));
  builder.add_angle(name, c[2]);
  builder.add_frame(name, {PlanarPoint::Kind::on_body, c, {}, {}});
}

void Sketch::mass(const std::string& point, double kg) {
  auto n = numbers("mass." + point, {{"mass_kg", kg}});
  append(n, builder.gravity_numbers());
  builder.add(std::make_unique<PointMass>(point, builder.point(point).coordinates(), n));
}

void Sketch::angle(const std::string& name, const std::string& from, const std::string& to, double guess) {
  const auto n = numbers("angle." + name, {{"start_rad", guess}, {"rate_rad_per_s", 0}});
  const int c = builder.add_coordinate(name, "rad", n[0], n[1]);
  builder.add(std::make_unique<BarAngleConstraint>(name, line(from, to), c));
  builder.add_angle(name, c);
}

void Sketch::distance(const std::string& name, const std::string& from, const std::string& to) {
  const PlanarVector d = line(from, to);
  const double length = (builder.first_position(d.to()) - builder.first_position(d.from())).norm();
  const int n = builder.add_number("distance." + name + ".length_m", length, NumberRule::positive);
  builder.add(std::make_unique<DistanceConstraint>("distance", name, d, n));
}

void Sketch::revolute(const std::string& name, const std::string& a, const std::string& b) {
  builder.add(std::make_unique<CoincidenceConstraint>("revolute", name, line(a, b)));
}

void Sketch::slot(const std::string& name, const std::string& line_from, const std::string& line_to,
                  const std::string& point) {
  builder.add(std::make_unique<TwoVectorConstraint>("slot", name, TwoVectorConstraint::Condition::parallel,
                                                    line(line_from, line_to), line(line_from, point)));
}

void Sketch::perpendicular(const std::string& name, const std::string& a, const std::string& b, const std::string& c,
                           const std::string& d) {
  builder.add(std::make_unique<TwoVectorConstraint>(
      "perpendicular", name, TwoVectorConstraint::Condition::perpendicular, line(a, b), line(c, d)));
}

void Sketch::driver(const std::string& name, const std::vector<std::pair<std::string, double>>& weighted,
                    const Law& law) {
  std::vector<int> coordinates, weights;
  for (const auto& [coordinate, weight] : weighted) {
    coordinates.push_back(builder.coordinate(coordinate));
    weights.push_back(builder.add_number("driver." + name + ".weight." + coordinate, weight));
  }
  builder.add(std::make_unique<CoordinateDriver>("driver", name, coordinates, weights, law.law,
                                                 numbers("driver." + name, law.keys)));
}

void Sketch::distance_driver(const std::string& name, const std::string& from, const std::string& to, const Law& law) {
  builder.add(std::make_unique<DistanceDriver<PlanarVector>>("driver", name, line(from, to), law.law,
                                                             numbers("driver." + name, law.keys)));
}

void Sketch::spring(const std::string& name, const std::string& from, const std::string& to, const Spring& s) {
  builder.add(std::make_unique<AxialForce<SpringDamperLaw>>("spring", name, SpringDamperLaw{s.spring.law, s.damper.law},
                                                            numbers("spring." + name, spring_keys(s)), line(from, to)));
}

void Sketch::maxwell(const std::string& name, const std::string& from, const std::string& to, double stiffness,
                     double natural, double damping, double state) {
  builder.add(std::make_unique<AxialForce<MaxwellLaw>>(
      "maxwell", name, MaxwellLaw{},
      numbers("maxwell." + name,
              {{"stiffness", stiffness}, {"natural", natural}, {"damping", damping}, {"state", state}}),
      line(from, to)));
}

void Sketch::lag_actuator(const std::string& name, const std::string& from, const std::string& to, double tau,
                          double state, const Law& command) {
  Keys keys = {{"tau", tau}, {"state", state}};
  append(keys, prefixed("command", command.keys));
  builder.add(std::make_unique<AxialForce<LagActuatorLaw>>("actuator", name, LagActuatorLaw{command.law},
                                                           numbers("actuator." + name, keys), line(from, to)));
}

void Sketch::torsion(const std::string& name, const std::vector<std::string>& angles, const Spring& s) {
  builder.add(std::make_unique<AngularForce<SpringDamperLaw>>(
      "torsion", name, SpringDamperLaw{s.spring.law, s.damper.law}, numbers("torsion." + name, spring_keys(s)),
      coordinates_of(angles)));
}

void Sketch::torsion_maxwell(const std::string& name, const std::vector<std::string>& angles, double stiffness,
                             double natural, double damping, double state) {
  builder.add(std::make_unique<AngularForce<MaxwellLaw>>(
      "torsion", name, MaxwellLaw{},
      numbers("torsion." + name,
              {{"stiffness", stiffness}, {"natural", natural}, {"damping", damping}, {"state", state}}),
      coordinates_of(angles)));
}

void Sketch::point_force(const std::string& name, const std::string& point, const Law& x, const Law& y) {
  auto n = numbers("force." + name + ".x", x.keys);
  append(n, numbers("force." + name + ".y", y.keys));
  builder.add(std::make_unique<PointForce>(name, builder.point(point), x.law, y.law, n));
}

void Sketch::couple(const std::string& name, const std::vector<std::string>& angles, const Law& torque) {
  builder.add(
      std::make_unique<Couple>(name, coordinates_of(angles), torque.law, numbers("couple." + name, torque.keys)));
}

}  // namespace costate::test
