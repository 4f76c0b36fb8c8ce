// costate regress: scenes run against stored results; what moved, by how much, and the baselines renewed on
// request.
#include <fmt/format.h>
#include <fnmatch.h>

#include <chrono>
#include <cmath>

#include "baseline.h"
#include "costate/base/error.h"
#include "costate/record/atomic_file.h"
#include "costate/record/interrupt.h"
#include "costate/record/print.h"
#include "page/command_pages.h"

namespace costate::app {

namespace {

namespace fs = std::filesystem;

struct RegressOptions {
  std::string directory;
  std::vector<std::string> only;
  bool update = false;
};

/// One quantity of a case that was run.
struct Comparison {
  Quantity expected;  // as in the file now, after an update
  std::optional<double> before, found;
  bool moved = false;    // beyond its tolerance
  bool updated = false;  // in the file
};

struct Case {
  std::string name;  // the file below the directory, without .json
  fs::path file;
  std::string scene, command, error;
  std::vector<Comparison> comparisons;
  double wall_s = 0;
  bool written = false;

  bool moved() const {
    return std::any_of(comparisons.begin(), comparisons.end(),
                       [](const Comparison& c) { return c.moved && !c.updated; });
  }
  const char* status() const { return !error.empty() ? "failed" : moved() ? "moved" : written ? "updated" : "ok"; }
};

std::string shift_text(const Comparison& c) {
  const double by = *c.found - *c.before;
  std::string text = fmt::format("{}: {:.12g} -> {:.12g}, by {:.2e}", c.expected.name, *c.before, *c.found, by);
  if (*c.before != 0) text += fmt::format(" ({:.1e} relative)", std::abs(by / *c.before));
  return text + fmt::format(", allowed {:.1e}", c.expected.allowed());
}

class Regression {
 public:
  Regression(const CommonOptions& common, const RegressOptions& options) : common_(common), options_(options) {}

  int run() {
    if (common_.no_files && options_.update)
      throw Error("--update writes what moved into the baselines, so it excludes --no-files.");
    if (!common_.overrides.empty() && options_.update)
      throw Error(
          "--set asks what other values would move, so it excludes --update: a baseline's own values are its "
          "options, {\"set\": [\"path=value\"]}.");
    if (!common_.output.empty() && !common_.no_files) require_writable(common_.output);
    collect();
    int interruption = 0;
    std::string message;
    std::size_t done = 0;
    try {
      for (Case& c : cases_) {
        throw_if_interrupted();
        run_case(c);
        ++done;
        tell(c);
      }
    } catch (const Interrupted& e) {
      interruption = e.signal_number();
      message = fmt::format("{} {} of {} baselines had been run; their results stand{}.", e.what(), done, cases_.size(),
                            options_.update ? ", and those updated are updated" : "");
      cases_.resize(done);
    }
    return finish(interruption, message);
  }

 private:
  /// The baselines of the directory, or the one file, that --only selects.
  void collect() {
    const fs::path root = options_.directory;
    const std::string example = fmt::format(
        "A baseline is a file such as '{}' with {{\"scene\": \"PATH OF THE SCENE FROM THERE\", \"command\": "
        "\"gradient\"}}; "
        "'costate regress {} --update' fills in the quantities.",
        (root / "NAME.json").string(), root.string());
    std::error_code code;
    if (fs::is_regular_file(root, code)) {
      cases_.push_back({root.stem().string(), root, {}, {}, {}, {}, 0, false});
    } else {
      if (!fs::exists(root, code)) throw Error(fmt::format("There is no directory '{}'. {}", root.string(), example));
      if (!fs::is_directory(root, code)) throw Error(fmt::format("'{}' is not a directory.", root.string()));
      for (const auto& entry : fs::recursive_directory_iterator(root))
        if (entry.path().extension() == ".json" && entry.is_regular_file())
          cases_.push_back({fs::path(entry.path()).lexically_relative(root).replace_extension().string(),
                            entry.path(),
                            {},
                            {},
                            {},
                            {},
                            0,
                            false});
      if (cases_.empty()) throw Error(fmt::format("There is no baseline (*.json) in '{}'. {}", root.string(), example));
    }
    std::sort(cases_.begin(), cases_.end(), [](const Case& a, const Case& b) { return a.name < b.name; });
    select();
    for (const Case& c : cases_) width_ = std::max(width_, c.name.size());
  }

