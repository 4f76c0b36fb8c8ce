#include "costate/objective/formula_output.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "costate/base/error.h"
#include "costate/objective/objective.h"
#include "costate/objective/sampled_cost.h"

namespace costate {

namespace {
constexpr std::size_t kMost = DefinedOutput::kMostNames;
}

FormulaOutput::FormulaOutput(const DefinedOutput& definition, std::vector<std::unique_ptr<Output>> inputs)
    : Output(definition.name(), definition.unit()), definition_(definition), inputs_(std::move(inputs)) {
  accelerations_ = std::any_of(inputs_.begin(), inputs_.end(), [](const auto& y) { return y->needs_accelerations(); });
}

/// The formula's arguments: its numbers, then the outputs.
struct FormulaOutput::Arguments {
  std::array<double, kMost> x{};
  std::size_t numbers, count;

  Arguments(const FormulaOutput& f, const StateView& s, Assembly& assembly)
      : numbers(f.definition_.numbers().size()), count(numbers + f.inputs_.size()) {
    for (std::size_t k = 0; k < numbers; ++k)
      x[k] = assembly.numbers()[static_cast<std::size_t>(f.definition_.numbers()[k])];
    for (std::size_t i = 0; i < f.inputs_.size(); ++i)
      x[numbers + i] = !s.a && f.inputs_[i]->needs_accelerations() ? 1 : f.inputs_[i]->value(s, assembly);
  }
  /// On straight lines along the variation.
  std::array<PathDual, kMost> along(const FormulaOutput& f, const StateView& s, Assembly& assembly,
                                    const Variation& d) const {
    std::array<PathDual, kMost> y;
    for (std::size_t k = 0; k < numbers; ++k) y[k] = PathDual(Taylor2(x[k], d.numbers[f.definition_.numbers()[k]], 0));
    for (std::size_t i = 0; i < f.inputs_.size(); ++i)
      y[numbers + i] = PathDual(Taylor2(x[numbers + i], f.inputs_[i]->change(s, assembly, d), 0));
    return y;
  }
};

double FormulaOutput::value(const StateView& s, Assembly& assembly) const {
  const Arguments a(*this, s, assembly);
  return definition_.formula().value(s.t, a.x.data());
}

void FormulaOutput::arguments(const StateView& s, Assembly& assembly, double* x) const {
  const Arguments a(*this, s, assembly);
  std::copy_n(a.x.begin(), a.count, x);
}

double FormulaOutput::shifted_value(const StateView& s, Assembly& assembly, std::size_t i, double shift) const {
  Arguments a(*this, s, assembly);
  a.x[a.numbers + i] += shift;
  return definition_.formula().value(s.t, a.x.data());
}

void FormulaOutput::add_gradient(const StateView& s, Assembly& assembly, double factor, ScalarGradient& g) const {
  const Arguments a(*this, s, assembly);
  std::array<PathDual, kMost> x;
  for (std::size_t k = 0; k < a.count; ++k) x[k] = PathDual(a.x[k]);
  for (std::size_t k = 0; k < a.count; ++k) {
    if (k < a.numbers && assembly.number_columns()[definition_.numbers()[k]].empty()) continue;
    x[k].d[0] = Taylor2(1.0);
    const double slope = factor * definition_.formula().value(PathDual(s.t), x.data()).d[0].c0;
    x[k].d[0] = Taylor2(0.0);
    if (k < a.numbers)
      g.add_number(assembly, definition_.numbers()[k], slope);
    else
      inputs_[k - a.numbers]->add_gradient(s, assembly, slope, g);
  }
}

double FormulaOutput::change(const StateView& s, Assembly& assembly, const Variation& d) const {
  const auto x = Arguments(*this, s, assembly).along(*this, s, assembly, d);
  return definition_.formula().value(PathDual(Taylor2(s.t, d.t, 0)), x.data()).v.c1;
}

// The gradient is the sum of f_i y_i,x: both factors change.
void FormulaOutput::add_gradient_change(const StateView& s, Assembly& assembly, const Variation& d, double factor,
                                        ScalarGradient& g) const {
  const Arguments a(*this, s, assembly);
  auto x = a.along(*this, s, assembly, d);
  for (std::size_t k = 0; k < a.count; ++k) {
    if (k < a.numbers && assembly.number_columns()[definition_.numbers()[k]].empty()) continue;
    x[k].d[0] = Taylor2(1.0);
    const Taylor2 slope = definition_.formula().value(PathDual(Taylor2(s.t, d.t, 0)), x.data()).d[0];
    x[k].d[0] = Taylor2(0.0);
    if (k < a.numbers) {
      g.add_number(assembly, definition_.numbers()[k], factor * slope.c1);
    } else {
      inputs_[k - a.numbers]->add_gradient(s, assembly, factor * slope.c1, g);
      inputs_[k - a.numbers]->add_gradient_change(s, assembly, d, factor * slope.c0, g);
    }
  }
}

std::optional<std::vector<int>> FormulaOutput::depends_on() const {
  std::vector<int> all;
  for (const auto& input : inputs_) {
    const auto of_input = input->depends_on();
    if (!of_input) return std::nullopt;
    all.insert(all.end(), of_input->begin(), of_input->end());
  }
  return all;
}

void FormulaOutput::add_course(const std::vector<double>& numbers, Course& course) const {
  if (!definition_.formula().varies()) return;
  // What the outputs will be is not known; at one the terms of the time are as large as they are by themselves.
  std::array<double, kMost> x;
  x.fill(1);
  for (std::size_t k = 0; k < definition_.numbers().size(); ++k)
    x[k] = numbers[static_cast<std::size_t>(definition_.numbers()[k])];
  course.add(GuessedFormula(definition_.formula()), x.data());
}

namespace {
void add_formulas(const Output* y, std::vector<const FormulaOutput*>& found) {
  const auto* formula = dynamic_cast<const FormulaOutput*>(y);
  if (!formula) return;
  found.push_back(formula);
  for (const auto& input : formula->inputs()) add_formulas(input.get(), found);
}
}  // namespace

std::vector<const FormulaOutput*> formulas_of(const CostTerm& term) {
  std::vector<const FormulaOutput*> found;
  if (const auto* of = dynamic_cast<const OutputTerm*>(&ungated(term))) {
    add_formulas(&of->output(), found);
    add_formulas(of->target().output.get(), found);
  }
  return found;
}

std::vector<const FormulaOutput*> formulas_of(const Output& output) {
  std::vector<const FormulaOutput*> found;
  add_formulas(&output, found);
  return found;
}

std::unique_ptr<Output> make_formula_output(const Mechanism& mechanism, const DefinedOutput& definition) {
  thread_local std::vector<std::string> open;  // definitions that are being made, each an input of the one before
  const std::string subject = definition.path() + ".formula";
  if (std::find(open.begin(), open.end(), definition.name()) != open.end())
    throw ModelError(subject, fmt::format("The output '{}' is defined by itself: {}, {}.", definition.name(),
                                          fmt::join(open, ", "), definition.name()));
  struct Entry {
    explicit Entry(const std::string& name) { open.push_back(name); }
    ~Entry() { open.pop_back(); }
  } const entry(definition.name());
  std::vector<std::unique_ptr<Output>> inputs;
  for (const std::string& name : definition.inputs()) try {
      inputs.push_back(make_output(mechanism, name));
    } catch (const ModelError& e) {
      throw ModelError(e.subject().empty() ? subject : e.subject(), e.bare_message());
    }
  return std::make_unique<FormulaOutput>(definition, std::move(inputs));
}

}  // namespace costate
