// The standing adversary: random mechanisms, every formulation and gradient method, oracles that share
// nothing with them.
//
//   costate_adversary --cases 5000 [--seed 1] [--combinations 3]   the table; status 1 if anything was wrong
//   without a word
//   costate_adversary --cases 5000 --of trusses | kinds            one half of it
//   costate_adversary --cases 1000 --of contacts                   rigid contacts, judged by energy and depth
//   costate_adversary --cases 1000 --of hessians                   products of Hessians, by differences of gradients
//   costate_adversary --cases 1000 --of touched-hessians           the same of contacts that give
//   costate_adversary --cases 1000 --of struck-hessians            the same of rigid contacts
//   costate_adversary --cases 1000 --of units                      trusses in millimetres, grams, hours
//   costate_adversary --cases 1000 --of motions                    all outputs, by two other integrators
//   costate_adversary --cases 1000 --of balances                   energy, work and momentum of what is stored
//   costate_adversary --cases 1000 --of cranks                     linkages that lock or do not, by closed forms
//   costate_adversary --cases 1000 --of switches                   forces and costs switched at times to be found
//   costate_adversary --cases 1000 --of touches                    contacts that give, by differences
//   costate_adversary --cases 1000 --of slips                      rigid contacts with friction, by differences
//   costate_adversary --cases 1000 --of rests                      slips in space that begin from rest, likewise
//   costate_adversary --cases 1000 --of slipped-hessians           products of Hessians through them
//   costate_adversary --case 4711 [--scene]                        one case again, with every combination
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <iterator>
#include <map>
#include <random>
#include <string_view>

#include "balances.h"
#include "contacts.h"
#include "judge.h"
#include "kinds.h"
#include "locked.h"
#include "motions.h"
#include "slips.h"
#include "touches.h"
#include "truss.h"
#include "truss_motion.h"
#include "units.h"

using namespace costate::adversary;