  void select() {
    if (options_.only.empty()) return;
    std::vector<std::string> names;
    for (const Case& c : cases_) names.push_back(c.name);
    for (const auto& pattern : options_.only)
      if (std::none_of(names.begin(), names.end(), [&](const auto& n) { return matches(pattern, n); }))
        throw Error(fmt::format("--only: No baseline of '{}' is called '{}'.{}", options_.directory, pattern,
                                suggestion(pattern, names)));
    std::erase_if(cases_, [&](const Case& c) {
      return std::none_of(options_.only.begin(), options_.only.end(),
                          [&](const auto& p) { return matches(p, c.name); });
    });
  }

  static bool matches(const std::string& pattern, const std::string& name) {
    return ::fnmatch(pattern.c_str(), name.c_str(), 0) == 0;
  }

  void run_case(Case& c) {
    const auto begin = std::chrono::steady_clock::now();
    try {
      Baseline baseline = Baseline::load(c.file);
      c.scene = baseline.scene;
      c.command = baseline.command;
      try {
        compare(c, baseline, measure(baseline, common_.quiet || common_.json, common_.overrides));
      } catch (const Interrupted&) {
        throw;
      } catch (const std::exception& e) {
        throw Error(fmt::format("{}: {}", c.file.string(), e.what()));
      }
    } catch (const Interrupted&) {
      throw;
    } catch (const std::exception& e) {
      c.error = e.what();
    }
    c.wall_s = seconds_since(begin);
  }

  void compare(Case& c, Baseline& baseline, const Measurement& m) {
    if (baseline.quantities.empty()) {
      if (!options_.update)
        throw Error(
            "There are no quantities yet. 'costate regress --update' fills in those of the command; or name "
            "some: "
            "{\"quantities\": {\"psi\": {}}}.");
      for (const Quantity& q : m.defaults) baseline.quantities.push_back({q.name, {}, {}, {}, {}});
    }
    std::vector<std::string> problems;
    for (Quantity& q : baseline.quantities) {
      Comparison r{q, q.value, {}, false, false};
      if (const double* found = m.find(q.name)) r.found = *found;
      if (!r.found || !std::isfinite(*r.found)) {
        problems.push_back(missing(q.name, m));
      } else if (!q.value && !options_.update) {
        problems.push_back(
            fmt::format("quantities.{}: There is no value yet (found now: {:.12g}); 'costate regress "
                        "--update' fills it in.",
                        q.name, *r.found));
      } else {
        r.moved = q.value && !(std::abs(*r.found - *q.value) <= q.allowed());
        r.updated = options_.update && (r.moved || !q.value);
        if (r.updated) {
          q.value = *r.found;
          if (!q.has_tolerance()) {
            const Quantity d = m.with_default(q.name);
            q.relative = d.relative;
            q.absolute = d.absolute;
            q.reason = d.reason;
          }
        }
      }
      r.expected = q;
      c.comparisons.push_back(r);
    }
    std::string text;
    for (const auto& p : problems) text += (text.empty() ? "" : "\n    ") + p;
    if (!problems.empty()) {
      for (Comparison& r : c.comparisons) r.updated = false;  // a file with a mistake stays as it is
      throw Error(text);
    }
    if (std::any_of(c.comparisons.begin(), c.comparisons.end(), [](const Comparison& r) { return r.updated; })) {
      try {
        baseline.write();
      } catch (...) {
        for (Comparison& r : c.comparisons) r.updated = false;
        throw;
      }
      c.written = true;
    }
  }

  static std::string missing(const std::string& name, const Measurement& m) {
    if (const double* found = m.find(name))
      return fmt::format("quantities.{}: It is {} now, which is no result to keep.", name, *found);
    std::vector<std::string> names;
    for (const auto& [n, value] : m.numbers)
      if (n.rfind("settings.", 0) != 0) names.push_back(n);
    const std::string near = nearest_name(name, names);
    std::string known;
    for (const Quantity& q : m.defaults) known += (known.empty() ? "" : ", ") + q.name;
    return fmt::format(
        "quantities.{}: The result has no such number; correct or remove it.{}", name,
        near.empty() ? fmt::format(" It has, among others: {}.", known) : fmt::format(" Did you mean '{}'?", near));
  }

  /// The lines of one case, as soon as it is done.
  void tell(const Case& c) const {
    if (!c.error.empty()) print_message(c.error);
    std::string text;
    if (c.error.empty()) {
      const bool moved = c.moved();
      text = fmt::format("{:<8} {:<{}} {:>3} quantities, {:.3g} s\n", moved ? "MOVED" : c.status(), c.name, width_,
                         c.comparisons.size(), c.wall_s);
      for (const Comparison& r : c.comparisons) {
        if (!r.moved && !r.updated) continue;
        text += "           ";
        text += r.before ? shift_text(r) + "\n"
                         : fmt::format("{}: {:.12g}, new, allowed {:.1e}\n", r.expected.name, *r.found,
                                       r.expected.allowed());
        if (r.moved && !r.updated) {
          if (!r.expected.reason.empty()) text += fmt::format("             ({})\n", r.expected.reason);
          print_message(fmt::format("moved: {}: {}", c.name, shift_text(r)));
        }
      }
    } else {
      text = fmt::format("{:<8} {}\n", "FAILED", c.name);
    }
    if (common_.json || common_.quiet) return;
    print_result(text);
    std::fflush(stdout);
  }

