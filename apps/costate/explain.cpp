// costate explain: what is built for a scene, what of it is evaluated how often and at what cost, and what nobody asked
// for.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>

#include "command.h"
#include "costate/analysis/start.h"
#include "costate/base/notice.h"
#include "costate/cycle/cycle_values.h"
#include "costate/integrator/run_end.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/redundant_rows.h"
#include "costate/record/atomic_file.h"
#include "costate/tradeoff/stopwatch.h"
#include "explain/explain_motion.h"
#include "explain/left_out.h"
#include "explain/merged_scene.h"
#include "explain/plane_scene.h"
#include "explain/rewritten.h"
#include "explain_parts.h"
#include "named_outputs.h"
#include "page/command_pages.h"
#include "page_parts.h"
#include "run_pages.h"
#include "trajectory.h"

namespace costate::app {

namespace {

constexpr int kPositions = 400;  // where a motion is looked at
// Out of its plane by no more than this part of its way, a motion is one of the plane.
constexpr double kFlat = 1e-6;

/// "3 bars", by unit of measurement.
std::string by_unit(const Mechanism& m) {
  std::map<std::string, int> count;
  for (const auto& c : m.coordinates()) ++count[c.unit];
  std::vector<std::string> texts;
  for (const auto& [unit, n] : count) texts.push_back(fmt::format("{} in {}", n, unit));
  return fmt::format("{}", fmt::join(texts, ", "));
}

class Explain {
 public:
  Explain(const CommonOptions& common, std::string plane_file, std::string merged_file)
      : common_(common),
        plane_file_(std::move(plane_file)),
        merged_file_(std::move(merged_file)),
        setup_(common, Purpose::simulate),
        progress_(setup_.progress_options) {}

  int run() {
    setup_.located([&] {
      look_at_start();
      look_at_run();
      shares_ = kind_shares(setup_.problem, setup_.rho);
      outputs_ = outputs_of_interest(setup_.scene);
      parts_ = independent_parts(mechanism(), wanted_coordinates(setup_));
      Setup reduced = setup_;
      leave_out_rest(reduced);
      rest_ = left_out(reduced);
      const bool some = std::any_of(parts_.begin(), parts_.end(), [](const Part& p) { return !p.needed; });
      if (some && !outputs_.empty() && rest_.coordinates.empty()) {
        kept_because_ = kept_because(setup_);
        if (kept_because_.empty()) kept_because_ = "The scene cannot be read without it.";
      }
    });
    progress_.finish();
    Json j = json();
    std::string all = text();
    if (!plane_file_.empty()) all += write_plane(j);
    if (!merged_file_.empty()) all += write_merged(j);
    const std::string body = all.substr(all.find('\n') + 1);
    report(setup_, common_, j, all + written_page(setup_, "explain.html", explain_page(setup_, j, body)),
           "explain.json");
    return 0;
  }

 private:
  /// The scene of the plane, its psi beside that of space.
  std::string write_plane(Json& j) {
    if (!plane_ || plane_->out_of_plane > kFlat)
      throw CapabilityError("--plane: The motion does not stay in a plane, or is one of the plane already.");
    const std::string toml = setup_.located([&] { return plane_scene(setup_, *plane_); });
    const Rewritten other = read_rewritten(setup_, toml, plane_file_, "--plane", result_.psi);
    write_file_atomically(plane_file_, toml);
    j["plane_scene"] = {{"file", plane_file_}, {"psi", other.psi}};
    return fmt::format(
        "  scene of the plane: {}, psi = {:.9g} against {:.9g} here; {} coordinates in the place of {}\n", plane_file_,
        other.psi, result_.psi, other.problem.mechanism->coordinate_count(), mechanism().coordinate_count());
  }

  /// The scene with welded bodies as one.
  std::string write_merged(Json& j) {
    const MergedScene merged = setup_.located([&] { return merged_scene(setup_); });
    const Rewritten other = read_rewritten(setup_, merged.toml, merged_file_, "--merged", result_.psi);
    check_same_start(setup_, other, "--merged");
    write_file_atomically(merged_file_, merged.toml);
    const Mechanism& m = *other.problem.mechanism;
    j["merged_scene"] = {{"file", merged_file_},
                         {"psi", other.psi},
                         {"bodies", merged.bodies},
                         {"kept", merged.kept},
                         {"coordinates", m.coordinate_count()},
                         {"multipliers", m.row_count()}};
    std::string t = fmt::format(
        "  welded bodies as one: {}, psi = {:.9g} against {:.9g} here; {} coordinates and {} rows in the place of {} "
        "and {}\n",
        merged_file_, other.psi, result_.psi, m.coordinate_count(), m.row_count(), mechanism().coordinate_count(),
        mechanism().row_count());
    for (const std::string& why : merged.kept) t += "  " + why + "\n";
    return t;
  }

