#include "costate/candidate/candidate_process.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "costate/base/error.h"
#include "costate/record/interrupt.h"

namespace costate {

namespace {

using Json = nlohmann::json;
constexpr std::size_t kStageSize = 256;
constexpr std::size_t kMostText = 64'000'000;  // bytes of a report
// Exit statuses of the keeper besides the candidate's own.
constexpr int kThrown = 97;     // the text is an exception's
constexpr int kSignalled = 98;  // the candidate ended by a signal
constexpr int kLate = 99;       // its time was over
constexpr int kStopped = 100;   // the tool wanted it to end
constexpr int kNoProcess = 101;

/// Text that survives the death of the child that writes it.
class SharedStage {
 public:
  SharedStage()
      : text_(
            static_cast<char*>(mmap(nullptr, kStageSize, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0))) {
    if (text_ == MAP_FAILED) throw Error(fmt::format("No shared memory: {}.", std::strerror(errno)));
    text_[0] = text_[kStageSize - 1] = 0;
  }
  ~SharedStage() { munmap(text_, kStageSize); }
  SharedStage(const SharedStage&) = delete;
  SharedStage& operator=(const SharedStage&) = delete;
  void set(const std::string& s) { std::snprintf(text_, kStageSize - 1, "%s", s.c_str()); }
  void set_signal(int number) { text_[kStageSize - 1] = static_cast<char>(number); }
  int signal() const { return text_[kStageSize - 1]; }
  /// The candidate shares this memory: what it holds need not be text that ends.
  std::string where() const {
    const std::string text(text_, strnlen(text_, kStageSize - 1));
    return text.empty() ? "" : " in " + text;
  }

