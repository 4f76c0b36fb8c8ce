#include "costate/scene/sample_reader.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "costate/base/error.h"
#include "costate/objective/sampled_cost.h"
#include "costate/scene/data_table.h"

namespace costate {

MakeCostTerm read_samples(SceneTable& table, MechanismBuilder& builder) {
  const std::string name = table.text("data"), column = table.text("column"), output = table.text("output");
  const auto at = [&](const std::string& key, const auto& find) {
    try {
      return find();
    } catch (const ModelError& e) {
      throw ModelError(table.path(key), e.bare_message());
    }
  };
  const auto data = at("data", [&] { return find_data_table(name); });
  const DataColumn* measured = at("column", [&] { return &data->column(column); });
  const DataColumn* sigmas = nullptr;
  double sigma = 1;
  if (table.has("sigma_column")) {
    if (table.has("sigma")) table.fail("sigma", "contradicts 'sigma_column': give one of them.");
    const std::string wanted = table.text("sigma_column");
    sigmas = at("sigma_column", [&] { return &data->column(wanted); });
  } else {
    sigma = table.value("sigma", NumberRule::positive);
  }
  const DataColumn* weights = nullptr;
  if (table.has("weight_column")) {
    const std::string wanted = table.text("weight_column");
    weights = at("weight_column", [&] { return &data->column(wanted); });
  }
  const double infinity = std::numeric_limits<double>::infinity();
  const double from = table.find_value("from_s").value_or(-infinity), to = table.find_value("to_s").value_or(infinity);
  const int weight = table.number("weight", builder, NumberRule::positive, 1);
  SampleData samples;
  samples.path = table.path();
  const std::vector<double>& times = at("data", [&] { return &data->time_column(); })->values;
  for (std::size_t k = 0; k < times.size(); ++k) {
    if (times[k] < from || times[k] > to || std::isnan(measured->values[k])) continue;
    const double of = sigmas ? sigmas->values[k] : sigma;
    if (!(of > 0))
      table.fail("sigma_column",
                 fmt::format("must be positive, found {} at t = {} s of {}.", of, times[k], data->source));
    const double w = weights ? weights->values[k] : 1;
    if (!(w >= 0 && std::isfinite(w)))
      table.fail("weight_column", fmt::format("must not be negative or missing, found {} at t = {} s of {}.", w,
                                              times[k], data->source));
    if (w == 0) continue;
    samples.times.push_back(times[k]);
    samples.values.push_back(measured->values[k]);
    // A weight is what a smaller sigma would be.
    samples.sigmas.push_back(of / std::sqrt(w));
  }
  if (samples.times.empty())
    table.fail("column", fmt::format("holds no value{}{} in {}.",
                                     std::isfinite(from) || std::isfinite(to) ? " between from_s and to_s" : "",
                                     weights ? " that has a weight" : "", data->source));
  return [=, path = table.path("output"), column_path = table.path("column"),
          of = DataColumn{measured->name, measured->unit, {}}, sigma_path = table.path("sigma_column"),
          of_sigma = sigmas ? DataColumn{sigmas->name, sigmas->unit, {}}
                            : DataColumn{}](const Mechanism& mechanism) -> std::shared_ptr<const CostTerm> {
    try {
      auto found = make_output(mechanism, output);
      const std::string wrong = wrong_unit(of, found->unit());
      if (!wrong.empty()) throw ModelError(column_path, fmt::format("{} '{}' is another quantity.", wrong, output));
      if (const std::string of_other = wrong_unit(of_sigma, found->unit()); !of_other.empty())
        throw ModelError(sigma_path, fmt::format("{} '{}' is another quantity.", of_other, output));
      return std::make_shared<SampledCost>(std::move(found), samples, weight);
    } catch (const ModelError& e) {
      throw ModelError(e.subject().empty() ? path : e.subject(), e.bare_message());
    }
  };
}

}  // namespace costate
