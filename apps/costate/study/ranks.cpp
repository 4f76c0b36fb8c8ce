#include "ranks.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/command.h"
#include "costate/library_file.h"
#include "costate/record/interrupt.h"
#include "mpi/message_passing.h"

namespace costate::app {

namespace {

/// For how long a rank that was told to end, or has nothing to say, waits for the others to end.
constexpr auto kPatience = std::chrono::seconds(3);

/// Of a rank that was told to end by a signal: the first one ends then, and the others with it; or all at once.
void wait_for_end(const Ranks& ranks) {
  const auto until = std::chrono::steady_clock::now() + kPatience;
  while (std::chrono::steady_clock::now() < until) {
    if (const auto message = ranks.receive(); message && message->second.contains("end")) return;
    std::this_thread::sleep_for(kLook);
  }
  ranks.abort();
}

}  // namespace

// Open MPI; MPICH, Intel MPI and Slurm by PMI; PMIx.
bool started_as_ranks() {
  for (const char* size : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE"})
    if (const char* text = std::getenv(size)) return std::atoi(text) > 1;
  return std::getenv("PMIX_RANK") != nullptr;
}

bool is_told_by_first_rank() {
  if (!started_as_ranks()) return false;
  const char* rank = nullptr;
  for (const char* name : {"OMPI_COMM_WORLD_RANK", "PMI_RANK", "PMIX_RANK"})
    if (!rank) rank = std::getenv(name);
  if (!rank || std::atoi(rank) == 0) return false;
  std::this_thread::sleep_for(kPatience);
  return true;
}

std::unique_ptr<Ranks> Ranks::of_this_job() {
  if (!started_as_ranks()) return nullptr;
  const std::filesystem::path library = library_of(&take_notices).parent_path() / "libcostate_mpi.so";
  // Its MPI loads parts of its own, which look for MPI's symbols among those of the program.
  void* loaded = ::dlopen(library.c_str(), RTLD_NOW | RTLD_GLOBAL);
  void* begin = loaded ? ::dlsym(loaded, kCostateMpiBegin) : nullptr;
  if (!begin)
    throw Error(
        fmt::format("mpirun has started this program several times, and the library by which its ranks meet is missing "
                    "({}): build Costate where MPI is found (libopenmpi-dev), or give each process a part of the study "
                    "by --shard I/N.",
                    std::filesystem::exists(library) ? std::string(::dlerror()) : library.string()));
  const CostateMessagePassing& mpi = *reinterpret_cast<CostateMpiBegin>(begin)();
  return std::make_unique<Ranks>(mpi);
}

Ranks::~Ranks() {
  if (rank() == 0)
    for (int other = 1; other < size(); ++other) send(other, {{"end", true}});
  mpi_.finish();
}

int Ranks::rank() const { return mpi_.rank; }
int Ranks::size() const { return mpi_.size; }

void Ranks::send(int to, const Json& message) const {
  const std::string text = message.dump(-1, ' ', false, Json::error_handler_t::replace);
  mpi_.send(to, text.data(), static_cast<int>(text.size()));
}

std::optional<std::pair<int, Json>> Ranks::receive() const {
  int source = 0, bytes = 0;
  if (mpi_.waits(&source, &bytes) == 0) return {};
  std::string text(static_cast<std::size_t>(bytes), ' ');
  mpi_.receive(source, text.data(), bytes);
  return std::pair(source, Json::parse(text));
}

void Ranks::abort() const {
  mpi_.abort(kFailed);
  ::_exit(kFailed);
}

RunPlaces::RunPlaces(std::size_t at_once, const Ranks* ranks) : pool_(at_once), ranks_(ranks) {
  if (!ranks) return;
  // So that all ranks get one before any gets two.
  for (std::size_t i = 0; i < at_once; ++i)
    for (int other = ranks->size(); other-- > 1;) rooms_.push_back(other);
}

void RunPlaces::start(std::size_t run, const std::vector<std::string>& words, const std::string& log) {
  if (rooms_.empty()) return pool_.start(run, words, log);
  ranks_->send(rooms_.back(), {{"run", run}, {"words", words}, {"log", log}});
  rooms_.pop_back();
  ++away_;
}

std::vector<ProcessPool::Ended> RunPlaces::take_ended() {
  std::vector<ProcessPool::Ended> ended = pool_.take_ended();
  if (!ranks_) return ended;
  while (const auto message = ranks_->receive()) {
    const auto& [source, what] = *message;
    if (what.contains("interrupted")) throw Interrupted(what.at("interrupted").get<int>());
    ended.push_back({what.at("run").get<std::size_t>(), what.at("status").get<int>()});
    rooms_.push_back(source);
    --away_;
  }
  return ended;
}

void serve_runs(const Ranks& ranks, std::size_t at_once) {
  ProcessPool pool(at_once);
  for (;; std::this_thread::sleep_for(kLook)) {
    for (const auto& [run, status] : pool.take_ended()) ranks.send(0, {{"run", run}, {"status", status}});
    while (const auto message = ranks.receive()) {
      const Json& what = message->second;
      if (what.contains("end")) return pool.stop_all();
      pool.start(what.at("run").get<std::size_t>(), what.at("words").get<std::vector<std::string>>(),
                 what.at("log").get<std::string>());
    }
    try {
      throw_if_interrupted();
    } catch (const Interrupted& e) {
      pool.stop_all();
      ranks.send(0, {{"interrupted", e.signal_number()}});
      wait_for_end(ranks);
      return;
    }
  }
}

}  // namespace costate::app
