// costate import: a robot's description (URDF) as a scene.
#include <fmt/format.h>

#include <charconv>

#include "costate/base/error.h"
#include "costate/command.h"
#include "costate/record/atomic_file.h"
#include "costate/record/print.h"
#include "robot.h"

namespace costate::app {

namespace {

struct ImportOptions {
  std::string source;
  std::filesystem::path file;
  std::vector<std::string> poses, loops;
  bool floating = false;
};

RobotOptions robot_options(const ImportOptions& options) {
  RobotOptions r;
  r.floating = options.floating;
  for (const auto& text : options.poses) {
    const auto equals = text.find('=');
    double value = 0;
    const char* begin = text.data() + (equals == std::string::npos ? text.size() : equals + 1);
    const auto read = std::from_chars(begin, text.data() + text.size(), value);
    if (equals == std::string::npos || read.ec != std::errc() || read.ptr != text.data() + text.size() ||
        !std::isfinite(value))
      throw Error(fmt::format("--pose needs JOINT=VALUE in rad or m, found '{}'. Example: --pose elbow=0.5.", text));
    if (!r.positions.emplace(text.substr(0, equals), value).second)
      throw Error(fmt::format("--pose gives joint '{}' twice.", text.substr(0, equals)));
  }
  for (const auto& text : options.loops) {
    const auto comma = text.find(',');
    if (comma == std::string::npos || comma == 0 || comma + 1 == text.size())
      throw Error(fmt::format("--close needs LINK,LINK, found '{}'.", text));
    r.closed.emplace_back(text.substr(0, comma), text.substr(comma + 1));
  }
  return r;
}

int run_import(const CommonOptions& common, const ImportOptions& options) {
  const Robot robot = read_urdf(options.source, robot_options(options));
  const std::string text = robot_scene(robot, std::filesystem::path(options.source).filename().string());
  const std::string name = options.file.empty() ? "scene.toml" : options.file.string();
  Scene::parse(text, name);  // what is written can be read
  if (options.file.empty()) {
    fmt::print("{}", text);
    return 0;
  }
  if (!common.no_files) write_file_atomically(options.file, text);
  if (common.quiet) return 0;
  std::string told = fmt::format("{}: {} bodies, {} joints, {} of them free; next: costate simulate {}\n",
                                 common.no_files ? "nothing written" : name, robot.bodies.size() - 1,
                                 robot.joints.size(), free_coordinates(robot).size(), name);
  for (const std::string& sentence : robot.left_out) told += fmt::format("  note: {}\n", sentence);
  print_result(told);
  return 0;
}

}  // namespace

const RegisterCommand import_command(
    CommandGroup::inspect, "import", "A robot's description (URDF) as a scene", [](Command& c, CommonOptions& common) {
      auto options = std::make_shared<ImportOptions>();
      c.option("file", options->source, "Robot description (URDF)").required();
      c.option("-o,--output", options->file, "Scene to write (default: standard output)");
      c.option("--pose", options->poses, "A joint's position at the start: JOINT=VALUE in rad or m (repeatable)")
          .value_name("JOINT=VALUE")
          .repeatable();
      c.option("--close", options->loops, "Two links whose origins are one point: LINK,LINK closes a loop (repeatable)")
          .value_name("LINK,LINK")
          .repeatable();
      c.flag("--floating", options->floating, "The root link is a free body, not the ground");
      c.flag("--no-files", common.no_files, "Write no file");
      c.flag("--quiet", common.quiet, "Print errors only");
      c.runs([&common, options] { return run_import(common, *options); });
    });

}  // namespace costate::app
