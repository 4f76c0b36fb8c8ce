#include "process_pool.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>

#include "costate/base/error.h"
#include "costate/command.h"

namespace costate::app {

void ProcessPool::start(std::size_t run, const std::vector<std::string>& words, const std::string& log) {
  std::vector<char*> argv;
  for (const auto& w : words) argv.push_back(const_cast<char*>(w.c_str()));
  argv.push_back(nullptr);
  const pid_t parent = ::getpid();
  std::fflush(nullptr);
  const pid_t pid = ::fork();
  if (pid < 0) throw Error(fmt::format("No further process can be started for the run of '{}'.", log));
  if (pid == 0) {
    // A group of its own: Ctrl-C reaches this program, which hands it on once. And an end with it, however
    // it ends.
    ::setpgid(0, 0);
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    const int file = ::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666), null = ::open("/dev/null", O_RDONLY);
    if (::getppid() != parent || file < 0 || null < 0) ::_exit(kFailed);
    ::dup2(null, 0);
    ::dup2(file, 1);
    ::dup2(file, 2);
    ::execv("/proc/self/exe", argv.data());
    ::_exit(kFailed);
  }
  running_.push_back({run, pid});
}

std::vector<ProcessPool::Ended> ProcessPool::take_ended() {
  std::vector<Ended> ended;
  std::erase_if(running_, [&](const Running& r) {
    int status = 0;
    if (::waitpid(r.pid, &status, WNOHANG) != r.pid) return false;
    ended.push_back({r.run, status});
    return true;
  });
  return ended;
}

void ProcessPool::stop_all() {
  for (const Running& r : running_) ::kill(r.pid, SIGINT);
  for (const Running& r : running_) ::waitpid(r.pid, nullptr, 0);
  running_.clear();
}

}  // namespace costate::app
