#include "costate/cycle/section.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "costate/base/error.h"
#include "costate/cycle/behind_impact.h"
#include "costate/element/unilateral_force.h"

namespace costate {

double along_way(int along, double angle) {
  if (along == 0) return 0;
  return along == 1 ? std::cos(angle) : std::sin(angle);
}

double along_way_angle(int along, double angle) {
  if (along == 0) return 0;
  return along == 1 ? -std::sin(angle) : std::cos(angle);
}

namespace {

template <class F>
auto at(const std::string& subject, const F& f) {
  try {
    return f();
  } catch (const ModelError& e) {
    throw ModelError(subject, e.bare_message());
  }
}

/// Sum of factor q_i v_j: a rate that the start gives (GivenStart).
class RateOutput final : public Output {
 public:
  RateOutput(std::string name, std::vector<GivenStart::Term> terms)
      : Output(std::move(name), "rad/s"), terms_(std::move(terms)) {}
  double value(const StateView& s, Assembly&) const override {
    double sum = 0;
    for (const auto& [i, j, factor] : terms_) sum += factor * s.q[i] * s.v[j];
    return sum;
  }
  void add_gradient(const StateView& s, Assembly&, double c, ScalarGradient& g) const override {
    for (const auto& [i, j, factor] : terms_) {
      g.q[i] += c * factor * s.v[j];
      g.v[j] += c * factor * s.q[i];
    }
  }
  double change(const StateView& s, Assembly&, const Variation& d) const override {
    double sum = 0;
    for (const auto& [i, j, factor] : terms_) sum += factor * (d.q[i] * s.v[j] + s.q[i] * d.v[j]);
    return sum;
  }
  void add_gradient_change(const StateView&, Assembly&, const Variation& d, double c,
                           ScalarGradient& g) const override {
    for (const auto& [i, j, factor] : terms_) {
      g.q[i] += c * factor * d.v[j];
      g.v[j] += c * factor * d.q[i];
    }
  }

