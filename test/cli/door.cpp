// The way in: what 'costate list' says of everything, the reference in models/README.md, the manual page, the
// completions of shells, and the guide to failures.
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>

#include "five_bar.h"
#include "process.h"
#include "support/paths.h"

using namespace costate::test;
using Catch::Contains;
namespace fs = std::filesystem;

namespace {

using Json = nlohmann::json;

const fs::path kRoot = COSTATE_SOURCE_DIR;

Outcome run(const std::string& program, const std::vector<std::string>& arguments, const fs::path& directory) {
  return Process(program, arguments, directory).finish();
}

std::string listed(const std::vector<std::string>& words) {
  const WorkingDirectory here;
  std::vector<std::string> arguments = {"list"};
  arguments.insert(arguments.end(), words.begin(), words.end());
  const Outcome r = run_costate(arguments, here.path());
  REQUIRE(r.status == 0);
  return r.out;
}

/// Headings of apps/README.md below "When a run fails".
std::set<std::string> guide_headings() {
  std::set<std::string> r;
  std::ifstream in(kRoot / "apps/README.md");
  bool inside = false;
  for (std::string line; std::getline(in, line);) {
    if (line.rfind("## ", 0) == 0) inside = line == "## When a run fails";
    if (inside && line.rfind("### ", 0) == 0) r.insert(line.substr(4));
  }
  return r;
}

/// The anchors and phrases of apps/costate/guide.cpp.
struct Guide {
  std::set<std::string> anchors;
  std::vector<std::string> phrases;
};
Guide guide() {
  const std::string text = file_text(kRoot / "apps/costate/guide.cpp");
  Guide g;
  const std::size_t from = text.find("guide = {"), to = text.find("return guide;");
  const std::string table = text.substr(from, to - from);
  const std::regex anchor("\\{\"([a-z-]+)\",\\s*\\{"), word("\"([^\"]+)\"");
  for (std::sregex_iterator i(table.begin(), table.end(), anchor), end; i != end; ++i) g.anchors.insert((*i)[1]);
  for (std::sregex_iterator i(table.begin(), table.end(), word), end; i != end; ++i)
    if (g.anchors.count((*i)[1]) == 0) g.phrases.push_back((*i)[1]);
  return g;
}

/// The string literals behind each `throw SolverError(` of a file, put together.
std::vector<std::string> solver_errors(const std::string& text) {
  std::vector<std::string> messages;
  const std::string begin = "throw SolverError(";
  for (std::size_t at = text.find(begin); at != std::string::npos; at = text.find(begin, at + 1)) {
    std::string message;
    bool literal = false;
    int depth = 1;
    for (std::size_t i = at + begin.size(); i < text.size() && depth > 0; ++i) {
      if (literal && text[i] == '\\') {
        ++i;
        continue;
      }
      if (text[i] == '"') {
        literal = !literal;
        continue;
      }
      if (literal)
        message += text[i];
      else
        depth += text[i] == '(' ? 1 : text[i] == ')' ? -1 : 0;
    }
    messages.push_back(message);
  }
  return messages;
}

}  // namespace

TEST_CASE("list: a kind, a law, a cost, a formulation, a method, an algorithm, with keys and example") {
  const std::string body = listed({"body"});
  CHECK_THAT(body, Contains("[body.NAME]") && Contains("inertia_kg_m2") && Contains("kg m^2") && Contains("required") &&
                       Contains("about the centre of mass") && Contains("[body.plate]"));
  CHECK_THAT(listed({"bump_stop"}), Contains("smoothing") && Contains("one of below, above"));
  CHECK_THAT(listed({"square"}), Contains("weight") && Contains("target_output"));
  CHECK_THAT(listed({"penalty"}), Contains("penalty_alpha") && Contains("--penalty-alpha") && Contains("soft") &&
                                      Contains("redundant rows are carried"));
  CHECK_THAT(listed({"idas-adjoint"}), Contains("baumgarte"));
  CHECK_THAT(listed({"slsqp"}), Contains("takes constraints"));
  CHECK_THAT(listed({"run"}), Contains("t_end_s") && Contains("1e-08"));
  CHECK_THAT(listed({"laws"}), Contains("polynomial") && Contains("bump_stop"));
  CHECK_THAT(listed({kFiveBar, "bar.A1"}), Contains("bar.A1.mass_kg"));
  const WorkingDirectory here;
  const auto j = costate_json({"list", "body"}, here.path());
  CHECK(j.at("entries").at(0).at("keys").at(0).at("required") == true);
  const Outcome wrong = run_costate({"list", "bodi"}, here.path());
  CHECK(wrong.status == 1);
  CHECK_THAT(wrong.err, Contains("Did you mean 'body'?"));
}

TEST_CASE("list: the reference in models/README.md is what the program says") {
  const std::string page = file_text(kRoot / "models/README.md");
  const std::string begin = "<!-- reference: made by the target 'reference' -->\n",
                    end = "<!-- end of the reference -->\n";
  const std::size_t from = page.find(begin), to = page.find(end);
  REQUIRE(from != std::string::npos);
  REQUIRE(to != std::string::npos);
  INFO("cmake --build BUILD --target reference writes it anew");
  CHECK((page.substr(from + begin.size(), to - from - begin.size()) == listed({"--all", "--markdown"})));
}

