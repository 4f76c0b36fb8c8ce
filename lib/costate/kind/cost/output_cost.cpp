// The built-in cost terms on named outputs: weight (y - target)^2 and weight (y - target).
#include <fmt/format.h>

#include "costate/base/error.h"
#include "costate/element/law/data_law.h"
#include "costate/kind/law/law_table.h"
#include "costate/scene/cost_kind.h"
#include "costate/scene/data_table.h"

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
  const int weight = table.number("weight", builder, NumberRule::any, 1);
  OutputTerm::Target target;
  DataColumn measured;  // that the target is, as it is
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
    const auto* of_data = dynamic_cast<const DataLaw*>(options.law.get());
    // A scale may be what turns one into the other.
    if (of_data && options.numbers.front().second == 1) measured = {of_data->column(), of_data->unit(), {}};
    const RegisteredLaw law = add_law(builder, target_path, options);
    target.law = law.law;
    target.law_numbers = law.numbers;
  }
  return [=](const Mechanism& mechanism) {
    OutputTerm::Target t = target;
    if (!target_output.empty()) t.output = output_at(mechanism, target_path, target_output);
    auto y = output_at(mechanism, output_path, output);
    if (const std::string wrong = wrong_unit(measured, y->unit()); !wrong.empty())
      throw ModelError(target_path, fmt::format("{} '{}' is another quantity.", wrong, output));
    return std::make_shared<OutputTerm>(std::move(y), power, weight, t);
  };
}

const RegisterCostKind square_registered(
    {.name = "square",
     .summary = "weight (output - target)^2; the target is a number, a law of time or an output",
     .read = read<2>});
const RegisterCostKind value_registered({.name = "value", .summary = "weight (output - target)", .read = read<1>});

}  // namespace

}  // namespace costate
