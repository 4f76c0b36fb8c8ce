#include "baseline.h"

#include <fmt/format.h>

#include <cmath>
#include <set>

#include "costate/base/error.h"
#include "costate/base/text_file.h"
#include "costate/record/atomic_file.h"
#include "costate/record/json_number.h"

namespace costate::app {

namespace {

/// Commands whose results can be kept.
const std::vector<std::string> kRunnables = {"simulate", "gradient", "optimize"};

/// Options about where results go: a baseline does not choose them.
const std::vector<std::string> kNotInBaselines = {"json",   "quiet", "verbose", "output",     "no-files",
                                                  "resume", "csv",   "help",    "output-step"};

constexpr std::size_t kLongestFile = 64 << 20;  // bytes
constexpr double kTolerances = 1000;            // times rtol and atol, as in costate check

class Reader {
 public:
  explicit Reader(const std::filesystem::path& file) : file_(file) {}

  [[noreturn]] void complain(const std::string& key, const std::string& message) const {
    throw Error(fmt::format("{}: {}{}{}", file_.string(), key, key.empty() ? "" : ": ", message));
  }

  Json parse() const {
    const std::string text = read_text_file(file_.string(), kLongestFile, "The baseline");
    std::vector<std::set<std::string>> keys;
    const auto twice = [&](int, Json::parse_event_t event, Json& value) {
      if (event == Json::parse_event_t::object_start) keys.emplace_back();
      if (event == Json::parse_event_t::object_end) keys.pop_back();
      if (event == Json::parse_event_t::key && !keys.back().insert(value.get<std::string>()).second)
        complain(value.get<std::string>(), "This key is there twice; keep one of them.");
      return true;
    };
    try {
      return Json::parse(text, twice);
    } catch (const Json::out_of_range&) {
      complain("", "It holds a number beyond 1.8e308, the largest there is.");
    } catch (const Json::parse_error& e) {
      const std::string before = text.substr(0, e.byte > 0 ? e.byte - 1 : 0);
      const std::size_t start = before.rfind('\n');
      throw Error(fmt::format("{}:{}:{}: A baseline is a JSON object, and this is no JSON: {}.", file_.string(),
                              1 + std::count(before.begin(), before.end(), '\n'),
                              before.size() - (start == std::string::npos ? 0 : start + 1) + 1, json_reason(e)));
    }
  }

  void known_keys(const Json& object, const std::string& where, const std::vector<std::string>& known) const {
    for (const auto& [key, value] : object.items())
      if (std::find(known.begin(), known.end(), key) == known.end())
        complain(where + key, fmt::format("There is no such key here.{}", suggestion(key, known)));
  }

  std::string text(const Json& object, const std::string& key, const char* what, bool required) const {
    if (!object.contains(key)) {
      if (required) complain(key, fmt::format("This key is missing; {}.", what));
      return {};
    }
    const Json& value = object.at(key);
    if (!value.is_string() || value.get<std::string>().empty())
      complain(key, fmt::format("Expected text ({}), found {}.", what, value.dump()));
    return value.get<std::string>();
  }

  std::optional<double> number(const Json& object, const std::string& where, const char* key) const {
    if (!object.contains(key)) return {};
    const Json& value = object.at(key);
    if (!value.is_number()) complain(where + key, fmt::format("Expected a number, found {}.", value.dump()));
    return value.get<double>();
  }

  Quantity quantity(const std::string& name, const Json& object) const {
    const std::string where = "quantities." + name + ".";
    if (!object.is_object())
      complain("quantities." + name,
               fmt::format("Expected an object with value, relative and/or absolute, and reason, found {}. "
                           "Write {{}} and run 'costate regress --update' to have it filled in.",
                           object.dump()));
    known_keys(object, where, {"value", "relative", "absolute", "reason"});
    Quantity q;
    q.name = name;
    q.value = number(object, where, "value");
    q.relative = number(object, where, "relative");
    q.absolute = number(object, where, "absolute");
    for (const auto& [key, tolerance] : {std::pair{"relative", q.relative}, std::pair{"absolute", q.absolute}})
      if (tolerance && !(*tolerance >= 0 && std::isfinite(*tolerance)))
        complain(where + key, fmt::format("A tolerance must not be negative, found {}.", *tolerance));
    if (q.value && !q.has_tolerance())
      complain("quantities." + name,
               "A value needs a tolerance: give relative and/or absolute, and the reason; or remove the "
               "value and run "
               "'costate regress --update', which fills in all of them.");
    if (object.contains("reason") && object.at("reason").is_string()) q.reason = object.at("reason");
    if (q.reason.empty() && (q.has_tolerance() || object.contains("reason")))
      complain(where + "reason", fmt::format("Expected text that says why the tolerance is what it is, found {}.",
                                             object.contains("reason") ? object.at("reason").dump() : "nothing"));
    return q;
  }

