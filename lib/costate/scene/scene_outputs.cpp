// What the outputs that a scene names are, once there is a mechanism: that each is there, and that none has two
// meanings.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>

#include "costate/base/error.h"
#include "costate/element/defined_output.h"
#include "costate/scene/scene_reader.h"

namespace costate {

/// The tables of the scene that bring an output of this name.
static std::vector<std::string> owners(const Mechanism& mechanism, const std::string& output) {
  std::vector<std::string> paths;
  const auto add = [&](const std::string& path) {
    if (std::find(paths.begin(), paths.end(), path) == paths.end()) paths.push_back(path);
  };
  const auto derived = [&](const std::string& name) {
    for (const char* order : {"", "_dot", "_ddot"})
      if (name + order == output) return true;
    return false;
  };
  for (const auto& c : mechanism.coordinates())
    if (derived(c.name)) {  // "body.one.x_m" belongs to [body.one]
      const std::string& path = mechanism.numbers()[static_cast<std::size_t>(c.position_number)].path;
      add(path.substr(0, path.find('.', path.find('.') + 1)));
    }
  for (const auto& p : mechanism.points())
    for (const char* component : {".x", ".y"})
      if (derived(p.name() + component)) add("point." + p.name());
  for (const auto& p : mechanism.spatial_points())
    for (const char* component : {".x", ".y", ".z"})
      if (derived(p.name() + component)) add("point." + p.name());
  const auto collect = [&](const auto& list) {
    for (const auto& e : list)
      for (const auto& measure : e->measures())
        if (e->name() + "." + measure.name == output) add(e->path());
  };
  collect(mechanism.bodies());
  collect(mechanism.constraints());
  collect(mechanism.forces());
  for (const auto& f : mechanism.forces())
    if (dynamic_cast<const DefinedOutput*>(f.get()) && f->name() == output) add(f->path());
  return paths;
}

/// Throws at the subject where the mechanism has no such output.
static void require_output(const Mechanism& mechanism, const std::string& subject, const std::string& name) {
  try {
    make_output(mechanism, name);
  } catch (const ModelError& e) {
    throw ModelError(e.subject().empty() ? subject : e.subject(), e.bare_message());
  }
}

void SceneReader::check_outputs() {
  std::map<std::string, int> count;
  for (const auto& name : output_names(*mechanism))
    if (++count[name] == 2) {
      const std::vector<std::string> paths = owners(*mechanism, name);
      throw ModelError(paths.empty() ? "" : paths.back(),
                       fmt::format("The output '{}' has two meanings: {} share a name. Rename one.", name,
                                   fmt::join(paths, " and ")));
    }
  for (const auto& f : mechanism->forces())  // that their formulas name outputs
    if (dynamic_cast<const DefinedOutput*>(f.get())) require_output(*mechanism, f->path(), f->name());
  if (run.ends_when) require_output(*mechanism, "run.ends_when.output", run.ends_when->output);
  for (std::size_t i = 0; i < run.outputs.size(); ++i)
    require_output(*mechanism, fmt::format("run.outputs[{}]", i), run.outputs[i]);
}

}  // namespace costate
