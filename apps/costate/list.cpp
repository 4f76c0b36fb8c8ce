// costate list: formulations, methods and which go together; with a scene, what it offers.
#include <fmt/format.h>

#include "command.h"
#include "costate/kind/law/law_table.h"
#include "costate/objective/all_outputs.h"
#include "costate/scene/scene_files.h"
#include "costate/scene/scene_kind.h"

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
    if (f.make_dae) e["integrators"].push_back("idas");
    if (f.make_ode) e["integrators"].push_back("cvodes");
    if (f.make_discrete) e["integrators"].push_back("fixed");
    e["default_integrator"] = f.default_integrator;
    e["carries_redundancy"] = f.carries_redundancy;
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
  return t;
}

int run(const CommonOptions& common) {
  if (common.scene.empty()) {
    fmt::print("{}", common.json ? json_text(capability_json()) + "\n" : capability_text());
    return 0;
  }
  const Scene scene = load_scene(common);
  const auto m = scene.mechanism();
  Json j;
  j["status"] = "ok";
  j["title"] = scene.title;
  j["coordinates"] = m->coordinate_names();
  j["multipliers"] = m->row_names();
  j["states"] = m->state_names();
  j["outputs"] = output_names(*m);
  j["parameters"] = Json::object();
  for (const auto& p : m->parameters())
    j["parameters"][p.name] = {{"value", p.value}, {"lower", p.lower}, {"upper", p.upper}, {"scale", p.scale}};
  j["default_parameters"] = m->default_parameters();
  j["numbers"] = Json::object();
  for (const auto& n : m->numbers()) j["numbers"][n.path] = n.value;
  if (common.json) {
    fmt::print("{}\n", json_text(j));
    return 0;
  }
  fmt::print("{}\n", scene.title.empty() ? common.scene : scene.title);
  fmt::print("  {} coordinates, {} constraint rows, {} force states\n\nParameters\n", m->coordinate_count(),
             m->row_count(), m->state_count());
  for (const auto& p : m->parameters())
    fmt::print("  {:<16} {:>14.9g}  in [{:g}, {:g}]  {}\n", p.name, p.value, p.lower, p.upper,
               m->numbers()[p.bindings.front().first].path);
  fmt::print("\nOutputs\n");
  for (const auto& o : make_all_outputs(*m)) fmt::print("  {:<28} [{}]\n", o->name(), o->unit());
  fmt::print("\nNumbers (each can be a parameter by its path)\n");
  for (const auto& n : m->numbers())
    if (n.fixed_because.empty()) fmt::print("  {:<44} {:g}\n", n.path, n.value);
  return 0;
}

}  // namespace

const RegisterCommand list_command(CommandGroup::inspect, "list",
                                   "Formulations, methods and scene tables; or what a scene offers",
                                   [](Command& c, CommonOptions& common) {
                                     common.add_to(c);
                                     c.existing("scene").required(false);
                                     c.flag("--json", common.json, "Print one JSON object and nothing else");
                                     c.runs([&common] { return run(common); });
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
