// Interleaved timing: several jobs take turns, so that what else the machine does falls on all of them alike, and
// their ratios mean something where their times alone do not. Processor time of the calling thread.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace costate::bench {

/// Seconds of processor time that this thread has used.
double processor_time_s();

struct Timing {
  double minimum_s = 0, median_s = 0;
};

class Race {
 public:
  /// Returns the job's index. The job may throw; the race ends there.
  int add(std::function<void()> job);
  /// One round unmeasured, then `rounds` measured ones; a job of less than `shortest_s` is repeated within a round.
  void run(int rounds, double shortest_s = 2e-3);
  Timing timing(int job) const;
  double minimum_ms(int job) const { return 1e3 * timing(job).minimum_s; }
  /// minimum of `job` / minimum of `reference`, and the same of their medians.
  double ratio(int job, int reference) const;
  double median_ratio(int job, int reference) const;

 private:
  std::vector<std::function<void()>> jobs_;
  std::vector<std::vector<double>> seconds_;
};

}  // namespace costate::bench
