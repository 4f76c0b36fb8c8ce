// Everything that the library reads, mutated: scenes (with their laws, formulas, tables and includes) and
// tyre files. Each input must be read or refused by an error that names a place; none may crash, hang, or end
// in a library's raw words.
//
//   costate_fuzz --inputs 1000000 [--seed 1]       the figures; status 1 if anything was found
//   costate_fuzz --input 4711 [--seed 1]           prints one input
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "costate/analysis/start.h"
#include "costate/base/error.h"
#include "costate/integrator/simulate.h"
#include "costate/kind/law/law_table.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/scene/scene_kind.h"
#include "support/paths.h"

namespace fs = std::filesystem;
using namespace costate;

namespace {

constexpr int kSeconds = 10;            // for one input
constexpr std::size_t kLargest = 8000;  // bytes of an input taken from a larger file
constexpr rlim_t kMemory = rlim_t{3} << 30;

// A wheel whose tyre is that of a file, named behind it.
const std::string kWheel = R"([road.plain]
kind = "flat"
[rigid_body.wheel]
x_m = 0
y_m = 0
z_m = 0.19
vx_m_per_s = 10
omega_y_rad_per_s = 52
mass_kg = 10
inertia_xx_kg_m2 = 1
inertia_yy_kg_m2 = 1
inertia_zz_kg_m2 = 1
[point.hub]
on = "wheel"
x_m = 0
y_m = 0
z_m = 0
[tyre.T]
wheel = "hub"
road = "plain"
stiffness_N_per_m = 1.6e5
model = "magic_formula"
)";

struct Input {
  bool tyre = false;
  std::string text;
};

