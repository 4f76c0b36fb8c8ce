#include "costate/record/jobs.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <string>
#include <thread>
#include <vector>

#include "costate/base/notice.h"

namespace costate {

namespace {
thread_local int jobs_of_thread = 1;
}

int cores() { return std::max(1, static_cast<int>(std::thread::hardware_concurrency())); }

int jobs() { return jobs_of_thread; }

void set_jobs(int at_once) { jobs_of_thread = at_once > 0 ? at_once : cores(); }

void for_each_job(std::size_t count, int at_once, const std::function<void(std::size_t)>& work) {
  if (at_once <= 1 || count <= 1) {
    for (std::size_t i = 0; i < count; ++i) work(i);
    return;
  }
  std::atomic<std::size_t> next{0};
  std::atomic<bool> failed{false};
  std::vector<std::exception_ptr> errors(count);
  std::vector<std::vector<std::string>> said(count);
  const auto serve = [&] {
    while (!failed) {
      const std::size_t i = next++;
      if (i >= count) return;
      try {
        work(i);
      } catch (...) {
        errors[i] = std::current_exception();
        failed = true;
      }
      said[i] = take_notices();
    }
  };
  std::vector<std::thread> threads;
  for (std::size_t k = 0; k < std::min(count, static_cast<std::size_t>(at_once)); ++k) threads.emplace_back(serve);
  for (std::thread& thread : threads) thread.join();
  for (const auto& sentences : said)
    for (const std::string& sentence : sentences) notice(sentence);
  for (const std::exception_ptr& error : errors)
    if (error) std::rethrow_exception(error);
}

}  // namespace costate
