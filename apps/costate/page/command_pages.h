// The pages of commands that judge, analyse or identify: each says what the command's text says, with the same digits,
// warnings on top, and adds what a picture tells better.
#pragma once

#include <utility>

#include "costate/analysis.h"
#include "costate/figure.h"
#include "costate/fit/fit.h"
#include "costate/record/trajectory_table.h"

namespace costate::app {

/// One of the scenes that were fitted, with the values found, and its motion where that could be computed.
struct FittedRun {
  Setup setup;
  std::optional<TrajectoryTable> motion;
};
/// costate fit: parameters, what the data tell of them, the samples against the motion, residuals.
std::string fit_page(const std::vector<FittedRun>& runs, const FitResult& result, const Json& summary);

/// costate sweep: outputs over the coordinate that is led.
std::string sweep_page(const Scene& scene, const Json& summary);

/// costate modes: `head` is what the text says above its table, whose cells are `rows`; and the roots.
std::string modes_page(const Scene& scene, const Json& summary, const std::string& head,
                       const std::vector<std::vector<std::string>>& rows);

/// costate equilibrium: `head` is what the text says above its lists.
std::string equilibrium_page(const Scene& scene, const Json& summary, const std::string& head, const Figure& figure,
                             const std::vector<std::pair<std::string, Listing>>& lists);

/// costate check: what disagrees, then every row. `verdict` is the sentence that ends the text, empty where something
/// disagrees.
std::string check_page(const Setup& setup, const Json& summary, const std::string& verdict);

/// costate compare: the outputs of both over time, and how far they are apart.
std::string compare_page(const Setup& a, const Json& summary, const std::string& text, const TrajectoryTable& motion_a,
                         const TrajectoryTable& motion_b);

/// costate regress: what failed and what moved, then every baseline.
std::string regress_page(const Json& summary, const std::string& text);

/// costate explain: what is built, what it costs by kind, what nobody asked for.
std::string explain_page(const Setup& setup, const Json& summary, const std::string& text);

}  // namespace costate::app
