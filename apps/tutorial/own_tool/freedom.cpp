// A command of one's own: costate freedom SCENE says how many degrees of freedom a mechanism has at its start, and
// which constraint rows are redundant there. Help, man page and completions know it from here. It is built with the
// tool, in the source tree: an installation has the library's headers, not the tool's.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <memory>

#include "command.h"
#include "costate/analysis/start.h"

namespace {

using namespace costate;
using namespace costate::app;

struct Options {
  bool rows = false;
};

int run(const CommonOptions& common, const Options& options) {
  const Scene scene = load_scene(common);
  const auto mechanism = scene.mechanism();
  Assembly assembly(mechanism, ParameterSelection{});
  const double t = scene.run.t_start_s;
  const Start start = find_start(assembly, t, false);
  const ConstraintRank rank = constraint_rank(assembly, t, start.q.data());
  fmt::print("{}: {} degrees of freedom\n", scene.title, assembly.n() - rank.rank);
  if (!options.rows) return 0;
  std::vector<std::string> redundant;
  for (const int i : rank.dependent_rows) redundant.push_back(mechanism->row_names()[static_cast<std::size_t>(i)]);
  fmt::print("  redundant rows: {}\n", redundant.empty() ? "none" : fmt::format("{}", fmt::join(redundant, ", ")));
  return 0;
}

const RegisterCommand freedom(CommandGroup::analyse, "freedom", "How many degrees of freedom a mechanism has",
                              [](Command& c, CommonOptions& common) {
                                auto options = std::make_shared<Options>();
                                common.add_to(c);
                                c.flag("--rows", options->rows, "Name the constraint rows that are redundant");
                                c.runs([&common, options] { return run(common, *options); });
                              });

}  // namespace