 private:
  std::vector<GivenStart::Term> terms_;
};

bool ends_with(const std::string& name, const char* with) {
  const std::string w = with;
  return name.size() > w.size() && name.compare(name.size() - w.size(), w.size(), w) == 0;
}

}  // namespace

std::string Section::partner(const std::string& name) const {
  std::string r;
  for (std::size_t from = 0; from <= name.size();) {
    const std::size_t to = std::min(name.find_first_of(". ", from), name.size());
    const std::string part = name.substr(from, to - from);
    const auto swapped = settings_.relabel.find(part);
    r += swapped == settings_.relabel.end() ? part : swapped->second;
    if (to < name.size()) r += name[to];
    from = to + 1;
  }
  return r;
}

/// What swaps roles must be alike: numbers of the two, and parameters that vary them.
void Section::check_pairs(const Problem& problem) const {
  const Mechanism& m = *problem.mechanism;
  std::set<std::string> met;
  const auto columns = problem.parameters.columns(m.numbers().size());
  for (std::size_t i = 0; i < m.numbers().size(); ++i) {
    const std::string &path = m.numbers()[i].path, other = partner(path);
    if (path == other) continue;
    for (std::size_t from = 0; from <= path.size();) {
      const std::size_t to = std::min(path.find('.', from), path.size());
      if (settings_.relabel.count(path.substr(from, to - from)) > 0) met.insert(path.substr(from, to - from));
      from = to + 1;
    }
    if (start_numbers_[i]) continue;
    const int k = at("cycle.relabel", [&] { return m.number(other); });
    const double a = m.numbers()[i].value, b = m.numbers()[static_cast<std::size_t>(k)].value;
    if (std::abs(a - b) > 1e-12 * std::max(std::abs(a), std::abs(b)))
      throw ModelError("cycle.relabel", fmt::format("'{}' = {:.12g} and '{}' = {:.12g} swap roles, and differ: such a "
                                                    "motion does not repeat itself. Make them alike, or leave the pair "
                                                    "out and set count = 2.",
                                                    path, a, other, b));
    if (columns[i] != columns[static_cast<std::size_t>(k)])
      throw ModelError("cycle.relabel", fmt::format("'{}' and '{}' swap roles, and are not varied alike: a parameter "
                                                    "must hold both.",
                                                    path, other));
  }
  for (const auto& [name, other] : settings_.relabel)
    if (met.count(name) == 0)
      throw ModelError("cycle.relabel", fmt::format("Nothing in the scene is named '{}'.", name));
}

/// A coordinate's own name for what may stand for it, "crank.angle" for "crank"; names of nothing stay.
static std::string full_name(const Mechanism& m, const std::string& name) {
  try {
    return m.coordinates()[static_cast<std::size_t>(m.coordinate(name))].name;
  } catch (const ModelError&) {
    return name;
  }
}

void Section::add_positions(const Mechanism& m) {
  for (const auto& g : m.given_positions()) {
    const auto i = static_cast<std::size_t>(g.coordinate);
    const Coordinate& c = m.coordinates()[i];
    const std::string& other = m.coordinates()[static_cast<std::size_t>(partner_coordinate_[i])].name;
    SectionCoordinate x{c.name, c.unit, g.number, make_output(m, c.name), make_output(m, other), along_[i]};
    x.turns = std::find(settings_.turns.begin(), settings_.turns.end(), c.name) != settings_.turns.end();
    if (c.name == settings_.travel) travelling_ = size();
    coordinates_.push_back(std::move(x));
  }
}

void Section::add_velocities(const Mechanism& m) {
  for (const auto& g : m.given_velocities()) {
    if (g.coordinate < 0) {
      std::vector<GivenStart::Term> swapped = g.terms;
      for (auto& t : swapped) {
        t.q = partner_coordinate_[static_cast<std::size_t>(t.q)];
        t.v = partner_coordinate_[static_cast<std::size_t>(t.v)];
      }
      const auto read = [&](const std::vector<GivenStart::Term>& terms, bool behind,
                            const std::optional<NamedEvent>& event) -> std::shared_ptr<Output> {
        if (behind) return make_rate_behind(*event, g.name, "rad/s", terms);
        return std::make_shared<RateOutput>(g.name, terms);
      };
      coordinates_.push_back({g.name, "rad/s", g.number, read(g.terms, impact_ && !starts_behind_, begin_event_),
                              read(swapped, impact_, end_event_)});
      continue;
    }
    const auto i = static_cast<std::size_t>(g.coordinate);
    const int j = partner_coordinate_[i];
    const std::string name = m.coordinates()[i].name + "_dot",
                      other = m.coordinates()[static_cast<std::size_t>(j)].name + "_dot";
    const std::string unit = make_output(m, name)->unit();
    const auto read = [&](const std::string& of, int coordinate, bool behind,
                          const std::optional<NamedEvent>& event) -> std::shared_ptr<Output> {
      if (behind) return make_rate_behind(*event, of, unit, {{-1, coordinate, 1}});
      return make_output(m, of);
    };
    coordinates_.push_back({name, unit, g.number, read(name, g.coordinate, impact_ && !starts_behind_, begin_event_),
                            read(other, j, impact_, end_event_)});
  }
}

void Section::add_states(const Mechanism& m, const std::vector<bool>& passive) {
  const std::vector<std::string> names = m.state_names();
  // By name: of a force that the events belong to, the states behind them.
  const auto read = [&](const std::string& name, const std::optional<NamedEvent>& event,
                        int mode) -> std::shared_ptr<Output> {
    if (event && mode >= 0) return make_mode_behind(*event, "z." + name, "1", mode);
    if (event && !impact_)
      for (int i = 0; i < event->force->states(); ++i)
        if (event->force->path() + "." + event->force->state_name(i) == name) return make_output_behind(*event, i);
    return make_output(m, "z." + name);
  };
  std::vector<int> number_of(names.size(), -1);
  std::vector<bool> is_mode(names.size(), false);  // of rigid contacts: the same at both ends, whatever happens between
  std::map<int, int> users;
  for (std::size_t f = 0; f < m.forces().size(); ++f)
    for (int i = 0; i < m.forces()[f]->states(); ++i) {
      const int local = m.forces()[f]->initial_state_number(i);
      if (local < 0) continue;
      const int number = m.forces()[f]->numbers()[static_cast<std::size_t>(local)];
      number_of[static_cast<std::size_t>(m.state_offsets()[f] + i)] = number;
      ++users[number];
      const auto* contact = dynamic_cast<const UnilateralForce*>(m.forces()[f].get());
      if (contact && (contact->closed_state() == i || contact->sliding_state() == i))
        is_mode[static_cast<std::size_t>(m.state_offsets()[f] + i)] = true;
      start_numbers_[static_cast<std::size_t>(number)] = true;
    }
  // Of rigid contacts an impact sets the modes.
  const auto mode_of = [&](std::size_t state) { return impact_ && is_mode[state] ? static_cast<int>(state) : -1; };
  const auto partner_of = [&](std::size_t i) {
    const std::string other = partner(names[i]);
    const auto found = std::find(names.begin(), names.end(), other);
    if (found == names.end())
      throw ModelError("cycle.relabel",
                       fmt::format("'{}' would swap roles with '{}', which there is not.", names[i], other));
    return static_cast<std::size_t>(found - names.begin());
  };
  const auto first_of = [&](std::size_t i) -> std::shared_ptr<Output> {
    if (starts_behind_) return make_output(m, "z." + names[i]);
    return read(names[i], begin_event_, mode_of(i));
  };
  const auto last_of = [&](std::size_t i) { return read(names[i], end_event_, mode_of(i)); };
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (!is_mode[i]) continue;
    const std::size_t dot = names[i].rfind('.');
    modes_.push_back({names[i], names[i].substr(0, dot), static_cast<int>(i), names[i].substr(dot + 1) == "closed",
                      m.numbers()[static_cast<std::size_t>(number_of[i])].value, first_of(i), last_of(partner_of(i))});
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (passive[i]) continue;
    const int number = number_of[i];
    if (number < 0 || users[number] > 1 ||
        m.numbers()[static_cast<std::size_t>(number)].path.find("bristles") != std::string::npos)
      throw ModelError(names[i].substr(0, names[i].rfind('.')),
                       fmt::format("The state '{}' has no number of its own that a cycle could begin with. A cycle "
                                   "carries approach speeds of contacts with one point, and states of elements that "
                                   "take initial values; of several points make a contact each, of friction with "
                                   "bristles take another model.",
                                   names[i]));
    const std::string unit = make_output(m, "z." + names[i])->unit();
    coordinates_.push_back({"z." + names[i], unit, number, first_of(i), last_of(partner_of(i))});
    if (is_mode[i]) ++trivial_;
    if (!impact_ && begin_event_ && names[i].rfind(begin_event_->force->path() + ".", 0) == 0) ++trivial_;
  }
}

