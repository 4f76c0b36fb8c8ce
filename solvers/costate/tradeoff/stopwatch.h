// Interleaved timing: several jobs take turns, so that what else the machine does falls on all of them alike, and
// their ratios mean something where their times alone do not. Processor time of the calling thread.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace costate {

/// Seconds of processor time that this thread has used.
double processor_time_s();

struct Timing {
  double minimum_s = 0, median_s = 0;
};

class Race {
 public:
  /// Returns the job's index. The job may throw; the race ends there. `known_s`: what it takes, where it has run
  /// before.
  int add(std::function<void()> job, double known_s = 0);
  /// One round unmeasured of those that have not run before, then `rounds` measured ones; a job of less than
  /// `shortest_s` is repeated within a round. Before each job `go_on` is asked; what has been measured until then
  /// stays.
  void run(int rounds, double shortest_s = 2e-3, const std::function<bool()>& go_on = {});
  /// In how many rounds it was measured.
  int rounds(int job) const { return static_cast<int>(seconds_[static_cast<std::size_t>(job)].size()); }
  Timing timing(int job) const;
  double minimum_ms(int job) const { return 1e3 * timing(job).minimum_s; }
  /// minimum of `job` / minimum of `reference`, and the same of their medians.
  double ratio(int job, int reference) const;
  double median_ratio(int job, int reference) const;

 private:
  std::vector<std::function<void()>> jobs_;
  std::vector<double> known_s_;
  std::vector<std::vector<double>> seconds_;
};

}  // namespace costate
