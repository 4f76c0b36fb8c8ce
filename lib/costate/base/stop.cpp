#include "costate/base/stop.h"

#include <atomic>
#include <chrono>
#include <future>
#include <thread>
#include <utility>

namespace costate {

namespace {
std::atomic<void (*)()> g_check{nullptr};
}

void set_stop_check(void (*check)()) { g_check.store(check, std::memory_order_relaxed); }

void check_stop() {
  if (const auto check = g_check.load(std::memory_order_relaxed)) check();
}

void run_stoppably(std::function<void()> work) {
  check_stop();
  std::packaged_task<void()> task(std::move(work));
  std::future<void> done = task.get_future();
  std::thread thread(std::move(task));
  try {
    while (done.wait_for(std::chrono::milliseconds(50)) != std::future_status::ready) check_stop();
  } catch (...) {
    thread.detach();
    throw;
  }
  thread.join();
  done.get();
}

}  // namespace costate
