#include "kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <random>

#include "costate/base/error.h"
#include "costate/objective/all_outputs.h"
#include "costate/scene/scene.h"
#include "costate/scene/scene_kind.h"

namespace costate::adversary {

KindScene random_kind_scene(std::uint64_t seed) {
  std::mt19937_64 engine(seed * 0xD1B54A32D192ED03ull + 7);
  const auto uniform = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(engine); };
  const auto pick = [&](std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(engine); };
  KindScene r;
  const auto& kinds = scene_kinds();
  const auto& kind = kinds[pick(kinds.size())];
  r.kind = kind.name;
  if (kind.example.empty()) return r;
  try {
    Scene scene = Scene::parse(kind.example, "example");
    std::vector<std::string> numbers;
    for (const auto& n : scene.mechanism()->numbers())
      if (n.fixed_because.empty()) numbers.push_back(n.path);
    if (numbers.empty()) return r;
    for (std::size_t k = pick(4); k > 0; --k) {
      const std::string path = numbers[pick(numbers.size())];
      const auto& all = scene.mechanism()->numbers();
      const auto at = std::find_if(all.begin(), all.end(), [&](const auto& n) { return n.path == path; });
      const double value = scene.mechanism()->base_numbers()[static_cast<std::size_t>(at - all.begin())];
      try {
        scene = scene.with_number(path, value == 0 ? uniform(-0.2, 0.2) : value * uniform(0.7, 1.3));
      } catch (const Error&) {
        continue;
      }
    }
    std::shuffle(numbers.begin(), numbers.end(), engine);
    numbers.resize(std::min<std::size_t>(numbers.size(), 1 + pick(2)));
    const auto outputs = make_all_outputs(*scene.mechanism());
    const std::string output = outputs[pick(outputs.size())]->name();
    std::string list;
    for (const auto& n : numbers) list += fmt::format("{}\"{}\"", list.empty() ? "" : ", ", n);
    // Whatever the example says of costs and runs gives way.
    std::string text = scene.dump();
    for (const char* table : {"[[cost", "[run]", "[optimize", "[parameter"})
      for (std::size_t at; (at = text.find(std::string("\n") + table)) != std::string::npos;) {
        const std::size_t end = text.find("\n[", at + 2);
        text.erase(at, (end == std::string::npos ? text.size() : end) - at);
      }
    r.text = text + fmt::format(
                        "\n[[cost.running]]\nkind = \"square\"\noutput = \"{}\"\ntarget = "
                        "{:.3f}\n[run]\nt_end_s = {:.3f}\n"
                        "rtol = 1e-8\nparameters = [{}]\n",
                        output, uniform(-0.5, 0.5), uniform(0.1, 0.8), list);
    Scene::parse(r.text, "random scene");
    r.parameters = numbers;
  } catch (const Error&) {
    r.text.clear();
  }
  return r;
}

}  // namespace costate::adversary
