// The progress display of long runs: one line on stderr that is rewritten in place, at most ten times a
// second, and only when stderr is a terminal and the user did not ask for quiet.
#pragma once

#include <chrono>
#include <cstdio>
#include <mutex>
#include <optional>
#include <string>

namespace costate {

struct ProgressOptions {
  bool quiet = false;               ///< show nothing at all (wins over verbose)
  bool verbose = false;             ///< print persistent lines also when the stream is not a terminal
  std::FILE* stream = stderr;       ///< where to write; not owned
  std::optional<bool> is_terminal;  ///< overrides the detection (isatty and TERM not "dumb")
};

/// Thread-safe. The destructor clears the line.
class Progress {
 public:
  explicit Progress(ProgressOptions options = {});
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  ~Progress();

  /// Marks the beginning of a simulation at time t_begin (s); speed and percentage count from here.
  /// Optional: without it they count from the first update, and again whenever time jumps back.
  void start(double t_begin);

  /// Shows simulated time t of t_end (s), percentage, step count and speed (simulated s per wall-clock s).
  /// Cheap to call after every step: returns at once unless 0.1 s have passed since the last display.
  void update(double t, double t_end, long steps);

  /// Prints a line that stays (without trailing line break), e.g. one per optimization evaluation: on a
  /// terminal always, otherwise only if verbose; never if quiet.
  void line(const std::string& text);

  /// Clears the progress line, so that other output can follow.
  void finish();

  /// Whether update() can show anything.
  [[nodiscard]] bool live() const { return live_; }

 private:
  using Clock = std::chrono::steady_clock;

  void clear_locked();
  void start_locked(double t_begin, Clock::time_point now);

  ProgressOptions options_;
  bool live_ = false;
  std::mutex mutex_;
  bool shown_ = false;    // a progress line is on the screen
  bool started_ = false;  // t_begin_ and began_ are set
  double t_begin_ = 0.0;
  double t_last_ = 0.0;
  Clock::time_point began_;
  Clock::time_point next_display_;
};

}  // namespace costate
