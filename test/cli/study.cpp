// costate study: runs in parallel, kept, resumed and tabulated.
#include <signal.h>
#include <sys/stat.h>

#include <algorithm>
#include <catch2/catch.hpp>

#include "process.h"
#include "support/paths.h"

using namespace costate::test;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

namespace {

const std::string kModels = COSTATE_MODELS_DIR;

std::string study_text(const std::string& last_options = "") {
  return R"(title = "Three runs"

[options]
rtol = 1e-8
no_certificate = true

[set]
run.t_end_s = 2.0

[[run]]
name = "damper"
scene = ")" +
         kModels + R"(/damped_pendulum/damped_pendulum.toml"

[[run]]
name = "lengths"
scene = ")" +
         kModels + R"(/five_bar/five_bar.toml"
parameters = ["L01", "L02"]
options = { formulation = "baumgarte", method = "cvodes-adjoint", max_evaluations = 4 }

[[run]]
name = "stiffness"
scene = ")" +
         kModels + R"(/five_bar/five_bar.toml"
parameters = ["k1"]
set = { "parameter.k1.upper" = 150, "run.rtol" = 1e-7 }
options = { max_evaluations = 3)" +
         last_options + R"( }
)";
}

}  // namespace

TEST_CASE("costate study: runs, a table, and what is finished is kept") {
  const WorkingDirectory here;
  write_text(here / "study.toml", study_text());
  const Json j = costate_json({"study", "study.toml", "--jobs", "2"}, here.path());
  CHECK(j.at("status") == "ok");
  REQUIRE(j.at("runs").size() == 3);
  for (const Json& r : j.at("runs")) {
    INFO(r.at("name"));
    CHECK(r.at("status") == "ok");
    CHECK(r.at("psi_after").get<double>() < r.at("psi_before").get<double>());
  }
  CHECK(j.at("runs").at(1).at("parameters_after").size() == 2);
  // The same as the run by itself.
  const Json alone = costate_json({"optimize", kModels + "/five_bar/five_bar.toml", "--no-files", "--no-certificate",
                                   "--set", "run.t_end_s=2.0", "--rtol", "1e-8", "--formulation", "baumgarte",
                                   "--method", "cvodes-adjoint", "--max-evaluations", "4", "--parameters", "L01,L02"},
                                  here.path());
  CHECK(j.at("runs").at(1).at("psi_after") == alone.at("psi"));
  CHECK(one_object(file_text(here / "results/study/study.json")) == j);
  const std::string csv = file_text(here / "results/study/study.csv");
  CHECK(std::count(csv.begin(), csv.end(), '\n') == 4);
  CHECK_THAT(csv, Contains("name,status,psi_before,psi_after") && Contains("L01.before,L01.after"));
  CHECK_THAT(file_text(here / "results/study/study.txt"), Contains("Three runs") && Contains("k1 100 -> "));

  const Json again = costate_json({"study", "study.toml"}, here.path());
  for (const Json& r : again.at("runs")) CHECK(r.at("status") == "kept");
  CHECK(again.at("runs").at(0).at("psi_after") == j.at("runs").at(0).at("psi_after"));
  // A run whose definition changed begins anew, the others are kept.
  write_text(here / "study.toml", study_text(", stop_value = 1e3"));
  const Json changed = costate_json({"study", "study.toml"}, here.path());
  CHECK(changed.at("runs").at(1).at("status") == "kept");
  CHECK(changed.at("runs").at(2).at("status") == "ok");
  CHECK(changed.at("runs").at(2).at("evaluations") == 1);
}

TEST_CASE("costate study: a summary that is not as it was written is made again, not kept") {
  const WorkingDirectory here;
  write_text(here / "study.toml", study_text());
  const auto result = [&] {
    Json r = costate_json({"study", "study.toml", "--only", "lengths"}, here.path()).at("runs").at(0);
    r.erase("wall_s");
    return r;
  };
  const auto with_status = [](Json r, const char* status) {
    r["status"] = status;
    return r;
  };
  const Json first = result();
  CHECK(first.at("status") == "ok");
  CHECK(result() == with_status(first, "kept"));
  const auto summary = here / "results/study/lengths/optimize.json";
  const std::string whole = file_text(summary);
  std::string flipped = whole;
  flipped.insert(flipped.find("\"psi\": ") + 7, "-");
  for (const std::string& damaged : {flipped, std::string(), std::string("[]"), std::string("{\"status\": \"ok\"}"),
                                     whole.substr(0, whole.size() / 2)}) {
    write_text(summary, damaged);
    CHECK(result() == with_status(first, "ok"));
    CHECK(result() == with_status(first, "kept"));
  }
}

TEST_CASE("costate study: pipes and directories in the place of its files are refused") {
  for (const std::string name : {"optimize.json", "study_run.json", "evaluations.jsonl", "log.txt"})
    for (const bool pipe : {false, true}) {
      INFO(name << (pipe ? ", a pipe" : ", a directory"));
      const WorkingDirectory here;
      write_text(here / "study.toml", study_text());
      const auto place = here / ("results/study/lengths/" + name);
      std::filesystem::create_directories(place.parent_path());
      if (pipe)
        REQUIRE(::mkfifo(place.c_str(), 0600) == 0);
      else
        std::filesystem::create_directory(place);
      const Json j = costate_json({"study", "study.toml", "--only", "lengths"}, here.path(), 1);
      CHECK_THAT(j.at("error").get<std::string>(), Contains(name) && Contains("no regular file"));
    }
}

