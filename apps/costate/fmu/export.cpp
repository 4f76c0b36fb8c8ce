// costate export: a scene as an FMU (FMI 3.0), for model exchange and co-simulation.
#include <fmt/format.h>

#include <cctype>
#include <fstream>
#include <iterator>

#include "costate/analysis.h"
#include "costate/base/digest.h"
#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/command.h"
#include "costate/integrator/simulate.h"
#include "costate/library_file.h"
#include "costate/record/atomic_file.h"
#include "costate/record/print.h"
#include "costate/scene/scene_files.h"
#include "description.h"
#include "fmu_model.h"
#include "zip_file.h"

namespace costate::app {

namespace {

namespace fs = std::filesystem;

struct ExportOptions {
  fs::path file;
  std::string formulation;
};

#if defined(__aarch64__)
constexpr const char* kPlatform = "aarch64-linux";
#else
constexpr const char* kPlatform = "x86_64-linux";
#endif

std::string content_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (!in) throw Error(fmt::format("'{}' cannot be read.", path.string()));
  return text;
}

/// A C identifier of a file's name.
std::string identifier_of(const std::string& name) {
  std::string text;
  for (const char c : name) text += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  if (text.empty() || std::isdigit(static_cast<unsigned char>(text[0])) != 0) text.insert(0, "scene_");
  return text;
}

std::unique_ptr<FmuModel> model_of(const Scene& scene) {
  return located_in(scene, [&] { return std::make_unique<FmuModel>(scene); });
}

/// The scene with an explicit formulation, its own where it has such a form.
CommonOptions with_formulation(const CommonOptions& common, const ExportOptions& options) {
  CommonOptions c = common;
  if (!options.formulation.empty()) {
    c.overrides.push_back("run.formulation=" + options.formulation);
    return c;
  }
  const Scene scene = load_scene(c);
  try {
    model_of(scene);
  } catch (const CapabilityError&) {
    notice(fmt::format("The FMU has the formulation '{}': '{}' has no explicit form in positions and velocities.",
                       kDefaultFormulation, scene.run.formulation));
    c.overrides.push_back(std::string("run.formulation=") + kDefaultFormulation);
  }
  return c;
}

using Entries = std::vector<std::pair<std::string, std::string>>;

/// The scene's text, with the files that it names beside it.
std::string scene_with_files(const Scene& scene, const SceneFileLog& log, Entries& entries) {
  std::string text = scene_text_for(scene, log.files(), "");
  int count = 0;
  for (const SceneFile& f : log.files()) {
    if (f.path.empty()) continue;  // a scene that this one includes: what it says is in the text
    const std::string named = '"' + fs::weakly_canonical(fs::absolute(f.file)).string() + '"';
    const std::string inside = fmt::format("files/{}_{}", ++count, fs::path(f.file).filename().string());
    std::size_t at = text.find(named);
    if (at == std::string::npos) {
      notice(fmt::format("The FMU reads the file '{}' ({}) where it is.", f.file, f.path));
      continue;
    }
    for (; at != std::string::npos; at = text.find(named, at)) text.replace(at, named.size(), '"' + inside + '"');
    entries.emplace_back("resources/" + inside, content_of(f.file));
  }
  return text;
}

int run_export(const CommonOptions& common, const ExportOptions& options) {
  if (options.file.extension() != ".fmu")
    throw Error(fmt::format("--output names a file that ends in .fmu, found '{}'.", options.file.string()));
  const CommonOptions chosen = with_formulation(common, options);
  const SceneFileLog log(chosen.scene);
  const Scene scene = load_scene(chosen);
  const auto model = model_of(scene);
  const fs::path library = library_of(&take_notices), solvers = library_of(&simulate),
                 fmu = library.parent_path() / "libcostate_fmu.so";
  if (!fs::exists(fmu))
    throw Error(
        fmt::format("'{}', the library for FMUs, is missing beside Costate's others; build the target "
                    "costate_fmu.",
                    fmu.string()));
  Entries entries;
  const std::string text = scene_with_files(scene, log, entries);
  const std::string identifier = identifier_of(options.file.stem().string());
  Digest digest;
  digest.add(text);
  const std::string token = "costate-" + digest.text();
  const std::string folder = fmt::format("binaries/{}/", kPlatform);
  entries.insert(entries.begin(),
                 {{"modelDescription.xml",
                   model_description(*model, scene.title.empty() ? options.file.stem().string() : scene.title,
                                     scene.description, identifier, token)},
                  {"resources/scene.toml", text}});
  entries.emplace_back(folder + identifier + ".so", content_of(fmu));
  for (const fs::path& path : {library, solvers})
    entries.emplace_back(folder + path.filename().string(), content_of(path));
  if (!common.no_files) write_file_atomically(options.file, zip_bytes(entries));
  for (const FmuVariable& v : model->variables())
    if (!v.differentiable)
      notice(fmt::format("'{}' has no derivatives: it is a local variable of the FMU, not an output.", v.name));
  if (scene.run.ends_when)
    notice(
        "The FMU goes as far as its importer wants: 'ends_when' in [run] is left out, and parameters of it alone do "
        "nothing in the FMU.");
  const auto notices = take_notices();
  for (const std::string& sentence : notices) print_message("warning: " + sentence);
  std::size_t outputs = 0;
  for (const FmuVariable& v : model->variables()) outputs += v.is_output ? 1 : 0;
  Json j;
  j["status"] = "ok";
  j["file"] = common.no_files ? Json() : Json(options.file.string());
  j["formulation"] = scene.run.formulation;
  j["model_exchange"] = model->no_model_exchange().empty();
  j["co_simulation"] = true;
  j["derivatives"] = model->has_derivatives();
  j["states"] = model->size();
  j["parameters"] = model->parameters().size();
  j["outputs"] = outputs;
  j["warnings"] = notices;
  if (common.json) {
    fmt::print("{}\n", json_text(j));
  } else if (!common.quiet) {
    std::string line = fmt::format("{}: FMI 3.0, {}, {} states, {} parameters, {} outputs\n",
                                   common.no_files ? "nothing written" : options.file.string(),
                                   model->no_model_exchange().empty() ? "model exchange and co-simulation, with "
                                                                        "directional and adjoint derivatives"
                                                                      : "co-simulation",
                                   model->size(), model->parameters().size(), outputs);
    if (const std::string why = model->no_model_exchange(); !why.empty())
      line += fmt::format("  no model exchange, no derivatives: {}\n", why);
    print_result(line);
  }
  return 0;
}

}  // namespace

const RegisterCommand export_command(CommandGroup::inspect, "export",
                                     "A scene as an FMU (FMI 3.0) for other simulators",
                                     [](Command& c, CommonOptions& common) {
                                       auto options = std::make_shared<ExportOptions>();
                                       common.add_to(c);
                                       c.remove("--case");
                                       c.flag("--json", common.json, "Print one JSON object");
                                       c.option("-o,--output", options->file, "File to write, ends in .fmu").required();
                                       c.option(
                                           "--formulation", options->formulation,
                                           "An explicit formulation (default: the scene's, where it has such a form)");
                                       c.runs([&common, options] { return run_export(common, *options); });
                                     });

}  // namespace costate::app
