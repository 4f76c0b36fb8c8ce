// The built-in cost terms on named outputs: weight (y - target)^2 and weight (y - target), where the weight may be a
// law of the time.
#include <fmt/format.h>

#include "costate/base/error.h"
#include "costate/kind/law/law_table.h"
#include "costate/kind/law/measured_columns.h"
#include "costate/objective/weighted_cost.h"
#include "costate/scene/cost_kind.h"

namespace costate {

namespace {

std::shared_ptr<const Output> output_at(const Mechanism& mechanism, const std::string& subject,
                                        const std::string& name) {
  try {
    return make_output(mechanism, name);
  } catch (const ModelError& e) {
    throw ModelError(subject, e.bare_message());
  }
}

template <int power>
MakeCostTerm read(SceneTable& table, MechanismBuilder& builder) {
  const std::string output = table.text("output"), output_path = table.path("output");
  const RegisteredLaw weights = add_law(builder, table.path("weight"), read_law(table, "weight", 1));
  const bool by_law = table.is_table("weight");
  const int weight = by_law ? -1 : weights.numbers.front();
  OutputTerm::Target target;
  std::vector<MeasuredColumn> measured;
  std::string target_output, target_path = table.path("target");
  if (table.has("target_output")) {
    if (table.has("target")) table.fail("target", "contradicts 'target_output': give one of them.");
    target_output = table.text("target_output");
    target_path = table.path("target_output");
  } else if (table.is_text("target")) {
    const std::string text = table.text("target"), prefix = "output:";
    if (text.rfind(prefix, 0) != 0) table.fail_type("target", "a number, a law of time, or the string \"output:NAME\"");
    target_output = text.substr(prefix.size());
  } else if (table.has("target")) {
    const LawOptions options = read_law(table, "target");
    measured = measured_columns(options);
    require_units(target_path, options, "", "s");
    const RegisteredLaw law = add_law(builder, target_path, options);
    target.law = law.law;
    target.law_numbers = law.numbers;
  }
  return [=](const Mechanism& mechanism) -> std::shared_ptr<const CostTerm> {
    OutputTerm::Target t = target;
    if (!target_output.empty()) t.output = output_at(mechanism, target_path, target_output);
    auto y = output_at(mechanism, output_path, output);
    for (const MeasuredColumn& m : measured)
      if (const std::string wrong = wrong_unit(m.column, y->unit()); !wrong.empty())
        throw ModelError(target_path + "." + m.path, fmt::format("{} '{}' is another quantity.", wrong, output));
    auto term = std::make_shared<OutputTerm>(std::move(y), power, weight, t);
    if (!by_law) return term;
    return std::make_shared<WeightedTerm>(std::move(term), weights.law, weights.numbers);
  };
}

const RegisterCostKind square_registered(
    {.name = "square",
     .summary = "weight (output - target)^2; the target is a number, a law of time or an output",
     .read = read<2>});
const RegisterCostKind value_registered({.name = "value", .summary = "weight (output - target)", .read = read<1>});

}  // namespace

}  // namespace costate
