// The budget of a run (integrator/run_budget.h) counts the processor time of all threads that run for it.
#include "costate/integrator/run_budget.h"

#include <catch2/catch.hpp>
#include <thread>
#include <vector>

namespace costate {
namespace {

/// Looks every millisecond of this thread's processor time until `seconds` of it are gone; false where it was cut.
bool spends(const RunBudget& budget, double seconds) {
  const double begin = RunBudget::processor_s();
  try {
    for (double next = 0; next < seconds; next += 1e-3) {
      while (RunBudget::processor_s() - begin < next) {
      }
      budget.look(0, 1, false);
    }
  } catch (const Cut&) {
    return false;
  }
  return true;
}

/// How many of two threads with `seconds` each are cut.
int cut_of_two(const RunBudget& budget, double seconds) {
  std::vector<char> ended(2, 0);
  std::vector<std::thread> threads;
  for (char& e : ended) threads.emplace_back([&e, &budget, seconds] { e = spends(budget, seconds); });
  for (std::thread& t : threads) t.join();
  return 2 - ended[0] - ended[1];
}

TEST_CASE("run budget: threads share it") {
  RunBudget budget;
  budget.begin(0.06);
  CHECK(cut_of_two(budget, 0.02) == 0);  // 0.04 s of 0.06
  CHECK(cut_of_two(budget, 0.02) > 0);   // 0.08 s; one thread alone stays below
  budget.begin(0.06);                    // from here on
  CHECK(spends(budget, 0.02));
  CHECK(cut_of_two(budget, 0.015) == 0);  // 0.05 s with what this thread has spent
  CHECK_FALSE(spends(budget, 0.02));
}

TEST_CASE("run budget: no seconds at all are none, and only no limit is none") {
  RunBudget budget;
  CHECK(spends(budget, 0.01));
  budget.begin(0);
  CHECK_FALSE(spends(budget, 0.01));
  budget.begin(RunBudget::kNoLimit, 0);
  CHECK_FALSE(spends(budget, 0.01));  // of a step
  budget.unlimited();
  CHECK(spends(budget, 0.01));
}

}  // namespace
}  // namespace costate
