#include "analysis.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/event/motion_events.h"
#include "costate/level/penalty_weight.h"
#include "costate/level/velocity_jump.h"
#include "costate/record/atomic_file.h"
#include "costate/record/print.h"
#include "digits.h"

namespace costate::app {

void AnalysisOptions::add_hold(Command& command, const std::string& text) {
  command.option("--hold", hold, text).separated().seen([this] { hold_given = true; });
}

std::string entry_name(const Mechanism& m, const PointKink& kink) {
  const auto& c = m.coordinates();
  return fmt::format("the {} of {} by {}", kink.of_velocity ? "damping" : "stiffness",
                     c[static_cast<std::size_t>(kink.row)].name, c[static_cast<std::size_t>(kink.column)].name);
}

void tell_of_contacts(const Assembly& at, double t, const Eigen::VectorXd& q, const Eigen::VectorXd& z,
                      const Eigen::VectorXd& lambda) {
  if (!MotionEvents::has_any(at.mechanism())) return;
  Assembly assembly(at.mechanism_ptr(), at.parameters());
  assembly.set_parameters(at.rho().data());
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(q.size());
  StateView s;
  s.t = t;
  s.q = q.data();
  s.v = s.a = rest.data();
  s.z = z.data();
  s.lambda = lambda.data();
  try {
    // What rests at a gap of zero moves as its accelerations say; rows may depend on each other.
    AccelerationLevel level(assembly, augmented_stabilization(at.mechanism_ptr()));
    VelocityJump jump(assembly, level);
    MotionEvents events(assembly);
    events.use(jump.balance());
    assembly.calc_dynamics(s);
    events.begin(s);
  } catch (const ModelError& e) {
    notice(fmt::format("This is no rest of a mechanism with its contacts: a run that begins here is refused. {}",
                       e.bare_message()));
  } catch (const SolverError&) {
    // Nothing is told of what has no accelerations: a run says so.
  }
}

Scene load_for_analysis(const CommonOptions& common, AnalysisOptions& options, bool released) {
  CommonOptions with = common;
  std::vector<std::string> hold;
  for (const auto& name : options.hold)
    if (!name.empty() && name != "none") hold.push_back(fmt::format("\"{}\"", name));
  if (options.hold_given) with.overrides.push_back(fmt::format("start.given=[{}]", fmt::join(hold, ", ")));
  if (released && !load_scene(common).mechanism()->starts_at_equilibrium()) {
    with.overrides.push_back("start.equilibrium=true");
    if (!options.hold_given) with.overrides.push_back("start.given=[]");
  }
  return load_scene(with);
}

std::vector<std::unique_ptr<Output>> outputs_named(const Mechanism& m, const std::vector<std::string>& names) {
  std::vector<std::unique_ptr<Output>> outputs;
  for (const auto& name : names) outputs.push_back(make_output(m, name));
  return outputs;
}

std::vector<std::unique_ptr<Output>> measured_outputs(const Mechanism& m) {
  const auto coordinates = m.coordinate_names();
  const auto starts = [](const std::string& name, const char* with) { return name.rfind(with, 0) == 0; };
  const auto ends = [](const std::string& name, const std::string& with) {
    return name.size() >= with.size() && name.compare(name.size() - with.size(), with.size(), with) == 0;
  };
  std::vector<std::string> names;
  for (const auto& name : output_names(m))
    if (!starts(name, "lambda.") && !starts(name, "z.") && !starts(name, "energy.") && name != "time" &&
        std::find(coordinates.begin(), coordinates.end(), name) == coordinates.end())
      names.push_back(name);
  auto outputs = outputs_named(m, names);
  std::erase_if(outputs, [&](const auto& o) { return ends(o->unit(), "/s") || ends(o->unit(), "/s^2"); });
  return outputs;
}

void Listing::add(const std::string& name, double value, const std::string& unit, const std::string& note) {
  lines_.push_back({name, value, unit, (unit == "1" ? "" : unit) + (note.empty() ? "" : "  " + note)});
}

std::map<std::string, double> Listing::sizes() const {
  std::map<std::string, double> largest;
  for (const auto* lines : {&lines_, &beside_})
    for (const auto& l : *lines) largest[l.unit] = std::max(largest[l.unit], std::abs(l.value));
  // Torques are made of forces on levers.
  largest["N m"] = std::max(largest["N m"], largest["N"] * largest["m"]);
  return largest;
}

std::vector<std::vector<std::string>> Listing::rows() const {
  const std::map<std::string, double> largest = sizes();
  std::vector<std::vector<std::string>> rows;
  for (const auto& l : lines_)
    rows.push_back({l.name, fmt::format("{:.10g}", shown(l.value, largest.at(l.unit))), l.rest});
  return rows;
}

std::string Listing::text() const {
  const auto lines = rows();
  std::size_t names = 0, values = 0;
  for (const auto& l : lines) {
    names = std::max(names, l[0].size());
    values = std::max(values, l[1].size());
  }
  std::string text;
  for (const auto& l : lines) {
    std::string line = fmt::format("  {:<{}}  {:>{}} {}", l[0], names, l[1], values, l[2]);
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

void report_analysis(const CommonOptions& common, const Json& json, const std::string& text, const std::string& file,
                     const std::function<std::string(const Json&)>& page) {
  namespace fs = std::filesystem;
  Json whole = json;
  add_notices(whole);
  const std::string object = json_text(whole) + "\n";
  fs::path path = common.output, page_path;
  if (common.no_files) path.clear();
  if (!path.empty()) {
    // A folder, as for all commands; what has an extension and is no folder is the file itself.
    if (fs::is_directory(path) || !path.has_extension()) {
      try {
        require_writable(path);
      } catch (const Error& e) {
        throw Error(fmt::format("--output: {}", e.what()));
      }
      path /= file;
      page_path = fs::path(path).replace_extension("html");
    }
    write_file_atomically(path, object);
    if (!page_path.empty()) write_file_atomically(page_path, page(whole));
  }
  if (common.hand_over) return common.hand_over(whole);
  print_warnings(whole.at("warnings").get<std::vector<std::string>>());
  if (common.json)
    fmt::print("{}", object);
  else if (!common.quiet) {
    print_result(text);
    if (!page_path.empty()) print_result(fmt::format("  report: {}\n", page_path.string()));
    if (!path.empty()) print_result(fmt::format("  summary: {}\n", path.string()));
  }
}

}  // namespace costate::app
