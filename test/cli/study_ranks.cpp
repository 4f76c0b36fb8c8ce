// costate study on the ranks of an MPI job: each run once, one writer, an orderly end, and the same command goes on
// where it stopped on any number of ranks. Lost ranks: test/mpi/run.
#include <signal.h>

#include <catch2/catch.hpp>
#include <filesystem>

#include "process.h"
#include "support/paths.h"

#ifdef COSTATE_MPIRUN

using namespace costate::test;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

namespace {

std::string sampled(const char* options) {
  return std::string("[[design]]\nname = \"d\"\nscene = \"" COSTATE_MODELS_DIR
                     "/five_bar/five_bar.toml\"\ntask = \"gradient\"\nkind = \"sobol\"\ncount = 7\n"
                     "options = { formulation = \"baumgarte\", method = \"cvodes-adjoint\", ") +
         options + " }\n[design.vary]\n\"spring.S1.stiffness_N_per_m\" = { from = 80, to = 120 }\n";
}

/// mpirun's words: so many ranks of `costate study s.toml --output OUT`, whoever runs them and on however few cores.
std::vector<std::string> on_ranks(int ranks, const std::vector<std::string>& more) {
  std::vector<std::string> words = {"OMPI_ALLOW_RUN_AS_ROOT=1",
                                    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1",
                                    "OMPI_MCA_rmaps_base_oversubscribe=1",
                                    COSTATE_MPIRUN,
                                    "-n",
                                    std::to_string(ranks),
                                    COSTATE_EXECUTABLE,
                                    "study"};
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

}  // namespace

TEST_CASE("study: ranks of MPI share the runs, each once, and make one table") {
  const WorkingDirectory here;
  write_text(here / "s.toml", sampled("t_end = 2.0"));
  REQUIRE(run_costate({"study", "s.toml", "--output", "alone"}, here.path()).status == 0);
  Process job("/usr/bin/env", on_ranks(3, {"s.toml", "--output", "ranks"}), here.path());
  const Outcome o = job.finish();
  INFO(o.err);
  CHECK(o.status == 0);
  CHECK(file_text(here / "ranks/d.csv") == file_text(here / "alone/d.csv"));
  for (int i = 1; i <= 7; ++i) CHECK_THAT(o.err, Contains("/7] d." + std::to_string(i) + ": psi"));
  CHECK_THAT(o.err, Contains("[7/7]"));
  // One writer, on its standard output, too.
  CHECK(o.out.find("results in ranks") == o.out.rfind("results in ranks"));
  // All is kept by the next one, with fewer ranks.
  Process again("/usr/bin/env", on_ranks(2, {"s.toml", "--output", "ranks", "--json"}), here.path());
  const Json kept = Json::parse(again.finish().out);
  CHECK(kept.at("status") == "ok");
  for (const Json& run : kept.at("runs")) CHECK(run.at("status") == "kept");
}

TEST_CASE("study: an MPI job that is interrupted ends in order and goes on without MPI") {
  const WorkingDirectory here;
  write_text(here / "s.toml", sampled("t_end = 400.0"));
  {
    Process job("/usr/bin/env", on_ranks(3, {"s.toml", "--output", "out"}), here.path());
    REQUIRE(job.wait_until([&] { return std::filesystem::exists(here / "out/d.1/log.txt"); }));
    job.send(SIGINT);
    CHECK(job.finish().status != 0);
  }
  const Json left = Json::parse(file_text(here / "out/study.json"));
  CHECK(left.at("status") == "interrupted");
  CHECK(left.at("runs").size() == 7);
  // The runs that were begun have ended with it: nobody holds the directory.
  write_text(here / "s.toml", sampled("t_end = 2.0"));
  CHECK(costate_json({"study", "s.toml", "--output", "out"}, here.path()).at("status") == "ok");
}

TEST_CASE("study: mistakes end an MPI job at once, and parts of a study do without one") {
  const WorkingDirectory here;
  write_text(here / "s.toml", "[[run]]\nname = \"a\"\nscene = \"nowhere.toml\"\n");
  Process wrong("/usr/bin/env", on_ranks(3, {"s.toml"}), here.path());
  const Outcome o = wrong.finish();
  CHECK(o.status == 1);
  CHECK_THAT(o.err, Contains("s.toml"));
  // By one rank.
  CHECK(o.err.find("costate: ") == o.err.rfind("costate: "));
  write_text(here / "s.toml", sampled("t_end = 2.0"));
  Process shards("/usr/bin/env", on_ranks(2, {"s.toml", "--shard", "1/2"}), here.path());
  const Outcome refused = shards.finish();
  CHECK(refused.status == 2);
  const auto told_once = [](const Outcome& outcome, const std::string& text) {
    const std::size_t at = outcome.err.find(text);
    return at != std::string::npos && outcome.err.find(text, at + 1) == std::string::npos;
  };
  CHECK(told_once(refused, "ranks of MPI share a study without it"));
  Process misspelt("/usr/bin/env", on_ranks(3, {"s.toml", "--fresch"}), here.path());
  const Outcome unknown = misspelt.finish();
  CHECK(unknown.status == 2);
  CHECK(told_once(unknown, "has no option '--fresch'"));
  Process without("/usr/bin/env", on_ranks(2, {"s.toml", "--no-files"}), here.path());
  CHECK(told_once(without.finish(), "hand over their runs by files"));
  Process parts("/usr/bin/env", on_ranks(1, {"s.toml", "--shard", "2/3", "--json"}), here.path());
  CHECK(Json::parse(parts.finish().out).at("runs").size() == 2);
}

#endif
