// What --accuracy is of: of outputs that are named, and what is told of all else that a simulation stores.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <string>

#include "csv_table.h"
#include "process.h"

using namespace costate::test;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

namespace {

/// A bob on a spring that gets stiffer, with a damper: energies that lose digits of forces.
const char* const kBob = R"toml(
[gravity]
y_m_per_s2 = -9.81
[point.A]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 0.6
y_m = -0.8
[mass.bob]
point = "P"
mass_kg = 1.5
[spring.h]
from = "A"
to = "P"
natural_length_m = 0.9
stiffness_N_per_m = 40
spring_law = { kind = "polynomial", coefficients = [0, 0, 0, 300] }
damper_law = { kind = "polynomial", coefficients = [0, 0.4, 0, 0.8] }
[start]
given = ["P.x", "P.y"]
[[cost.running]]
kind = "square"
output = "h.force"
[run]
t_end_s = 6
)toml";

Table stored(const WorkingDirectory& here, const std::string& directory) {
  return read_table(file_text(here / (directory + "/trajectory.csv")));
}

/// The largest difference of a column to the right one, of its range.
double off(const Table& found, const Table& right, const std::string& column) {
  const auto a = found.column(column), b = right.column(column);
  REQUIRE(a.size() == b.size());
  const auto [low, high] = std::minmax_element(b.begin(), b.end());
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(a[i] - b[i]));
  return most / (*high - *low);
}

}  // namespace

// Errors are looked at at 60 times, of some 30 steps: between them energies were 2.2 times as far off as that tells.
// The page claims that nothing is off by more than five times what is asked.
TEST_CASE("accuracy: what is stored besides says how far it is off", "[accuracy]") {
  const WorkingDirectory here;
  write_text(here / "bob.toml", kBob);
  const auto simulate = [&](std::vector<std::string> arguments, const std::string& directory) {
    arguments.insert(arguments.begin(),
                     {"simulate", "bob.toml", "--csv", "--output-step", "0.06", "--output", directory});
    return costate_json(arguments, here.path());
  };
  simulate({"--rtol", "1e-12"}, "right");
  const Table right = stored(here, "right");
  for (const char* a : {"1e-3", "1e-4", "1e-6"}) {
    CAPTURE(a);
    const Json run = simulate({"--accuracy", a}, "all");
    const Json& accuracy = run.at("accuracy");
    CHECK(accuracy.at("met") == true);
    const double besides = accuracy.at("stored_error").get<double>(), asked = std::stod(a);
    CHECK(accuracy.at("stored_worst").is_string());
    const Table all = stored(here, "all");
    for (const auto& column : right.heading) {
      if (column.starts_with("time")) continue;
      CAPTURE(column, besides);
      const bool counts = column.starts_with("coordinates/");
      CHECK(off(all, right, column) <= (counts ? asked : 3 * besides));
    }
    CHECK((run.at("warnings").dump().find("besides") != std::string::npos) == (besides > asked));
    // What is named is as accurate as it is asked to be.
    const Json named = simulate({"--accuracy", a, "--outputs", "energy.total,P.x_ddot"}, "named");
    CHECK(named.at("accuracy").at("met") == true);
    CHECK(named.at("accuracy").at("stored_error").is_null());
    const Table two = stored(here, "named");
    for (const auto& column : two.heading)
      if (!column.starts_with("time")) CHECK(off(two, right, column) <= 5 * asked);
  }
}
