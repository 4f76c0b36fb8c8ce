#include "viewer.h"

#include <fmt/format.h>

#include "costate/json_text.h"
#include "costate/page_script.h"
#include "costate/record/svg_plot.h"
#include "gltf.h"

namespace costate::app {

namespace {

std::string layout_element(const Viewed& viewed) {
  if (viewed.motions.size() < 2) return "";
  std::string text =
      "<select id=\"layout\"><option value=\"over\">over each other</option><option value=\"beside\">side by "
      "side</option>";
  for (const auto& [name, stage] : viewed.motions)
    text += fmt::format("<option value=\"{0}\">{0} alone</option>", xml_escaped(name));
  return text + "</select> ";
}

}  // namespace

std::string viewer_style() {
  return "#view { width: 100%; height: 60vh; max-height: 640px; border: 1px solid #cccccc; touch-action: none; "
         "display: block; }\n"
         "#track { display: inline-block; position: relative; width: 55%; vertical-align: middle; }\n"
         "#time { width: 100%; margin: 0; } #label { margin-left: 1em; }\n"
         "#marks span { position: absolute; top: 1.1em; width: 3px; height: 0.7em; margin-left: -1px; background: "
         "#a3195b; cursor: pointer; }\n"
         "@media print { #viewer { display: none; } }\n";
}

std::string viewer_element(const Viewed& viewed, const std::string& title) {
  if (!has_viewer()) return fmt::format("<div id=\"still\">\n{}</div>\n", viewed.drawing);
  Json events = Json::array();
  for (const auto& [t, name] : viewed.events) events.push_back({{"t", t}, {"name", name}});
  std::string text = fmt::format(
      "<div id=\"viewer\" hidden=\"hidden\" data-start=\"{:.17g}\" data-speed=\"{:.6g}\" data-events=\"{}\">\n"
      "<canvas id=\"view\" tabindex=\"0\"></canvas>\n<p><button id=\"play\">Pause</button> {}"
      "<span id=\"track\"><input id=\"time\" type=\"range\" min=\"0\" value=\"0\"/><span id=\"marks\"></span></span>"
      "<span id=\"label\"></span></p>\n<p>Drag to turn, drag with Shift to move, wheel to come nearer (in a long page "
      "after a click).{}</p>\n</div>\n"
      "<div id=\"still\">\n{}</div>\n",
      viewed.motions.back().second.times.front(), viewed.speed, xml_escaped(json_text(events)), layout_element(viewed),
      viewed.speed == 1 ? "" : fmt::format(" It plays {:g} times as fast as it was.", viewed.speed), viewed.drawing);
  for (const auto& [name, stage] : viewed.motions)
    text += fmt::format("<script class=\"gltf\" type=\"application/json\" data-name=\"{}\">{}</script>\n",
                        xml_escaped(name), script_data(gltf_text(stage, title)));
  return text + script_element(viewer_library(), "three") + script_element(viewer_script());
}

std::string viewer_page(const Viewed& viewed, const std::string& title) {
  return fmt::format(
      "<!DOCTYPE html>\n<html xmlns=\"http://www.w3.org/1999/xhtml\" lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
      "<title>{0}</title>\n<style>\nbody {{ font-family: sans-serif; color: #222222; max-width: 1180px; margin: 1em "
      "auto; padding: 0 1em; }}\n{1}#view {{ height: 70vh; max-height: none; "
      "}}\n</style>\n</head>\n<body>\n<h1>{0}</h1>\n{2}</body>\n"
      "</html>\n",
      xml_escaped(title), viewer_style(), viewer_element(viewed, title));
}

}  // namespace costate::app
