#include "costate/sensitivity/candidate_process.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "costate/base/error.h"

namespace costate {

namespace {

using Json = nlohmann::json;
constexpr std::size_t kStageSize = 256;
constexpr int kThrown = 97;  // exit status of a child whose text is an exception's

/// Text that survives the death of the child that writes it.
class SharedStage {
 public:
  SharedStage()
      : text_(static_cast<char*>(
            mmap(nullptr, kStageSize, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0))) {
    if (text_ == MAP_FAILED) throw Error(fmt::format("No shared memory: {}.", std::strerror(errno)));
    text_[0] = 0;
  }
  ~SharedStage() { munmap(text_, kStageSize); }
  SharedStage(const SharedStage&) = delete;
  SharedStage& operator=(const SharedStage&) = delete;
  void set(const std::string& s) { std::snprintf(text_, kStageSize, "%s", s.c_str()); }
  std::string where() const { return text_[0] ? std::string(" in ") + text_ : ""; }

 private:
  char* text_;
};

[[noreturn]] void child(int out, SharedStage& stage, const std::function<std::string(const CandidateStage&)>& work) {
  // The interrupt handler of the tool is not for the candidate.
  for (const int s : {SIGINT, SIGTERM}) signal(s, SIG_DFL);
  dup2(STDERR_FILENO, STDOUT_FILENO);
  int status = 0;
  std::string text;
  try {
    text = work([&stage](const std::string& s) { stage.set(s); });
  } catch (const std::exception& e) {
    text = e.what();
    status = kThrown;
  } catch (...) {
    text = "an exception that is no std::exception";
    status = kThrown;
  }
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t n = write(out, text.data() + done, text.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) break;
    done += static_cast<std::size_t>(n);
  }
  close(out);
  std::fflush(stderr);
  _exit(status);
}

}  // namespace

IsolatedResult run_isolated(const std::function<std::string(const CandidateStage&)>& work, double limit_s) {
  SharedStage stage;
  int ends[2];
  if (pipe(ends) != 0) throw Error(fmt::format("No pipe: {}.", std::strerror(errno)));
  std::fflush(stdout);
  std::fflush(stderr);
  const pid_t pid = fork();
  if (pid < 0) {
    close(ends[0]);
    close(ends[1]);
    throw Error(fmt::format("No new process: {}.", std::strerror(errno)));
  }
  if (pid == 0) {
    close(ends[0]);
    child(ends[1], stage, work);
  }
  close(ends[1]);
  IsolatedResult r;
  const auto begin = std::chrono::steady_clock::now();
  bool late = false;
  char buffer[4096];
  for (;;) {
    const double left = limit_s - std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    if (left <= 0) {
      late = true;
      break;
    }
    pollfd p{ends[0], POLLIN, 0};
    const int ready = poll(&p, 1, static_cast<int>(std::min(1e8, std::ceil(1000 * left))));
    if (ready < 0 && errno != EINTR) break;
    if (ready <= 0) continue;
    const ssize_t n = read(ends[0], buffer, sizeof buffer);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) break;
    r.text.append(buffer, static_cast<std::size_t>(n));
  }
  close(ends[0]);
  if (late) kill(pid, SIGKILL);
  int status = 0;
  while (waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  const std::string where = stage.where();
  if (late)
    r.failure = fmt::format("did not end within {:g} s{}", limit_s, where);
  else if (WIFSIGNALED(status))
    r.failure = fmt::format("crashed with signal {} ({}){}", WTERMSIG(status), strsignal(WTERMSIG(status)), where);
  else if (WEXITSTATUS(status) == kThrown)
    r.failure = fmt::format("threw{}: {}", where, r.text);
  else if (WEXITSTATUS(status) != 0 || r.text.empty())
    r.failure = fmt::format("ended the process with status {}{}", WEXITSTATUS(status), where);
  return r;
}