TEST_CASE("costate study: an interrupted study goes on where it stopped") {
  const WorkingDirectory here;
  std::string text = study_text();
  const auto at = text.find("max_evaluations = 4");
  text.replace(at, 19, "max_evaluations = 12");
  // Long enough that the interruption comes in the middle.
  text.replace(text.find("run.t_end_s = 2.0"), 17, "run.t_end_s = 300.0");
  write_text(here / "study.toml", text);
  const auto journal = here / "results/study/lengths/evaluations.jsonl";
  const auto evaluations = [&] {
    const std::string lines = std::filesystem::exists(journal) ? file_text(journal) : std::string();
    return std::count(lines.begin(), lines.end(), '\n') - 1;
  };
  Process p(COSTATE_EXECUTABLE, {"study", "study.toml", "--only", "lengths"}, here.path());
  p.wait_until([&] { return evaluations() >= 2; });
  p.send(SIGINT);
  const Outcome stopped = p.finish();
  const auto before = evaluations();
  CHECK_THAT(stopped.err, Contains("nterrupted"));
  CHECK(one_object(file_text(here / "results/study/study.json")).at("status") == "interrupted");
  const Json j = costate_json({"study", "study.toml", "--only", "lengths"}, here.path());
  CHECK(j.at("status") == "ok");
  CHECK(evaluations() >= before);
  REQUIRE(stopped.status == 130);
  CHECK_THAT(file_text(here / "results/study/lengths/log.txt"), Contains("resuming after"));
}

TEST_CASE("costate study: mistakes have a place, and a run that fails does not stop the others") {
  const WorkingDirectory here;
  const auto complaint = [&](const std::string& text) {
    write_text(here / "s.toml", text);
    const Outcome o = run_costate({"study", "s.toml"}, here.path());
    CHECK(o.status == 1);
    return o.err;
  };
  const std::string scene = "scene = \"" + kModels + "/damped_pendulum/damped_pendulum.toml\"\n";
  CHECK_THAT(complaint("title = 3\n"), Contains("s.toml:1:9") && Contains("must be a string"));
  CHECK_THAT(complaint("title = \"x\"\n"), Contains("[[run]]"));
  CHECK_THAT(complaint("[[run]]\nname = \"a\"\n"), Contains("s.toml:1:") && Contains("'scene'"));
  CHECK_THAT(complaint("[[run]]\nname = \"a/b\"\n" + scene), Contains("s.toml:2:8") && Contains("name of a run"));
  CHECK_THAT(complaint("[[run]]\nname = \"a\"\nparametres = []\n" + scene), Contains("Did you mean 'parameters'?"));
  CHECK_THAT(complaint("[[run]]\nname = \"a\"\n" + scene + "[[run]]\nname = \"a\"\n" + scene),
             Contains("two runs named 'a'"));
  CHECK_THAT(complaint("[[run]]\nname = \"a\"\nparameters = [\"x\"]\n" + scene), Contains("no parameter 'x'"));
  CHECK_THAT(complaint("[options]\nmethd = \"x\"\n[[run]]\nname = \"a\"\n" + scene),
             Contains("s.toml:2:1") && Contains("'method'"));
  CHECK_FALSE(std::filesystem::exists(here / "results"));
  write_text(here / "s.toml",
             "[options]\nno_certificate = true\n[[run]]\nname = \"wrong\"\noptions = { method = \"nothing\" }\n" +
                 scene + "[[run]]\nname = \"right\"\noptions = { max_evaluations = 2 }\n" + scene);
  const Json j = costate_json({"study", "s.toml"}, here.path(), 1);
  CHECK(j.at("status") == "failed");
  CHECK(j.at("runs").at(0).at("status") == "failed");
  CHECK_THAT(j.at("runs").at(0).at("error").get<std::string>(), Contains("--method"));
  CHECK(j.at("runs").at(1).at("status") == "ok");
}

TEST_CASE("costate study: one at a time in a directory, and an edited one waits for what still runs") {
  const WorkingDirectory here;
  std::string text = study_text();
  text.replace(text.find("run.t_end_s = 2.0"), 17, "run.t_end_s = 300.0");
  write_text(here / "study.toml", text);
  const auto journal = here / "results/study/lengths/evaluations.jsonl";
  const auto begun = [&] {
    return std::filesystem::exists(journal) && file_text(journal).find("\"index\":1") != std::string::npos;
  };
  {
    Process p(COSTATE_EXECUTABLE, {"study", "study.toml", "--only", "lengths"}, here.path());
    REQUIRE(p.wait_until(begun));
    // Edited and started while the old one runs: refused, and the old journal is as it was.
    std::string edited = text;
    edited.replace(edited.find("run.t_end_s = 300.0"), 19, "run.t_end_s = 2.0");
    write_text(here / "study.toml", edited);
    const std::string header = file_text(journal).substr(0, file_text(journal).find('\n'));
    const Json j = costate_json({"study", "study.toml", "--only", "lengths"}, here.path(), 1);
    CHECK_THAT(j.at("error").get<std::string>(), Contains("Another study is at work"));
    CHECK(file_text(journal).substr(0, header.size()) == header);
    p.send(SIGKILL);
    CHECK(p.finish().signal == SIGKILL);
  }
  // Right after the kill the run may still be there; the next study waits for it, and makes all of its own.
  const Outcome next = run_costate({"study", "study.toml", "--only", "lengths", "--json"}, here.path());
  INFO(next.err);
  CHECK(next.status == 0);
  const Json j = one_object(next.out);
  CHECK(j.at("runs").at(0).at("status") == "ok");
  CHECK(one_object(file_text(here / "results/study/lengths/optimize.json")).at("settings").at("t_end_s") == 2);
}
