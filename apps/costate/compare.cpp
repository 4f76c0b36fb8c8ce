// costate compare: two scenes, typically a reduced and a full model of the same thing, over the same time: how far
// their outputs, costs and gradients are apart, and what each costs to run. The second one is what the first is
// measured by.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "command.h"
#include "compare_side.h"
#include "costate/base/notice.h"
#include "costate/integrator/run_end.h"
#include "costate/objective/output.h"
#include "digits.h"
#include "named_outputs.h"
#include "page/command_pages.h"
#include "run_pages.h"

namespace costate::app {

namespace {

struct CompareOptions {
  std::string other;
  std::vector<std::string> outputs, set_a, set_b;
  long samples = 1000;
  bool no_gradient = false;
};

struct OutputDifference {
  std::string name, unit;
  double largest = 0, at_s = 0, rms = 0;
  double range = 0;       // of B
  bool constant = false;  // B's, within 100 times its relative tolerance: then nothing is relative to its range
  std::optional<double> relative(double x) const { return constant ? std::nullopt : std::optional(x / range); }
};

class Compare {
 public:
  Compare(const CommonOptions& common, const CompareOptions& options)
      : common_(common),
        options_(options),
        a_(make_compare_side(common, common.scene, options.set_a, !options.no_gradient)),
        b_(make_compare_side(common, options.other, options.set_b, !options.no_gradient)),
        progress_(a_.setup.progress_options) {}

  int run() {
    if (options_.samples < 1 || options_.samples > 10'000'000)
      throw Error(fmt::format("--samples must lie between 1 and 10000000, found {}.", options_.samples));
    same_time();
    choose_outputs();
    choose_parameters();
    std::vector<std::string> notices;
    for (CompareSide* side : {&a_, &b_}) {
      side->setup.problem.monitor = monitor(progress_, side->setup.problem.solver.t_end);
      progress_.start(side->setup.problem.solver.t_start);
      side->run(end_, options_.samples, outputs_, !parameters_.empty());
      for (const auto& sentence : take_notices())
        notices.push_back(fmt::format("{}: {}", side == &a_ ? "A" : "B", sentence));
    }
    for (const auto& sentence : notices) notice(sentence);
    progress_.finish();
    for (const auto& name : outputs_) differences_.push_back(difference(name));
    const auto stem = [](const std::string& file) { return std::filesystem::path(file).stem().string(); };
    if (!a_.setup.directory_chosen)
      a_.setup.directory = std::filesystem::path("results") / (stem(common_.scene) + "_vs_" + stem(options_.other));
    CommonOptions plain = common_;
    plain.verbose = false;  // the details of a single run
    const Json j = json();
    const std::string page =
        written_page(a_.setup, "compare.html", compare_page(a_.setup, j, text(), a_.motion, b_.motion));
    report(a_.setup, plain, j, text() + page, "compare.json");
    return 0;
  }

 private:
  void same_time() {
    SolverOptions &a = a_.setup.problem.solver, &b = b_.setup.problem.solver;
    if (a.t_start != b.t_start)
      throw Error(
          fmt::format("The scenes start at different times, {} s and {} s; set run.t_start_s, for example with "
                      "--set-a run.t_start_s={}.",
                      a.t_start, b.t_start, b.t_start));
    // Motions that end by themselves are compared as far as they both go; psi and gradient are those of the whole runs.
    if (a_.setup.problem.ends_when || b_.setup.problem.ends_when) {
      const auto end_of = [](CompareSide& side) {
        return side.setup.located([&] { return until_its_end(side.setup.problem, side.setup.rho).solver.t_end; });
      };
      const double end_a = end_of(a_), end_b = end_of(b_);
      end_ = std::min(end_a, end_b);
      if (end_a != end_b)
        notes_.push_back(fmt::format("The runs end at {:.9g} s and {:.9g} s; their motions are compared to {:.9g} s.",
                                     end_a, end_b, end_));
      return;
    }
    if (a.t_end != b.t_end)
      notes_.push_back(fmt::format("The scenes end at {:g} s and {:g} s; both were run to {:g} s.", a.t_end, b.t_end,
                                   std::min(a.t_end, b.t_end)));
    end_ = a.t_end = b.t_end = std::min(a.t_end, b.t_end);
  }