  const Mechanism& mechanism() const { return *setup_.problem.mechanism; }

  void look_at_start() {
    Assembly assembly(setup_.problem.mechanism, setup_.problem.parameters);
    assembly.set_parameters(setup_.rho.data());
    const Start start = find_start(assembly, setup_.problem.solver.t_start, false);
    freedom_ = assembly.n() - constraint_rank(assembly, setup_.problem.solver.t_start, start.q.data()).rank;
    redundant_ = redundant_rows(setup_.problem, setup_.rho);
    for (const auto& [name, pattern] :
         {std::pair("M, K, C", &assembly.square()), std::pair("Phi_q", &assembly.jacobian()),
          std::pair("Q_z", &assembly.force_state()), std::pair("f_q, f_v", &assembly.state_force()),
          std::pair("f_z", &assembly.state_state())})
      if (pattern->entries() > 0)
        patterns_.push_back({name, pattern->rows, pattern->cols, static_cast<long>(pattern->entries())});
  }

  void look_at_run() {
    Problem p = without_cycle_cost(setup_.problem);
    p.monitor = monitor(progress_, p.solver.t_end);
    progress_.start(p.solver.t_start);
    const double end = until_its_end(p, setup_.rho).solver.t_end;
    std::vector<double> times;
    for (int i = 1; i <= kPositions; ++i)
      times.push_back(p.solver.t_start + (end - p.solver.t_start) * (i - 0.618034) / kPositions);
    std::vector<std::vector<double>> positions;
    GapWatch gaps(mechanism());
    simulate(p, setup_.rho, times, [&](const MechanismState& s, System& system) {
      const Assembly& a = system.assembly();
      gaps.add(s, a);
      positions.emplace_back(s.q, s.q + a.n());
      unknowns_ = system.size();
      kinks_ = system.kinks();
    });
    if (mechanism().coordinate_count() > 0) plane_ = plane_of(mechanism(), positions);
    never_met_ = gaps.open();
    // Again, plain: for the clock and the counts.
    const double begin = processor_time_s();
    result_ = simulate(p, setup_.rho, {end}, [&](const MechanismState&, System& system) {
      dynamics_ = system.assembly().counters().dynamics;
      partials_ = system.assembly().counters().partials;
    });
    time_s_ = processor_time_s() - begin;
    take_notices();
  }

  double kernel_s(const KindShare& k) const {
    return k.dynamics_s * static_cast<double>(dynamics_) + k.partials_s * static_cast<double>(partials_);
  }
  double kernels_s() const {
    double sum = 0;
    for (const KindShare& k : shares_) sum += kernel_s(k);
    return sum;
  }
  /// Of the run; kernels by themselves may take longer than in it, where contacts are passed over while they are open.
  double share(double seconds) const {
    const double all = std::max(time_s_, kernels_s());
    return all > 0 ? seconds / all : 0;
  }

  std::map<std::string, int> events_by_name() const {
    std::map<std::string, int> count;
    for (const RunEvent& e : result_.events) ++count[e.name];
    return count;
  }

  /// Elements that may touch: those whose gaps stayed open between all looks, and which met no event.
  std::vector<std::string> never_met() const {
    std::vector<std::string> names = never_met_;
    std::erase_if(names, [&](const std::string& path) {
      return std::any_of(result_.events.begin(), result_.events.end(),
                         [&](const RunEvent& e) { return e.name.rfind(path + ":", 0) == 0; });
    });
    return names;
  }