void Section::find_travel(const Mechanism& m) {
  if (settings_.travel.empty()) return;
  int along = 0;
  if (travelling_ >= 0) {
    along = coordinates_[static_cast<std::size_t>(travelling_)].along;
  } else {
    std::vector<std::string> given;
    for (const auto& c : coordinates_)
      if (c.along == 1) given.push_back(c.name);
    if (!given.empty())
      throw ModelError("cycle.travel", fmt::format("'{}' is no position that [start] gives.{}", settings_.travel,
                                                   suggestion(settings_.travel, given)));
    carried_.coordinate = at("cycle.travel", [&] { return m.coordinate(settings_.travel); });
    const auto i = static_cast<std::size_t>(carried_.coordinate);
    carried_.along = along = along_[i];
    carried_.at_end = make_output(m, m.coordinates()[static_cast<std::size_t>(partner_coordinate_[i])].name);
  }
  if (along == 0)
    throw ModelError("cycle.travel", fmt::format("'{}' is no coordinate along x, nor upwards.", settings_.travel));
}

void Section::find_event_sections(const Mechanism& m) {
  begin_event_ = at("cycle.section", [&] { return find_event(m, settings_.event); });
  end_event_ = at("cycle.relabel", [&] { return find_event(m, partner(begin_event_->name)); });
  const auto made = [](std::shared_ptr<const Output> output, int direction) {
    EndEvent end;
    end.output = std::move(output);
    end.above = direction > 0;
    return std::make_shared<EndEvent>(std::move(end));
  };
  end_ = made(make_guard_output(*end_event_), end_event_->direction);
  first_ = begin_ = made(make_guard_output(*begin_event_), begin_event_->direction);
  const auto* contact = dynamic_cast<const UnilateralForce*>(begin_event_->guarded);
  if (!contact) return;
  if (contact->guard_kind(begin_event_->k) != UnilateralForce::Guard::touch)
    throw ModelError(
        "cycle.section",
        fmt::format("'{}' is where a rigid contact lets go, slides or stops: a cycle does not begin with that. Take "
                    "where it touches, '{} touch', or an output's crossing of a level, as the stance leg's angle in "
                    "mid-stance: [cycle.section] with output = \"left.angle\", below = 0.",
                    begin_event_->name, begin_event_->force->path()));
  impact_ = true;
  closes_ = contact->closed_state() >= 0;
  if (closes_) begin_ = nullptr;
}