  /// Those asked for, which both must have; or what either names in its cost or in [run], as far as both have it.
  void choose_outputs() {
    const auto of_a = output_names(a_.mechanism()), of_b = output_names(b_.mechanism());
    const auto has = [](const std::vector<std::string>& names, const std::string& name) {
      return std::find(names.begin(), names.end(), name) != names.end();
    };
    for (const auto& name : options_.outputs) {
      if (name == "time") throw Error("--outputs: 'time' is the same in both motions; name what is a function of it.");
      for (const auto& [names, scene] : {std::pair(&of_a, common_.scene), std::pair(&of_b, options_.other)})
        if (!has(*names, name))
          throw Error(
              fmt::format("--outputs: There is no output '{}' to compare in '{}'.{} 'costate list SCENE' names them.",
                          name, scene, suggestion(name, *names)));
      if (!has(outputs_, name)) outputs_.push_back(name);
    }
    if (options_.outputs.empty()) {
      std::vector<std::string> names = outputs_of_interest(b_.setup.scene);
      for (const auto& name : outputs_of_interest(a_.setup.scene))
        if (!has(names, name)) names.push_back(name);
      for (const auto& name : names)
        if (name == "time")
          continue;
        else if (has(of_a, name) && has(of_b, name))
          outputs_.push_back(name);
        else
          notes_.push_back(fmt::format("Output {} exists only in {}.", name, has(of_a, name) ? "A" : "B"));
    }
    if (outputs_.empty())
      throw Error(
          "There is nothing to compare: no output that a cost or [run] outputs names exists in both scenes. "
          "Name some that do with --outputs.");
    for (const auto& name : outputs_) {
      const std::string a = make_output(a_.mechanism(), name)->unit(), b = make_output(b_.mechanism(), name)->unit();
      if (a != b)
        throw Error(fmt::format("Output '{}' is in {} in '{}' but in {} in '{}'; choose others with --outputs.", name,
                                a, common_.scene, b, options_.other));
    }
  }

  void choose_parameters() {
    if (options_.no_gradient || !a_.has_cost() || !b_.has_cost()) return;
    const auto accepts = [](const CompareSide& side, const std::string& name) {
      try {
        side.mechanism().select({name});
        return true;
      } catch (const Error&) {
        return false;
      }
    };
    for (const CompareSide* side : {&b_, &a_})
      for (const auto& name : side->setup.problem.parameters.names())
        if (std::find(parameters_.begin(), parameters_.end(), name) == parameters_.end()) {
          if (accepts(a_, name) && accepts(b_, name))
            parameters_.push_back(name);
          else
            notes_.push_back(fmt::format("Parameter {} exists only in {}.", name, accepts(a_, name) ? "A" : "B"));
        }
    if (parameters_.empty()) return;
    for (CompareSide* side : {&a_, &b_}) {
      side->setup.problem.parameters = side->mechanism().select(parameters_);
      side->setup.rho = side->setup.problem.parameters.values();
    }
    for (std::size_t i = 0; i < parameters_.size(); ++i)
      if (a_.setup.rho[i] != b_.setup.rho[i])
        notes_.push_back(
            fmt::format("Parameter {} is {:.9g} in A, {:.9g} in B.", parameters_[i], a_.setup.rho[i], b_.setup.rho[i]));
  }

  OutputDifference difference(const std::string& name) const {
    const Column *a = column_of_output(a_.motion, name), *b = column_of_output(b_.motion, name);
    if (a == nullptr || b == nullptr) throw Error(fmt::format("Output '{}' was not recorded.", name));
    const std::vector<double>& t = b_.motion.time_s;
    OutputDifference d{name, b->unit};
    const auto [low, high] = std::minmax_element(b->values.begin(), b->values.end());
    d.range = *high - *low;
    const double rtol = b_.setup.problem.solver.rtol;
    d.constant = !(d.range > 100 * rtol * std::max(std::abs(*low), std::abs(*high)));
    double integral = 0;  // of the squared difference, by the trapezoidal rule
    for (std::size_t k = 0; k < t.size(); ++k) {
      const double apart = std::abs(a->values[k] - b->values[k]);
      if (apart > d.largest) d.largest = apart, d.at_s = t[k];
      const double width = (k > 0 ? t[k] - t[k - 1] : 0) + (k + 1 < t.size() ? t[k + 1] - t[k] : 0);
      integral += apart * apart * width / 2;
    }
    d.rms = std::sqrt(integral / (t.back() - t.front()));
    return d;
  }

