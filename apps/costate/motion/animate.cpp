// costate animate: the motion of a scene for viewers, as glTF, a page, an SVG that plays or a series for ParaView.
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "costate/base/notice.h"
#include "costate/command.h"
#include "costate/drawing.h"
#include "costate/record/atomic_file.h"
#include "costate/record/print.h"
#include "costate/start_notice.h"
#include "costate/trajectory.h"
#include "figures.h"
#include "gltf.h"
#include "viewer.h"
#include "vtk.h"

namespace costate::app {

namespace {

struct AnimateOptions {
  std::filesystem::path file;
  std::optional<double> step;
  double speed = 1;
  DrawOptions drawing{.view = "", .width = 640, .no_names = true};
};

/// Between samples viewers, and eyes, turn by the shorter way: beyond a quarter turn a spin begins to look wrong.
void notice_fast_turns(const Stage& stage) {
  const auto [angle, name] = largest_turn(stage);
  if (angle > std::numbers::pi / 2)
    notice(
        fmt::format("'{}' turns by up to {:.0f} degrees from one sample to the next, which viewers cannot follow; "
                    "take a smaller --output-step.",
                    name, angle * 180 / std::numbers::pi));
}

/// What a page shows where it cannot show more: some fifty of the samples.
std::string fallback(const FiguresOfRun& run, const AnimateOptions& options) {
  const std::size_t every = 1 + run.times.size() / 50;
  std::vector<Figure> figures;
  std::vector<double> times;
  for (std::size_t i = 0; i < run.times.size(); i += every) {
    figures.push_back(run.figures[i]);
    times.push_back(run.times[i]);
  }
  return moving_drawing(figures, times, options.drawing, options.speed);
}

void require_sense(const AnimateOptions& options, const std::string& kind) {
  if (kind != ".gltf" && kind != ".glb" && kind != ".svg" && kind != ".html" && kind != ".pvd")
    throw Error(fmt::format("--output names a file that ends in .gltf, .glb, .html, .svg or .pvd, found '{}'.",
                            options.file.string()));
  if (!(options.speed > 0 && std::isfinite(options.speed)))
    throw Error(fmt::format("--speed must be a positive number, found {}.", options.speed));
  if (kind != ".pvd") return;
  if (options.speed != 1)
    throw Error("--speed is not for .pvd, whose times are the motion's; ParaView plays them as fast as it is told to.");
  require_series_place(options.file);
}

/// Nothing else is as large: each frame has all its points.
void write_frames(const std::filesystem::path& file, const Stage& stage, Progress& progress) {
  write_series(file, stage, [&](std::size_t frames) {
    if (frames % 250 == 0) progress.line(fmt::format("{} of {} frames are written", frames, stage.times.size()));
  });
}

int run_animate(const CommonOptions& common, const AnimateOptions& options) {
  const std::string kind = options.file.extension().string();
  require_sense(options, kind);
  CommonOptions without_files = common;
  without_files.no_files = true;
  Setup setup(without_files, Purpose::simulate);
  setup.method.clear();
  Progress progress(setup.progress_options);
  progress.start(setup.problem.solver.t_start);
  setup.problem.monitor = monitor(progress, setup.problem.solver.t_end);
  FiguresOfRun run = started(setup, [&] { return figures_of_run(setup, options.step); });
  progress.finish();
  if (run.figures.empty()) throw Error("The run gave no sample to draw; take a smaller --output-step.");
  // Files of glTF have the speed in their times, the others play at it.
  auto shown = run.times;
  if (kind == ".gltf" || kind == ".glb")
    for (double& t : shown) t = run.times.front() + (t - run.times.front()) / options.speed;
  const Stage stage = make_stage(shown, run.figures);
  notice_fast_turns(stage);
  std::string content;
  if (kind == ".pvd") {
    if (!common.no_files) write_frames(options.file, stage, progress);
  } else if (kind == ".svg") {
    content = moving_drawing(run.figures, run.times, options.drawing, options.speed);
  } else {
    const std::string title = setup.scene.title.empty() ? common.scene : setup.scene.title;
    content = kind == ".glb"    ? glb_bytes(stage, title)
              : kind == ".html" ? viewer_page({{{"", stage}}, {}, options.speed, fallback(run, options)}, title)
                                : gltf_text(stage, title);
  }
  if (!common.no_files && kind != ".pvd") write_file_atomically(options.file, content);
  Json j;
  j["status"] = "ok";
  j["file"] = common.no_files ? Json() : Json(options.file.string());
  j["samples"] = run.times.size();
  j["t_start_s"] = run.times.front();
  j["t_end_s"] = run.times.back();
  j["warnings"] = take_notices();
  print_warnings(j["warnings"].get<std::vector<std::string>>());
  if (common.json)
    fmt::print("{}\n", json_text(j));
  else if (!common.quiet)
    print_result(fmt::format("{}: {} samples of t = {:g} .. {:g} s\n",
                             common.no_files ? "nothing written" : options.file.string(), run.times.size(),
                             run.times.front(), run.times.back()));
  return 0;
}

}  // namespace

const RegisterCommand animate_command(
    CommandGroup::inspect, "animate", "The motion of a scene to be seen: glTF, a page in 3-D, SVG that plays, ParaView",
    [](Command& c, CommonOptions& common) {
      auto options = std::make_shared<AnimateOptions>();
      common.add_to(c);
      common.add_run_options(c);
      c.remove("--output");
      for (const char* other : {"--method", "--parameters", "--checkpoint-steps"}) c.remove(other);
      c.option("-o,--output", options->file, "File to write: .gltf, .glb, .html (in 3-D), .svg or .pvd (ParaView)")
          .required();
      c.option("--output-step", options->step, "Time between samples [s] (default: the scene's, or 300 samples)");
      c.option("--speed", options->speed, "How many times as fast as the motion it plays (default: 1); not of .pvd");
      c.option("--view", options->drawing.view, "SVG: xy, xz, yz or isometric (default: as 'costate draw')")
          .among({"xy", "xz", "yz", "isometric"});
      c.option("--width", options->drawing.width, "SVG: width of the page [pixels]").between(200, 10000);
      c.runs([&common, options] { return run_animate(common, *options); });
    });

}  // namespace costate::app