std::string read(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

std::vector<Input> corpus() {
  std::vector<Input> list;
  for (const auto& entry : fs::recursive_directory_iterator(COSTATE_MODELS_DIR)) {
    const std::string extension = entry.path().extension().string();
    if (extension != ".toml" && extension != ".tir") continue;
    Input input{extension == ".tir", read(entry.path())};
    if (!input.tyre && input.text.size() > kLargest) continue;
    list.push_back(std::move(input));
  }
  for (const SceneKind& kind : scene_kinds())
    if (!kind.example.empty()) list.push_back({false, kind.example});
  for (const LawKind& law : law_kinds())
    if (!law.example.empty())
      list.push_back({false,
                      "[point.A]\nground = true\nx_m = 0\ny_m = 0\n[point.P]\nx_m = 0.6\ny_m = "
                      "-0.8\n[bar.b]\nfrom = \"A\"\n"
                      "to = \"P\"\nmass_kg = 1\n[force.f]\npoint = \"P\"\nx_N = " +
                          law.example + "\n[start]\ngiven = [\"P.x\"]\n"});
  return list;
}

class Mutator {
 public:
  Mutator(const std::vector<Input>& corpus, std::uint64_t seed) : corpus_(corpus), engine_(seed) {}

  Input make() {
    Input input = corpus_[pick(corpus_.size())];
    if (input.tyre && pick(4) != 0) input = corpus_[pick(corpus_.size())];  // tyre files are long
    for (std::size_t n = 1 + pick(3); n > 0; --n) change(input.text);
    return input;
  }

 private:
  std::size_t pick(std::size_t n) { return n == 0 ? 0 : static_cast<std::size_t>(engine_() % n); }

  /// [begin, end) of a random line.
  std::pair<std::size_t, std::size_t> line(const std::string& s) {
    const std::size_t at = pick(s.size());
    const std::size_t begin = at == 0 ? 0 : s.rfind('\n', at - 1) + 1, end = s.find('\n', at);
    return {begin == std::string::npos + 1 ? 0 : begin, end == std::string::npos ? s.size() : end};
  }

  void change(std::string& s) {
    if (s.empty()) return;
    static const char* const values[] = {"0",
                                         "-1",
                                         "1e308",
                                         "-1e308",
                                         "1e-320",
                                         "nan",
                                         "inf",
                                         "-inf",
                                         "1e999",
                                         "true",
                                         "\"\"",
                                         "\"A\"",
                                         "[]",
                                         "[1, 2]",
                                         "{}",
                                         "[[]]",
                                         "1979-05-27",
                                         "99999999999999999999",
                                         "0x7fffffffffffffff",
                                         "{ kind = \"sine\" }",
                                         "{ kind = \"formula\", formula = \"1/t\" }",
                                         "\"a.b\"",
                                         "1e-12",
                                         "1e12",
                                         "{ P = { x_m = 1, y_m = 2 } }",
                                         "[\"P.x\", \"P.y\"]",
                                         "\"\\u0000\"",
                                         "'",
                                         "-0.0"};
    static const char* const keys[] = {"point = { P = { x_m = 1, y_m = 2 } }",
                                       "[bar.b]",
                                       "[point.P]",
                                       "include = [\"x.toml\"]",
                                       "remove = [\"*\"]",
                                       "[[cost.running]]",
                                       "[start]\nequilibrium = true",
                                       "ground = true",
                                       "[run]\nt_end_s = 1",
                                       "a.b.c.d.e = 1",
                                       "[a]",
                                       "[[a]]",
                                       "= 1",
                                       "x_m = 1",
                                       "mass_kg = 0"};
    switch (pick(11)) {
      case 0:
        s[pick(s.size())] = static_cast<char>(engine_() % 256);
        break;
      case 1:
        s.erase(pick(s.size()), 1 + pick(8));
        break;
      case 2: {
        const auto [b, e] = line(s);
        s.erase(b, e - b);
        break;
      }
      case 3: {
        const auto [b, e] = line(s);
        s.insert(b, s.substr(b, e - b) + "\n");
        break;
      }
      case 4:
      case 5: {  // another value
        const auto [b, e] = line(s);
        const std::size_t equals = s.find('=', b);
        if (equals == std::string::npos || equals >= e) break;
        s.replace(equals + 1, e - equals - 1, std::string(" ") + values[pick(std::size(values))]);
        break;
      }
      case 6: {  // a line of another input
        const std::string& other = corpus_[pick(corpus_.size())].text;
        const auto [b, e] = line(other);
        const auto [at, unused] = line(s);
        s.insert(at, other.substr(b, e - b) + "\n");
        break;
      }
      case 7:
        s.insert(line(s).first, std::string(keys[pick(std::size(keys))]) + "\n");
        break;
      case 8:
        s.resize(pick(s.size()));
        break;
      case 9: {  // a number replaced within the line
        const std::size_t at = s.find_first_of("0123456789", pick(s.size()));
        if (at == std::string::npos) break;
        const std::size_t end = s.find_first_not_of("0123456789.eE+-", at);
        s.replace(at, (end == std::string::npos ? s.size() : end) - at, values[pick(14)]);
        break;
      }
      default: {  // a name replaced by another of the same text
        const std::size_t a = s.find('"', pick(s.size())), b = s.find('"', pick(s.size()));
        if (a == std::string::npos || b == std::string::npos) break;
        const std::size_t ae = s.find('"', a + 1), be = s.find('"', b + 1);
        if (ae == std::string::npos || be == std::string::npos) break;
        const std::string name = s.substr(b, be - b + 1);
        s.replace(a, ae - a + 1, name);
      }
    }
  }

  const std::vector<Input>& corpus_;
  std::mt19937_64 engine_;
};

Input input_of(const std::vector<Input>& corpus, std::uint64_t seed, long index) {
  return Mutator(corpus, seed * 1000003 + static_cast<std::uint64_t>(index)).make();
}

/// What the parent sees of a child that may vanish at any input.
struct Shared {
  long index = 0, read = 0, ran = 0, refused = 0, placeless = 0, raw = 0;
  char message[400] = {};
};

bool names_a_place(const std::string& message) {
  return message.find("fuzz") != std::string::npos || message.find('\'') != std::string::npos;
}

void note(Shared& shared, long& count, long index, const std::string& kind, const std::string& message) {
  if (++count <= 5) {
    fmt::print("input {}: {}: {}\n", index, kind, message.substr(0, 300));
    std::fflush(stdout);
  }
  std::strncpy(shared.message, message.c_str(), sizeof shared.message - 1);
}

void try_input(const Input& input, const fs::path& directory, Shared& shared) {
  const long index = shared.index;
  try {
    std::string text = input.text;
    if (input.tyre) {
      const fs::path file = directory / "fuzz.tir";
      std::ofstream(file, std::ios::binary) << input.text;
      text = kWheel + fmt::format("tir_file = \"{}\"\n[start]\ngiven = [\"wheel\"]\n", file.string());
    }
    const Scene scene = Scene::parse(text, "fuzz.toml");
    ++shared.read;
    if (scene.mechanism()->coordinate_count() > 60) return;
    try {
      Problem problem = make_problem(scene);
      problem.formulation = "baumgarte";
      problem.solver.integrator = "cvodes";
      problem.solver.t_end = problem.solver.t_start + 1e-3;
      problem.solver.rtol = 1e-6;
      problem.solver.atol = 0;
      problem.solver.max_steps = 2000;
      simulate(problem, problem.parameters.values());
      ++shared.ran;
    } catch (const SolverError&) {   // a run may fail, with a cause
    } catch (const ModelError& e) {  // as the tool reports it
      throw scene.located(e);
    }
  } catch (const Error& e) {
    ++shared.refused;
    if (!names_a_place(e.what())) note(shared, shared.placeless, index, "names no place", e.what());
  } catch (const std::exception& e) {
    note(shared, shared.raw, index, "raw words", e.what());
  }
}

}  // namespace