 private:
  const std::filesystem::path& file_;
};

/// The words of a command line for an option of a baseline.
void append_words(std::vector<std::string>& words, const std::string& key, const Json& value) {
  const auto word = [&](const Json& v) {
    words.push_back(fmt::format("--{}={}", key, v.is_string() ? v.get<std::string>() : v.dump()));
  };
  if (value.is_boolean()) {
    if (value.get<bool>()) words.push_back("--" + key);
  } else if (value.is_array()) {
    for (const Json& v : value) word(v);
  } else {
    word(value);
  }
}

/// Every number below, by its path; lists by their length.
void flatten(const Json& value, const std::string& path, std::vector<std::pair<std::string, double>>& numbers) {
  if (value.is_object()) {
    for (const auto& [key, v] : value.items()) flatten(v, path.empty() ? key : path + "." + key, numbers);
  } else if (value.is_array()) {
    numbers.emplace_back(path, static_cast<double>(value.size()));
  } else if (value.is_number()) {
    numbers.emplace_back(path, value.get<double>());
  } else if (value.is_boolean()) {
    numbers.emplace_back(path, value.get<bool>() ? 1 : 0);
  }
}

/// Counts without a decimal point.
Json number_json(double x) {
  return x == std::floor(x) && std::abs(x) < 1e15 ? Json(static_cast<long long>(x)) : Json(x);
}

const std::string kCompilers = "another compiler or processor moves a run within its own error";

std::vector<Quantity> default_quantities(const std::string& command, const Setup& setup, const Json& summary) {
  const double rtol = setup.problem.solver.rtol, relative = rounded(kTolerances * rtol),
               absolute = rounded(kTolerances * setup.problem.solver.absolute());
  std::vector<Quantity> list;
  const auto add = [&](const std::string& name, std::optional<double> r, std::optional<double> a,
                       const std::string& reason) {
    list.push_back({name, {}, r, a, reason});
  };
  const double psi = summary.at("psi").get<double>();
  if (command == "optimize") {
    const double initial = summary.at("initial").at("psi").get<double>();
    add("psi", {}, rounded(relative * std::abs(initial)),
        fmt::format("{:g} times rtol {:g} of the first design's psi: at the optimum psi may be zero", kTolerances,
                    rtol));
    add("initial.psi", relative, {}, fmt::format("{:g} times rtol {:g}: {}", kTolerances, rtol, kCompilers));
  } else if (psi != 0) {
    add("psi", relative, {}, fmt::format("{:g} times rtol {:g}: {}", kTolerances, rtol, kCompilers));
  } else {
    add("psi", {}, absolute, fmt::format("{:g} times atol, psi being zero: {}", kTolerances, kCompilers));
  }
  const auto& parameters = setup.problem.parameters.parameters;
  if (command == "gradient") {
    double size = 0;
    for (const auto& p : parameters)
      size = std::max(size, std::abs(summary.at("gradient").at(p.name).get<double>()) * p.scale);
    for (const auto& p : parameters)
      add("gradient." + p.name, {}, size > 0 ? rounded(relative * size / p.scale) : absolute,
          fmt::format("{:g} times rtol {:g} of the largest scaled component: {}", kTolerances, rtol, kCompilers));
  }
  if (command == "optimize") {
    for (const auto& p : parameters)
      add("parameters." + p.name, {}, rounded(std::sqrt(rtol) * p.scale),
          fmt::format("the square root of rtol {:g} times the parameter's scale: near an optimum psi is flat", rtol));
    add("evaluations", 0.25, 2.0, "the path of an optimizer depends on rounding; the number shows its speed only");
  }
  if (command == "simulate")
    for (const auto& c : setup.problem.mechanism->coordinate_names())
      for (const std::string& name : {"terminal." + c, "terminal." + c + "_dot"})
        add(name, relative, absolute, fmt::format("{:g} times rtol {:g} and atol: {}", kTolerances, rtol, kCompilers));
  if (command != "optimize")
    for (const std::string name : {"steps", "backward_steps"})
      if (summary.at("counters").at(name) != 0)
        add("counters." + name, 0.25, 5.0,
            "the choice of steps depends on rounding; the number shows the cost of a run only");
  return list;
}

}  // namespace

std::vector<std::string> baseline_commands() { return kRunnables; }

Baseline Baseline::load(const std::filesystem::path& file) {
  const Reader reader(file);
  const Json json = reader.parse();
  const std::string example = "a baseline is at least {\"scene\": \"../five_bar.toml\", \"command\": \"gradient\"}";
  if (!json.is_object())
    reader.complain("", fmt::format("Expected a JSON object, found {}; {}.", json.type_name(), example));
  reader.known_keys(json, "", {"about", "scene", "command", "options", "quantities"});
  Baseline b;
  b.file = file;
  b.about = reader.text(json, "about", "what this case is for", false);
  b.scene = reader.text(json, "scene", ("the path of the scene from this file; " + example).c_str(), true);
  b.command = reader.text(json, "command", "simulate, gradient or optimize", true);
  const auto commands = baseline_commands();
  if (std::find(commands.begin(), commands.end(), b.command) == commands.end())
    reader.complain("command", fmt::format("Expected simulate, gradient or optimize, found '{}'.{}", b.command,
                                           suggestion(b.command, commands)));
  if (json.contains("options")) b.options = json.at("options");
  if (!b.options.is_object())
    reader.complain("options",
                    fmt::format("Expected an object such as {{\"formulation\": \"index1\", \"rtol\": 1e-8}}, "
                                "found {}.",
                                b.options.dump()));
  for (const auto& [key, value] : b.options.items()) {
    const auto scalar = [](const Json& v) { return v.is_string() || v.is_number() || v.is_boolean(); };
    if (!scalar(value) && !(value.is_array() && std::all_of(value.begin(), value.end(), scalar)))
      reader.complain("options." + key,
                      fmt::format("Expected text, a number, true, or a list of these, found {}.", value.dump()));
  }
  if (json.contains("quantities")) {
    const Json& quantities = json.at("quantities");
    if (!quantities.is_object())
      reader.complain("quantities",
                      fmt::format("Expected an object such as {{\"psi\": {{}}}}, found {}.", quantities.dump()));
    for (const auto& [name, object] : quantities.items()) b.quantities.push_back(reader.quantity(name, object));
  }
  return b;
}

void Baseline::write() const {
  Json json;
  if (!about.empty()) json["about"] = about;
  json["scene"] = scene;
  json["command"] = command;
  if (!options.empty()) json["options"] = options;
  json["quantities"] = Json::object();
  for (const Quantity& q : quantities) {
    Json& j = json["quantities"][q.name] = Json::object();
    if (q.value) j["value"] = number_json(*q.value);
    if (q.relative) j["relative"] = *q.relative;
    if (q.absolute) j["absolute"] = *q.absolute;
    if (!q.reason.empty()) j["reason"] = q.reason;
  }
  write_file_atomically(file, json.dump(2) + "\n");
}

const double* Measurement::find(const std::string& name) const {
  for (const auto& [n, value] : numbers)
    if (n == name) return &value;
  return nullptr;
}

Quantity Measurement::with_default(const std::string& name) const {
  for (const Quantity& q : defaults)
    if (q.name == name) return q;
  Quantity q = fallback_;
  q.name = name;
  return q;
}

Measurement measure(const Baseline& baseline, bool quiet, const std::vector<std::string>& overrides) {
  CommandLine line;
  CommonOptions& common = line.common();
  std::vector<std::string> names;
  for (const auto& name : line.option_names(baseline.command))
    if (std::find(kNotInBaselines.begin(), kNotInBaselines.end(), name) == kNotInBaselines.end()) names.push_back(name);
  std::vector<std::string> words = {baseline.command, baseline.scene_path().string()};
  if (baseline.command == "gradient") words.push_back("--no-confirm");  // of the one run, with its counters
  for (const auto& [key, value] : baseline.options.items()) {
    if (std::find(names.begin(), names.end(), key) == names.end())
      throw Error(fmt::format("options.{}: A baseline of 'costate {}' has no such option.{}", key, baseline.command,
                              suggestion(key, names)));
    append_words(words, key, value);
  }
  for (const std::string& value : overrides) words.insert(words.end(), {"--set", value});
  try {
    line.parse(words);
  } catch (const UsageError& e) {
    throw Error(fmt::format("options: {}", e.what()));
  }
  common.no_files = true;
  common.quiet = quiet;
  Measurement m;
  common.take = [&](const Setup& setup, const Json& summary) {
    flatten(summary, "", m.numbers);
    m.defaults = default_quantities(baseline.command, setup, summary);
    const double rtol = setup.problem.solver.rtol;
    m.fallback_ = {"",
                   {},
                   rounded(kTolerances * rtol),
                   rounded(kTolerances * setup.problem.solver.absolute()),
                   fmt::format("{:g} times rtol {:g} and atol: {}", kTolerances, rtol, kCompilers)};
  };
  line.action()();
  return m;
}

}  // namespace costate::app
