#include "costate/record/progress.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <string_view>

#include "costate/record/print.h"

namespace costate {
namespace {

constexpr std::chrono::milliseconds kInterval{100};

bool is_terminal(std::FILE* stream) {
  const char* term = std::getenv("TERM");
  return ::isatty(::fileno(stream)) == 1 && (term == nullptr || std::string_view(term) != "dumb");
}

std::size_t terminal_columns(std::FILE* stream) {
  winsize size{};
  if (::ioctl(::fileno(stream), TIOCGWINSZ, &size) == 0 && size.ws_col > 0) return size.ws_col;
  return 80;
}

}  // namespace

Progress::Progress(ProgressOptions options) : options_(options) {
  live_ = !options_.quiet && options_.is_terminal.value_or(is_terminal(options_.stream));
}

Progress::~Progress() { finish(); }

void Progress::start_locked(double t_begin, Clock::time_point now) {
  t_begin_ = t_last_ = t_begin;
  began_ = now;
  started_ = true;
}

void Progress::start(double t_begin) {
  if (!live_) return;
  const std::lock_guard<std::mutex> guard(mutex_);
  start_locked(t_begin, Clock::now());
}

void Progress::update(double t, double t_end, long steps) {
  if (!live_) return;
  const std::lock_guard<std::mutex> guard(mutex_);
  const Clock::time_point now = Clock::now();
  if (!started_ || t < t_last_) start_locked(t, now);
  t_last_ = t;
  if (now < next_display_) return;
  next_display_ = now + kInterval;

  const double wall_s = std::chrono::duration<double>(now - began_).count();
  const double span = t_end - t_begin_;
  const double percent = span > 0 ? std::clamp(100.0 * (t - t_begin_) / span, 0.0, 100.0) : 100.0;
  std::string text = fmt::format("t = {:.4g} of {:.6g} s  {:3.0f} %  {} steps", t, t_end, percent, steps);
  if (wall_s > 0.05) text += fmt::format("  {:.3g} simulated s/s", (t - t_begin_) / wall_s);
  const std::size_t columns = terminal_columns(options_.stream);
  if (text.size() >= columns) text.resize(columns - 1);  // a wrapped line could not be rewritten in place
  print_text(options_.stream, fmt::format("\r{}\x1b[K", text));
  std::fflush(options_.stream);
  shown_ = true;
}

void Progress::clear_locked() {
  if (!shown_) return;
  print_text(options_.stream, fmt::format("\r\x1b[K"));
  std::fflush(options_.stream);
  shown_ = false;
}

void Progress::line(const std::string& text) {
  if (options_.quiet || (!live_ && !options_.verbose)) return;
  const std::lock_guard<std::mutex> guard(mutex_);
  clear_locked();
  print_text(options_.stream, fmt::format("{}\n", text));
  std::fflush(options_.stream);
}

void Progress::finish() {
  if (!live_) return;
  const std::lock_guard<std::mutex> guard(mutex_);
  clear_locked();
  started_ = false;
}

}  // namespace costate
