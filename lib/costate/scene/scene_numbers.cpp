// Numbers written into a scene's tree.
#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "costate/scene/scene_reader.h"

namespace costate {

void set_number(SceneNode& root, const std::string& path, double value) {
  SceneNode node = number_node(value);
  if (const SceneNode* old = find_node(root, path)) node.where = old->where;
  set_node(root, path, std::move(node));
}

namespace {

/// Parameters that are not among the selected ones and bind numbers that these have moved apart: no scene may have
/// them.
void drop_parted(SceneNode& root, const Mechanism& mechanism, const ParameterSelection& selection,
                 const std::vector<double>& numbers) {
  const auto number = [&](const auto& binding) {
    return numbers[static_cast<std::size_t>(binding.first)] / binding.second;
  };
  const auto drop = [](SceneNode* from, const auto& which) {
    if (from) std::erase_if(from->children, which);
  };
  for (const Parameter& p : mechanism.parameters()) {
    if (std::any_of(selection.parameters.begin(), selection.parameters.end(),
                    [&](const Parameter& s) { return s.name == p.name; }))
      continue;
    const double value = number(p.bindings.front());
    if (std::all_of(p.bindings.begin(), p.bindings.end(),
                    [&](const auto& b) { return std::abs(number(b) - value) <= 1e-12 * std::abs(value); }))
      continue;
    drop(root.find("parameter"), [&](const SceneNode& n) { return n.key == p.name; });
    if (SceneNode* run = root.find("run"))
      drop(run->find("parameters"), [&](const SceneNode& n) { return n.text == p.name; });
  }
}

}  // namespace

void set_parameters(SceneNode& root, const Mechanism& mechanism, const ParameterSelection& selection,
                    const std::vector<double>& rho) {
  std::vector<double> numbers = mechanism.base_numbers();
  selection.apply(rho.data(), numbers);
  // The tables [kind.NAME] by kind and name: paths mostly begin so.
  std::unordered_map<std::string, std::size_t> places;
  for (std::size_t k = 0; k < root.children.size(); ++k)
    for (std::size_t i = 0; i < root.children[k].children.size(); ++i)
      places.emplace(root.children[k].key + "." + root.children[k].children[i].key, i);
  for (const auto& p : selection.parameters)
    for (const auto& [number, factor] : p.bindings) {
      const auto at = static_cast<std::size_t>(number);
      const std::string& path = mechanism.numbers()[at].path;
      const std::size_t first = path.find('.'), second = first == std::string::npos ? first : path.find('.', first + 1);
      const auto place = places.find(path.substr(0, second));
      SceneNode* kind =
          second == std::string::npos || place == places.end() ? nullptr : root.find(path.substr(0, first));
      SceneNode* element = kind ? &kind->children[place->second] : nullptr;
      if (element && find_node(*element, path.substr(second + 1)))
        set_number(*element, path.substr(second + 1), numbers[at]);
      else
        set_number(root, path, numbers[at]);
    }
  drop_parted(root, mechanism, selection, numbers);
}

}  // namespace costate
