// Independent computations on several threads: rows of a table, runs of difference quotients. Each owns what it
// computes with (a System serves one thread), so that numbers are the same whatever runs beside them; what a thread has
// said (base/notice.h) and the first error, both in order of the work, come back to the caller.
#pragma once

#include <cstddef>
#include <functional>

namespace costate {

/// The number of processor cores, at least 1.
int cores();

/// How many computations this thread may run at once where a library function can: 1 until set_jobs() has said more.
/// Threads of for_each_job() begin with 1, so that what is inside takes no more.
int jobs();
/// 0: as many as there are cores.
void set_jobs(int at_once);

/// Another number of jobs() while it lives.
class JobsHere {
 public:
  explicit JobsHere(int at_once) : before_(jobs()) { set_jobs(at_once); }
  ~JobsHere() { set_jobs(before_); }
  JobsHere(const JobsHere&) = delete;
  JobsHere& operator=(const JobsHere&) = delete;

 private:
  int before_;
};

/// work(i) for all i < count, at most `at_once` of them at a time, begun in their order. Where one throws no other is
/// begun, and the error of the smallest i is thrown once all have ended. With at_once <= 1 in the calling thread.
void for_each_job(std::size_t count, int at_once, const std::function<void(std::size_t)>& work);

}  // namespace costate