namespace {

constexpr int kSeconds =
    300;  // of the processor for one case: fixed steps may take a million of a vehicle with many tyres

const std::string_view kOf[] = {"trusses",          "kinds",           "contacts", "hessians",         "units",
                                "motions",          "balances",        "cranks",   "switches",         "touches",
                                "touched-hessians", "struck-hessians", "slips",    "slipped-hessians", "rests"};

struct Options {
  long cases = 200, first = 1, one = -1;
  int combinations = 3;
  std::string only;  // of the combinations, those that hold this
  std::string of;    // "": gradients of trusses and kinds
  bool scene = false, quiet = false;
};

Truss truss_of(long number, const Options& options) {
  const auto seed = static_cast<std::uint64_t>(number);
  return options.of == "switches" ? switched_truss(seed) : random_truss(seed);
}

/// Every fourth case is an example of a registered kind.
bool is_truss(long number) { return number % 4 != 0; }

/// By differences over `part` of their usual steps.
Truth truth_of(const Truss& t, double part = 1) {
  const Reference r = reference(t, part);
  Truth truth;
  if (!r.found) return truth;
  double size = 0;
  for (const Bar& b : t.bars) size = std::max(size, b.length);
  size = size > 0 ? size : 1;
  truth.psi = r.psi;
  truth.psi_scale = 0;
  for (const Cost& c : t.costs) {
    const double y = c.rate ? std::max(r.speed, 1e-3 * size) : size;
    truth.psi_scale += std::abs(c.weight) * (c.terminal ? y : y * y * t.t_end);
  }
  truth.gradient = r.gradient;
  truth.uncertainty = r.gradient_error;
  double largest = 1e-3 * truth.psi_scale;
  for (const Parameter& p : t.parameters) truth.scales.push_back(t.scale(p));
  for (std::size_t j = 0; j < truth.gradient.size(); ++j)
    largest = std::max(largest, std::abs(truth.gradient[j]) * truth.scales[j]);
  truth.psi_uncertainty = r.psi_error;
  truth.known = r.regularity > 1e-3 && r.psi_error < 5e-5 * std::max(std::abs(r.psi), 1e-3 * truth.psi_scale);
  // Where differences do not settle, the motion depends too strongly on its numbers for them to judge by.
  for (std::size_t j = 0; j < truth.gradient.size(); ++j)
    if (!(truth.uncertainty[j] * truth.scales[j] < 2e-4 * largest)) truth.known = false;
  return truth;
}

std::vector<Finding> try_truss(const Truss& t, const Truth& truth,
                               std::vector<std::pair<std::string, std::string>> chosen, std::mt19937_64& engine) {
  std::vector<Finding> list;
  for (const auto& [formulation, method] : chosen) {
    list.push_back(run_gradient(t.scene(), formulation, method, truth));
  }
  // The same motion, mirrored, turned or renamed.
  if (!chosen.empty()) {
    const auto& [formulation, method] = chosen.front();
    const int which = static_cast<int>(engine() % 3);
    const Truss other = which == 0 ? t.mirrored() : which == 1 ? t.turned() : t.renamed();
    Truth same = truth;
    if (which != 2)
      for (std::size_t j = 0; j < same.gradient.size(); ++j) {
        const Parameter& p = t.parameters[j];
        int axis = -1;
        if (p.kind == Parameter::Kind::position || p.kind == Parameter::Kind::velocity ||
            p.kind == Parameter::Kind::gravity)
          axis = p.axis;
        if (p.kind == Parameter::Kind::force) axis = t.forces[static_cast<std::size_t>(p.element)].axis;
        if (axis == which) same.gradient[j] = -same.gradient[j];
      }
    Finding f = run_gradient(other.scene(), formulation, method, same);
    f.run += which == 0 ? ", mirrored" : which == 1 ? ", turned" : ", renamed";
    list.push_back(f);
  }
  return list;
}

/// In some other units.
std::vector<Finding> try_units(const Truss& t, const Truth& truth,
                               const std::vector<std::pair<std::string, std::string>>& chosen, long number) {
  const Units& u = all_units()[static_cast<std::size_t>(number) % all_units().size()];
  const std::string scene = in_units(t, u).scene();
  const Truth same = in_units(truth, t, u);
  std::vector<Finding> list;
  for (const auto& [formulation, method] : chosen) {
    list.push_back(run_gradient(scene, formulation, method, same));
    list.back().run += fmt::format(", in {}", u.name);
  }
  return list;
}

bool bad(const Finding& f) {
  return f.outcome == Outcome::wrong || f.outcome == Outcome::crashed || f.outcome == Outcome::hung;
}

/// Differences over steps that are too long for a motion may look settled where they are not: whoever is wrong by them
/// is judged once more by shorter ones, where these settle.
template <class Try>
std::vector<Finding> judged(const Truss& t, const Try& attempt) {
  auto list = attempt(truth_of(t));
  if (std::none_of(list.begin(), list.end(), [](const Finding& f) { return f.outcome == Outcome::wrong; })) return list;
  constexpr double kShorter = 0.1;
  const Truth again = truth_of(t, kShorter);
  return again.known ? attempt(again) : list;
}

/// Those that the options ask for: of one case all, else a few at random.
std::vector<std::pair<std::string, std::string>> some(std::vector<std::pair<std::string, std::string>> all,
                                                      const Options& options, std::mt19937_64& engine) {
  std::erase_if(all,
                [&](const auto& c) { return (c.first + " x " + c.second).find(options.only) == std::string::npos; });
  if (options.one >= 0) return all;
  std::shuffle(all.begin(), all.end(), engine);
  all.resize(std::min<std::size_t>(all.size(), static_cast<std::size_t>(options.combinations)));
  return all;
}

std::vector<Finding> try_case(long number, const Options& options) {
  std::mt19937_64 engine(static_cast<std::uint64_t>(number) * 77 + 5);
  if (options.of == "contacts") {
    const std::string scene = random_contact_scene(static_cast<std::uint64_t>(number));
    if (options.scene) fmt::print("{}", scene);
    std::fflush(stdout);
    std::vector<Finding> list;
    for (const char* formulation : {"index1", "baumgarte", "penalty", "maggi", "maggi-implicit"})
      if (options.one >= 0 || number % 5 == static_cast<long>(list.size()))
        list.push_back(run_contacts(scene, formulation));
      else
        list.emplace_back();
    std::erase_if(list, [](const Finding& f) { return f.run.empty(); });
    return list;
  }
  if (options.of == "cranks") {
    const Crank crank = random_crank(static_cast<std::uint64_t>(number));
    if (options.scene) fmt::print("{}", crank.scene);
    std::fflush(stdout);
    return run_crank(crank, some(runs_of_motions(), options, engine));
  }
  const char* with_products[] = {"index1", "baumgarte", "penalty", "augmented-lagrangian"};
  if (options.of == "struck-hessians" || options.of == "slipped-hessians") {
    const auto seed = static_cast<std::uint64_t>(number);
    const std::string scene =
        options.of == "struck-hessians" ? random_struck_scene(seed) : random_slip_scene(seed).text;
    if (options.scene) fmt::print("{}", scene);
    std::fflush(stdout);
    return {run_hessian(scene, with_products[engine() % 4], "baumgarte", 2e-4)};
  }
  const bool touched = options.of == "touched-hessians";
  if (options.of == "hessians" || touched || options.of == "motions" || options.of == "balances") {
    const std::string scene = touched ? random_touch_scene(static_cast<std::uint64_t>(number)).text
                              : is_truss(number)
                                  ? random_truss(static_cast<std::uint64_t>(number)).scene()
                                  : random_kind_scene(static_cast<std::uint64_t>(number), number % 8 == 0).text;
    if (options.scene) fmt::print("{}", scene);
    std::fflush(stdout);
    if (scene.empty()) return {};
    if (options.of == "motions") return run_motions(scene, some(runs_of_motions(), options, engine));
    if (options.of == "balances") {
      const auto runs = some(runs_of_motions(), options, engine);
      return is_truss(number) ? run_balances(random_truss(static_cast<std::uint64_t>(number)), runs)
                              : run_created_energy(scene, runs);
    }
    return {run_hessian(scene, with_products[engine() % 4])};
  }
  const auto chosen = some(combinations(), options, engine);
  if (is_truss(number) && options.of != "touches" && options.of != "slips" && options.of != "rests") {
    const Truss t = truss_of(number, options);
    if (options.scene)
      fmt::print("{}", options.of == "units"
                           ? in_units(t, all_units()[static_cast<std::size_t>(number) % all_units().size()]).scene()
                           : t.scene());
    std::fflush(stdout);
    return judged(t, [&](const Truth& truth) {
      auto same = engine;
      return options.of == "units" ? try_units(t, truth, chosen, number) : try_truss(t, truth, chosen, same);
    });
  }
  const auto seed = static_cast<std::uint64_t>(number);
  const KindScene scene = options.of == "touches" ? random_touch_scene(seed)
                          : options.of == "slips" ? random_slip_scene(seed)
                          : options.of == "rests" ? random_rest_scene(seed)
                                                  : random_kind_scene(seed, number % 8 == 0);
  if (options.scene) fmt::print("# [{}]\n{}", scene.kind, scene.text);
  if (scene.text.empty()) return {};
  const Truth truth = options.of == "slips"   ? truth_by_rereading(scene.text, scene.parameters, "index1", "radau9")
                      : options.of == "rests" ? truth_by_rereading(scene.text, scene.parameters, "index1", "idas")
                                              : truth_by_rereading(scene.text, scene.parameters);
  std::vector<Finding> list;
  for (const auto& [formulation, method] : chosen) {
    list.push_back(run_gradient(scene.text, formulation, method, truth));
    list.back().run += " on [" + scene.kind + "]";
  }
  if (!chosen.empty())
    for (const KindVariant& v : scene.variants) {
      list.push_back(run_gradient(v.text, chosen.front().first, chosen.front().second, truth));
      list.back().run += ", " + v.name + ", on [" + scene.kind + "]";
    }
  return list;
}

/// A smaller truss that is wrong in the same run.
Truss shrink(Truss t, const std::string& run) {
  const auto cut = run.find(" x ");
  const std::string formulation = run.substr(0, cut);
  const std::string method = run.substr(cut + 3, run.find_first_of(", ", cut + 3) - cut - 3);
  const auto still = [&](const Truss& s) {
    const auto found = in_child(
        [&] {
          return judged(s, [&](const Truth& truth) {
            return std::vector<Finding>{run_gradient(s.scene(), formulation, method, truth)};
          });
        },
        kSeconds);
    return std::any_of(found.begin(), found.end(), bad);
  };
  if (!still(t)) return t;
  for (bool smaller = true; smaller;) {
    smaller = false;
    for (const Truss& s : t.smaller())
      if (still(s)) {
        t = s;
        smaller = true;
        break;
      }
  }
  return t;
}

}  // namespace

