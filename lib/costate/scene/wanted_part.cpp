#include "costate/scene/wanted_part.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "costate/base/notice.h"
#include "costate/element/defined_output.h"
#include "costate/mechanism/builder.h"
#include "costate/objective/sampled_cost.h"
#include "costate/objective/weighted_cost.h"

namespace costate {

namespace {

template <class Visit>
void for_each_element(const Mechanism& m, const Visit& visit) {
  for (const auto& b : m.bodies()) visit(*b);
  for (const auto& c : m.constraints()) visit(*c);
  for (const auto& f : m.forces()) visit(*f);
}

/// Whether all of these coordinates are kept, or none; an element that has none stays.
bool is_kept(const std::vector<int>& coordinates, const std::vector<bool>& kept) {
  return coordinates.empty() || kept[static_cast<std::size_t>(coordinates.front())];
}

/// What coordinates, elements, points, given values and numbers are called, in their order: of those that are kept.
std::vector<std::string> names_in(const Mechanism& m, const std::vector<bool>& kept) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < m.coordinates().size(); ++i)
    if (kept[i]) names.push_back(m.coordinates()[i].name);
  for_each_element(m, [&](const Element& e) {
    const bool formula = dynamic_cast<const DefinedOutput*>(&e) != nullptr;  // it stays where its outputs do
    if (!formula && is_kept(e.coordinates(), kept)) names.push_back(e.path());
  });
  const auto given = [&](const std::vector<GivenStart>& list) {
    for (const GivenStart& g : list)
      if (kept[static_cast<std::size_t>(g.coordinate < 0 ? g.terms.front().v : g.coordinate)])
        names.push_back(m.numbers()[static_cast<std::size_t>(g.number)].path);
  };
  given(m.given_positions());
  given(m.given_velocities());
  for (const Number& n : m.numbers()) names.push_back(n.path);
  for (const Number& n : m.numbers()) names.push_back(n.fixed_because);
  return names;
}

/// Of spring.S.damper_law.slope those are spring, spring.S and spring.S.damper_law.
std::set<std::string> tables_of(const std::string& path) {
  std::set<std::string> tables;
  for (auto at = path.find('.'); at != std::string::npos; at = path.find('.', at + 1))
    tables.insert(path.substr(0, at));
  return tables;
}

thread_local const WantedPart* g_wanted = nullptr;

void add(std::optional<std::vector<int>>& sum, const std::optional<std::vector<int>>& more) {
  if (sum && more)
    sum->insert(sum->end(), more->begin(), more->end());
  else
    sum.reset();
}

std::optional<std::vector<int>> coordinates_of_term(const Mechanism& m, const CostTerm& term) {
  if (const auto* t = dynamic_cast<const OutputTerm*>(&term)) {
    auto all = coordinates_of(m, t->output().name());
    if (t->target().output) add(all, coordinates_of(m, t->target().output->name()));
    return all;
  }
  if (const auto* t = dynamic_cast<const SampledCost*>(&term)) return coordinates_of(m, t->output().name());
  if (const auto* t = dynamic_cast<const WeightedTerm*>(&term)) return coordinates_of_term(m, t->term());
  return std::nullopt;
}

}  // namespace

std::vector<int> acting_groups(const Mechanism& mechanism) {
  std::vector<int> parent(static_cast<std::size_t>(mechanism.coordinate_count()));
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int i) {
    while (parent[static_cast<std::size_t>(i)] != i) {
      int& above = parent[static_cast<std::size_t>(i)];
      i = above = parent[static_cast<std::size_t>(above)];
    }
    return i;
  };
  for_each_element(mechanism, [&](const Element& e) {
    for (const int i : e.coordinates()) {
      const int a = root(e.coordinates().front()), b = root(i);
      parent[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    }
  });
  std::map<int, int> number;
  std::vector<int> groups;
  for (int i = 0; i < mechanism.coordinate_count(); ++i)
    groups.push_back(number.emplace(root(i), static_cast<int>(number.size())).first->second);
  return groups;
}

std::optional<std::vector<int>> coordinates_of(const Mechanism& m, const std::string& output) {
  for (int i = 0; i < m.coordinate_count(); ++i) {
    const std::string& name = m.coordinates()[static_cast<std::size_t>(i)].name;
    if (output == name || output == name + "_dot" || output == name + "_ddot") return std::vector<int>{i};
  }
  if (output.starts_with("lambda."))
    for (const auto& c : m.constraints())
      for (int i = 0; i < c->rows(); ++i)
        if (output == "lambda." + c->path() + "." + c->row_name(i)) return c->coordinates();
  if (output.starts_with("z."))
    for (const auto& f : m.forces())
      for (int i = 0; i < f->states(); ++i)
        if (output == "z." + f->path() + "." + f->state_name(i)) return f->coordinates();
  for (const auto& f : m.forces())
    if (const auto* formula = dynamic_cast<const DefinedOutput*>(f.get()); formula && formula->name() == output) {
      std::optional<std::vector<int>> all = std::vector<int>{};
      for (const std::string& input : formula->inputs()) add(all, coordinates_of(m, input));
      return all;
    }
  return make_output(m, output)->depends_on();
}

