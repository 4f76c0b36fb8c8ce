// What the fuzzer starts from.
#include "adversary/fuzz_inputs.h"

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>

#include "costate/kind/law/law_table.h"
#include "costate/optimize/optimizer.h"
#include "costate/scene/scene_kind.h"
#include "optimize_journal.h"
#include "support/paths.h"

namespace costate::fuzz {

namespace fs = std::filesystem;

const char* const kWheel = R"([gravity]
z_m_per_s2 = -9.81
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
[start]
given = ["wheel"]
)";

const char* const kPendulum = R"([gravity]
y_m_per_s2 = -9.81
[point.A]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 0.6
y_m = -0.8
[bar.b]
from = "A"
to = "P"
length_m = 1
mass_kg = 1
[start]
given = ["P.x"]
[[cost.running]]
kind = "square"
output = "P.x"
[parameter.m]
number = "bar.b.mass_kg"
lower = 0.1
upper = 10
[parameter.x]
number = "point.P.x_m"
)";

namespace {

constexpr std::size_t kLargest = 8000;  // bytes of a scene taken as it is

std::string read(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

const char* const kStudy = R"(title = "two runs"

[set]
"run.t_end_s" = 1

[options]
formulation = "baumgarte"
method = "cvodes-adjoint"
rtol = 1e-7
max_evaluations = 5

[[run]]
name = "first"
scene = "fuzz_scene.toml"

[[run]]
name = "second"
scene = "fuzz_scene.toml"
parameters = ["m"]
set = { bar.b.mass_kg = 2, "point.P.x_m" = 0.5 }
options = { algorithm = "mma", no_certificate = true }
)";

const char* const kProfile = "# x z\n-5 0\n0 0.001\n0.5, 0.002\n1 ; 0.004\n2 -0.001\n4 0\n20 0.003\n";

const char* const kCsv =
    "time [s],coordinates/P.x [m],coordinates/P.y [m],\"velocities/P.x_dot [m/s]\"\n0,0.6,-0.8,0\n0.1,0.59,-0.81,-0.1\n"
    "0.2,nan,inf,-0.2\n";

const char* const kCrg = R"($ROAD_CRG
REFERENCE_LINE_START_Z   = 0.5   ! m
REFERENCE_LINE_INCREMENT = 0.5
LONG_SECTION_V_RIGHT = -0.5
LONG_SECTION_V_INCREMENT = 1.0
$
$KD_Definition
#:LRFI
U:reference line u,m,-3,1.0
D:reference line slope,m/m
D:long section 1,m
D:long section 2,m
$
$$$$
**unused** 0.0010000 0.0020000
 0.1000000-0.0010000-0.0020000
-0.2000000 0.0000000*missing**
 0.0000000 0.0050000 0.0000000
)";

const char* const kPart = R"([point.A]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 0.6
y_m = -0.8
[bar.b]
from = "A"
to = "P"
mass_kg = 1
[spring.s]
from = "P"
to = "A"
stiffness_N_per_m = 3
natural_length_m = 0.8
)";

/// Paths and values for the command line, one a line.
const char* const kOverrides = R"(bar.b.mass_kg=2
bar.b.length_m=1.1
point.P.x_m=0.55
run.t_end_s=2
run.parameters=['x', 'bar.b.mass_kg']
start.given=['P.y']
parameter.m.upper=5
gravity={ y_m_per_s2 = -1 }
cost.running[0].weight=2
cost.running[0].target={ kind = "sine", amplitude = 1, angular_frequency_rad_per_s = 2 }
)";

}  // namespace

const char* name_of(Input::Kind kind) {
  static const char* const names[] = {"scene", "tyre",     "profile", "include", "set",
                                      "study", "baseline", "journal", "csv",     "crg"};
  return names[static_cast<std::size_t>(kind)];
}

const char* file_of(Input::Kind kind) {
  static const char* const names[] = {"fuzz.toml", "fuzz.tir",  "fuzz.txt",   "fuzz_part.toml", "fuzz.toml",
                                      "fuzz.toml", "fuzz.json", "fuzz.jsonl", "fuzz.csv",       "fuzz.crg"};
  return names[static_cast<std::size_t>(kind)];
}

std::string journal_text() {
  const nlohmann::json header = {{"scene", "x"}, {"parameters", {"m", "x"}}, {"settings", {{"rtol", 1e-8}}}};
  const fs::path file = fs::temp_directory_path() / fmt::format("costate_fuzz_{}.jsonl", ::getpid());
  {
    Journal journal = Journal::open(file, header, false);
    for (int i = 1; i <= 4; ++i) {
      OptimizerEvaluation e;
      e.index = i;
      e.rho = {1.0 + 0.1 * i, 0.6 - 0.05 * i};
      e.psi = 3.25 / i;
      e.gradient = {0.125 * i, -1e-3};
      e.constraints = {-0.5};
      e.constraint_gradients = {{1, 2}};
      e.projected_gradient = 0.1;
      e.wall_s = 0.01;
      if (i == 3) {
        e.failure = "The mechanism locks.";
        e.psi = std::numeric_limits<double>::quiet_NaN();
        e.gradient = e.constraints = {};
        e.constraint_gradients = {};
      }
      journal.append(app::evaluation_record(e));
    }
  }
  const std::string text = read(file);
  fs::remove(file);
  return text;
}

std::vector<Input> corpus() {
  using Kind = Input::Kind;
  std::vector<Input> list;
  for (const char* folder : {COSTATE_MODELS_DIR, COSTATE_SOURCE_DIR "/test/cases", COSTATE_SOURCE_DIR "/test/regress"})
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      const std::string extension = entry.path().extension().string();
      const std::string text =
          extension == ".toml" || extension == ".tir" || extension == ".json" ? read(entry.path()) : std::string();
      if (extension == ".tir") list.push_back({Kind::tyre, text});
      if (extension == ".toml" && text.size() <= kLargest)
        list.push_back({Kind::scene, text, entry.path().parent_path().string()});
      if (extension == ".json" && std::string(folder).ends_with("regress")) list.push_back({Kind::baseline, text});
    }
  for (const SceneKind& kind : scene_kinds())
    if (!kind.example.empty()) list.push_back({Kind::scene, kind.example});
  for (const LawKind& law : law_kinds())
    if (!law.example.empty())
      for (const char* place : {"x_N = ", "y_N = "})
        list.push_back(
            {Kind::scene, std::string(kPendulum) + "[force.f]\npoint = \"P\"\n" + place + law.example + "\n"});
  list.push_back({Kind::scene, kPendulum});
  list.push_back({Kind::profile, kProfile});
  list.push_back({Kind::include, kPart});
  list.push_back({Kind::over, kOverrides});
  list.push_back({Kind::study, kStudy});
  list.push_back({Kind::journal, journal_text()});
  list.push_back({Kind::csv, kCsv});
  list.push_back({Kind::crg, kCrg});
  return list;
}

}  // namespace costate::fuzz
