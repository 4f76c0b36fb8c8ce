#include "description.h"

#include <fmt/format.h>

#include <cmath>
#include <set>

#include "costate/base/version.h"
#include "costate/record/svg_plot.h"
#include "units.h"

namespace costate::app {

namespace {

using Kind = FmuVariable::Kind;

/// Units as the standard has them: a name, and what it is of SI's base units where that is known.
std::string unit_definitions(const FmuModel& model) {
  std::set<std::string> units;
  for (const FmuVariable& v : model.variables())
    if (!v.unit.empty() && v.unit != "1") units.insert(v.unit);
  std::string text = "  <UnitDefinitions>\n";
  for (const std::string& unit : units) {
    const std::string base = base_unit_attributes(unit);
    text += fmt::format("    <Unit name=\"{}\">{}</Unit>\n", xml_escaped(unit),
                        base.empty() ? "" : fmt::format("<BaseUnit {}/>", base));
  }
  return text + "  </UnitDefinitions>\n";
}

std::string variable_element(const FmuModel& model, std::size_t reference) {
  const FmuVariable& v = model.variables()[reference];
  std::string text = fmt::format("    <Float64 name=\"{}\" valueReference=\"{}\"", xml_escaped(v.name), reference);
  const auto add = [&](const char* key, const std::string& value) {
    text += fmt::format(" {}=\"{}\"", key, xml_escaped(value));
  };
  switch (v.kind) {
    case Kind::time:
      add("causality", "independent");
      add("variability", "continuous");
      break;
    case Kind::parameter: {
      const Parameter& p = model.parameters().parameters[v.index];
      add("causality", "parameter");
      add("variability", "fixed");
      add("initial", "exact");
      add("start", fmt::format("{:.17g}", p.value));
      if (std::isfinite(p.lower)) add("min", fmt::format("{:.17g}", p.lower));
      if (std::isfinite(p.upper)) add("max", fmt::format("{:.17g}", p.upper));
      break;
    }
    case Kind::state:
    case Kind::derivative:
    case Kind::output:
      add("causality", v.is_output ? "output" : "local");
      add("variability", "continuous");
      add("initial", "calculated");
      // States come before their derivatives, one for one.
      if (v.kind == Kind::derivative) add("derivative", fmt::format("{}", reference - model.size()));
      break;
  }
  if (!v.unit.empty() && v.unit != "1") add("unit", v.unit);
  if (!v.description.empty()) add("description", v.description);
  return text + "/>\n";
}

}  // namespace

std::string model_description(const FmuModel& model, const std::string& title, const std::string& description,
                              const std::string& identifier, const std::string& token) {
  const auto& variables = model.variables();
  const char* derivatives =
      model.has_derivatives() ? " providesDirectionalDerivatives=\"true\" providesAdjointDerivatives=\"true\"" : "";
  std::string text = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription fmiVersion=\"3.0\" modelName=\"{}\" "
      "instantiationToken=\"{}\" generationTool=\"Costate {}\"{}>\n",
      xml_escaped(title), xml_escaped(token), version,
      description.empty() ? "" : fmt::format(" description=\"{}\"", xml_escaped(description)));
  if (model.no_model_exchange().empty())
    text += fmt::format("  <ModelExchange modelIdentifier=\"{}\"{}/>\n", identifier, derivatives);
  text += fmt::format("  <CoSimulation modelIdentifier=\"{}\" canHandleVariableCommunicationStepSize=\"true\"{}/>\n",
                      identifier, derivatives);
  text += unit_definitions(model);
  text +=
      "  <LogCategories>\n    <Category name=\"logStatusWarning\"/>\n    <Category name=\"logStatusDiscard\"/>\n    "
      "<Category name=\"logStatusError\"/>\n  </LogCategories>\n";
  const SolverOptions& s = model.solver();
  text += fmt::format("  <DefaultExperiment startTime=\"{:.17g}\" stopTime=\"{:.17g}\" tolerance=\"{:.17g}\"/>\n",
                      s.t_start, s.t_end, s.rtol);
  text += "  <ModelVariables>\n";
  for (std::size_t i = 0; i < variables.size(); ++i) text += variable_element(model, i);
  text += "  </ModelVariables>\n  <ModelStructure>\n";
  const auto list = [&](const char* element, const auto& belongs) {
    for (std::size_t i = 0; i < variables.size(); ++i)
      if (belongs(variables[i])) text += fmt::format("    <{} valueReference=\"{}\"/>\n", element, i);
  };
  list("Output", [](const FmuVariable& v) { return v.is_output; });
  list("ContinuousStateDerivative", [](const FmuVariable& v) { return v.kind == Kind::derivative; });
  list("InitialUnknown",
       [](const FmuVariable& v) { return v.is_output || v.kind == Kind::derivative || v.kind == Kind::state; });
  return text + "  </ModelStructure>\n</fmiModelDescription>\n";
}

}  // namespace costate::app
