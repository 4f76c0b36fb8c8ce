#include "reference.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "costate/integrator/integrators.h"
#include "costate/kind/law/law_reference.h"
#include "costate/optimize/optimizer.h"

namespace costate::app {

namespace {

const char* constraints_of(const Formulation& f) {
  switch (f.constraints) {
    case ConstraintForm::acceleration:
      return "at acceleration level";
    case ConstraintForm::index2:
      return "at position and velocity level";
    case ConstraintForm::index3:
      return "at position level";
    case ConstraintForm::independent:
      return "solved, motion in independent coordinates";
  }
  return "";
}

ReferenceEntry of_formulation(const Formulation& f) {
  ReferenceEntry e{"formulation", f.name, f.name, f.summary, {}, {}, {}};
  std::vector<std::string> integrators, methods;
  for (const Integrator* i : integrators_of(f)) integrators.push_back(i->name);
  for (const auto& m : sensitivity_methods())
    if (refusal(m, f).empty()) methods.push_back(m.name);
  e.remarks = {
      fmt::format("integrators: {} (default {})", fmt::join(integrators, ", "), f.default_integrator),
      fmt::format("constraints: {}; {}; {}", constraints_of(f), f.exact_constraints() ? "exact" : "soft, O(1/alpha)",
                  f.carries_redundancy ? "redundant rows are carried" : "no redundant rows"),
      fmt::format("gradient methods: {}", fmt::join(methods, ", ")),
      fmt::format("hand-derived adjoint: {}; Hessian-vector products: {}; adjoints of one's own: {}",
                  !f.make_hand_adjoint   ? "no"
                  : f.adjoint_order == 2 ? "of second order"
                                         : "of first order",
                  f.make_hessian ? "yes" : "no", f.candidate_stabilization ? "yes" : "no")};
  for (const FormulationOption& o : f.options) {
    KeyEntry k;
    k.key = o.key;
    k.unit = unit_of_key(o.key);
    k.what = o.is_number() ? "a number" : fmt::format("one of {}", fmt::join(o.words, ", "));
    k.default_value = o.is_number() ? fmt::format("{:g}", o.number) : "\"" + o.words.front() + "\"";
    k.meaning = o.help + (o.flag.empty() ? "" : " (" + o.flag + ")");
    k.rule = o.rule;
    e.keys.push_back(std::move(k));
  }
  return e;
}

/// What a key's value is, without the article: "number > 0".
std::string value_of(const KeyEntry& k) {
  std::string what = k.what;
  for (const char* article : {"a ", "an "})
    if (what.rfind(article, 0) == 0) what.erase(0, std::string(article).size());
  if (what == "string") what = "text";
  if (what == "array of strings") what = "texts";
  if (what == "array of numbers") what = "numbers";
  if (what == "array of arrays of numbers") what = "rows of numbers";
  if (k.rule == NumberRule::positive) what += " > 0";
  if (k.rule == NumberRule::non_negative) what += " >= 0";
  return what;
}

std::string default_of(const KeyEntry& k) {
  if (k.need == KeyEntry::Need::always) return "required";
  if (k.need == KeyEntry::Need::in_its_form) return "by form";
  return k.default_value;
}

constexpr const char* kByForm = "by form: required where the form of the table that is written has this key";

bool has_forms(const ReferenceEntry& e) {
  return std::any_of(e.keys.begin(), e.keys.end(), [](const auto& k) { return k.need == KeyEntry::Need::in_its_form; });
}

/// In a table of Markdown.
std::string cell(std::string text) {
  for (std::size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2) text.insert(at, "\\");
  return text;
}

}  // namespace

const std::vector<std::pair<std::string, std::string>>& reference_families() {
  static const std::vector<std::pair<std::string, std::string>> families = {{"settings", "Settings"},
                                                                            {"kinds", "Kinds"},
                                                                            {"laws", "Laws"},
                                                                            {"costs", "Costs"},
                                                                            {"formulations", "Formulations"},
                                                                            {"methods", "Methods"},
                                                                            {"algorithms", "Algorithms"}};
  return families;
}

std::vector<ReferenceEntry> reference_entries() {
  std::vector<ReferenceEntry> r;
  for (auto& s : settings_reference()) {
    std::string name = s.header.substr(0, s.header.find('.'));
    name.erase(std::remove(name.begin(), name.end(), '['), name.end());
    name.erase(std::remove(name.begin(), name.end(), ']'), name.end());
    r.push_back({"setting", name, s.header, s.summary, {}, std::move(s.keys), {}});
  }
  for (const auto& k : scene_kinds())
    r.push_back({"kind", k.name, "[" + k.name + ".NAME]", k.summary, {}, scene_kind_keys(k), k.example});
  for (const auto& k : law_kinds())
    r.push_back({"law", k.name, "{ kind = \"" + k.name + "\", ... }", k.summary, {}, law_keys(k), k.example});
  for (const auto& k : cost_kinds())
    r.push_back({"cost",
                 k.name,
                 "[[cost.running]] or [[cost.terminal]] with kind = \"" + k.name + "\"",
                 k.summary,
                 {},
                 cost_kind_keys(k),
                 key_example("cost " + k.name)});
  for (const auto& f : formulations()) r.push_back(of_formulation(f));
  for (const auto& m : sensitivity_methods()) {
    ReferenceEntry e{"method", m.name, m.name, m.summary, {}, {}, {}};
    std::vector<std::string> with;
    for (const auto& f : formulations())
      if (refusal(m, f).empty()) with.push_back(f.name);
    e.remarks = {fmt::format("formulations: {}", fmt::join(with, ", "))};
    r.push_back(std::move(e));
  }
  for (const auto& a : optimizer_algorithms())
    r.push_back({"algorithm",
                 a.name,
                 a.name,
                 a.summary,
                 {a.takes_constraints ? "takes constraints" : "takes bounds alone"},
                 {},
                 {}});
  return r;
}

std::string reference_text(const ReferenceEntry& e, bool with_example) {
  std::string t = fmt::format("{}  {}\n", e.title, e.summary);
  for (const auto& remark : e.remarks) t += "  " + remark + "\n";
  std::size_t key = 0, value = 0, unit = 0, otherwise = 0;
  for (const auto& k : e.keys) {
    key = std::max(key, k.key.size());
    value = std::max(value, std::min<std::size_t>(value_of(k).size(), 30));
    unit = std::max(unit, k.unit.size());
    otherwise = std::max(otherwise, default_of(k).size());
  }
  for (const auto& k : e.keys)
    t += fmt::format("  {:<{}}  {:<{}}  {:<{}}  {:<{}}  {}\n", k.key, key, k.unit, unit, default_of(k), otherwise,
                     value_of(k), value, k.meaning);
  if (has_forms(e)) t += fmt::format("  ({})\n", kByForm);
  if (with_example && !e.example.empty()) {
    const std::size_t from = e.example.find_first_not_of('\n'), to = e.example.find_last_not_of('\n');
    t += "\nExample\n" + e.example.substr(from, to - from + 1) + "\n";
  }
  return t;
}

Json reference_json(const ReferenceEntry& e) {
  Json j{{"family", e.family}, {"name", e.name}, {"title", e.title}, {"summary", e.summary}};
  j["remarks"] = e.remarks;
  j["keys"] = Json::array();
  for (const auto& k : e.keys)
    j["keys"].push_back({{"key", k.key},
                         {"unit", k.unit},
                         {"value", value_of(k)},
                         {"required", k.need == KeyEntry::Need::always},
                         {"required_by_form", k.need == KeyEntry::Need::in_its_form},
                         {"default", k.default_value},
                         {"meaning", k.meaning}});
  if (!e.example.empty()) j["example"] = e.example;
  return j;
}

std::string reference_markdown(const std::vector<ReferenceEntry>& entries) {
  std::string t = fmt::format("\n*{}.*\n", kByForm), family;
  for (const ReferenceEntry& e : entries) {
    if (e.family == "formulation") break;  // what is chosen for a run stands in solvers/README.md
    if (e.family != family) {
      for (const auto& [name, title] : reference_families())
        if (name.rfind(e.family, 0) == 0) t += fmt::format("\n### {}\n", title);
      family = e.family;
    }
    t += fmt::format("\n**`{}`** {}\n", e.title, e.summary);
    if (e.keys.empty()) continue;
    t += "\n| key | unit | default | value | meaning |\n|---|---|---|---|---|\n";
    for (const auto& k : e.keys)
      t += fmt::format("| `{}` | {} | {} | {} | {} |\n", k.key, k.unit, cell(default_of(k)), cell(value_of(k)),
                       cell(k.meaning));
  }
  return t + "\n";
}

}  // namespace costate::app
