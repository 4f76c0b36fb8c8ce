#include "stress_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/record/atomic_file.h"
#include "html_page.h"

namespace costate::app {

namespace {

constexpr StressVerdict kVerdicts[] = {StressVerdict::held, StressVerdict::warned,   StressVerdict::refused,
                                       StressVerdict::cut,  StressVerdict::unjudged, StressVerdict::wrong};

std::vector<std::string> axes_of(const StressedScene& s) {
  std::vector<std::string> axes;
  for (const StressEntry& e : s.entries)
    if (std::find(axes.begin(), axes.end(), e.axis) == axes.end()) axes.push_back(e.axis);
  return axes;
}

std::string setting(const StressEntry& e) { return fmt::format("{}: {}, {}", e.axis, e.value, e.what.name()); }

std::string wrong_sentence(const StressEntry& e) {
  return fmt::format("{}: {} is off by {:.1e}, where {:.1e} would be in line", setting(e), e.measure, e.error,
                     e.allowed);
}

std::string name_of_scene(const StressedScene& s) { return std::filesystem::path(s.file).stem().string(); }

/// A row a scene and axis: how many of each verdict, and the first that did not hold.
std::vector<std::vector<std::string>> axis_rows(const StressedScene& s) {
  std::vector<std::vector<std::string>> rows;
  for (const auto& axis : axes_of(s)) {
    std::vector<std::string> row = {name_of_scene(s), axis};
    const StressEntry* first = nullptr;
    for (const StressVerdict v : kVerdicts) {
      std::size_t n = 0;
      for (const StressEntry& e : s.entries)
        if (e.axis == axis && e.verdict == v) {
          ++n;
          if (v != StressVerdict::held && (!first || v == StressVerdict::wrong)) first = &e;
        }
      row.push_back(n > 0 ? std::to_string(n) : "");
    }
    row.push_back(
        !first ? ""
        : first->verdict == StressVerdict::wrong
            ? wrong_sentence(*first)
            : fmt::format("{}, {}: {}: {}", first->value, first->what.name(), name_of(first->verdict), first->why));
    rows.push_back(row);
  }
  return rows;
}

Json entry_json(const StressEntry& e) {
  Json j = {{"axis", e.axis},
            {"value", e.value},
            {"formulation", e.what.formulation},
            {"integrator", e.what.integrator},
            {"verdict", e.verdict == StressVerdict::wrong ? "wrong" : name_of(e.verdict)}};
  j["error"] = e.measure.empty() ? Json(nullptr) : Json(e.error);
  j["allowed"] = e.allowed;
  j["measure"] = e.measure.empty() ? Json(nullptr) : Json(e.measure);
  if (e.drift > 0) j["drift"] = e.drift;
  if (!e.why.empty()) j["why"] = e.why;
  return j;
}

Json summary_json(const StressSummary& summary, bool interrupted) {
  Json j;
  j["status"] = interrupted ? "interrupted" : summary.count(StressVerdict::wrong) > 0 ? "disagreement" : "ok";
  if (!summary.note.empty()) j["error"] = summary.note;
  j["warnings"] = summary.warnings;
  j["wall_s"] = summary.wall_s;
  j["counts"] = Json::object();
  for (const StressVerdict v : kVerdicts)
    j["counts"][v == StressVerdict::wrong ? "wrong" : name_of(v)] = summary.count(v);
  j["scenes"] = Json::array();
  for (const StressedScene& s : summary.scenes) {
    Json e = {{"scene", s.file}, {"title", s.title}, {"failed", s.failed.empty() ? Json(nullptr) : Json(s.failed)}};
    e["proven"] = s.failed.empty() && s.unjudged.empty();
    e["notes"] = s.notes;
    e["wall_s"] = s.wall_s;
    e["entries"] = Json::array();
    for (const StressEntry& x : s.entries) e["entries"].push_back(entry_json(x));
    j["scenes"].push_back(e);
  }
  return j;
}

std::string page_text(const StressSummary& summary) {
  HtmlPage page("At the extremes");
  if (!summary.note.empty()) page.paragraph(summary.note, true);
  page.paragraph(
      "Every run is judged against a reference of its own scene: two runs that share neither formulation nor "
      "integrator. "
      "It held what its tolerance claims; it warned; it refused, with the cause; it was cut for its time; or it is "
      "wrong "
      "in silence.");
  page.paragraph(
      "The bar is generous: held is what is within 10,000 tolerances of the size of psi and of each output (1e-4 at "
      "rtol "
      "1e-8), or 100 times what the reference's own formulations make of a tolerance along this motion, if that is "
      "more, and within 0.3 of it in any case. Soft constraints may cost 0.01. Of fixed steps it is held that smaller "
      "ones are not worse.");
  std::vector<std::string> wrong;
  for (const StressedScene& s : summary.scenes)
    for (const StressEntry& e : s.entries)
      if (e.verdict == StressVerdict::wrong) wrong.push_back(name_of_scene(s) + ", " + wrong_sentence(e));
  page.heading("Wrong in silence");
  if (wrong.empty())
    page.paragraph("None.");
  else
    page.list(wrong);
  page.heading("What held");
  std::vector<std::vector<std::string>> rows;
  for (const StressedScene& s : summary.scenes) {
    const auto own = axis_rows(s);
    rows.insert(rows.end(), own.begin(), own.end());
    std::string said = s.failed;
    if (said.empty() && !s.unjudged.empty()) said = "Not judged: " + s.unjudged + ".";
    for (const auto& n : s.notes) said += (said.empty() ? "" : " ") + n;
    if (!said.empty()) rows.push_back({name_of_scene(s), "", "", "", "", "", "", "", said});
  }
  page.table(
      {"scene", "extreme", "#held", "#warned", "#refused", "#cut", "#not judged", "#wrong", "first that did not hold"},
      rows);
  return page.text();
}

}  // namespace

std::size_t StressedScene::count(StressVerdict verdict) const {
  return static_cast<std::size_t>(
      std::count_if(entries.begin(), entries.end(), [&](const StressEntry& e) { return e.verdict == verdict; }));
}

std::string StressedScene::counts() const {
  if (!failed.empty()) return failed;
  std::string text;
  for (const StressVerdict v : kVerdicts)
    if (const std::size_t n = count(v); n > 0) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", n, name_of(v));
  return text.empty() ? "nothing was run" : text;
}

std::size_t StressSummary::count(StressVerdict verdict) const {
  std::size_t n = 0;
  for (const StressedScene& s : scenes) n += s.count(verdict);
  return n;
}

std::string drift_exponents(const std::vector<StressEntry>& entries) {
  std::string text;
  for (const StressEntry& once : entries)
    for (const StressEntry& ten : entries)
      if (once.axis == "long time" && ten.axis == once.axis && once.value == kOneTime && ten.value == kTenTimes &&
          once.what.name() == ten.what.name() && once.drift > 0 && ten.drift > 0 && !once.measure.empty() &&
          !ten.measure.empty())
        text += fmt::format("{}{} {:.1f} (to {:.0e})", text.empty() ? "" : ", ", once.what.name(),
                            std::log10(ten.drift / once.drift), ten.drift);
  return text;
}

std::vector<std::string> gradient_horizons(const std::vector<StressEntry>& entries) {
  std::vector<std::string> methods, sentences;
  for (const StressEntry& e : entries)
    if (!e.what.method.empty() && std::find(methods.begin(), methods.end(), e.what.name()) == methods.end())
      methods.push_back(e.what.name());
  for (const auto& name : methods) {
    const StressEntry *last = nullptr, *then = nullptr;
    for (const StressEntry& e : entries) {
      if (e.what.name() != name) continue;
      if (e.verdict == StressVerdict::held)
        last = &e, then = nullptr;
      else if (!then)
        then = &e;
    }
    std::string text = "Gradient, " + name + ": ";
    text += last ? fmt::format("digits until {} (off by {:.0e})", last->value, last->error) : "no digits";
    if (then)
      text +=
          fmt::format("; {}: {}{}{}", then->value, name_of(then->verdict), then->why.empty() ? "" : ": ", then->why);
    sentences.push_back(text + (text.ends_with('.') ? "" : "."));
  }
  return sentences;
}

void finish_stress(const StressSummary& summary, const CommonOptions& common, const std::filesystem::path& directory,
                   bool interrupted) {
  const std::string object = json_text(summary_json(summary, interrupted)) + "\n";
  std::string text;
  for (const StressedScene& s : summary.scenes) {
    text += fmt::format("{}: {}\n", name_of_scene(s), s.counts());
    if (!s.unjudged.empty()) text += fmt::format("  not judged: {}\n", s.unjudged);
    for (const StressEntry& e : s.entries)
      if (e.verdict == StressVerdict::wrong) text += "  WRONG in silence: " + wrong_sentence(e) + "\n";
  }
  if (!summary.note.empty()) text += summary.note + "\n";
  if (!common.no_files) {
    write_file_atomically(directory / "stress.html", page_text(summary));
    write_file_atomically(directory / "stress.json", object);
    text += fmt::format("  page: {}\n  summary: {}\n", (directory / "stress.html").string(),
                        (directory / "stress.json").string());
  }
  print_warnings(summary.warnings);
  if (common.json)
    fmt::print("{}", object);
  else if (!common.quiet)
    fmt::print("{}", text);
}

}  // namespace costate::app
