// Ctrl-C and SIGTERM in every phase of commands on ten thousand bars: reading, setting up, stepping, sampling, writing.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <csignal>
#include <fstream>

#include "process.h"

using Catch::Matchers::Contains;
using costate::test::Outcome;
using costate::test::Process;
using costate::test::WorkingDirectory;
using costate::test::write_text;

namespace {

/// Memory in use by the one process that this one has started [MiB]; 0 while there is none.
double resident_MiB() {
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    pid_t child = 0;
    if (!(std::ifstream(task.path() / "children") >> child)) continue;
    double all = 0, resident = 0;
    std::ifstream("/proc/" + std::to_string(child) + "/statm") >> all >> resident;
    return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / (1 << 20);
  }
  return 0;
}

/// Bars one below the other, each with a damped spring from its end to the ground; `twice`: every hundredth is there a
/// second time.
std::string chain(int bars, bool twice) {
  std::string text = "[gravity]\ny_m_per_s2 = -9.81\n[point.P0]\nground = true\nx_m = 0\ny_m = 0\n", given;
  const double side = 0.2 * std::sqrt(0.5);
  const auto bar = [&](const std::string& name, int i) {
    text += fmt::format("[bar.{}]\nfrom = \"P{}\"\nto = \"P{}\"\nmass_kg = 0.1\n", name, i - 1, i);
  };
  for (int i = 1; i <= bars; ++i) {
    text += fmt::format("[point.P{0}]\nx_m = {1}\ny_m = -{1}\n", i, i * side);
    bar(fmt::format("B{}", i), i);
    if (twice && i % 100 == 0) bar(fmt::format("T{}", i), i);
    text += fmt::format("[point.A{0}]\nground = true\nx_m = {1}\ny_m = -{2}\n", i, i * side, i * side + 1);
    text += fmt::format(
        "[spring.S{0}]\nfrom = \"P{0}\"\nto = \"A{0}\"\nstiffness_N_per_m = 5\nnatural_length_m = 1\n"
        "damping_N_s_per_m = 0.2\n",
        i);
    given += fmt::format("\"P{}.x\", ", i);
  }
  return text + fmt::format(
                    "[start]\ngiven = [{0}]\n[[cost.running]]\nkind = \"square\"\noutput = \"P{1}.y\"\n"
                    "[parameter.m]\nnumber = \"bar.B{1}.mass_kg\"\n[run]\nt_end_s = 100\nrtol = 1e-5\n"
                    "output_step_s = 0.01\n",
                    given, bars);
}

}  // namespace

// What they do by then is told by the memory that they have in use. The run never ends by itself: who does not heed the
// signal is not ended by the end of its work, and this test by its limit. (Below 25 MiB there is no handler yet.)
TEST_CASE("ten thousand bars: a signal ends every phase, and leaves nothing behind") {
  const WorkingDirectory here;
  write_text(here / "chain.toml", chain(10000, false));
  write_text(here / "twice.toml", chain(10000, true));
  const std::vector<std::vector<std::string>> commands = {
      {"simulate", "chain.toml", "--json"},
      {"gradient", "chain.toml", "--json", "--no-confirm"},
      {"simulate", "twice.toml", "--json", "--formulation", "augmented-lagrangian"},
  };
  const std::vector<std::vector<double>> phases = {{40, 150, 320}, {80, 200}, {150, 250}};
  for (std::size_t c = 0; c < commands.size(); ++c)
    for (const double phase : phases[c]) {
      INFO(commands[c][0] << " " << commands[c][1] << " at " << phase << " MiB");
      Process process(COSTATE_EXECUTABLE, commands[c], here.path());
      REQUIRE(process.wait_until([&] { return resident_MiB() >= phase; }));
      const int signal_number = c % 2 == 0 ? SIGINT : SIGTERM;
      process.send(signal_number);
      const Outcome o = process.finish();
      CHECK(o.status == 128 + signal_number);
      CHECK_THAT(o.err, Contains("interrupted by"));
      const nlohmann::json j = costate::test::one_object(o.out);
      CHECK(j.at("status") == "interrupted");
      CHECK(here.entries() == std::vector<std::string>{"chain.toml", "twice.toml"});
    }
}
