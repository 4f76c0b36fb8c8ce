// Programs within pages: how they stand in HTML and XML alike, and the one that makes plots to be read off.
#pragma once

#include <string>

namespace costate::app {

/// A script element with a program of JavaScript; with an id where one is given.
std::string script_element(const std::string& program, const std::string& id = "");
/// The text of JSON as the content of a script element.
std::string script_data(std::string json);

/// Makes the plots of a page (svg_plot.h) answer the mouse: values beside the pointer, a span of the abscissa by
/// dragging, all of it by a double click. In plots over time a click is the moment that the viewer shows
/// ('costate-seek'), and a line marks the one that it shows ('costate-time').
const char* plot_script();
/// What it needs in the page's style.
const char* plot_style();

}  // namespace costate::app
