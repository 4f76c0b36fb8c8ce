// Runs programs as a user's shell would: in a directory of their own, with their output captured, on a terminal or
// not, and ended by signals at chosen moments.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace costate::test {

/// A new empty directory, removed with its content at the end of the test.
class WorkingDirectory {
 public:
  WorkingDirectory();
  ~WorkingDirectory();
  WorkingDirectory(const WorkingDirectory&) = delete;
  WorkingDirectory& operator=(const WorkingDirectory&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  /// Every file and directory below, relative and sorted.
  std::vector<std::string> entries() const;

 private:
  std::filesystem::path path_;
};

std::string file_text(const std::filesystem::path& path);
void write_text(const std::filesystem::path& path, const std::string& text);

/// What is left of a process.
struct Outcome {
  int status = -1;  // exit status, or -1 when a signal ended it
  int signal = 0;   // that signal
  std::string out, err;
  std::string terminal;  // what it wrote to its terminal, if it had one
};

/// How a process is connected to the outside.
enum class Connection {
  files,            // standard output and error are no terminal
  terminal,         // both are
  terminal_errors,  // only standard error is, as with `costate ... > file`
};

class Process {
 public:
  /// Starts a program; `arguments` without its name.
  Process(const std::string& program, const std::vector<std::string>& arguments, const std::filesystem::path& directory,
          Connection connection = Connection::files);
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void send(int signal_number) const;
  /// Types on its terminal.
  void type(const std::string& text) const;
  /// Waits until `condition` holds or the process ends; whether it still runs.
  bool wait_until(const std::function<bool()>& condition);
  /// What it has written to its terminal so far.
  const std::string& seen() const { return written_; }
  Outcome finish();

 private:
  bool ended();
  void read_terminal();

  WorkingDirectory captured_;
  pid_t pid_ = -1;
  int terminal_ = -1;
  bool reaped_ = false;
  int wait_status_ = 0;
  std::string written_;
};

/// Runs `costate ARGUMENTS` to its end.
Outcome run_costate(const std::vector<std::string>& arguments, const std::filesystem::path& directory,
                    Connection connection = Connection::files);
/// The same with --json; requires exactly one JSON object on standard output.
nlohmann::json costate_json(std::vector<std::string> arguments, const std::filesystem::path& directory,
                            int expected_status = 0);
/// The one JSON object that `text` consists of; fails the test otherwise.
nlohmann::json one_object(const std::string& text);

}  // namespace costate::test