int main(int argc, char** argv) {
  Options o;
  for (int i = 1; i < argc; ++i) {
    const auto is = [&](const char* name) { return std::strcmp(argv[i], name) == 0 && i + 1 < argc; };
    if (is("--cases"))
      o.cases = std::atol(argv[++i]);
    else if (is("--seed"))
      o.first = std::atol(argv[++i]);
    else if (is("--combinations"))
      o.combinations = std::atoi(argv[++i]);
    else if (is("--only"))
      o.only = argv[++i];
    else if (is("--case"))
      o.one = std::atol(argv[++i]);
    else if (is("--of") && std::find(std::begin(kOf), std::end(kOf), argv[i + 1]) != std::end(kOf))
      o.of = argv[++i];
    else if (std::strcmp(argv[i], "--scene") == 0)
      o.scene = true;
    else if (std::strcmp(argv[i], "--quiet") == 0)
      o.quiet = true;
    else {
      fmt::print(stderr,
                 "usage: {} [--cases N] [--seed N] [--of trusses | kinds | contacts | hessians | units | motions | "
                 "balances | cranks | switches | touches | touched-hessians | struck-hessians | slips | rests | "
                 "slipped-hessians] "
                 "[--combinations N] "
                 "[--only TEXT] "
                 "[--case N "
                 "[--scene]] [--quiet]\n",
                 argv[0]);
      return 2;
    }
  }
  if (o.one >= 0) {
    const auto found = in_child(
        [&] {
          auto list = try_case(o.one, o);
          std::fflush(stdout);
          return list;
        },
        10 * kSeconds);
    for (const Finding& f : found)
      fmt::print("{:<9} {:<50} {:9.1e}  {}\n", name_of(f.outcome), f.run, f.error, f.message);
    for (const Finding& f : found)
      if (f.outcome == Outcome::wrong && is_truss(o.one) && (o.of.empty() || o.of == "trusses" || o.of == "switches") &&
          f.run.find(',') == std::string::npos) {
        fmt::print("\n# the smallest scene on which {} is still wrong\n{}", f.run,
                   shrink(truss_of(o.one, o), f.run).scene());
        break;
      }
    return std::any_of(found.begin(), found.end(), bad) ? 1 : 0;
  }
  std::map<Outcome, long> counts;
  std::map<std::string, std::map<Outcome, long>> by_run;
  const auto begin = std::chrono::steady_clock::now();
  long none = 0, cases = 0;
  for (long i = o.first; i < o.first + o.cases; ++i) {
    if (o.of == "kinds" ? is_truss(i) : (o.of == "trusses" || o.of == "units" || o.of == "switches") && !is_truss(i))
      continue;
    ++cases;
    const auto found = in_child([&] { return try_case(i, o); }, kSeconds);
    if (found.empty()) ++none;
    for (const Finding& f : found) {
      ++counts[f.outcome];
      ++by_run[f.run.substr(0, f.run.find(" x "))][f.outcome];
      if (bad(f))
        fmt::print("case {}: {} {} {:.1e} {}\n", i, name_of(f.outcome), f.run, f.error, f.message);
      else if (!o.quiet && f.outcome == Outcome::failed)
        fmt::print("case {}: failed {} {}\n", i, f.run, f.message);
    }
    std::fflush(stdout);
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  fmt::print("\n{} cases from seed {}, {:.0f} s ({} gave no scene)\n\n| runs |", cases, o.first, seconds, none);
  const Outcome all[] = {Outcome::agreed,   Outcome::warned, Outcome::refused, Outcome::failed,
                         Outcome::unjudged, Outcome::wrong,  Outcome::crashed, Outcome::hung};
  for (const Outcome x : all) fmt::print(" {} |", name_of(x));
  fmt::print("\n|---|---|---|---|---|---|---|---|---|\n| all |");
  for (const Outcome x : all) fmt::print(" {} |", counts[x]);
  fmt::print("\n");
  for (auto& [run, c] : by_run) {
    fmt::print("| {} |", run);
    for (const Outcome x : all) fmt::print(" {} |", c[x]);
    fmt::print("\n");
  }
  const long wrong = counts[Outcome::wrong] + counts[Outcome::crashed] + counts[Outcome::hung];
  // A runner that judged nothing has shown nothing.
  return wrong > 0 || counts[Outcome::agreed] == 0 ? 1 : 0;
}
