// costate draw: the mechanism of a scene at its start, or at a time of its run, as SVG.
#include <fmt/format.h>

#include <fstream>

#include "command.h"
#include "costate/analysis/start.h"
#include "drawing.h"
#include "motion/figures.h"
#include "start_notice.h"

namespace costate::app {

namespace {

struct DrawCommandOptions {
  DrawOptions drawing;
  std::string file;
  std::optional<double> at;
};

Figure figure_at_start(const CommonOptions& common) {
  const Scene scene = load_scene(common);
  const auto m = scene.mechanism();
  Assembly assembly(m, m->select({}));
  const double t = scene.run.t_start_s;
  Start start;
  try {
    start = find_start(assembly, t, false);
  } catch (const ModelError& e) {
    throw scene.located(e);
  }
  return make_figure(*m, scene_numbers(scene), start.q, start.v, start.z, t);
}

Figure figure_at(const CommonOptions& common, double t) {
  CommonOptions without_files = common;
  without_files.no_files = true;
  Setup setup(without_files, Purpose::simulate);
  const SolverOptions& solver = setup.problem.solver;
  if (!(t >= solver.t_start && t <= solver.t_end))
    throw Error(
        fmt::format("--at: The run goes from {:g} to {:g} s, found {:g} s. A longer one: --set run.t_end_s={:g}.",
                    solver.t_start, solver.t_end, t, t));
  FiguresOfRun run = started(setup, [&] { return figures_of_run(setup, {}, {t}); });
  // A run that ends by itself hands out its end besides.
  if (run.figures.empty() || run.times.front() < t)
    throw Error(fmt::format("--at: The run ended{} before {:g} s.",
                            run.times.empty() ? "" : fmt::format(" at {:g} s,", run.times.back()), t));
  return run.figures.front();
}

int run_draw(const CommonOptions& common, const DrawCommandOptions& options) {
  const double width = options.drawing.width;
  if (!(width >= 200 && width <= 10000))
    throw Error(fmt::format("--width must be 200 to 10000 pixels, found {}.", width));
  const Figure figure = options.at ? figure_at(common, *options.at) : figure_at_start(common);
  const std::string svg = drawing(figure, options.drawing);
  if (options.file.empty()) {
    fmt::print("{}", svg);
    return 0;
  }
  if (common.no_files) return 0;
  std::ofstream out(options.file, std::ios::binary);
  out << svg;
  out.close();
  if (!out) throw Error(fmt::format("'{}' cannot be written; check the directory and its permissions.", options.file));
  return 0;
}

}  // namespace

const RegisterCommand draw_command(
    CommandGroup::inspect, "draw", "Draw a scene's mechanism at its start, or at a time of its run, as SVG",
    [](Command& c, CommonOptions& common) {
      auto options = std::make_shared<DrawCommandOptions>();
      common.add_to(c);
      DrawOptions& drawing = options->drawing;
      c.option("--at", options->at, "Time of the run at which to draw it [s] (default: the start)");
      c.option("--view", drawing.view, "xy, xz, yz or isometric (default: xy in the plane, isometric in space)")
          .among({"xy", "xz", "yz", "isometric"});
      c.option("-o,--output", options->file, "File to write (default: standard output)");
      c.option("--width", drawing.width, "Width of the page [pixels]").between(200, 10000);
      c.flag("--no-names", drawing.no_names, "Leave out the names");
      c.runs([&common, options] { return run_draw(common, *options); });
    });

}  // namespace costate::app