int main(int argc, char** argv) {
  long inputs = 10000, one = -1;
  std::uint64_t seed = 1;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::strcmp(argv[i], "--inputs") == 0) inputs = std::atol(argv[i + 1]);
    if (std::strcmp(argv[i], "--input") == 0) one = std::atol(argv[i + 1]);
    if (std::strcmp(argv[i], "--seed") == 0) seed = std::strtoull(argv[i + 1], nullptr, 10);
  }
  const std::vector<Input> all = corpus();
  if (one >= 0) {
    fmt::print("{}", input_of(all, seed, one).text);
    return 0;
  }
  const fs::path directory = fs::temp_directory_path() / fmt::format("costate_fuzz_{}", getpid());
  fs::create_directories(directory);
  auto* shared =
      static_cast<Shared*>(mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
  new (shared) Shared;
  // A tyre file as it is must be read: else its mutations would be refused before anyone looks at them.
  for (const Input& input : all) {
    if (!input.tyre) continue;
    const long before = shared->read;
    try_input(input, directory, *shared);
    if (shared->read > before) continue;
    fmt::print("A tyre file is refused as it is.\n");
    fs::remove_all(directory);
    return 1;
  }
  *shared = Shared{};
  long crashed = 0, hung = 0;
  const auto begin = std::chrono::steady_clock::now();
  while (shared->index < inputs) {
    std::fflush(stdout);
    const pid_t child = fork();
    if (child == 0) {
#if !defined(__SANITIZE_ADDRESS__)
      const rlimit limit{kMemory, kMemory};
      setrlimit(RLIMIT_AS, &limit);
#endif
      for (; shared->index < inputs; ++shared->index) {
        alarm(kSeconds);
        try_input(input_of(all, seed, shared->index), directory, *shared);
      }
      std::fflush(stdout);
      _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    if (shared->index >= inputs && WIFEXITED(status)) break;
    const bool alarmed = WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM;
    ++(alarmed ? hung : crashed);
    fmt::print("input {}: {} (status {})\n", shared->index, alarmed ? "HUNG" : "CRASHED", status);
    ++shared->index;
  }
  fs::remove_all(directory);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  fmt::print(
      "{} inputs, seed {}, {:.0f} s: {} read, {} of them run, {} refused ({} of these name no place), {} "
      "raw, {} crashed, {} hung\n",
      inputs, seed, seconds, shared->read, shared->ran, shared->refused, shared->placeless, shared->raw, crashed, hung);
  return crashed + hung + shared->raw + shared->placeless > 0 || shared->read == 0 ? 1 : 0;
}
