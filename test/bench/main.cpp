// costate_bench [NAME...] [--json] [--quick] [--rounds N]: without a name all of the benchmarks below but the parts of
// `vehicle` under names of their own.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iterator>
#include <string>
#include <vector>

#include "benchmark.h"
#include "costate/base/error.h"

namespace costate::bench {

nlohmann::json counters_json(const Counters& c) {
  nlohmann::json j;
  for (const auto& [name, value] : counter_list(c)) j[name] = value;
  j["callbacks"] = callbacks(c);
  return j;
}

namespace {

struct Benchmark {
  const char* name;
  Report (*run)(const Settings&);
  bool part = false;  // of another one
};
constexpr Benchmark kBenchmarks[] = {{"gradients", gradients},
                                     {"parameters", parameters},
                                     {"matrix", matrix},
                                     {"discrete", discrete},
                                     {"peers", peers},
                                     {"bodies", bodies},
                                     {"vehicle", vehicle},
                                     {"requires", requires_of_scenes},
                                     {"reactions", reactions},
                                     {"vehicle_speed", vehicle_speed, true},
                                     {"vehicle_gradients", vehicle_gradients, true},
                                     {"vehicle_number", vehicle_number, true}};

int run(const std::vector<std::string>& arguments) {
  Settings settings;
  bool json = false;
  std::vector<const Benchmark*> chosen;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string& a = arguments[i];
    const auto known =
        std::find_if(std::begin(kBenchmarks), std::end(kBenchmarks), [&](const Benchmark& b) { return a == b.name; });
    if (known != std::end(kBenchmarks)) {
      chosen.push_back(known);
    } else if (a == "--json") {
      json = true;
    } else if (a == "--quick") {
      settings.quick = true;
      settings.rounds = 1;
    } else if (a == "--rounds" && i + 1 < arguments.size()) {
      settings.rounds = std::atoi(arguments[++i].c_str());
    } else {
      std::string names;
      for (const Benchmark& b : kBenchmarks) names += fmt::format(" [{}]", b.name);
      throw Error(
          fmt::format("Unknown argument '{}'. Usage: costate_bench{} [--json] [--quick] [--rounds N]", a, names));
    }
  }
  if (settings.rounds < 1) throw Error("--rounds needs a positive number.");
  if (chosen.empty())
    for (const Benchmark& b : kBenchmarks)
      if (!b.part) chosen.push_back(&b);
  nlohmann::json all;
  for (const Benchmark* b : chosen) {
    const Report r = b->run(settings);
    if (!json) fmt::print("{}\n", r.text);
    std::fflush(stdout);
    all[b->name] = r.json;
  }
  if (json) fmt::print("{}\n", all.dump(2));
  return 0;
}

}  // namespace
}  // namespace costate::bench

int main(int argc, char* argv[]) {
  try {
    return costate::bench::run({argv + 1, argv + argc});
  } catch (const std::exception& e) {
    fmt::print(stderr, "costate_bench: {}\n", e.what());
    return 1;
  }
}