std::unique_ptr<CandidateAdjoint> load_candidate(const std::string& path) {
  std::error_code code;
  if (!std::filesystem::exists(path, code))
    throw Error(fmt::format("There is no candidate library '{}'.", path));
  // With a slash the loader takes the path as it is.
  const std::string file = std::filesystem::absolute(path, code).string();
  void* library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!library) throw Error(fmt::format("The candidate library cannot be loaded: {}", dlerror()));
  const auto symbol = [&](const char* name) {
    void* p = dlsym(library, name);
    if (!p)
      throw Error(fmt::format("'{}' has no '{}': it needs one line COSTATE_CANDIDATE(YourClass), "
                              "see costate/adjoint/candidate.h.", path, name));
    return p;
  };
  CandidateBuild built, own;
  reinterpret_cast<void (*)(CandidateBuild*)>(symbol("costate_candidate_build"))(&built);
  if (built.abi != own.abi)
    throw Error(fmt::format("'{}' was built for version {} of the candidate interface, this is version {}: build it "
                            "again.", path, built.abi, own.abi));
  if (built.blocks_size != own.blocks_size || built.alignment != own.alignment)
    throw Error(fmt::format("'{}' was built with other compiler settings than this tool (blocks of {} bytes aligned to "
                            "{}, expected {} and {}): build it with costate_add_candidate.", path, built.blocks_size,
                            built.alignment, own.blocks_size, own.alignment));
  auto* candidate = reinterpret_cast<CandidateAdjoint* (*)()>(symbol("costate_candidate_make"))();
  if (!candidate) throw Error(fmt::format("'{}' made no candidate.", path));
  return std::unique_ptr<CandidateAdjoint>(candidate);
}

std::string candidate_formulation(const std::string& path, double limit_s) {
  const IsolatedResult r = run_isolated(
      [&](const CandidateStage& stage) {
        try {
          const auto candidate = load_candidate(path);
          stage("formulation()");
          return "+" + candidate->formulation();
        } catch (const Error& e) {
          return std::string("-") + e.what();
        }
      },
      limit_s);
  if (!r.failure.empty()) throw Error(fmt::format("The candidate '{}' {}.", path, r.failure));
  if (r.text[0] == '-') throw Error(r.text.substr(1));
  return r.text.substr(1);
}

namespace {

Json to_json(const CandidateReport& r) {
  Json j;
  j["formulation"] = r.formulation;
  j["method"] = r.method;
  j["gradient"] = r.gradient;
  j["error"] = r.error;
  j["own_error"] = r.own_error;
  j["agrees"] = r.agrees;
  if (r.first)
    j["first"] = {{"t", r.first->t}, {"component", r.first->component}, {"expected", r.first->expected}, {"found", r.first->found}};
  j["findings"] = Json::array();
  for (const auto& f : r.findings)
    j["findings"].push_back({f.where, f.term, f.what, f.message, f.alternatives});
  j["blind"] = Json::array();
  for (const auto& b : r.blind) j["blind"].push_back({b.where, b.term, b.why});
  j["notes"] = r.notes;
  j["failure"] = r.failure;
  return j;
}

double number(const Json& j) { return j.is_number() ? j.get<double>() : HUGE_VAL; }

CandidateReport from_json(const Json& j, const CandidateReference& reference) {
  CandidateReport r;
  r.formulation = j.at("formulation");
  r.method = j.at("method");
  for (const auto& x : j.at("gradient")) r.gradient.push_back(number(x));
  r.reference = reference.gradient;
  r.error = number(j.at("error"));
  r.own_error = number(j.at("own_error"));
  r.agrees = j.at("agrees");
  if (j.contains("first")) {
    const Json& f = j.at("first");
    r.first = CandidateReport::Disagreement{number(f.at("t")), f.at("component"), number(f.at("expected")), number(f.at("found"))};
  }
  for (const auto& f : j.at("findings"))
    r.findings.push_back({f[0], f[1], f[2], f[3], f[4].get<std::vector<std::string>>()});
  for (const auto& b : j.at("blind")) r.blind.push_back({b[0], b[1], b[2]});
  r.notes = j.at("notes").get<std::vector<std::string>>();
  r.failure = j.at("failure");
  return r;
}

}  // namespace

CandidateReport check_candidate_library(const std::string& path, const CandidateReference& reference, double limit_s) {
  const IsolatedResult r = run_isolated(
      [&](const CandidateStage& stage) {
        const auto candidate = load_candidate(path);
        const std::string text =
            to_json(check_candidate(*candidate, reference, stage)).dump(-1, ' ', false, Json::error_handler_t::replace);
        stage("its destructor");
        return text;
      },
      limit_s);
  if (r.failure.empty()) return from_json(Json::parse(r.text), reference);
  CandidateReport report;
  report.formulation = reference.problem.formulation;
  report.method = reference.method;
  report.reference = reference.gradient;
  report.error = HUGE_VAL;
  report.failure = r.failure;
  return report;
}

}  // namespace costate
