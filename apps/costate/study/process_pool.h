// Runs of this program as processes of their own, some at a time.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

namespace costate::app {

/// How often ends of processes, and messages of other ranks, are looked for.
inline constexpr auto kLook = std::chrono::milliseconds(2);

class ProcessPool {
 public:
  explicit ProcessPool(std::size_t at_once) : at_once_(at_once) {}

  bool has_room() const { return running_.size() < at_once_; }
  std::size_t running() const { return running_.size(); }
  /// Begins this program with these words, the first being its name; what it says goes into the file `log`. It ends
  /// with this process, however that ends.
  void start(std::size_t run, const std::vector<std::string>& words, const std::string& log);
  struct Ended {
    std::size_t run;
    int wait_status;  // as waitpid() has it
  };
  /// Those that have ended since the last call.
  std::vector<Ended> take_ended();
  /// Asks all to end, which write what they have, and waits for them.
  void stop_all();

 private:
  struct Running {
    std::size_t run;
    pid_t pid;
  };
  std::size_t at_once_;
  std::vector<Running> running_;
};

}  // namespace costate::app
