#include "costate/record/interrupt.h"

#include <atomic>
#include <csignal>

namespace costate {
namespace {

std::atomic<int> g_signal{0};
static_assert(std::atomic<int>::is_always_lock_free, "the signal handler needs a lock-free flag");

extern "C" void costate_on_signal(int signal_number) {
  g_signal.store(signal_number, std::memory_order_relaxed);
  // From now on either signal has its default action: the second Ctrl-C ends the process.
  struct sigaction action {};
  action.sa_handler = SIG_DFL;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

}  // namespace

Interrupted::Interrupted(int signal_number)
    : Error(signal_number == SIGTERM ? std::string("interrupted by SIGTERM")
                                     : std::string("interrupted by Ctrl-C (SIGINT)")),
      signal_number_(signal_number) {}

void install_interrupt_handler() {
  g_signal.store(0, std::memory_order_relaxed);
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

}  // namespace costate
