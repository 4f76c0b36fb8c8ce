#include "costate/record/interrupt.h"

#include <sys/time.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <csignal>
#include <cstring>

#include "costate/base/stop.h"
#include "costate/record/nothing_to_save.h"

namespace costate {
namespace {

constexpr int kPatience_us = 500000;

std::atomic<int> g_signal{0}, g_nothing_to_save{0};
std::atomic<bool> g_json{false};
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<bool>::is_always_lock_free,
              "the signal handlers need lock-free flags");

// Files that are being written, for a handler that may allocate and lock nothing; what finds no place stays behind,
// until the next file that is written beside it.
struct Removed {
  std::atomic<int> state{0};  // free, being filled or emptied, in force
  char path[4096];
};
std::array<Removed, 16> g_removed;

void arm() {
  itimerval in{};
  in.it_value.tv_usec = kPatience_us;
  setitimer(ITIMER_REAL, &in, nullptr);
}

void say(int descriptor, const char* text) {
  if (::write(descriptor, text, std::strlen(text)) < 0) return;  // there is no one to tell
}

extern "C" void costate_on_alarm(int) {
  const int signal_number = g_signal.load(std::memory_order_relaxed);
  if (signal_number == 0 || g_nothing_to_save.load(std::memory_order_relaxed) == 0) return;
  const bool term = signal_number == SIGTERM;
  say(STDERR_FILENO, term ? "costate: interrupted by SIGTERM\n" : "costate: interrupted by Ctrl-C (SIGINT)\n");
  if (g_json.load(std::memory_order_relaxed))
    say(STDOUT_FILENO, term ? "{\n \"status\": \"interrupted\",\n \"error\": \"interrupted by SIGTERM\"\n}\n"
                            : "{\n \"status\": \"interrupted\",\n \"error\": \"interrupted by Ctrl-C (SIGINT)\"\n}\n");
  for (const Removed& r : g_removed)
    if (r.state.load(std::memory_order_acquire) == 2) ::unlink(r.path);
  _exit(128 + signal_number);
}

extern "C" void costate_on_signal(int signal_number) {
  g_signal.store(signal_number, std::memory_order_relaxed);
  // From now on either signal has its default action: the second Ctrl-C ends the process.
  struct sigaction action {};
  action.sa_handler = SIG_DFL;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  if (g_nothing_to_save.load(std::memory_order_relaxed) > 0) arm();
}

}  // namespace

Interrupted::Interrupted(int signal_number)
    : std::runtime_error(signal_number == SIGTERM ? std::string("interrupted by SIGTERM")
                                                  : std::string("interrupted by Ctrl-C (SIGINT)")),
      signal_number_(signal_number) {}

void install_interrupt_handler() {
  g_signal.store(0, std::memory_order_relaxed);
  set_stop_check(&throw_if_interrupted);
  struct sigaction alarm {};
  alarm.sa_handler = costate_on_alarm;
  alarm.sa_flags = SA_RESTART;
  sigemptyset(&alarm.sa_mask);
  sigaction(SIGALRM, &alarm, nullptr);
  for (const int signal_number : {SIGINT, SIGTERM}) {
    struct sigaction old_action {};
    sigaction(signal_number, nullptr, &old_action);
    if (old_action.sa_handler == SIG_IGN) continue;
    struct sigaction action {};
    action.sa_handler = costate_on_signal;
    action.sa_flags = SA_RESTART;  // file output in progress must not fail with EINTR
    sigemptyset(&action.sa_mask);
    sigaction(signal_number, &action, nullptr);
  }
}

bool interrupted() noexcept { return g_signal.load(std::memory_order_relaxed) != 0; }

void throw_if_interrupted() {
  const int signal_number = g_signal.load(std::memory_order_relaxed);
  if (signal_number != 0) throw Interrupted(signal_number);
}

RemovedAtOnce::RemovedAtOnce(const std::string& path) {
  if (path.size() >= sizeof(Removed::path)) return;
  for (std::size_t i = 0; i < g_removed.size(); ++i) {
    int free = 0;
    if (!g_removed[i].state.compare_exchange_strong(free, 1)) continue;
    std::memcpy(g_removed[i].path, path.c_str(), path.size() + 1);
    g_removed[i].state.store(2, std::memory_order_release);
    place_ = static_cast<int>(i);
    return;
  }
}

RemovedAtOnce::~RemovedAtOnce() {
  if (place_ >= 0) g_removed[static_cast<std::size_t>(place_)].state.store(0, std::memory_order_release);
}

NothingToSave::NothingToSave(bool json) {
  if (json) g_json.store(true, std::memory_order_relaxed);
  g_nothing_to_save.fetch_add(1, std::memory_order_relaxed);
  if (interrupted()) arm();
}

NothingToSave::~NothingToSave() {
  if (g_nothing_to_save.fetch_sub(1, std::memory_order_relaxed) == 1) g_json.store(false, std::memory_order_relaxed);
}

}  // namespace costate