  bool compares_gradients() const { return !parameters_.empty(); }
  double scaled(const CompareSide& side, std::size_t i) const {
    return side.result.gradient[i] * b_.setup.problem.parameters.parameters[i].scale;
  }
  /// The difference of one component relative to B's largest, all in B's scaled parameters.
  std::optional<double> gradient_difference(std::size_t i) const {
    double largest = 0;
    for (std::size_t j = 0; j < parameters_.size(); ++j) largest = std::max(largest, std::abs(scaled(b_, j)));
    return largest > 0 ? std::optional((scaled(a_, i) - scaled(b_, i)) / largest) : std::nullopt;
  }
  /// Of the angle between the gradients: 1 where an optimizer would go the same way.
  std::optional<double> cosine() const {
    double ab = 0, aa = 0, bb = 0;
    for (std::size_t i = 0; i < parameters_.size(); ++i) {
      ab += scaled(a_, i) * scaled(b_, i);
      aa += scaled(a_, i) * scaled(a_, i);
      bb += scaled(b_, i) * scaled(b_, i);
    }
    return aa > 0 && bb > 0 ? std::optional(ab / std::sqrt(aa * bb)) : std::nullopt;
  }
  std::optional<double> psi_relative() const {
    const double a = a_.result.psi, b = b_.result.psi;
    return b != 0 ? std::optional((a - b) / std::abs(b)) : std::nullopt;
  }
  static std::string percent(const std::optional<double>& x) { return x ? fmt::format("{:.3g} %", 100 * *x) : "-"; }
  std::string cost_difference() const {
    const double apart = a_.result.psi - b_.result.psi, known = psi_uncertainty(a_) + psi_uncertainty(b_);
    if (apart != 0 && std::abs(apart) <= known)
      return fmt::format("psi of A is that of B, to the digits that tolerances hold (they differ by {:.1g})", apart);
    return fmt::format("psi of A is that of B {}{} ({})", apart < 0 ? "" : "+", known_digits(apart, known),
                       percent(psi_relative()));
  }
  static double psi_uncertainty(const CompareSide& side) {
    const std::optional<KnownError>& known = side.result.known_error;
    return std::max(uncertainty_of(side.result.psi, relative(side)), known ? known->psi : 0);
  }
  static std::string digits(const CompareSide& side) { return known_digits(side.result.psi, psi_uncertainty(side)); }
  static double relative(const CompareSide& side) {
    return precision_of(side.setup.problem.solver, side.result.integrator, side.result.counters.steps).relative;
  }
  static std::string component(const CompareSide& side, std::size_t i) {
    const GradientResult& r = side.result;
    return known_digits(r.gradient[i], gradient_digits(r.gradient, side.setup.problem.parameters, relative(side),
                                                       r.gradient_error, r.known_error)
                                           .unknown[i]);
  }
  bool compares_costs() const { return a_.has_cost() && b_.has_cost(); }

  static Json optional_json(const std::optional<double>& x) { return x ? Json(*x) : Json(); }

  Json side_json(const CompareSide& side) const {
    Json j = run_json(side.setup, side.result, compares_gradients() ? side.setup.method : "", side.simulation_s);
    if (!side.has_cost()) j["psi"] = nullptr;
    if (const auto of_psi = psi_error_of({}, side.result.known_error)) j["psi_error"] = *of_psi;
    if (!compares_gradients()) j["parameters"] = Json::object();
    j["coordinates"] = side.mechanism().coordinate_count();
    j["multipliers"] = side.mechanism().row_count();
    j["states"] = side.mechanism().state_count();
    j["gradient_wall_s"] = compares_gradients() ? Json(side.gradient_s) : Json();
    return j;
  }

  Json json() const {
    Json j;
    j["status"] = "ok";
    j["t_start_s"] = b_.setup.problem.solver.t_start;
    j["t_end_s"] = end_;
    j["a"] = side_json(a_);
    j["b"] = side_json(b_);
    j["outputs"] = Json::array();
    for (const auto& d : differences_)
      j["outputs"].push_back({{"name", d.name},
                              {"unit", d.unit},
                              {"range", d.range},
                              {"largest", d.largest},
                              {"at_s", d.at_s},
                              {"rms", d.rms},
                              {"largest_relative", optional_json(d.relative(d.largest))},
                              {"rms_relative", optional_json(d.relative(d.rms))}});
    j["psi_difference"] = compares_costs() ? Json(a_.result.psi - b_.result.psi) : Json();
    j["psi_relative"] = compares_costs() ? optional_json(psi_relative()) : Json();
    j["gradient_difference"] = nullptr;
    if (compares_gradients()) {
      j["gradient_difference"] = Json::object();
      for (std::size_t i = 0; i < parameters_.size(); ++i)
        j["gradient_difference"][parameters_[i]] = optional_json(gradient_difference(i));
    }
    j["gradient_cosine"] = compares_gradients() ? optional_json(cosine()) : Json();
    j["time_ratio"] = a_.simulation_s / b_.simulation_s;
    j["notes"] = notes_;
    return j;
  }

