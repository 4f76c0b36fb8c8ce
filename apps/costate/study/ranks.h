// The ranks of an MPI job, where mpirun has started this program several times: the first one has the runs and writes,
// the others take runs from it.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "costate/json_text.h"
#include "process_pool.h"

struct CostateMessagePassing;

namespace costate::app {

/// Whether the starter of an MPI job has started this program, and not alone.
bool started_as_ranks();

/// Of a mistake that every rank makes before they have met each other: false at once where this is the first rank, or
/// no rank; on the others true after a while, in which the first one tells it and ends the job.
bool is_told_by_first_rank();

class Ranks {
 public:
  /// Those of this job, once all have met; null where this program runs alone. Throws Error where the ranks cannot
  /// meet, as this build has no MPI.
  static std::unique_ptr<Ranks> of_this_job();
  explicit Ranks(const CostateMessagePassing& mpi) : mpi_(mpi) {}
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;
  /// The first one sends the others home. Returns when all have come here.
  ~Ranks();

  int rank() const;
  int size() const;
  void send(int to, const Json& message) const;
  /// Whose, and what; nothing where none waits.
  std::optional<std::pair<int, Json>> receive() const;
  /// Ends all ranks at once.
  [[noreturn]] void abort() const;

 private:
  const CostateMessagePassing& mpi_;
};

/// Where a study's runs take place: processes of this machine, and of the other ranks'.
class RunPlaces {
 public:
  /// `ranks` (or null) of the first rank; `at_once` of each.
  RunPlaces(std::size_t at_once, const Ranks* ranks);

  bool has_room() const { return pool_.has_room() || !rooms_.empty(); }
  std::size_t running() const { return pool_.running() + away_; }
  void start(std::size_t run, const std::vector<std::string>& words, const std::string& log);
  /// Throws Interrupted where another rank was.
  std::vector<ProcessPool::Ended> take_ended();
  /// Those of this machine; the others' when the ranks end.
  void stop_all() { pool_.stop_all(); }

 private:
  ProcessPool pool_;
  const Ranks* ranks_;
  std::vector<int> rooms_;  // ranks with room, each as often as it has some
  std::size_t away_ = 0;
};

/// What the other ranks do: the runs that the first one gives them, until it sends them home.
void serve_runs(const Ranks& ranks, std::size_t at_once);

}  // namespace costate::app