  Json json() const {
    Json j = run_json(setup_, GradientResult(result_), "", time_s_);
    j["coordinates"] = mechanism().coordinate_count();
    j["multipliers"] = mechanism().row_count();
    j["states"] = mechanism().state_count();
    j["degrees_of_freedom"] = freedom_;
    j["unknowns"] = unknowns_;
    j["redundant"] = redundant_.empty() ? Json(nullptr) : Json(redundant_);
    j["patterns"] = Json::array();
    for (const auto& p : patterns_)
      j["patterns"].push_back({{"name", p.name}, {"rows", p.rows}, {"columns", p.columns}, {"entries", p.entries}});
    j["evaluations"] = {{"dynamics", dynamics_}, {"partials", partials_}};
    j["kinds"] = Json::array();
    for (const KindShare& k : shares_)
      j["kinds"].push_back({{"kind", k.kind},
                            {"elements", k.elements},
                            {"rows", k.rows},
                            {"states", k.states},
                            {"square_entries", k.square_entries},
                            {"jacobian_entries", k.jacobian_entries},
                            {"constant_mass", k.constant_mass},
                            {"constant_force", k.constant_force},
                            {"dynamics_s", k.dynamics_s},
                            {"partials_s", k.partials_s},
                            {"share", share(kernel_s(k))}});
    j["kinks_s"] = kinks_;
    j["never_met"] = never_met();
    j["outputs"] = outputs_;
    j["parts"] = Json::array();
    for (const Part& p : parts_)
      j["parts"].push_back({{"coordinates", p.coordinates}, {"elements", p.elements}, {"needed", p.needed}});
    j["left_out"] = rest_.coordinates.empty() ? Json(nullptr) : left_out_json(rest_);
    j["kept_because"] = kept_because_.empty() ? Json(nullptr) : Json(kept_because_);
    j["welds"] = Json::array();
    for (const Weld& w : welds(mechanism()))
      j["welds"].push_back({{"weld", w.path}, {"bodies", w.bodies}, {"rows", w.rows}, {"coordinates", w.coordinates}});
    j["plane"] = nullptr;
    if (plane_)
      j["plane"] = {
          {"normal", {plane_->normal[0], plane_->normal[1], plane_->normal[2]}},
          {"out_of_plane", plane_->out_of_plane},
          {"moves_in_plane", plane_->out_of_plane <= kFlat},
          {"line", plane_->line ? Json({(*plane_->line)[0], (*plane_->line)[1], (*plane_->line)[2]}) : Json()}};
    return j;
  }