  int finish(int interruption, const std::string& message) const {
    const auto count = [&](std::string_view status) {
      return std::count_if(cases_.begin(), cases_.end(), [&](const Case& c) { return c.status() == status; });
    };
    const auto moved = count("moved"), failed = count("failed"), updated = count("updated");
    Json j;
    j["status"] = interruption != 0 ? "interrupted" : failed > 0 ? "failed" : moved > 0 ? "moved" : "ok";
    if (!message.empty()) j["error"] = message;
    j["directory"] = Json::parse(json_text(options_.directory));
    j["moved"] = moved;
    j["failed"] = failed;
    j["updated"] = updated;
    j["cases"] = Json::array();
    for (const Case& c : cases_) j["cases"].push_back(case_json(c));
    std::string text =
        fmt::format("{} baseline{}: {} moved, {} failed", cases_.size(), cases_.size() == 1 ? "" : "s", moved, failed);
    if (options_.update) text += fmt::format(", {} updated", updated);
    text += "\n";
    if (moved > 0) text += "Where a move is meant, 'costate regress --update' writes the new values; review them.\n";
    if (!common_.output.empty() && !common_.no_files) {
      write_file_atomically(common_.output / "regress.html", regress_page(j, text));
      text += fmt::format("  report: {}\n", (common_.output / "regress.html").string());
    }
    if (common_.json)
      fmt::print("{}\n", json_text(j));
    else if (!common_.quiet)
      print_result(text);
    if (interruption != 0) {
      print_message(message);
      return 128 + interruption;
    }
    return moved + failed > 0 ? kFailed : 0;
  }

  static Json case_json(const Case& c) {
    Json j;
    j["name"] = c.name;
    j["file"] = c.file.string();
    j["scene"] = c.scene;
    j["command"] = c.command;
    j["status"] = c.status();
    if (!c.error.empty()) j["error"] = c.error;
    j["wall_s"] = c.wall_s;
    j["quantities"] = Json::array();
    const auto number = [](const std::optional<double>& x) { return x ? Json(*x) : Json(nullptr); };
    for (const Comparison& r : c.comparisons)
      j["quantities"].push_back({{"name", r.expected.name},
                                 {"expected", number(r.before)},
                                 {"found", number(r.found)},
                                 {"difference", r.before && r.found ? Json(*r.found - *r.before) : Json(nullptr)},
                                 {"allowed", r.expected.has_tolerance() ? Json(r.expected.allowed()) : Json(nullptr)},
                                 {"moved", r.moved},
                                 {"updated", r.updated},
                                 {"reason", r.expected.reason}});
    return j;
  }

  const CommonOptions& common_;
  const RegressOptions& options_;
  std::vector<Case> cases_;
  std::size_t width_ = 0;  // of their names
};

}  // namespace

const RegisterCommand regress_command(
    CommandGroup::judge, "regress", "Run scenes against stored results and say what moved",
    [](Command& c, CommonOptions& common) {
      auto options = std::make_shared<RegressOptions>();
      c.option("directory", options->directory, "Directory with baselines (*.json, also below), or one baseline")
          .required();
      c.option("--only", options->only, "Only baselines of this name; * and ? stand for anything (repeatable)")
          .value_name("PATTERN")
          .separated();
      c.option("--set", common.overrides, "Replace a value of every baseline's scene: path=value (repeatable)")
          .value_name("PATH=VALUE")
          .repeatable();
      c.flag("--update", options->update, "Write what moved, and what has no value yet, into the baselines");
      c.flag("--no-files", common.no_files, "Write no files, which is so without --update");
      c.option("--output", common.output, "Directory for regress.html, a page with what moved (default: none)");
      c.flag("--json", common.json, "Print one JSON object and nothing else");
      c.flag("--quiet", common.quiet, "Print errors and moves only");
      c.footer(
          "A baseline: {\"scene\": \"PATH FROM THE FILE\", \"command\": \"simulate, gradient or optimize\", "
          "\"options\": "
          "{\"rtol\": 1e-8}, \"quantities\": {...}}; --update fills in the quantities.");
      c.runs([&common, options] { return Regression(common, *options).run(); });
    });

}  // namespace costate::app
