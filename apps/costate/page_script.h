// Programs within pages: how they stand in HTML and XML alike.
#pragma once

#include <string>

namespace costate::app {

/// A script element with a program of JavaScript; with an id where one is given.
std::string script_element(const std::string& program, const std::string& id = "");
/// The text of JSON as the content of a script element.
std::string script_data(std::string json);

}  // namespace costate::app
