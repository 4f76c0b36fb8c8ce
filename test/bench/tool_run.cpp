#include "tool_run.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "costate/base/error.h"

namespace costate::bench {

namespace {

double seconds(const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); }

std::string text_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

void write_to(int descriptor, const char* path) {
  const int file = ::open(path, O_WRONLY | O_CREAT | O_TRUNC, 0600);
  if (file < 0 || ::dup2(file, descriptor) < 0) ::_exit(126);
  ::close(file);
}

}  // namespace

ToolRun run_tool(const std::vector<std::string>& arguments, const std::string& directory) {
  std::vector<std::string> words = {COSTATE_EXECUTABLE};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& w : words) argv.push_back(w.data());
  argv.push_back(nullptr);
  const std::string out = directory + "/standard_output", err = directory + "/standard_error";
  const pid_t pid = ::fork();
  if (pid < 0) throw Error("A process could not be started.");
  if (pid == 0) {  // only calls that are safe after fork
    if (::chdir(directory.c_str()) != 0) ::_exit(126);
    write_to(1, out.c_str());
    write_to(2, err.c_str());
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }
  int status = 0;
  rusage used{};
  if (::wait4(pid, &status, 0, &used) != pid) throw Error("A process could not be waited for.");
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    std::string command;
    for (const std::string& w : words) command += w + " ";
    throw Error(command + "failed: " + text_of(err));
  }
  ToolRun run;
  run.user_s = seconds(used.ru_utime);
  run.system_s = seconds(used.ru_stime);
  run.peak_MiB = static_cast<double>(used.ru_maxrss) / 1024;
  run.out = text_of(out);
  return run;
}

}  // namespace costate::bench
