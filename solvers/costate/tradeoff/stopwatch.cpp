#include "costate/tradeoff/stopwatch.h"

#include <algorithm>
#include <cmath>
#include <ctime>

namespace costate {

double processor_time_s() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

int Race::add(std::function<void()> job, double known_s) {
  jobs_.push_back(std::move(job));
  known_s_.push_back(known_s);
  seconds_.emplace_back();
  return static_cast<int>(jobs_.size()) - 1;
}

void Race::run(int rounds, double shortest_s, const std::function<bool()>& go_on) {
  seconds_.assign(jobs_.size(), {});
  std::vector<int> repetitions;
  const auto measure = [](const std::function<void()>& job, int n) {
    const double begin = processor_time_s();
    for (int i = 0; i < n; ++i) job();
    return (processor_time_s() - begin) / n;
  };
  for (std::size_t k = 0; k < jobs_.size(); ++k) {
    const double once = std::max(known_s_[k] > 0 ? known_s_[k] : measure(jobs_[k], 1), 1e-6);
    repetitions.push_back(static_cast<int>(std::clamp(std::ceil(shortest_s / once), 1.0, 1000.0)));
  }
  for (int round = 0; round < rounds; ++round)
    for (std::size_t k = 0; k < jobs_.size(); ++k) {
      if (go_on && !go_on()) return;
      seconds_[k].push_back(measure(jobs_[k], repetitions[k]));
    }
}

Timing Race::timing(int job) const {
  std::vector<double> s = seconds_[static_cast<std::size_t>(job)];
  if (s.empty()) return {};
  std::sort(s.begin(), s.end());
  return {s.front(), s[s.size() / 2]};
}

double Race::ratio(int job, int reference) const { return timing(job).minimum_s / timing(reference).minimum_s; }

double Race::median_ratio(int job, int reference) const { return timing(job).median_s / timing(reference).median_s; }

}  // namespace costate
