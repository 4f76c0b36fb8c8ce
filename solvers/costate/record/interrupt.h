// Orderly interruption: the first Ctrl-C (SIGINT) or SIGTERM only sets a flag that long computations look
// at between steps, so that partial results are saved; a second one ends the process at once.
#pragma once

#include <stdexcept>
#include <string>

namespace costate {

/// Thrown by throw_if_interrupted; the command line turns it into exit status 128 + signal. No Error: who handles
/// those, or says more about them, does not mean this.
class Interrupted : public std::runtime_error {
 public:
  explicit Interrupted(int signal_number);
  /// SIGINT or SIGTERM.
  [[nodiscard]] int signal_number() const { return signal_number_; }

 private:
  int signal_number_;
};

/// Installs the handler for SIGINT and SIGTERM and clears the flag. A signal that the parent process set to
/// be ignored (nohup, background jobs of a script) stays ignored. For main(); libraries must not call it.
void install_interrupt_handler();

/// Whether a signal has arrived since install_interrupt_handler. One relaxed atomic load; any thread.
[[nodiscard]] bool interrupted() noexcept;

/// Throws Interrupted if interrupted(). The flag stays set.
void throw_if_interrupted();

}  // namespace costate