  std::string text() const {
    const auto title = [](const char* label, const CompareSide& s, const std::string& file) {
      return fmt::format("{}: {}{}\n", label, file, s.setup.scene.title.empty() ? "" : ", " + s.setup.scene.title);
    };
    std::string t = title("A", a_, common_.scene) + title("B", b_, options_.other);
    t +=
        fmt::format("t = {:g} .. {:g} s, {} samples\n", b_.setup.problem.solver.t_start, end_, b_.motion.time_s.size());
    for (const auto& note : notes_) t += "  " + note + "\n";

    t += fmt::format("\n  {:<22} {:>14} {:>14} {:>10}\n", "", "A", "B", "A / B");
    const auto row = [&](const char* name, double a, double b) {
      t +=
          fmt::format("  {:<22} {:>14.9g} {:>14.9g} {:>10}\n", name, a, b, b != 0 ? fmt::format("{:.3g}", a / b) : "-");
    };
    row("coordinates", a_.mechanism().coordinate_count(), b_.mechanism().coordinate_count());
    row("multipliers", a_.mechanism().row_count(), b_.mechanism().row_count());
    row("force states", a_.mechanism().state_count(), b_.mechanism().state_count());
    row("steps", static_cast<double>(a_.result.counters.steps), static_cast<double>(b_.result.counters.steps));
    row("simulation [s]", rounded(a_.simulation_s), rounded(b_.simulation_s));
    if (compares_gradients()) row("gradient [s]", rounded(a_.gradient_s), rounded(b_.gradient_s));
    if (compares_costs())
      t += fmt::format("  {:<22} {:>14} {:>14} {:>10}\n", "psi", digits(a_), digits(b_),
                       b_.result.psi != 0 ? fmt::format("{:.3g}", a_.result.psi / b_.result.psi) : "-");

    std::size_t width = 9;
    for (const auto& d : differences_) width = std::max(width, d.name.size() + d.unit.size() + 3);
    t += fmt::format("\n  {:<{}} {:>12} {:>13} {:>9} {:>10} {:>10} {:>10}\n", "output", width, "range of B",
                     "largest diff.", "at [s]", "rms diff.", "largest", "rms");
    for (const auto& d : differences_)
      t += fmt::format("  {:<{}} {:>12.5g} {:>13.3g} {:>9.4g} {:>10.3g} {:>10} {:>10}\n",
                       fmt::format("{} [{}]", d.name, d.unit), width, d.range, d.largest, d.at_s, d.rms,
                       percent(d.relative(d.largest)), percent(d.relative(d.rms)));
    if (compares_costs()) t += "\n  " + cost_difference() + "\n";
    if (!compares_gradients()) return t;
    std::size_t letters = 9;
    for (const auto& p : parameters_) letters = std::max(letters, p.size());
    t += fmt::format("\n  {:<{}} {:>16} {:>16} {:>12}\n", "d(psi)/d", letters, "A", "B", "difference");
    for (std::size_t i = 0; i < parameters_.size(); ++i)
      t += fmt::format("  {:<{}} {:>16} {:>16} {:>12}\n", parameters_[i], letters, component(a_, i), component(b_, i),
                       percent(gradient_difference(i)));
    const auto c = cosine();
    t += fmt::format("  (of B's largest, in scaled parameters); cosine of the angle between them: {}\n",
                     c ? fmt::format("{:.6g}", *c) : "-");
    return t;
  }

  const CommonOptions& common_;
  const CompareOptions& options_;
  CompareSide a_, b_;
  Progress progress_;
  std::vector<std::string> outputs_, parameters_, notes_;
  double end_ = 0;  // to which motions are compared
  std::vector<OutputDifference> differences_;
};

}  // namespace

const RegisterCommand compare_command(
    CommandGroup::judge, "compare", "Two scenes over the same time: differences of outputs, cost, gradient, effort",
    [](Command& c, CommonOptions& common) {
      auto options = std::make_shared<CompareOptions>();
      common.add_to(c);
      c.existing("scene").text("Scene A, the reduced one (TOML)");
      c.option("other", options->other, "Scene B, which A is measured by (TOML)").required();
      common.add_run_options(c);
      c.existing("--output").text("Directory for result files (default: results/A_vs_B)");
      c.existing("--parameters").text("Of the gradients, separated by commas (default: those that both scenes have)");
      c.option("--outputs", options->outputs,
               "Outputs to compare, separated by commas (default: those of cost and [run])")
          .separated();
      const auto add_set = [&](const char* name, std::vector<std::string>& set, const char* text) {
        c.option(name, set, text).value_name("PATH=VALUE").repeatable();
      };
      add_set("--set-a", options->set_a, "Like --set, in scene A only (repeatable)");
      add_set("--set-b", options->set_b, "Like --set, in scene B only (repeatable)");
      c.option("--samples", options->samples, "Intervals between samples of the outputs").shows_default();
      c.flag("--no-gradient", options->no_gradient, "Compare no gradients");
      c.runs([&common, options] { return Compare(common, *options).run(); });
    });

}  // namespace costate::app
