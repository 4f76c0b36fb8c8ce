#include "costate/objective/work_hint.h"

#include <fmt/format.h>

#include <algorithm>

namespace costate {

namespace {
bool reports_power(const Element& e) {
  const auto measures = e.measures();
  return std::any_of(measures.begin(), measures.end(), [](const Measure& m) { return m.name == "power"; });
}
}  // namespace

std::string work_hint(const Mechanism& mechanism, const std::string& output) {
  if (!output.ends_with(".work")) return {};
  const std::string of = output.substr(0, output.size() - 5);
  const auto is = [&](const auto& e) { return (e->name() == of || e->path() == of) && reports_power(*e); };
  for (const auto& f : mechanism.forces())
    if (is(f)) return fmt::format(" It is integrated where 'work = true' stands in [{}].", f->path());
  for (const auto& c : mechanism.constraints())
    if (is(c))
      return fmt::format(" A running cost of kind \"value\" of '{}.power' is the work of this {}.", of, c->kind());
  return {};
}

}  // namespace costate