// Its own gap is a row of the start.
void Section::set_let_go(const Mechanism& m, const std::string& contact) {
  EndEvent at_ground;
  at_ground.output = make_output(m, contact.substr(contact.find('.') + 1) + ".gap");
  begin_ = std::make_shared<EndEvent>(std::move(at_ground));
  ++trivial_;
}

Section::Section(const Problem& problem, const CycleSettings& settings, const std::vector<bool>& passive,
                 const std::string& let_go)
    : settings_(settings), starts_behind_(!let_go.empty()) {
  const Mechanism& m = *problem.mechanism;
  for (std::string& name : settings_.turns) name = full_name(m, name);
  settings_.travel = full_name(m, settings_.travel);
  const auto names = m.coordinate_names();
  start_numbers_.assign(m.numbers().size(), false);
  bool space = !m.spatial_points().empty();
  for (const auto& name : names) space = space || ends_with(name, ".z");
  for (std::size_t i = 0; i < names.size(); ++i) {
    const Coordinate& c = m.coordinates()[i];
    for (const int number : {c.position_number, c.velocity_number})
      if (number >= 0) start_numbers_[static_cast<std::size_t>(number)] = true;
    partner_coordinate_.push_back(at("cycle.relabel", [&] { return m.coordinate(partner(names[i])); }));
    along_.push_back(ends_with(names[i], ".x") ? 1 : ends_with(names[i], space ? ".z" : ".y") ? 2 : 0);
  }
  for (const auto& g : m.given_velocities()) start_numbers_[static_cast<std::size_t>(g.number)] = true;
  if (!settings_.event.empty()) {
    find_event_sections(m);
  } else if (!settings_.output.empty()) {
    const auto made = [&](const std::string& output) {
      EndEvent end;
      end.output = at("cycle.section.output", [&] { return make_output(m, output); });
      end.above = settings_.above;
      end.level_number = settings_.level_number;
      return std::make_shared<EndEvent>(std::move(end));
    };
    first_ = begin_ = made(settings_.output);
    end_ = made(partner(settings_.output));
  }
  trivial_ = begin_ ? 1 : 0;
  if (starts_behind_) set_let_go(m, let_go);
  if (!settings_.travel_angle_number.empty())
    angle_number_ = at("cycle.travel_angle_rad", [&] { return m.number(settings_.travel_angle_number); });
  add_positions(m);
  add_velocities(m);
  add_states(m, passive);
  find_travel(m);
  for (const auto& name : settings_.turns)
    if (std::none_of(coordinates_.begin(), coordinates_.end(),
                     [&](const auto& c) { return c.name == name && c.turns; }))
      throw ModelError("cycle.turns", fmt::format("'{}' is no position that [start] gives.", name));
  for (int i = 0; i < size(); ++i)
    if (i != travelling_) free_.push_back(i);
  check_pairs(problem);
}

double Section::angle(const std::vector<double>& numbers) const {
  return angle_number_ < 0 ? settings_.travel_angle_rad : numbers[static_cast<std::size_t>(angle_number_)];
}

std::vector<double> Section::positions_behind(const double* q, double travel, double angle) const {
  std::vector<double> r(partner_coordinate_.size());
  for (std::size_t i = 0; i < r.size(); ++i) r[i] = q[partner_coordinate_[i]];
  return moved_back(r, travel, angle);
}

std::vector<double> Section::moved_back(std::vector<double> positions, double travel, double angle) const {
  for (std::size_t i = 0; i < positions.size(); ++i) positions[i] -= travel * along_way(along_[i], angle);
  return positions;
}

}  // namespace costate