  std::string text() const {
    const Mechanism& m = mechanism();
    std::string t = fmt::format("{}\n  {} on {}: {} unknowns of the integrator\n", title_of(setup_),
                                setup_.problem.formulation, result_.integrator, unknowns_);
    t += fmt::format("  {} coordinates ({}), {} constraint rows, {} force states; {} degrees of freedom\n",
                     m.coordinate_count(), by_unit(m), m.row_count(), m.state_count(), freedom_);
    if (!redundant_.empty()) t += "  " + redundant_ + "\n";
    t += "\n  matrix        size            entries\n";
    for (const auto& p : patterns_)
      t += fmt::format("  {:<13} {:<15} {:>7}  ({:.3g} % of full)\n", p.name, fmt::format("{} x {}", p.rows, p.columns),
                       p.entries, 100.0 * static_cast<double>(p.entries) / p.rows / p.columns);
    t += fmt::format(
        "\n  a run: {} steps, {} evaluations of M, Phi_q, Q, {} of their derivatives, {} factorizations, {:.3g} ms\n",
        result_.counters.steps, dynamics_, partials_, result_.counters.factorizations, 1e3 * time_s_);
    t += fmt::format("  {:<22} {:>8} {:>5} {:>7} {:>9} {:>9} {:>12} {:>12} {:>7}\n", "kind", "elements", "rows",
                     "states", "M, K", "Phi_q", "once [us]", "deriv. [us]", "share");
    int constant = 0;
    for (const KindShare& k : shares_) {
      constant += k.constant_mass;
      t += fmt::format("  {:<22} {:>8} {:>5} {:>7} {:>9} {:>9} {:>12.3g} {:>12.3g} {:>6.1f} %\n", k.kind, k.elements,
                       k.rows, k.states, k.square_entries, k.jacobian_entries, 1e6 * k.dynamics_s, 1e6 * k.partials_s,
                       100 * share(kernel_s(k)));
    }
    t += fmt::format("  {:<22} {:>74.1f} %\n", "the rest", 100 * (1 - share(kernels_s())));
    t += kernels_s() <= time_s_
             ? "  (the rest: assembling, factorizations, the integrator, the cost; times are those of the kernels "
               "alone)\n\n"
             : "  (the kernels one by one take longer than the run, which passes over some of them while contacts are "
               "open: shares are those of their sum)\n\n";
    if (constant > 0)
      t += fmt::format("  latched: the mass matrices of {} of {} bodies are constant and evaluated once\n", constant,
                       m.bodies().size());
    if (!kinks_.empty())
      t += fmt::format("  the run is parted at {} times where a driver's law has a kink\n", kinks_.size());
    for (const auto& [name, count] : events_by_name()) t += fmt::format("  event {}: {} times\n", name, count);
    for (const auto& name : never_met())
      t += fmt::format("  {} is never met: it could be left out of this run\n", name);
    if (parts_.size() > 1) t += fmt::format("  {} parts do not act on each other\n", parts_.size());
    if (outputs_.empty()) t += "  neither a cost nor [run] outputs asks for anything: all of it could be left out\n";
    for (const Part& p : parts_)
      if (!p.needed && !outputs_.empty())
        t += fmt::format("  not needed by any output or cost: {} coordinates ({}), elements {}\n", p.coordinates.size(),
                         shortened(p.coordinates), shortened(p.elements));
    for (const Weld& w : welds(m))
      t += fmt::format(
          "  {} welds {}: as one they would have {} rows and {} coordinates less (--merged FILE writes that)\n", w.path,
          w.bodies.size() == 1 ? w.bodies.front() + " to the ground" : fmt::format("{}", fmt::join(w.bodies, " and ")),
          w.rows, w.coordinates);
    if (!rest_.coordinates.empty())
      t += fmt::format("  gradient, optimize, pareto and fit leave out {} of {} coordinates, simulate nothing\n",
                       rest_.coordinates.size(), m.coordinate_count());
    else if (!kept_because_.empty())
      t += fmt::format("  all the same gradient, optimize, pareto and fit build it: {}\n", kept_because_);
    if (plane_ && plane_->line && plane_->out_of_plane <= kFlat)
      t += fmt::format(
          "  everything moves along one line, ({:.3g}, {:.3g}, {:.3g}): a scene of any plane through it would do\n",
          (*plane_->line)[0], (*plane_->line)[1], (*plane_->line)[2]);
    else if (plane_ && plane_->out_of_plane <= kFlat)
      t += fmt::format(
          "  the motion stays in the plane with the normal ({:.3g}, {:.3g}, {:.3g}), to {:.1g} of its way: a "
          "scene of the plane would do\n",
          plane_->normal[0], plane_->normal[1], plane_->normal[2], plane_->out_of_plane);
    else if (plane_)
      t += fmt::format("  the motion needs space: out of the best plane by {:.2g} of its way\n", plane_->out_of_plane);
    return t;
  }

  struct Pattern {
    std::string name;
    int rows, columns;
    long entries;
  };

  const CommonOptions& common_;
  std::string plane_file_, merged_file_;
  Setup setup_;
  Progress progress_;
  int freedom_ = 0, unknowns_ = 0;
  std::string redundant_;
  std::vector<Pattern> patterns_;
  std::vector<double> kinks_;
  std::optional<PlaneMotion> plane_;
  std::vector<std::string> never_met_;  // but for events
  Simulation result_;
  long dynamics_ = 0, partials_ = 0;
  double time_s_ = 0;
  std::vector<KindShare> shares_;
  std::vector<std::string> outputs_;
  std::vector<Part> parts_;
  LeftOut rest_;  // of gradients
  std::string kept_because_;
};

}  // namespace

const RegisterCommand explain_command(
    CommandGroup::inspect, "explain", "What is built for a scene, what it costs by kind, and what nobody asked for",
    [](Command& c, CommonOptions& common) {
      common.add_to(c);
      common.add_run_options(c);
      auto file = std::make_shared<std::string>();
      c.option("--plane", *file, "Write the cheaper scene of the plane, of a motion that stays in one")
          .value_name("FILE");
      auto merged = std::make_shared<std::string>();
      c.option("--merged", *merged, "Write the scene with welded bodies as one").value_name("FILE");
      c.runs([&common, file, merged] { return Explain(common, *file, *merged).run(); });
    });

}  // namespace costate::app
