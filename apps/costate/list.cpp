// costate list: formulations, methods and which go together; of a name, all there is to say; with a scene, what it
// offers.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <memory>

#include "command.h"
#include "costate/integrator/integrators.h"
#include "costate/kind/law/law_table.h"
#include "costate/objective/all_outputs.h"
#include "costate/optimize/optimizer.h"
#include "costate/record/print.h"
#include "costate/scene/scene_files.h"
#include "costate/scene/scene_kind.h"
#include "reference.h"

namespace costate::app {

namespace {

Json capability_json() {
  Json j;
  j["status"] = "ok";
  j["formulations"] = Json::array();
  for (const auto& f : formulations()) {
    Json e;
    e["name"] = f.name;
    e["summary"] = f.summary;
    e["integrators"] = Json::array();
    for (const Integrator* i : integrators_of(f)) e["integrators"].push_back(i->name);
    e["default_integrator"] = f.default_integrator;
    e["carries_redundancy"] = f.carries_redundancy;
    e["exact_constraints"] = f.exact_constraints();
    e["options"] = Json::array();
    for (const auto& o : f.options) e["options"].push_back(o.key);
    j["formulations"].push_back(e);
  }
  j["methods"] = Json::array();
  for (const auto& m : sensitivity_methods()) j["methods"].push_back({{"name", m.name}, {"summary", m.summary}});
  j["combinations"] = Json::array();
  for (const auto& f : formulations())
    for (const auto& m : sensitivity_methods()) {
      const std::string no = refusal(m, f);
      Json e{{"formulation", f.name}, {"method", m.name}, {"possible", no.empty()}};
      if (!no.empty()) e["refused"] = no;
      j["combinations"].push_back(e);
    }
  j["kinds"] = Json::array();
  for (const auto& k : scene_kinds()) j["kinds"].push_back({{"name", k.name}, {"summary", k.summary}});
  j["costs"] = Json::array();
  for (const auto& k : cost_kinds()) j["costs"].push_back({{"name", k.name}, {"summary", k.summary}});
  j["algorithms"] = Json::array();
  for (const auto& a : optimizer_algorithms()) j["algorithms"].push_back({{"name", a.name}, {"summary", a.summary}});
  j["laws"] = Json::array();
  for (const auto& k : law_kinds())
    j["laws"].push_back({{"name", k.name}, {"summary", k.summary}, {"example", k.example}});
  return j;
}

std::string capability_text() {
  std::string t = "Formulations\n";
  for (const auto& f : formulations()) t += fmt::format("  {:<22} {}\n", f.name, f.summary);
  t += "\nMethods\n";
  for (const auto& m : sensitivity_methods()) t += fmt::format("  {:<22} {}\n", m.name, m.summary);
  t += fmt::format("\nCombinations\n  {:<22}", "");
  for (const auto& m : sensitivity_methods()) t += fmt::format(" {:>16}", m.name);
  t += "\n";
  for (const auto& f : formulations()) {
    t += fmt::format("  {:<22}", f.name);
    for (const auto& m : sensitivity_methods()) t += fmt::format(" {:>16}", refusal(m, f).empty() ? "yes" : "-");
    t += "\n";
  }
  t += "\nScene tables\n";
  for (const auto& k : scene_kinds())
    t += fmt::format("  [{}.NAME]{:<{}} {}\n", k.name, "", k.name.size() < 16 ? 16 - k.name.size() : 0, k.summary);
  t += "\nLaws, wherever a number may be one: { kind = \"NAME\", ... }\n";
  for (const auto& k : law_kinds()) t += fmt::format("  {:<22} {}\n", k.name, k.summary);
  t += "\nCosts, [[cost.running]] and [[cost.terminal]]\n";
  for (const auto& k : cost_kinds()) t += fmt::format("  {:<22} {}\n", k.name, k.summary);
  t += "\nAlgorithms of optimize\n";
  for (const auto& a : optimizer_algorithms()) t += fmt::format("  {:<22} {}\n", a.name, a.summary);
  t += "\n'costate list NAME' has the keys, units, defaults and an example of each; --all the whole.\n";
  return t;
}

struct ListOptions {
  std::string element;
  bool all = false, markdown = false;
};

int print_entries(const std::vector<ReferenceEntry>& entries, bool with_examples, bool json) {
  Json j{{"status", "ok"}, {"entries", Json::array()}};
  std::string t;
  for (const auto& e : entries) {
    j["entries"].push_back(reference_json(e));
    t += (t.empty() ? "" : "\n") + reference_text(e, with_examples);
  }
  fmt::print("{}", json ? json_text(j) + "\n" : t);
  return 0;
}

/// 'costate list body': what has this name, or is of this family; nothing where it is no such name.
std::vector<ReferenceEntry> entries_named(const std::string& name, const std::vector<ReferenceEntry>& all) {
  std::vector<ReferenceEntry> r;
  for (const auto& e : all)
    if (e.name == name || (name.size() > 1 && e.family + "s" == name)) r.push_back(e);
  return r;
}

[[noreturn]] void no_such_name(const std::string& name, const std::vector<ReferenceEntry>& all) {
  std::vector<std::string> names;
  for (const auto& [family, title] : reference_families()) names.push_back(family);
  for (const auto& e : all) names.push_back(e.name);
  throw Error(
      fmt::format("There is no scene file '{}', and nothing of that name to list.{}", name, suggestion(name, names)));
}

/// The outputs that an element of a scene brings: 'costate list SCENE spring.strut', or its name alone.
int list_element(const Mechanism& m, const std::string& element, bool json) {
  const std::string name = element.substr(element.find('.') == std::string::npos ? 0 : element.find('.') + 1);
  Json j{{"status", "ok"}, {"element", element}, {"outputs", Json::object()}, {"numbers", Json::object()}};
  std::string t = fmt::format("{}\n", element);
  for (const auto& o : make_all_outputs(m))
    if (o->name().rfind(name + ".", 0) == 0) {
      j["outputs"][o->name()] = o->unit();
      t += fmt::format("  {:<28} [{}]\n", o->name(), o->unit());
    }
  const bool whole = name != element;
  for (const auto& n : m.numbers()) {
    const std::size_t dot = n.path.find('.');
    if (dot == std::string::npos || n.path.compare(whole ? 0 : dot + 1, element.size() + 1, element + ".") != 0)
      continue;
    j["numbers"][n.path] = n.value;
    t += fmt::format("  {:<44} {:g}{}\n", n.path, n.value, n.fixed_because.empty() ? "" : "  (fixed)");
  }
  if (j["outputs"].empty() && j["numbers"].empty()) {
    std::vector<std::string> paths;
    for (const auto& n : m.numbers()) {
      const std::string path = n.path.substr(0, n.path.find('.', n.path.find('.') + 1));
      if (std::find(paths.begin(), paths.end(), path) == paths.end()) paths.push_back(path);
    }
    throw Error(fmt::format("There is no element '{}' in the scene.{}", element, suggestion(element, paths)));
  }
  fmt::print("{}", json ? json_text(j) + "\n" : t);
  return 0;
}

/// What a shell completes behind 'costate list'; nothing is read for it.
std::vector<std::string> names() {
  std::vector<std::string> r;
  for (const auto& [family, title] : reference_families()) r.push_back(family);
  const auto add = [&](const auto& list) {
    for (const auto& entry : list) r.push_back(entry.name);
  };
  add(scene_kinds());
  add(law_kinds());
  add(cost_kinds());
  add(formulations());
  add(sensitivity_methods());
  add(optimizer_algorithms());
  return r;
}

int run(const CommonOptions& common, const ListOptions& options) {
  if (options.all || options.markdown) {
    const auto entries = reference_entries();
    if (!options.markdown) return print_entries(entries, true, common.json);
    fmt::print("{}", reference_markdown(entries));
    return 0;
  }
  if (common.scene.empty()) {
    fmt::print("{}", common.json ? json_text(capability_json()) + "\n" : capability_text());
    return 0;
  }
  std::error_code code;
  if (!std::filesystem::is_regular_file(common.scene, code) && !common.scene.ends_with(".toml")) {
    const auto all = reference_entries();
    const auto found = entries_named(common.scene, all);
    if (!found.empty()) return print_entries(found, found.front().name == common.scene, common.json);
    if (!std::filesystem::exists(common.scene, code)) no_such_name(common.scene, all);
  }
  const Scene scene = load_scene(common);
  const auto m = scene.mechanism();
  if (!options.element.empty()) return list_element(*m, options.element, common.json);
  Json j;
  j["status"] = "ok";
  j["title"] = scene.title;
  j["coordinates"] = m->coordinate_names();
  j["multipliers"] = m->row_names();
  j["states"] = m->state_names();
  j["outputs"] = output_names(*m);
  KeyedObject parameters, numbers;
  for (const auto& p : m->parameters())
    parameters.set(p.name, {{"value", p.value}, {"lower", p.lower}, {"upper", p.upper}, {"scale", p.scale}});
  j["parameters"] = parameters.take();
  j["default_parameters"] = m->default_parameters();
  for (const auto& n : m->numbers()) numbers.set(n.path, n.value);
  j["numbers"] = numbers.take();
  if (common.json) {
    fmt::print("{}\n", json_text(j));
    return 0;
  }
  std::string text = fmt::format("{}\n  {} coordinates, {} constraint rows, {} force states\n\nParameters\n",
                                 scene.title.empty() ? common.scene : scene.title, m->coordinate_count(),
                                 m->row_count(), m->state_count());
  for (const auto& p : m->parameters())
    text += fmt::format("  {:<16} {:>14.9g}  in [{:g}, {:g}]  {}\n", p.name, p.value, p.lower, p.upper,
                        m->numbers()[p.bindings.front().first].path);
  text += "\nOutputs\n";
  for (const auto& o : make_all_outputs(*m)) text += fmt::format("  {:<28} [{}]\n", o->name(), o->unit());
  text += "\nNumbers (each can be a parameter by its path)\n";
  for (const auto& n : m->numbers())
    if (n.fixed_because.empty()) text += fmt::format("  {:<44} {:g}\n", n.path, n.value);
  print_result(text);
  return 0;
}

}  // namespace

const RegisterCommand list_command(CommandGroup::inspect, "list",
                                   "Formulations, methods and scene tables; all of one; or what a scene offers",
                                   [](Command& c, CommonOptions& common) {
                                     auto options = std::make_shared<ListOptions>();
                                     common.add_to(c);
                                     c.existing("scene").required(false).suggests(names()).text(
                                         "Scene file, or a name: body, sine, baumgarte, kinds, ...");
                                     c.option("element", options->element,
                                              "Of a scene: what this element has, such as spring.strut");
                                     c.flag("--all", options->all, "All keys of all kinds, with examples");
                                     c.flag("--markdown", options->markdown, "The reference as tables of Markdown");
                                     c.flag("--json", common.json, "Print one JSON object and nothing else");
                                     c.runs([&common, options] { return run(common, *options); });
                                   });

const RegisterCommand dump_command(
    CommandGroup::inspect, "dump", "Print a scene as it was understood, overrides applied",
    [](Command& c, CommonOptions& common) {
      common.add_to(c);
      c.flag("--json", common.json, "Print one JSON object, with the scene as text");
      c.runs([&common] {
        const SceneFileLog log(common.scene);
        const Scene loaded = load_scene(common);
        const std::string scene = scene_text_for(loaded, log.files(), "");
        fmt::print("{}", common.json ? json_text({{"status", "ok"}, {"scene", scene}}) + "\n" : scene);
        return 0;
      });
    });

}  // namespace costate::app
