// costate modes: natural frequencies, damping and mode shapes about the start of a scene.
#include "costate/analysis/modes.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <numeric>

#include "analysis.h"
#include "costate/analysis/start_remarks.h"
#include "costate/record/atomic_file.h"
#include "costate/record/print.h"
#include "page/command_pages.h"

namespace costate::app {

namespace {

struct ModesOptions {
  AnalysisOptions analysis;
  std::filesystem::path shapes;
};

/// The three directions with most of the kinetic energy, or the force state that moves where none does.
std::string participants(const Mechanism& m, const Modes& r, const Mode& mode) {
  std::vector<int> order(static_cast<std::size_t>(mode.share.size()));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return mode.share[a] > mode.share[b]; });
  std::vector<std::string> names;
  for (std::size_t i = 0; i < std::min<std::size_t>(3, order.size()); ++i)
    if (mode.share[order[i]] >= 0.05)
      names.push_back(fmt::format("{} {:.0f} %", r.directions[static_cast<std::size_t>(order[i])].name,
                                  100 * mode.share[order[i]]));
  if (!mode.oscillates() && mode.z.size() > 0) {
    Eigen::Index at;
    mode.z.cwiseAbs().maxCoeff(&at);
    names.push_back("state " + m.state_names()[static_cast<std::size_t>(at)]);
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

// Coefficients that change by less, in an instant of the fastest mode, are taken to stay.
constexpr double kStays = 1e-5;
// Accelerations of less are rounding.
constexpr double kSteady = 1e-6;

/// Without what rounding leaves, or what its decimals do not show.
double clean(double x, double below = 1e-12) { return std::abs(x) < below ? 0 : x; }

Json shape_json(const Mechanism& m, const Modes& r, const Mode& mode) {
  Json j = Json::object();
  const auto put = [&](const std::string& name, const std::complex<double>& x) { j[name] = {x.real(), x.imag()}; };
  for (std::size_t i = 0; i < r.directions.size(); ++i)
    put(r.directions[i].name, mode.shape[static_cast<Eigen::Index>(i)]);
  const auto states = m.state_names();
  for (std::size_t i = 0; i < states.size(); ++i) put("z." + states[i], mode.z[static_cast<Eigen::Index>(i)]);
  return j;
}

std::string shapes_csv(const Mechanism& m, const Modes& r) {
  std::string text = "mode,frequency_Hz,damping_ratio,real_per_s,imaginary_per_s";
  std::vector<std::string> names;
  for (const auto& d : r.directions) names.push_back(d.name);
  for (const auto& s : m.state_names()) names.push_back("z." + s);
  for (const auto& name : names) text += fmt::format(",{0}.re,{0}.im", name);
  text += "\n";
  for (std::size_t k = 0; k < r.modes.size(); ++k) {
    const Mode& mode = r.modes[k];
    text += fmt::format("{},{},{},{},{}", k + 1, mode.frequency_Hz(), mode.damping_ratio(), mode.eigenvalue.real(),
                        mode.eigenvalue.imag());
    for (const auto& x : mode.shape) text += fmt::format(",{},{}", x.real(), x.imag());
    for (const auto& x : mode.z) text += fmt::format(",{},{}", x.real(), x.imag());
    text += "\n";
  }
  return text;
}

/// About the point of the modes, for motions of the fastest of them.
std::optional<PointKink> kink_of_modes(Assembly& assembly, double t, const Modes& r) {
  const StateView s{t, r.q.data(), r.v.data(), r.a.data(), r.lambda.data(), r.z.data()};
  return find_point_kink(assembly, s, r.modes.empty() ? 1.0 : std::abs(r.modes.back().eigenvalue));
}

int run(const CommonOptions& common, ModesOptions& options) {
  const Scene scene = load_for_analysis(common, options.analysis, options.analysis.at_equilibrium);
  const auto m = scene.mechanism();
  Assembly assembly(m, ParameterSelection{});
  const double t = scene.run.t_start_s;
  std::vector<std::string> remarks;
  const Modes r = located_in(scene, [&] {
    const Start start = find_start(assembly, t, false);
    remarks = start_remarks(assembly, start);
    Modes found = find_modes(assembly, t, start);
    if (found.v.isZero(0)) tell_of_contacts(assembly, t, found.q, found.z, found.lambda);
    return found;
  });

  Eigen::Index fastest = 0;
  const double acceleration = r.acceleration.size() > 0 ? r.acceleration.cwiseAbs().maxCoeff(&fastest) : 0;
  const bool moves = !r.v.isZero(0), steady = acceleration <= kSteady;
  const auto kink = kink_of_modes(assembly, t, r);
  // At rest on a kink either side may be met a little later.
  const bool changes = steady && !(kink && !moves);
  const double change = changes ? coefficient_change(assembly, t, r) : 0;
  Json j;
  j["status"] = "ok";
  j["scene"] = scene.file_name();
  j["title"] = scene.title;
  j["t_s"] = t;
  j["degrees_of_freedom"] = r.degrees_of_freedom;
  j["zero_eigenvalues"] = r.zero_eigenvalues;
  j["largest_acceleration"] = acceleration;
  j["coefficient_change"] = changes ? Json(change) : Json();
  j["modes"] = Json::array();
  std::string text = fmt::format("{}\n", scene.title.empty() ? common.scene : scene.title);
  text += fmt::format("  about {} at t = {:g} s, {} degree{} of freedom\n",
                      m->starts_at_equilibrium() && !moves ? "the equilibrium"
                      : moves                              ? "the motion"
                                                           : "the position",
                      t, r.degrees_of_freedom, r.degrees_of_freedom == 1 ? "" : "s");
  if (r.zero_eigenvalues > 0)
    text += fmt::format("  {} zero eigenvalue{} within rounding (a free translation, turn or spin counts two)\n",
                        r.zero_eigenvalues, r.zero_eigenvalues == 1 ? "" : "s");
  if (!steady) {
    const auto& of = r.directions[static_cast<std::size_t>(fastest)];
    text += fmt::format("  not steady: {} accelerates with {:.3g} {}/s^2\n", of.name, acceleration, of.unit);
    remarks.push_back(
        fmt::format("This start is not steady, as {} accelerates with {:.3g} {}/s^2: these are the modes of the frozen "
                    "instant, which need not be those of the motion.",
                    of.name, acceleration, of.unit));
  } else if (change > kStays)
    remarks.push_back(fmt::format(
        "Masses, damping or stiffness change along the motion, by {:.1g} of their size in an instant of the fastest "
        "mode (a spin about an axis that is not one of symmetry, a law of time): these are the modes of the frozen "
        "instant, which need not be those of the motion.",
        change));
  if (kink)
    remarks.push_back(fmt::format(
        "A force has a kink here: {} is {:.6g} on one side and {:.6g} on the other. These are the modes of one side; a "
        "motion over both sides has others.",
        entry_name(*m, *kink), kink->one, kink->other));
  const std::string head = text.substr(text.find('\n') + 1);
  std::vector<std::vector<std::string>> rows;
  text += fmt::format("\n  {:>4} {:>14} {:>10} {:>14}  {}\n", "mode", "frequency [Hz]", "damping", "real [1/s]",
                      "kinetic energy in");
  for (std::size_t k = 0; k < r.modes.size(); ++k) {
    const Mode& mode = r.modes[k];
    Json e;
    e["real_per_s"] = mode.eigenvalue.real();
    e["imaginary_per_s"] = mode.eigenvalue.imag();
    e["frequency_Hz"] = mode.frequency_Hz();
    e["damping_ratio"] = mode.damping_ratio();
    e["relative_error"] = mode.relative_error;
    e["kinetic_energy"] = Json::object();
    for (int i = 0; i < mode.share.size(); ++i)
      if (mode.share[i] >= 0.01) e["kinetic_energy"][r.directions[static_cast<std::size_t>(i)].name] = mode.share[i];
    e["shape"] = shape_json(*m, r, mode);
    j["modes"].push_back(e);
    const double size = std::abs(mode.eigenvalue);
    rows.push_back(mode.oscillates()
                       ? std::vector{std::to_string(k + 1), fmt::format("{:.8g}", mode.frequency_Hz()),
                                     fmt::format("{:.5f}", clean(mode.damping_ratio(), 5e-6)),
                                     fmt::format("{:.6g}", clean(mode.eigenvalue.real() / size) * size),
                                     participants(*m, r, mode)}
                       : std::vector{std::to_string(k + 1), std::string("-"), std::string("-"),
                                     fmt::format("{:.6g}", mode.eigenvalue.real()), participants(*m, r, mode)});
    const auto& row = rows.back();
    text += fmt::format("  {:>4} {:>14} {:>10} {:>14}  {}\n", row[0], row[1], row[2], row[3], row[4]);
  }
  j["warnings"] = Json::array();
  for (std::size_t k = 0; k < r.modes.size(); ++k)
    if (r.modes[k].relative_error > 1e-3)
      j["warnings"].push_back(
          fmt::format("Mode {}: the accuracy of this root is not known; rounding in the stiffness and damping of the "
                      "mechanism may have "
                      "moved it by {:.2g} of its size.",
                      k + 1, r.modes[k].relative_error));
  for (const auto& remark : remarks) j["warnings"].push_back(remark);
  if (!options.shapes.empty()) {
    write_file_atomically(options.shapes, shapes_csv(*m, r));
    text += fmt::format("  shapes: {}\n", options.shapes.string());
  }
  report_analysis(common, j, text, "modes.json",
                  [&](const Json& whole) { return modes_page(scene, whole, head, rows); });
  return 0;
}

}  // namespace

const RegisterCommand modes_command(
    CommandGroup::analyse, "modes", "Natural frequencies, damping and mode shapes about a scene's start",
    [](Command& c, CommonOptions& common) {
      auto options = std::make_shared<ModesOptions>();
      common.add_to(c);
      c.flag("--equilibrium", options->analysis.at_equilibrium,
             "About the static equilibrium, also where the scene starts elsewhere");
      options->analysis.add_hold(c, "With --equilibrium: positions held, separated by commas, or 'none'");
      c.option("--shapes", options->shapes, "Write the mode shapes to this file (CSV)");
      c.option("--output", common.output,
               "Directory for modes.json and modes.html, or a file with an extension (default: none)");
      c.flag("--json", common.json, "Print one JSON object and nothing else");
      c.runs([&common, options] { return run(common, *options); });
    });

}  // namespace costate::app