TEST_CASE("the manual page has every command and every option, and is a manual page") {
  const WorkingDirectory here;
  const Outcome r = run_costate({"man"}, here.path());
  REQUIRE(r.status == 0);
  CHECK(r.out.rfind(".TH COSTATE 1", 0) == 0);
  for (const std::string command :
       {"simulate", "gradient", "optimize", "check", "study", "regress", "animate", "list", "man"})
    CHECK_THAT(r.out, Contains("\\fBcostate " + command + "\\fR"));
  CHECK_THAT(r.out, Contains("\\fB\\-\\-penalty\\-alpha\\fR") && Contains("\\fB\\-\\-resume\\fR"));
  // No line begins with a request that is none of those used: what a text holds is escaped.
  const std::regex request("(^|\n)[.']([A-Z]*)");
  for (std::sregex_iterator i(r.out.begin(), r.out.end(), request), end; i != end; ++i)
    CHECK(std::set<std::string>{"TH", "SH", "SS", "TP", "RS", "RE", "PP", "B", "br", ""}.count((*i)[2]) == 1);
  if (std::system("command -v groff > /dev/null 2>&1") == 0) {
    write_text(here / "costate.1", r.out);
    const Outcome shown = run("/bin/sh", {"-c", "groff -man -Tascii -ww costate.1"}, here.path());
    CHECK(shown.status == 0);
    CHECK(shown.err == "");
  }
}

TEST_CASE("completions: bash completes commands, options and values") {
  const WorkingDirectory here;
  const Outcome r = run_costate({"completion", "bash"}, here.path());
  REQUIRE(r.status == 0);
  write_text(here / "completion", r.out);
  const auto completed = [&](const std::string& words) {
    const std::string script = "source ./completion; COMP_WORDS=(costate " + words +
                               "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _costate; echo \"${COMPREPLY[@]}\"";
    const Outcome o = run("/bin/bash", {"-c", script}, here.path());
    INFO(words << ": " << o.err);
    CHECK(o.status == 0);
    return o.out;
  };
  CHECK(completed("opt") == "optimize\n");
  CHECK(completed("gradient --formulation aug") == "augmented-lagrangian\n");
  CHECK(completed("check --formulations index1,baum") == "index1,baumgarte\n");
  CHECK(completed("optimize --algorithm sl") == "slsqp\n");
  CHECK(completed("gradient --penalty-a") == "--penalty-alpha\n");
  CHECK_THAT(completed("list bump"), Contains("bump_stop"));
  CHECK(completed("completion z") == "zsh\n");
  CHECK(completed("simulate some_fi") == "\n");  // the shell's own completion of files
}

TEST_CASE("completions: zsh is told of every command and option") {
  const WorkingDirectory here;
  const Outcome r = run_costate({"completion", "zsh"}, here.path());
  REQUIRE(r.status == 0);
  CHECK(r.out.rfind("#compdef costate\n", 0) == 0);
  CHECK_THAT(r.out, Contains("'optimize:Minimise") && Contains("--resume[") &&
                        Contains("(idas cvodes radau3 radau5 radau9 dopri5 dop853 fixed)"));
  if (std::system("command -v zsh > /dev/null 2>&1") == 0) {
    write_text(here / "_costate", r.out);
    CHECK(run("/bin/sh", {"-c", "zsh -n _costate"}, here.path()).status == 0);
  }
}

TEST_CASE("failure guide: every anchor is a heading and every heading an anchor") {
  CHECK(guide().anchors == guide_headings());
  CHECK(guide().anchors.size() > 10);
}

TEST_CASE("failure guide: its phrases stand in messages, and every failure of a run has one") {
  const Guide g = guide();
  std::string sources;
  std::vector<std::string> without;
  for (const char* tree : {"lib", "solvers", "apps/costate"})
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / tree)) {
      const fs::path kind = entry.path().extension();
      if ((kind != ".cpp" && kind != ".h") || entry.path().filename() == "guide.cpp") continue;
      // Literals go on from line to line.
      const std::string text = std::regex_replace(file_text(entry.path()), std::regex("\"\\s*\\n\\s*\""), "");
      sources += text;
      for (const auto& message : solver_errors(text)) {
        if (message.find_first_not_of("{}.: ") == std::string::npos) continue;  // put together elsewhere
        if (message.ends_with(": {}")) continue;                                // where another one stands behind
        if (std::none_of(g.phrases.begin(), g.phrases.end(),
                         [&](const auto& phrase) { return message.find(phrase) != std::string::npos; }))
          without.push_back(entry.path().filename().string() + ": " + message);
      }
    }
  CHECK(without == std::vector<std::string>{});
  for (const auto& phrase : g.phrases) {
    INFO(phrase);
    // That of SUNDIALS' own names.
    CHECK((phrase == "CONV_FAIL" || sources.find(phrase) != std::string::npos));
  }
}

TEST_CASE("failure guide: a message ends with the place where it is told of") {
  const WorkingDirectory here;
  // Two rods that cannot reach each other.
  write_text(here / "short.toml", R"(
[point.A]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 1
y_m = 0.5
[point.B]
ground = true
x_m = 5
y_m = 0
[bar.a]
from = "A"
to = "P"
mass_kg = 1
length_m = 1
[bar.b]
from = "P"
to = "B"
mass_kg = 1
length_m = 1
[start]
given = []
[run]
t_end_s = 1
)");
  const Outcome r = run_costate({"simulate", "short.toml", "--json", "--no-files"}, here.path());
  CHECK(r.status == 1);
  CHECK_THAT(r.err,
             Contains("The start cannot be reached") && Contains(" See apps/README.md#start-cannot-be-assembled.\n"));
  const Json j = Json::parse(r.out);
  CHECK(j.at("guide") == "apps/README.md#start-cannot-be-assembled");
  CHECK(j.at("error").get<std::string>().find("README") == std::string::npos);
}
