// Everything that is read, mutated: scenes (with their laws, formulas and tables), what they include, overrides, tyre
// files, road profiles, studies, baselines, journals, stored trajectories. Each input must be read or refused by an
// error that names a place; none may crash, hang, outgrow a bound of memory, or end in a library's raw words. Scenes
// that read whole are started and run some steps, a third of them with a gradient.
//
//   costate_fuzz --inputs 1000000 [--from 0] [--seed 1] [--kind study]   the figures; status 1 if anything was found
//   costate_fuzz --input 4711 [--seed 1]                                 prints one input and what becomes of it
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <new>

#include "adversary/fuzz_inputs.h"
#include "adversary/fuzz_targets.h"

namespace fs = std::filesystem;
using namespace costate::fuzz;

namespace {

#if defined(__SANITIZE_ADDRESS__)
constexpr int kSlower = 6;  // what is watched at every access takes that much longer
#else
constexpr int kSlower = 1;
#endif
constexpr int kSeconds = 10 * kSlower, kWait = 300 * kSlower;  // for one input: of the processor, and its waits
constexpr rlim_t kMemory = rlim_t{2} << 30;
constexpr std::size_t kVerdicts = 7;
constexpr long kShown = 8;  // messages of each kind of finding

/// What the parent sees of a child that may vanish at any input.
struct Shared {
  long index = 0;
  long counts[kKinds][kVerdicts] = {};
  long of(Verdict v) const {
    long sum = 0;
    for (const auto& c : counts) sum += c[static_cast<std::size_t>(v)];
    return sum;
  }
};

Input input_of(const std::vector<Input>& corpus, std::uint64_t seed, long index) {
  return Mutator(corpus, seed * 1000003 + static_cast<std::uint64_t>(index)).make();
}

const char* const kVerdictNames[] = {"refused",        "read",      "ran",  "ended with a cause",
                                     "NAMES NO PLACE", "RAW WORDS", "WRONG"};

void note(Shared& shared, const Input& input, const Outcome& o) {
  long& count = shared.counts[static_cast<std::size_t>(input.kind)][static_cast<std::size_t>(o.verdict)];
  ++count;
  if (o.verdict < Verdict::placeless || count > kShown) return;
  fmt::print("input {} ({}): {}: {}\n", shared.index, name_of(input.kind),
             kVerdictNames[static_cast<std::size_t>(o.verdict)], o.message.substr(0, 400));
  std::fflush(stdout);
}

void limit_memory() {
#if !defined(__SANITIZE_ADDRESS__)
  const rlimit limit{kMemory, kMemory};
  setrlimit(RLIMIT_AS, &limit);
#endif
}

int show(const std::vector<Input>& all, std::uint64_t seed, long index, const fs::path& directory) {
  const Input input = input_of(all, seed, index);
  fmt::print("{}\n--- {}: ", input.text, name_of(input.kind));
  std::fflush(stdout);
  limit_memory();
  const Outcome o = try_input(input, index, directory);
  fmt::print("{} {}\n", kVerdictNames[static_cast<std::size_t>(o.verdict)], o.message);
  fs::remove_all(directory);
  return 0;
}

/// Whether every input is read as it is; else its mutations would be refused before anyone looks at them.
bool reads_unchanged(const std::vector<Input>& all, const fs::path& directory) {
  bool good = true;
  for (const Input& input : all) {
    if (input.kind == Input::Kind::scene || input.kind == Input::Kind::baseline) continue;  // some lack files they name
    const Outcome o = try_input(input, 1, directory);
    if (o.verdict == Verdict::read || o.verdict == Verdict::ran) continue;
    fmt::print("A {} is refused as it is: {}\n", name_of(input.kind), o.message);
    good = false;
  }
  return good;
}

}  // namespace

int main(int argc, char** argv) {
  long inputs = 10000, from = 0, one = -1;
  std::uint64_t seed = 1;
  std::string kind;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::strcmp(argv[i], "--inputs") == 0) inputs = std::atol(argv[i + 1]);
    if (std::strcmp(argv[i], "--from") == 0) from = std::atol(argv[i + 1]);
    if (std::strcmp(argv[i], "--input") == 0) one = std::atol(argv[i + 1]);
    if (std::strcmp(argv[i], "--seed") == 0) seed = std::strtoull(argv[i + 1], nullptr, 10);
    if (std::strcmp(argv[i], "--kind") == 0) kind = argv[i + 1];
  }
  const std::vector<Input> all = corpus();
  const fs::path directory = fs::temp_directory_path() / fmt::format("costate_fuzz_{}", getpid());
  fs::create_directories(directory);
  if (one >= 0) return show(all, seed, one, directory);
  if (!reads_unchanged(all, directory)) {
    fs::remove_all(directory);
    return 1;
  }
  auto* shared =
      static_cast<Shared*>(mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
  new (shared) Shared;
  shared->index = from;
  const long end = from + inputs;
  long crashed = 0, hung = 0;
  const auto begin = std::chrono::steady_clock::now();
  while (shared->index < end) {
    std::fflush(stdout);
    const pid_t child = fork();
    if (child == 0) {
      limit_memory();
      for (; shared->index < end; ++shared->index) {
        const Input input = input_of(all, seed, shared->index);
        if (!kind.empty() && kind != name_of(input.kind)) continue;
        const itimerval limit{{0, 0}, {kSeconds, 0}};
        setitimer(ITIMER_VIRTUAL, &limit, nullptr);
        alarm(kWait);
        note(*shared, input, try_input(input, shared->index, directory));
      }
      std::fflush(stdout);
      _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    if (shared->index >= end && WIFEXITED(status)) break;
    const bool alarmed = WIFSIGNALED(status) && (WTERMSIG(status) == SIGALRM || WTERMSIG(status) == SIGVTALRM);
    ++(alarmed ? hung : crashed);
    fmt::print("input {} ({}): {} (status {})\n", shared->index, name_of(input_of(all, seed, shared->index).kind),
               alarmed ? "HUNG" : "CRASHED", status);
    ++shared->index;
  }
  fs::remove_all(directory);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  rusage used{};
  getrusage(RUSAGE_CHILDREN, &used);
  fmt::print("{:10} {:>9} {:>9} {:>9} {:>9} {:>6} {:>6}\n", "", "refused", "read", "ran", "no place", "raw", "wrong");
  for (std::size_t k = 0; k < kKinds; ++k) {
    const auto& c = shared->counts[k];
    fmt::print("{:10} {:9} {:9} {:9} {:9} {:6} {:6}\n", name_of(static_cast<Input::Kind>(k)), c[0], c[1] + c[3], c[2],
               c[4], c[5], c[6]);
  }
  const long found = shared->of(Verdict::placeless) + shared->of(Verdict::raw) + shared->of(Verdict::wrong);
  fmt::print(
      "{} inputs from {}, seed {}, {:.0f} s, at most {} MB: {} without a place, raw or wrong, {} crashed, {} hung\n",
      inputs, from, seed, seconds, used.ru_maxrss / 1024, found, crashed, hung);
  return crashed + hung + found > 0 ? 1 : 0;
}
