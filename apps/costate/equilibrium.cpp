// costate equilibrium: where a mechanism rests, what its forces are there, and how that depends on the
// parameters.
#include <fmt/format.h>

#include <utility>

#include "analysis.h"
#include "costate/analysis/start.h"
#include "costate/analysis/undetermined_reactions.h"
#include "costate/base/notice.h"
#include "costate/mechanism/multiplier_unit.h"
#include "digits.h"
#include "motion/figures.h"
#include "page/command_pages.h"

namespace costate::app {

namespace {

struct EquilibriumOptions {
  AnalysisOptions analysis;
  std::vector<std::string> outputs;
  bool derivatives = false;
};

Json positions_json(const Mechanism& m, const Equilibrium& e) {
  KeyedObject j;
  for (int i = 0; i < m.coordinate_count(); ++i) j.set(m.coordinates()[static_cast<std::size_t>(i)].name, e.q[i]);
  return j.take();
}

void tell_of_open_reactions(Assembly& assembly, double t, const Equilibrium& e) {
  const UndeterminedReactions reactions(assembly, t, e.q, e.z);
  if (reactions.none()) return;
  notice(
      fmt::format("Balance does not determine the multipliers of rows that depend on each other ({}), nor what is made "
                  "of them: given are those of least norm. What parts would bear is decided by how they give.",
                  first_names(reactions.rows())));
}

void tell_of_kink(Assembly& assembly, double t, const Equilibrium& e) {
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(e.q.size());
  if (const auto kink =
          find_point_kink(assembly, {t, e.q.data(), rest.data(), rest.data(), e.lambda.data(), e.z.data()}, 0))
    notice(
        fmt::format("A force has a kink where the mechanism rests: {} is {:.6g} on one side and {:.6g} on the other. "
                    "The derivatives "
                    "are those of one side.",
                    entry_name(assembly.mechanism(), *kink), kink->one, kink->other));
}

int run(const CommonOptions& common, EquilibriumOptions& options) {
  const Scene scene = load_for_analysis(common, options.analysis, true);
  const auto m = scene.mechanism();
  const ParameterSelection parameters = located_in(scene, [&] { return m->select(common.parameters); });
  // Of very large mechanisms only what is asked for.
  const auto measures = m->coordinate_count() <= 500 ? measured_outputs(*m) : std::vector<std::unique_ptr<Output>>();
  auto chosen = outputs_named(*m, options.outputs);
  Assembly assembly(m, parameters);
  const double t = scene.run.t_start_s;
  const auto held = held_by_start(assembly);
  const Equilibrium e = located_in(scene, [&] { return find_equilibrium(assembly, t, held, options.derivatives); });
  tell_of_contacts(assembly, t, e.q, e.z, e.lambda);
  tell_of_open_reactions(assembly, t, e);
  const bool stable = is_stable(e);

  Json j;
  j["status"] = "ok";
  j["scene"] = scene.file_name();
  j["title"] = scene.title;
  j["t_s"] = t;
  j["iterations"] = e.iterations;
  j["residual"] = e.residual;
  j["constraint_residual"] = e.constraint_residual;
  j["degrees_of_freedom"] = e.degrees_of_freedom;
  j["lowest_stiffness_per_s2"] = e.lowest_stiffness;
  j["stable"] = stable;
  j["positions"] = positions_json(*m, e);
  std::string text = fmt::format("{}\n", scene.title.empty() ? common.scene : scene.title);
  text += fmt::format("  at rest at t = {:g} s: {} coordinate{} found by balance, {} iterations\n", t,
                      e.degrees_of_freedom, e.degrees_of_freedom == 1 ? "" : "s", e.iterations);
  text +=
      fmt::format("  out of balance by {:.2g} N or N m, constraints by {:.2g}\n", e.residual, e.constraint_residual);
  if (!stable) text += fmt::format("  NOT STABLE: a stiffness is {:.4g} 1/s^2 per mass\n", e.lowest_stiffness);
  const std::string head = text.substr(text.find('\n') + 1);
  Listing positions, forces, multipliers;
  for (const char* key : {"held", "states", "outputs"}) j[key] = Json::object();
  KeyedObject values;
  for (const auto* list : {&measures, &std::as_const(chosen)})
    for (const auto& o : *list) {
      const double x = value_at_rest(*o, assembly, t, e);
      if (!values.has(o->name())) forces.add(o->name(), x, o->unit());
      values.set(o->name(), x);
    }
  j["outputs"] = values.take();
  const auto rows = m->row_names(), row_units = multiplier_units(*m);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    values.set(rows[i], e.lambda[static_cast<Eigen::Index>(i)]);
    multipliers.add(rows[i], e.lambda[static_cast<Eigen::Index>(i)], row_units[i]);
  }
  j["multipliers"] = values.take();
  Listing made_of;  // what the held positions' forces may be
  for (int i = 0; i < m->coordinate_count(); ++i)
    made_of.add("", e.q[i], m->coordinates()[static_cast<std::size_t>(i)].unit);
  made_of.beside(forces);
  made_of.beside(multipliers);
  auto sizes = made_of.sizes();
  for (int i = 0; i < m->coordinate_count(); ++i) {
    const auto& c = m->coordinates()[static_cast<std::size_t>(i)];
    std::string note;
    for (std::size_t h = 0; h < held.size(); ++h)
      if (held[h].coordinate == i) {
        const double force = e.held[static_cast<Eigen::Index>(h)];
        j["held"][c.name] = force;
        const std::string unit = c.unit == "m" ? "N" : c.unit == "rad" ? "N m" : "";
        note = fmt::format("held with {:.6g} {}", shown(-force, unit.empty() ? 0 : sizes[unit]), unit);
      }
    positions.add(c.name, e.q[i], c.unit, note);
  }
  const auto states = m->state_names(), units_of_states = state_units(*m);
  for (std::size_t i = 0; i < states.size(); ++i) {
    j["states"][states[i]] = e.z[static_cast<Eigen::Index>(i)];
    positions.add("z." + states[i], e.z[static_cast<Eigen::Index>(i)], units_of_states[i]);
  }
  positions.beside(forces);
  forces.beside(positions);
  forces.beside(multipliers);
  multipliers.beside(forces);
  multipliers.beside(made_of);
  text += "\nPositions\n" + positions.text();
  if (!forces.empty()) text += "\nPoints and elements\n" + forces.text();
  if (!multipliers.empty()) text += "\nMultipliers\n" + multipliers.text();
  std::vector<std::pair<std::string, Listing>> lists = {
      {"Positions", positions}, {"Points and elements", forces}, {"Multipliers", multipliers}};
  if (options.derivatives) {
    tell_without_parameters(*m, parameters);
    tell_of_kink(assembly, t, e);
    j["parameters"] = named(parameters.names(), parameters.values());
    j["derivatives"] = Json::object();
    if (chosen.empty()) chosen = outputs_named(*m, m->coordinate_names());
    for (const auto& o : chosen) {
      const Eigen::VectorXd d = derivative_at_rest(*o, assembly, t, e);
      Listing listing;
      for (int k = 0; k < parameters.size(); ++k)
        listing.add(parameters.parameters[static_cast<std::size_t>(k)].name, d[k], "");
      j["derivatives"][o->name()] = named(parameters.names(), {d.data(), d.data() + d.size()});
      lists.emplace_back(fmt::format("Derivative of {} [{}]", o->name(), o->unit()), listing);
      text += fmt::format("\n{}\n{}", lists.back().first, listing.text());
    }
  }
  report_analysis(common, j, text, "equilibrium.json", [&](const Json& whole) {
    const Eigen::VectorXd at_rest = Eigen::VectorXd::Zero(e.q.size());
    const Figure figure = make_figure(*m, scene_numbers(scene), e.q, at_rest, e.z, t);
    return equilibrium_page(scene, whole, head, figure, lists);
  });
  return 0;
}

}  // namespace

const RegisterCommand equilibrium_command(
    CommandGroup::analyse, "equilibrium", "Where a scene's mechanism rests, and the forces there",
    [](Command& c, CommonOptions& common) {
      auto options = std::make_shared<EquilibriumOptions>();
      common.add_to(c);
      options->analysis.add_hold(
          c,
          "Positions held, separated by commas, or 'none' (default: what [start] gives if the scene "
          "starts at equilibrium, else none)");
      c.option("--outputs", options->outputs, "Further outputs, separated by commas").separated();
      c.flag("--derivatives", options->derivatives,
             "Derivatives of --outputs (default: of the positions) with respect to the parameters");
      c.option("--parameters", common.parameters,
               "Parameters or number paths, separated by commas (default: the scene's)")
          .separated();
      c.option("--output", common.output,
               "Directory for equilibrium.json and equilibrium.html, or a file with an extension (default: none)");
      c.flag("--json", common.json, "Print one JSON object and nothing else");
      c.runs([&common, options] { return run(common, *options); });
    });

}  // namespace costate::app
