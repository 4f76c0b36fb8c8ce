#include "kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <regex>
#include <set>

#include "costate/base/error.h"
#include "costate/objective/all_outputs.h"
#include "costate/scene/scene.h"
#include "costate/scene/scene_kind.h"

namespace costate::adversary {

namespace {

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : engine(seed * 0xD1B54A32D192ED03ull + 7) {}
  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(engine); }
  std::size_t pick(std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(engine); }
  bool chance(double p) { return uniform(0, 1) < p; }
  std::mt19937_64 engine;
};

double number_of(const Scene& scene, const std::string& path) {
  const auto& all = scene.mechanism()->numbers();
  const auto at = std::find_if(all.begin(), all.end(), [&](const auto& n) { return n.path == path; });
  return scene.mechanism()->base_numbers()[static_cast<std::size_t>(at - all.begin())];
}

/// Without what the example says of costs and runs.
std::string bare(const Scene& scene) {
  std::string text = scene.dump();
  for (const char* table : {"[[cost", "[run]", "[optimize", "[parameter"})
    for (std::size_t at; (at = text.find(std::string("\n") + table)) != std::string::npos;) {
      const std::size_t end = text.find("\n[", at + 2);
      text.erase(at, (end == std::string::npos ? text.size() : end) - at);
    }
  return text;
}

std::string join(const std::vector<std::string>& paths) {
  std::string list;
  for (const auto& n : paths) list += fmt::format("{}\"{}\"", list.empty() ? "" : ", ", n);
  return list;
}

/// A law of time of size 1: steady, or something that comes late and is short.
std::string event(Dice& dice, double t_end, double size) {
  const double at = dice.uniform(0, 0.95) * t_end, length = t_end * std::pow(10, dice.uniform(-3, -0.3));
  switch (dice.pick(4)) {
    case 0:
      return fmt::format("{{ kind = \"sine\", amplitude = {:.4g}, angular_frequency_rad_per_s = {:.3f} }}", size,
                         dice.uniform(1, 30));
    case 1:
      return fmt::format("{{ kind = \"bump\", height_m = {:.4g}, start_m = {:.4f}, length_m = {:.6f} }}", size / 2, at,
                         length);
    case 2:
      return fmt::format(
          "{{ kind = \"bump\", shape = \"half_sine\", height_m = {:.4g}, start_m = {:.4f}, length_m = {:.6f} }}", size,
          at, length);
    default:
      return fmt::format("{{ kind = \"steps\", at = [{:.4f}], values = [0, {:.4g}], width = {:.6f} }}", at, size,
                         length);
  }
}

/// A force on a point that is free, late and short.
std::string pulse(Dice& dice, const Scene& scene, double t_end) {
  std::vector<std::string> points;
  const std::string text = scene.dump();
  static const std::regex header(R"(\n\[point\.([A-Za-z0-9_]+)\])");
  for (std::sregex_iterator i(text.begin(), text.end(), header), end; i != end; ++i) points.push_back((*i)[1]);
  if (points.empty()) return {};
  const std::string force =
      fmt::format("\n[force.adversary]\npoint = \"{}\"\n{}_N = {}\n", points[dice.pick(points.size())],
                  dice.chance(0.5) ? "x" : "y", event(dice, t_end, dice.uniform(1, 30)));
  try {
    Scene::parse(text + force, "with a force");
    return force;
  } catch (const Error&) {
    return {};
  }
}

/// One cost or two on any outputs, steady or with events of their own.
std::string costs(Dice& dice, const Scene& scene, double t_end) {
  const auto outputs = make_all_outputs(*scene.mechanism());
  std::string text;
  for (std::size_t k = 1 + dice.pick(2); k > 0; --k) {
    const bool terminal = dice.chance(0.3), square = dice.chance(0.7);
    text += fmt::format(
        "\n[[cost.{}]]\nkind = \"{}\"\noutput = \"{}\"\nweight = {:.4g}\ntarget = ", terminal ? "terminal" : "running",
        square ? "square" : "value", outputs[dice.pick(outputs.size())]->name(), std::pow(10, dice.uniform(-2, 2)));
    text += !terminal && dice.chance(0.3) ? event(dice, t_end, 0.5) : fmt::format("{:.3f}", dice.uniform(-0.5, 0.5));
  }
  return text + "\n";
}