 private:
  char* text_;
};

/// In the process of the candidate: works and sends what came of it.
[[noreturn]] void candidate(int out, SharedStage& stage,
                            const std::function<std::string(const CandidateStage&)>& work) {
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

/// The processes that have this one as their parent.
std::vector<pid_t> children() {
  std::vector<pid_t> pids;
  if (std::FILE* list = std::fopen("/proc/thread-self/children", "re")) {
    int pid = 0;
    while (std::fscanf(list, "%d", &pid) == 1) pids.push_back(pid);
    std::fclose(list);
  }
  return pids;
}

/// Ends everything that the candidate started, also what left its group or lost its parent: such processes become
/// children of the keeper (PR_SET_CHILD_SUBREAPER).
void end_descendants(pid_t group) {
  kill(-group, SIGKILL);
  for (int round = 0; round < 1000; ++round) {
    const std::vector<pid_t> left = children();
    if (left.empty()) return;
    for (const pid_t pid : left) kill(pid, SIGKILL);
    for (const pid_t pid : left) waitpid(pid, nullptr, 0);
  }
}

/// Between the tool and the candidate: passes on how the candidate ended, and ends it and all that it started when its
/// time is over, when the tool says so (a byte or the end of `control`), or when the tool is gone, however that died.
[[noreturn]] void keeper(int control, int out, SharedStage& stage, double limit_s,
                         const std::function<std::string(const CandidateStage&)>& work) {
  setpgid(0, 0);  // Ctrl-C reaches the tool alone, which passes it on
  // The interrupt handler of the tool is not for the candidate.
  for (const int s : {SIGINT, SIGTERM}) signal(s, SIG_DFL);
  prctl(PR_SET_CHILD_SUBREAPER, 1);
  const pid_t own = getpid(), pid = fork();
  if (pid < 0) _exit(kNoProcess);
  if (pid == 0) {
    setpgid(0, 0);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != own) _exit(kNoProcess);
    close(control);
    candidate(out, stage, work);
  }
  setpgid(pid, pid);
  close(out);
  const auto begin = std::chrono::steady_clock::now();
  for (;;) {
    // The candidate's own end is waited for; whether it still holds or closed its descriptors is its affair.
    int status = 0;
    if (waitpid(pid, &status, WNOHANG) == pid) {
      end_descendants(pid);
      if (WIFEXITED(status)) _exit(WEXITSTATUS(status));
      stage.set_signal(WTERMSIG(status));
      _exit(kSignalled);
    }
    const bool late = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() > limit_s;
    pollfd p{control, POLLIN, 0};
    if (late || poll(&p, 1, 10) > 0) {
      end_descendants(pid);
      _exit(late ? kLate : kStopped);
    }
  }
}

}  // namespace

IsolatedResult run_isolated(const std::function<std::string(const CandidateStage&)>& work, double limit_s) {
  SharedStage stage;
  int ends[2], control[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw Error(fmt::format("No pipe: {}.", std::strerror(errno)));
  if (pipe2(control, O_CLOEXEC) != 0) {
    close(ends[0]);
    close(ends[1]);
    throw Error(fmt::format("No pipe: {}.", std::strerror(errno)));
  }
  std::fflush(stdout);
  std::fflush(stderr);
  const pid_t pid = fork();
  if (pid < 0) {
    for (const int fd : {ends[0], ends[1], control[0], control[1]}) close(fd);
    throw Error(fmt::format("No new process: {}.", std::strerror(errno)));
  }
  if (pid == 0) {
    close(ends[0]);
    close(control[1]);
    keeper(control[0], ends[1], stage, limit_s, work);
  }
  close(ends[1]);
  close(control[0]);
  IsolatedResult r;
  bool too_much = false, sending = true;
  int status = 0;
  char buffer[65536];
  // The keeper ends soon after the limit, whatever the candidate does; what was sent before is still in the pipe then.
  for (bool ended = false; !ended || sending;) {
    if (interrupted() || too_much) {
      close(control[1]);
      control[1] = -1;
      while (waitpid(pid, &status, 0) < 0 && errno == EINTR) {
      }
      break;
    }
    if (!ended) ended = waitpid(pid, &status, WNOHANG) == pid;
    pollfd p{sending ? ends[0] : -1, POLLIN, 0};
    const int ready = poll(&p, 1, ended ? 0 : 10);
    if (ready <= 0) {
      if (ended) break;
      continue;
    }
    const ssize_t n = read(ends[0], buffer, sizeof buffer);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      sending = false;
      continue;
    }
    r.text.append(buffer, static_cast<std::size_t>(n));
    too_much = r.text.size() > kMostText;
  }
  close(ends[0]);
  if (control[1] >= 0) close(control[1]);
  throw_if_interrupted();
  const std::string where = stage.where();
  const int code = WIFEXITED(status) ? WEXITSTATUS(status) : kNoProcess;
  if (too_much)
    r.failure = fmt::format("sent more than {} MB{}", kMostText / 1000000, where);
  else if (code == kLate)
    r.failure = fmt::format("did not end within {:g} s{}", limit_s, where);
  else if (code == kSignalled)
    r.failure = fmt::format("crashed with signal {} ({}){}", stage.signal(), strsignal(stage.signal()), where);
  else if (code == kThrown)
    r.failure = fmt::format("threw{}: {}", where, r.text);
  else if (code == kNoProcess)
    r.failure = fmt::format("could not be kept: the process that watches it ended with status {}", status);
  else if (code != 0 || r.text.empty())
    r.failure = fmt::format("ended the process with status {}{}", code, where);
  if (!r.failure.empty() && code != kThrown) r.text.clear();
  return r;
}

std::unique_ptr<CandidateAdjoint> load_candidate(const std::string& path) {
  std::error_code code;
  if (!std::filesystem::exists(path, code)) throw Error(fmt::format("There is no candidate library '{}'.", path));
  // With a slash the loader takes the path as it is.
  const std::string file = std::filesystem::absolute(path, code).string();
  void* library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!library) throw Error(fmt::format("The candidate library cannot be loaded: {}", dlerror()));
  const auto symbol = [&](const char* name) {
    void* p = dlsym(library, name);
    if (!p)
      throw Error(
          fmt::format("'{}' has no '{}': it needs one line COSTATE_CANDIDATE(YourClass), "
                      "see costate/candidate/candidate.h.",
                      path, name));
    return p;
  };
  CandidateBuild built, own;
  reinterpret_cast<void (*)(CandidateBuild*)>(symbol("costate_candidate_build"))(&built);
  if (built.abi != own.abi)
    throw Error(
        fmt::format("'{}' was built for version {} of the candidate interface, this is version {}: build it "
                    "again.",
                    path, built.abi, own.abi));
  if (built.blocks_size != own.blocks_size || built.alignment != own.alignment)
    throw Error(
        fmt::format("'{}' was built with other compiler settings than this tool (blocks of {} bytes aligned to "
                    "{}, expected {} and {}): build it with costate_add_candidate.",
                    path, built.blocks_size, built.alignment, own.blocks_size, own.alignment));
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
  if (r.text[0] != '+') throw Error(fmt::format("The candidate '{}' sent what is no name of a formulation.", path));
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
    j["first"] = {{"t", r.first->t},
                  {"component", r.first->component},
                  {"expected", r.first->expected},
                  {"found", r.first->found}};
  j["findings"] = Json::array();
  for (const auto& f : r.findings) j["findings"].push_back({f.where, f.term, f.what, f.message, f.alternatives});
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
    r.first = CandidateReport::Disagreement{number(f.at("t")), f.at("component"), number(f.at("expected")),
                                            number(f.at("found"))};
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
  std::string failure = r.failure;
  if (failure.empty()) try {
      return from_json(Json::parse(r.text), reference);
    } catch (const Json::exception&) {
      failure = "sent what is no report";
    }
  CandidateReport report;
  report.formulation = reference.problem.formulation;
  report.method = reference.method;
  report.reference = reference.gradient;
  report.error = HUGE_VAL;
  report.failure = failure;
  return report;
}

}  // namespace costate
