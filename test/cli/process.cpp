#include "process.h"

#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <thread>

namespace costate::test {

namespace fs = std::filesystem;

WorkingDirectory::WorkingDirectory() {
  std::string name = (fs::temp_directory_path() / "costate_cli_XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("mkdtemp failed");
  path_ = name;
}

WorkingDirectory::~WorkingDirectory() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

std::vector<std::string> WorkingDirectory::entries() const {
  std::vector<std::string> names;
  // by the names alone: a process that still runs may have renamed a file since it was listed
  for (const auto& entry : fs::recursive_directory_iterator(path_))
    names.push_back(entry.path().lexically_relative(path_).string());
  std::sort(names.begin(), names.end());
  return names;
}

std::string file_text(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

void write_text(const fs::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary | std::ios::trunc) << text;
}

namespace {

void open_as(int descriptor, const fs::path& path, int flags) {
  const int file = ::open(path.c_str(), flags, 0600);
  if (file < 0 || ::dup2(file, descriptor) < 0) ::_exit(126);
  ::close(file);
}

}  // namespace

Process::Process(const std::string& program, const std::vector<std::string>& arguments, const fs::path& directory,
                 Connection connection) {
  std::vector<std::string> words = {program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (auto& w : words) argv.push_back(w.data());
  argv.push_back(nullptr);
  const fs::path out = captured_ / "out", err = captured_ / "err";
  write_text(out, "");
  write_text(err, "");
  if (connection == Connection::files) {
    pid_ = ::fork();
  } else {
    winsize size{};
    size.ws_col = 120;
    size.ws_row = 40;
    pid_ = ::forkpty(&terminal_, nullptr, nullptr, &size);
  }
  if (pid_ < 0) throw std::runtime_error("the process could not be started");
  if (pid_ > 0) return;
  // In the child: only calls that are safe after fork.
  if (::chdir(directory.c_str()) != 0) ::_exit(126);
  if (connection == Connection::files) open_as(0, "/dev/null", O_RDONLY);
  if (connection != Connection::terminal) open_as(1, out, O_WRONLY | O_TRUNC);
  if (connection == Connection::files) open_as(2, err, O_WRONLY | O_TRUNC);
  for (const int s : {SIGINT, SIGTERM, SIGPIPE}) ::signal(s, SIG_DFL);
  ::setenv("TERM", "xterm", 1);
  ::execv(argv[0], argv.data());
  ::_exit(127);
}

Process::~Process() {
  if (!ended()) {
    send(SIGKILL);
    finish();
  }
  if (terminal_ >= 0) ::close(terminal_);
}

void Process::send(int signal_number) const { ::kill(pid_, signal_number); }

void Process::type(const std::string& text) const {
  REQUIRE(::write(terminal_, text.data(), text.size()) == static_cast<ssize_t>(text.size()));
}

void Process::read_terminal() {
  if (terminal_ < 0) return;
  pollfd ready{terminal_, POLLIN, 0};
  char buffer[4096];
  while (::poll(&ready, 1, 0) > 0) {
    const ssize_t count = ::read(terminal_, buffer, sizeof buffer);
    if (count <= 0) return;  // EIO: the other side is closed
    written_.append(buffer, static_cast<std::size_t>(count));
  }
}

bool Process::ended() {
  read_terminal();
  if (!reaped_ && ::waitpid(pid_, &wait_status_, WNOHANG) == pid_) {
    reaped_ = true;
    read_terminal();
  }
  return reaped_;
}

bool Process::wait_until(const std::function<bool()>& condition) {
  const auto limit = std::chrono::steady_clock::now() + std::chrono::minutes(5);
  while (!ended()) {
    if (condition()) return true;
    if (std::chrono::steady_clock::now() > limit) FAIL("the process has been running for five minutes");
    std::this_thread::sleep_for(std::chrono::microseconds(500));
  }
  return false;
}

Outcome Process::finish() {
  wait_until([] { return false; });
  Outcome o;
  if (WIFEXITED(wait_status_)) o.status = WEXITSTATUS(wait_status_);
  if (WIFSIGNALED(wait_status_)) o.signal = WTERMSIG(wait_status_);
  o.out = file_text(captured_ / "out");
  o.err = file_text(captured_ / "err");
  o.terminal = written_;
  return o;
}

Outcome run_costate(const std::vector<std::string>& arguments, const fs::path& directory, Connection connection) {
  return Process(COSTATE_EXECUTABLE, arguments, directory, connection).finish();
}

nlohmann::json one_object(const std::string& text) {
  INFO("standard output: " << text);
  nlohmann::json value;
  REQUIRE_NOTHROW(value = nlohmann::json::parse(text));  // refuses anything before or after the value
  REQUIRE(value.is_object());
  return value;
}

nlohmann::json costate_json(std::vector<std::string> arguments, const fs::path& directory, int expected_status) {
  arguments.push_back("--json");
  const Outcome o = run_costate(arguments, directory);
  INFO("standard error: " << o.err);
  CHECK(o.status == expected_status);
  return one_object(o.out);
}

}  // namespace costate::test