/// The same scene with other names.
KindVariant renamed(const std::string& text, const std::vector<std::string>& parameters) {
  static const std::regex header(R"(\n\[+([a-z_]+)\.([A-Za-z0-9_]+)\])"), word(R"([A-Za-z_][A-Za-z0-9_]*)");
  std::set<std::string> names, others{"cost"};
  for (const SceneKind& kind : scene_kinds()) others.insert(kind.name);
  for (std::sregex_iterator i(text.begin(), text.end(), header), end; i != end; ++i)
    if ((*i)[1] != "cost" && (*i)[1] != "parameter") names.insert((*i)[2]);
  // What is a key as well, or the name of a law, stays.
  static const std::regex key(R"(([A-Za-z_][A-Za-z0-9_]*) *=)"), of_kind(R"~(kind = "([a-z_0-9]+)")~");
  for (const std::regex& r : {key, of_kind})
    for (std::sregex_iterator i(text.begin(), text.end(), r), end; i != end; ++i) others.insert((*i)[1]);
  const auto rename = [&](const std::string& from) {
    std::string to;
    std::size_t last = 0;
    for (std::sregex_iterator i(from.begin(), from.end(), word), end; i != end; ++i) {
      const auto at = static_cast<std::size_t>(i->position());
      to += from.substr(last, at - last);
      const std::string w = i->str();
      to += names.count(w) > 0 && others.count(w) == 0 ? "z9" + std::string(w.rbegin(), w.rend()) : w;
      last = at + w.size();
    }
    return to + from.substr(last);
  };
  KindVariant v{"renamed", rename(text), {}};
  for (const auto& p : parameters) v.parameters.push_back(rename(p));
  return v;
}

/// The same scene with its tables in another order.
KindVariant reordered(Dice& dice, const std::string& text, const std::vector<std::string>& parameters) {
  std::vector<std::string> blocks;
  std::size_t begin = text.find("\n[");
  const std::string first = text.substr(0, begin);
  while (begin != std::string::npos) {
    const std::size_t end = text.find("\n[", begin + 2);
    blocks.push_back(text.substr(begin, end == std::string::npos ? end : end - begin));
    begin = end;
  }
  std::shuffle(blocks.begin(), blocks.end(), dice.engine);
  std::string all = first;
  for (const auto& b : blocks) all += b + "\n";
  return {"reordered", all, parameters};
}

}  // namespace

KindScene random_kind_scene(std::uint64_t seed, bool harder) {
  Dice dice(seed);
  KindScene r;
  const auto& kinds = scene_kinds();
  const auto& kind = kinds[dice.pick(kinds.size())];
  r.kind = kind.name;
  if (kind.example.empty()) return r;
  try {
    Scene scene = Scene::parse(kind.example, "example");
    std::vector<std::string> numbers;
    for (const auto& n : scene.mechanism()->numbers())
      if (n.fixed_because.empty()) numbers.push_back(n.path);
    if (numbers.empty()) return r;
    for (std::size_t k = dice.pick(4); k > 0; --k) {
      const std::string path = numbers[dice.pick(numbers.size())];
      const double value = number_of(scene, path);
      // Now and then by orders of magnitude: what locks, is light, stiff or large.
      const auto factor = [&] {
        return harder && dice.chance(0.4) ? std::pow(10, dice.uniform(-3, 3)) : dice.uniform(0.7, 1.3);
      };
      try {
        scene = scene.with_number(path, value == 0 ? dice.uniform(-0.2, 0.2) : value * factor());
      } catch (const Error&) {
        continue;
      }
    }
    std::shuffle(numbers.begin(), numbers.end(), dice.engine);
    numbers.resize(std::min<std::size_t>(numbers.size(), 1 + dice.pick(2)));
    r.parameters = numbers;
    if (!harder) {
      const auto outputs = make_all_outputs(*scene.mechanism());
      const std::string output = outputs[dice.pick(outputs.size())]->name();
      const double t_end = dice.uniform(0.1, 0.8), target = dice.uniform(-0.5, 0.5);
      r.text = bare(scene) + fmt::format(
                                 "\n[[cost.running]]\nkind = \"square\"\noutput = \"{}\"\ntarget = {:.3f}\n[run]\n"
                                 "t_end_s = {:.3f}\nrtol = 1e-8\nparameters = [{}]\n",
                                 output, target, t_end, join(numbers));
    } else {
      const double t_end = std::pow(10, dice.uniform(-2, 0.5));
      r.text = bare(scene);
      if (dice.chance(0.5)) r.text += pulse(dice, scene, t_end);
      r.text += costs(dice, scene, t_end) +
                fmt::format("[run]\nt_end_s = {:.4f}\nrtol = 1e-8\nparameters = [{}]\n", t_end, join(numbers));
    }
    Scene::parse(r.text, "random scene");
  } catch (const Error&) {
    r.text.clear();
    return r;
  }
  if (!harder) return r;
  for (const KindVariant& v : {renamed(r.text, r.parameters), reordered(dice, r.text, r.parameters)}) try {
      Scene::parse(v.text, v.name).mechanism()->select(v.parameters);
      r.variants.push_back(v);
    } catch (const Error&) {
      continue;
    }
  return r;
}

}  // namespace costate::adversary
