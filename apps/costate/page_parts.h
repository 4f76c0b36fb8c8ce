// What pages of runs have in common: what was run, and the motion in 3-D with plots over time.
#pragma once

#include "command.h"
#include "costate/record/trajectory_table.h"
#include "html_page.h"

namespace costate::app {

/// As pages write it; infinite ones are "none". Of a summary null and what is missing are "-".
std::string page_number(double x);
std::string page_number(const Json& j, const char* key);

/// A summary's psi in the digits that are known.
std::string page_psi(const Setup& setup, const Json& summary);

/// Of a summary's case: "ride.toml, index1 by idas-adjoint, rtol 1e-08".
std::string run_of_case(const Json& c);

std::string title_of(const Setup& setup);

/// The scene, its time and settings, its cases where it has several, and what was noticed.
void add_run(HtmlPage& page, const Setup& setup, const Json& summary);

/// As it stands, line by line.
void add_text(HtmlPage& page, const std::string& text);

/// What a summary says was noticed.
void add_warnings(HtmlPage& page, const Json& summary);

struct Motion {
  std::string name;
  const TrajectoryTable* table;
  Scene scene;  // with its parameters
};

/// Under a heading the motions in 3-D, if wanted, the later over the earlier ones, and one plot an output that the cost
/// or [run] names, with their names in the legend, and with what the cost wants of it.
void add_motion(HtmlPage& page, const Setup& setup, const std::vector<Motion>& motions, const std::string& title,
                bool viewer);

}  // namespace costate::app
