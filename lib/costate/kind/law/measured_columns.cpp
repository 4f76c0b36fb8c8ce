#include "costate/kind/law/measured_columns.h"

#include <fmt/format.h>

#include "costate/base/error.h"
#include "costate/element/law/composed_law.h"
#include "costate/element/law/data_law.h"

namespace costate {

namespace {
/// `first`: of the part's numbers among those of the whole law.
void add_columns(const ScalarLaw& law, const LawOptions& whole, std::size_t first,
                 std::vector<MeasuredColumn>& columns) {
  if (const auto* data = dynamic_cast<const DataLaw*>(&law)) {
    // Its one number is the scale.
    const auto& [key, scale] = whole.numbers[first];
    if (scale == 1)
      columns.push_back({key.substr(0, key.rfind("scale")) + "column",
                         {data->column(), data->unit(), {}},
                         {data->argument(), data->argument_unit(), {}}});
  } else if (const auto* sum = dynamic_cast<const ComposedLaw*>(&law);
             sum && sum->operation() == ComposedLaw::Operation::sum) {
    for (const auto& part : sum->parts()) {
      add_columns(*part, whole, first, columns);
      first += static_cast<std::size_t>(part->number_count());
    }
  }
}
}  // namespace

std::vector<MeasuredColumn> measured_columns(const LawOptions& law) {
  std::vector<MeasuredColumn> columns;
  if (law) add_columns(*law.law, law, 0, columns);
  return columns;
}

void require_units(const std::string& path, const LawOptions& law, const std::string& unit,
                   const std::string& argument) {
  for (const MeasuredColumn& c : measured_columns(law)) {
    if (const std::string wrong = wrong_unit(c.column, unit); !wrong.empty())
      throw ModelError(path + "." + c.path, wrong);
    if (const std::string wrong = wrong_unit(c.argument, argument); !wrong.empty())
      throw ModelError(path + "." + c.path,
                       fmt::format("Column '{}' goes over another quantity than this law: {} Name the right one: over "
                                   "= \"...\".",
                                   c.column.name, wrong));
  }
}

}  // namespace costate
