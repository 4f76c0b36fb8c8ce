#include "costate/mechanism/builder.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include "costate/base/error.h"
#include "costate/base/library_class.h"
#include "costate/mechanism/derivative_check.h"
#include "costate/mechanism/element_check.h"
#include "costate/mechanism/parameter_bounds.h"
#include "costate/mechanism/taken_number.h"

namespace costate {

MechanismBuilder::MechanismBuilder() : m_(std::make_unique<Mechanism>()) {
  gravity_ = {add_number("gravity.x_m_per_s2", 0), add_number("gravity.y_m_per_s2", 0)};
}

void MechanismBuilder::set_gravity(double x, double y, double z) {
  m_->numbers_[gravity_[0]].value = x;
  m_->numbers_[gravity_[1]].value = y;
  gravity_z_ = z;
}

std::vector<int> MechanismBuilder::spatial_gravity_numbers() {
  const std::string path = "gravity.z_m_per_s2";
  return {gravity_[0], gravity_[1], has_number(path) ? number(path) : add_number(path, gravity_z_)};
}

int MechanismBuilder::add_number(const std::string& path, double value, NumberRule rule) {
  require_element(this);
  if (const char* wrong = violation(rule, value)) throw ModelError(path, fmt::format("{}, found {}.", wrong, value));
  const int index = static_cast<int>(m_->numbers_.size());
  if (!m_->number_index_.emplace(path, index).second) throw ModelError(path, "This number is defined twice.");
  m_->numbers_.push_back({path, value, {}});
  return index;
}

int MechanismBuilder::add_coordinate(const std::string& name, const std::string& unit, int position_number,
                                     int velocity_number) {
  require_element(this);
  for (const int number : {position_number, velocity_number})
    if (number < 0 || number >= static_cast<int>(m_->numbers_.size()))
      throw ModelError("",
                       fmt::format("Coordinate '{}' starts with the number {}, and there are {}: add_number() gives "
                                   "one.",
                                   name, number, m_->numbers_.size()));
  const int index = m_->coordinate_count();
  if (!m_->coordinate_index_.emplace(name, index).second)
    throw ModelError("", fmt::format("Coordinate '{}' exists already; points, bodies and angles share one set of "
                                     "names.",
                                     name));
  m_->coordinates_.push_back({name, unit, position_number, velocity_number});
  return index;
}

void MechanismBuilder::add_point(PlanarPoint point) {
  const int index = static_cast<int>(m_->points_.size());
  if (has_spatial_point(point.name()) || !m_->point_index_.emplace(point.name(), index).second)
    throw ModelError("point." + point.name(), "This point exists already.");
  m_->points_.push_back(std::move(point));
}

void MechanismBuilder::add_point(SpatialPoint point) {
  const int index = static_cast<int>(m_->spatial_points_.size());
  if (m_->point_index_.count(point.name()) || !m_->spatial_point_index_.emplace(point.name(), index).second)
    throw ModelError("point." + point.name(), "This point exists already.");
  m_->spatial_points_.push_back(std::move(point));
}

void MechanismBuilder::add_rigid_body_frame(const std::string& name, std::vector<int> coordinates) {
  if (natural_bodies_.count(name) || !rigid_bodies_.emplace(name, std::move(coordinates)).second)
    throw ModelError("", fmt::format("There are two rigid bodies named '{}'.", name));
}

void MechanismBuilder::add_natural_body_frame(const std::string& name, std::vector<int> coordinates) {
  if (rigid_bodies_.count(name) || !natural_bodies_.emplace(name, std::move(coordinates)).second)
    throw ModelError("", fmt::format("There are two rigid bodies named '{}'.", name));
}

const std::vector<int>& MechanismBuilder::rigid_body_frame(const std::string& name) const {
  const auto at = rigid_bodies_.find(name);
  if (at != rigid_bodies_.end()) return at->second;
  std::vector<std::string> known;
  for (const auto& [k, v] : rigid_bodies_) known.push_back(k);
  if (natural_bodies_.count(name))
    throw ModelError("", fmt::format("'{}' is a [natural_body.*]; a [rigid_body.*] is needed here.", name));
  throw ModelError(
      "", fmt::format("There is no rigid body '{}'.{}{}", name, suggestion(name, known),
                      frames_.count(name) ? fmt::format(" '{}' is planar: points on it have no z_m.", name) : ""));
}

void MechanismBuilder::add_angle(const std::string& name, int coordinate) {
  if (!m_->angles_.emplace(name, coordinate).second)
    throw ModelError("", fmt::format("There are two angles (or bodies) named '{}'.", name));
}

int MechanismBuilder::angle(const std::string& name) const {
  const auto at = m_->angles_.find(name);
  if (at != m_->angles_.end()) return at->second;
  std::vector<std::string> known;
  for (const auto& [k, v] : m_->angles_) {
    if (m_->coordinates_[static_cast<std::size_t>(v)].name == name) return v;  // "link.angle" for "link"
    known.push_back(k);
  }
  throw ModelError("", fmt::format("There is no body or angle '{}'.{}{}", name, suggestion(name, known),
                                   known.empty() ? " Give a bar an angle coordinate with [angle.NAME]." : ""));
}

void MechanismBuilder::add_frame(const std::string& name, AttachmentFrame frame) {
  if (!frames_.emplace(name, std::move(frame)).second)
    throw ModelError("", fmt::format("There are two bodies or bars named '{}'.", name));
}

const AttachmentFrame& MechanismBuilder::frame(const std::string& name) const {
  const auto at = frames_.find(name);
  if (at != frames_.end()) return at->second;
  std::vector<std::string> known;
  for (const auto& [k, v] : frames_) known.push_back(k);
  throw ModelError("", fmt::format("There is no body or bar '{}'.{}", name, suggestion(name, known)));
}

Eigen::Vector2d MechanismBuilder::first_position(const PlanarPoint& point) const {
  double q[PlanarPoint::kMaxCoordinates] = {}, p[PlanarPoint::kMaxNumbers] = {};
  for (std::size_t i = 0; i < point.coordinates().size(); ++i)
    q[i] = number_value(m_->coordinates_[point.coordinates()[i]].position_number);
  for (std::size_t i = 0; i < point.numbers().size(); ++i) p[i] = number_value(point.numbers()[i]);
  Eigen::Vector2d r;
  point.position(q, p, r[0], r[1]);
  return r;
}

Eigen::Vector3d MechanismBuilder::first_position(const SpatialPoint& point) const {
  double q[SpatialPoint::kMaxCoordinates] = {}, p[3] = {};
  for (std::size_t i = 0; i < point.coordinates().size(); ++i) q[i] = first_value(point.coordinates()[i]);
  for (std::size_t i = 0; i < point.numbers().size(); ++i) p[i] = number_value(point.numbers()[i]);
  Eigen::Vector3d r;
  point.position(q, p, r.data());
  return r;
}

void MechanismBuilder::add_shared_part(const std::string& path, std::shared_ptr<const SharedPart> part) {
  if (!shared_parts_.emplace(path, std::move(part)).second) throw ModelError(path, "This name is taken already.");
}

std::shared_ptr<const SharedPart> MechanismBuilder::find_shared_part(const std::string& path) const {
  const auto at = shared_parts_.find(path);
  return at == shared_parts_.end() ? nullptr : at->second;
}

std::vector<std::string> MechanismBuilder::shared_part_names(const std::string& kind) const {
  std::vector<std::string> names;
  for (const auto& [path, part] : shared_parts_)
    if (path.rfind(kind + ".", 0) == 0) names.push_back(path.substr(kind.size() + 1));
  return names;
}

void MechanismBuilder::require_element(const void* element) const {
  if (!m_) throw Error("This builder is done: build() has handed its mechanism out. Take another builder.");
  if (!element) throw Error("An element is expected, found a null pointer.");
}

/// Kernels keep so many on the stack.
static void require_count(const Element& e, const char* function, int found, int least) {
  if (found < least || found > kMaxLocal)
    throw ModelError(e.path(),
                     fmt::format("Its {}() is {}; between {} and {} are expected.", function, found, least, kMaxLocal));
}

static void require_room(const Element& e) {
  if (e.coordinates().size() > static_cast<std::size_t>(kMaxLocal))
    throw ModelError(e.path(),
                     fmt::format("It depends on {} coordinates, of {} at most.", e.coordinates().size(), kMaxLocal));
}

void MechanismBuilder::require_own_path(const Element& element, const char* what) {
  const bool ours = is_wholly_of_library(typeid(element));
  const auto [other, is_new] = paths_.emplace(fmt::format("{} {}", what, element.path()), ours);
  if (!is_new && !(ours && other->second))
    throw ModelError(element.path(),
                     fmt::format("There is a {} of this name already: results, outputs and messages know "
                                 "it by that. Take another name.",
                                 what));
}

void MechanismBuilder::sign() {
  std::size_t all = 0;
  const auto add = [&](const std::string& name) { all = 31 * all + std::hash<std::string>()(name); };
  for (const Coordinate& c : m_->coordinates_) add(c.name);
  for (const Number& n : m_->numbers_) add(n.path);
  for (const auto& e : m_->bodies_) add(e->path());
  for (const auto& e : m_->constraints_) add(e->path());
  for (const auto& e : m_->forces_) add(e->path());
  m_->signature_ = all == 0 ? 1 : all;
}

void MechanismBuilder::add(std::unique_ptr<Body> body) {
  require_element(body.get());
  require_room(*body);
  check_element(*m_, *body);
  require_own_path(*body, "body");
  m_->bodies_.push_back(std::move(body));
}

void MechanismBuilder::add(std::unique_ptr<Constraint> c) {
  require_element(c.get());
  if (c->coordinates().empty())
    throw ModelError(c->path(), "This constraint touches no coordinate (both ends are on the ground).");
  require_room(*c);
  require_count(*c, "rows", c->rows(), 1);
  check_element(*m_, *c);
  require_own_path(*c, "constraint");
  m_->row_offsets_.push_back(m_->row_count_);
  m_->row_count_ += c->rows();
  m_->constraints_.push_back(std::move(c));
}

void MechanismBuilder::add(std::unique_ptr<Force> f) {
  require_element(f.get());
  require_room(*f);
  require_count(*f, "states", f->states(), 0);
  check_element(*m_, *f);
  require_own_path(*f, "force");
  m_->state_offsets_.push_back(m_->state_count_);
  m_->state_count_ += f->states();
  m_->forces_.push_back(std::move(f));
}

void MechanismBuilder::add_parameter(Parameter p) {
  const std::string subject = "parameter." + p.name;
  require_element(this);
  if (shared_parts_.count(subject) > 0) throw ModelError(subject, "This parameter exists already.");
  if (p.bindings.empty()) throw ModelError(subject, "A parameter must name at least one number.");
  if (!(p.scale > 0)) throw ModelError(subject, fmt::format("The scale must be positive, found {}.", p.scale));
  for (const auto& [number, f] : p.bindings) {
    if (number < 0 || static_cast<std::size_t>(number) >= m_->numbers_.size())
      throw ModelError(
          subject, fmt::format("There is no number of index {}; the mechanism has {}.", number, m_->numbers_.size()));
    if (std::count_if(p.bindings.begin(), p.bindings.end(), [n = number](const auto& b) { return b.first == n; }) > 1)
      throw ModelError(subject, fmt::format("'{}' is listed twice: a number has one factor.",
                                            m_->numbers_[static_cast<std::size_t>(number)].path));
  }
  const auto& [first, factor] = p.bindings.front();
  const double own = m_->numbers_[first].value / factor;
  if (p.value != 0 && !(std::abs(p.value - own) <= 1e-12 * (std::abs(p.value) + std::abs(own))))
    throw ModelError(subject, fmt::format("Its value is that of its number, '{}' = {} with factor {}, so {}: found {}. "
                                          "Leave it out.",
                                          m_->numbers_[first].path, m_->numbers_[first].value, factor, own, p.value));
  p.value = rounded_to_bounds(p, m_->numbers_[first].value / factor);
  for (const auto& [number, f] : p.bindings) {
    if (f == 0) throw ModelError(subject, "A factor must not be zero.");
    const double expected = f * p.value, found = m_->numbers_[number].value;
    if (std::abs(expected - found) > 1e-12 * (std::abs(expected) + std::abs(found)))
      throw ModelError(
          subject, fmt::format("'{}' is {} in the scene, but '{}' = {} with factor {} makes it {}. Numbers "
                               "of one parameter must agree at the start.",
                               m_->numbers_[number].path, found, m_->numbers_[first].path, m_->numbers_[first].value,
                               f / factor, expected));
  }
  shared_parts_.emplace(subject, nullptr);
  m_->parameters_.push_back(std::move(p));
}

void MechanismBuilder::set_default_parameters(std::vector<std::string> names) {
  m_->default_parameters_ = std::move(names);
}

std::shared_ptr<const Mechanism> MechanismBuilder::build() {
  require_element(this);
  Mechanism& m = *m_;
  if (m.coordinates_.empty()) throw ModelError("", "The mechanism has no coordinate: add a free point or a body.");
  give_what_is_free();
  std::set<int> given, given_velocity, given_rate;
  for (const auto& g : m.given_positions_) given.insert(g.coordinate);
  for (const auto& g : m.given_velocities_) {
    given_velocity.insert(g.coordinate);
    given_rate.insert(g.number);
  }
  for (int i = 0; i < m.coordinate_count(); ++i) {
    const Coordinate& c = m.coordinates_[i];
    if (!given.count(i) && m.numbers_[c.position_number].fixed_because.empty())
      m.numbers_[c.position_number].fixed_because = fmt::format(
          "it is only the first guess of coordinate '{}', which the start solves for (given coordinates are listed "
          "in [start])",
          c.name);
    if (!given_velocity.count(i) && m.numbers_[c.velocity_number].fixed_because.empty())
      m.numbers_[c.velocity_number].fixed_because =
          fmt::format("the start solves for the velocity of '{}' (given velocities are listed in [start])", c.name);
  }
  for (const auto& [name, rate] : rates_)
    if (!given_rate.count(rate.number) && m.numbers_[rate.number].fixed_because.empty())
      m.numbers_[rate.number].fixed_because = fmt::format(
          "the start does not give '{0}' (given velocities are listed in [start]: name \"{0}\" in "
          "given_velocities, in the place of another one)",
          name);
  hold_or_balance_states();
  // A number that is taken from others counts where it is more than a first guess, or where one that counts is taken
  // from it. What it is taken from must not vary.
  std::set<int> guesses;
  for (int i = 0; i < m.coordinate_count(); ++i)
    if (!given.count(i)) guesses.insert(m.coordinates_[i].position_number);
  std::map<int, std::set<std::string>> written;  // by number: what would have to be written for it to vary
  for (bool more = true; more;) {
    more = false;
    for (const auto& [path, part] : shared_parts_) {
      const auto* taken = dynamic_cast<const TakenNumber*>(part.get());
      if (!taken || (guesses.count(taken->number) && !written.count(taken->number))) continue;
      const Number& n = m.numbers_[taken->number];
      const std::string text = taken->written_as.empty() ? fmt::format("{} = {}", n.path, n.value) : taken->written_as;
      std::vector<int> inputs = taken->numbers;
      for (const int i : taken->coordinates) inputs.push_back(m.coordinates_[i].position_number);
      for (const int k : inputs) more = written[k].insert(text).second || more;
    }
  }
  for (const auto& [k, texts] : written)
    if (m.numbers_[k].fixed_because.empty())
      m.numbers_[k].fixed_because = fmt::format(
          "numbers that the scene leaves out are taken from it and would change with it; write {} to hold them.",
          fmt::join(texts, " and "));
  m.select(m.default_parameters_);  // names must exist and be free to vary
  check_derivatives(m);
  sign();
  return std::shared_ptr<const Mechanism>(std::move(m_));
}

}  // namespace costate
