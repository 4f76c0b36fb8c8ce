#include "page_script.h"

namespace costate::app {

std::string script_element(const std::string& program, const std::string& id) {
  return (id.empty() ? "<script>" : "<script id=\"" + id + "\">") + "//<![CDATA[\n" + program + "\n//]]></script>\n";
}

std::string script_data(std::string json) {
  // In strings of JSON these are the same characters; outside of strings there are none.
  for (const auto& [character, code] : {std::pair('<', "\\u003c"), {'>', "\\u003e"}, {'&', "\\u0026"}})
    for (std::size_t at = 0; (at = json.find(character, at)) != std::string::npos; at += 6) json.replace(at, 1, code);
  return json;
}

}  // namespace costate::app