std::optional<std::vector<int>> coordinates_of(const Mechanism& mechanism, const Objective& objective) {
  std::optional<std::vector<int>> all = std::vector<int>{};
  for (const auto* terms : {&objective.running, &objective.terminal})
    for (const auto& term : *terms) add(all, coordinates_of_term(mechanism, *term));
  return all;
}

WantedPart::WantedPart(const Mechanism& whole, std::vector<bool> kept)
    : whole_(whole), kept_(std::move(kept)), before_(g_wanted) {
  for (int i = 0; i < whole.coordinate_count(); ++i) {
    const Coordinate& c = whole.coordinates()[static_cast<std::size_t>(i)];
    for (const std::string& table : tables_of(whole.numbers()[static_cast<std::size_t>(c.position_number)].path))
      own_[table].coordinates.push_back(i);
  }
  for_each_element(whole, [&](const Element& e) {
    std::set<std::string> tables = {e.path()};
    for (const int k : e.numbers()) tables.merge(tables_of(whole.numbers()[static_cast<std::size_t>(k)].path));
    for (const std::string& table : tables) own_[table].elements.push_back(&e);
  });
  for (const PlanarPoint& p : whole.points()) own_["point." + p.name()].points.push_back(p.coordinates());
  for (const SpatialPoint& p : whole.spatial_points()) own_["point." + p.name()].points.push_back(p.coordinates());
  g_wanted = this;
}

WantedPart::~WantedPart() { g_wanted = before_; }

const WantedPart* WantedPart::current() { return g_wanted; }

bool WantedPart::leaves_out(const std::string& path) const {
  const auto own = own_.find(path);
  if (own == own_.end()) return false;
  bool some = false, kept = false;
  const auto look = [&](const std::vector<int>& coordinates) {
    if (coordinates.empty()) return;
    some = true;
    kept = kept || is_kept(coordinates, kept_);
  };
  for (const int i : own->second.coordinates) look({i});
  for (const Element* e : own->second.elements) {
    if (const auto* formula = dynamic_cast<const DefinedOutput*>(e)) {
      // Of what is perhaps of everything, such as an energy, the part would have another one.
      const auto inputs = coordinates_of(whole_, formula->name());
      some = true;
      kept = inputs && std::all_of(inputs->begin(), inputs->end(), [&](int i) { return is_kept({i}, kept_); });
    } else {
      look(e->coordinates());
    }
  }
  for (const std::vector<int>& coordinates : own->second.points) look(coordinates);
  return some && !kept;
}

void WantedPart::add_numbers(const std::string& path, MechanismBuilder& builder) const {
  const std::vector<Number>& numbers = whole_.numbers();
  if (added_ > 0 && !builder.has_number(numbers[added_ - 1].path)) added_ = 0;  // another builder
  for (std::size_t i = added_; i < numbers.size(); ++i) {
    const Number& n = numbers[i];
    if (builder.has_number(n.path)) {
      if (i == added_) ++added_;
      continue;
    }
    // Gravity's third number comes with the first element in space.
    if (!n.path.starts_with(path + ".") && !n.path.starts_with("gravity.")) return;
    builder.fix_number(builder.add_number(n.path, n.value), n.fixed_because);
  }
}

std::optional<Scene> read_part(const Scene& scene, const std::vector<int>& wanted) {
  const Mechanism& whole = *scene.mechanism();
  const std::vector<int> groups = acting_groups(whole);
  std::vector<bool> group_kept(groups.size(), false), kept;
  for (const int i : wanted) group_kept[static_cast<std::size_t>(groups[static_cast<std::size_t>(i)])] = true;
  for (const int g : groups) kept.push_back(group_kept[static_cast<std::size_t>(g)]);
  const auto count = std::count(kept.begin(), kept.end(), true);
  if (count == 0 || count == static_cast<long>(kept.size())) return std::nullopt;
  // What reading has to say was said when the whole was read.
  const std::vector<std::string> said = take_notices();
  std::optional<Scene> part;
  try {
    const WantedPart guard(whole, kept);
    part = scene.with_override("run.everything", "true");
    const Mechanism& m = *part->mechanism();
    const std::vector<bool> all(static_cast<std::size_t>(m.coordinate_count()), true);
    if (names_in(m, all) != names_in(whole, kept)) part.reset();
  } catch (const Error&) {
    part.reset();
  }
  take_notices();
  for (const std::string& sentence : said) notice(sentence);
  return part;
}

}  // namespace costate
