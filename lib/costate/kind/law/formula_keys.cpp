#include "costate/kind/law/formula_keys.h"

#include <fmt/format.h>

#include <algorithm>

#include "costate/base/error.h"
#include "costate/element/law/motion_law.h"
#include "costate/kind/law/law_table.h"
#include "costate/kind/law/measured_columns.h"
#include "costate/scene/key_recorder.h"

namespace costate {

FormulaKeys read_formula_keys(SceneTable& table, const std::vector<std::string>& others) {
  FormulaKeys keys;
  for (const std::string& key : table.keys()) {
    if (std::find(others.begin(), others.end(), key) != others.end()) continue;
    if (KeyRecorder* r = KeyRecorder::current(); r && table.is_table(key))
      r->add(table.path(), key, "a number, a law or a map", false);
    if (is_map(table, key))
      keys.maps.emplace_back(key, read_map(table.table(key)));
    else if (table.is_table(key))
      keys.laws.emplace_back(key, read_law(table, key));
    else
      keys.numbers.emplace_back(key, table.value(key));
  }
  return keys;
}

FormulaReader::FormulaReader(std::string path, const FormulaKeys& keys)
    : path_(std::move(path)), numbers_(keys.numbers), own_(keys.numbers.size()) {
  for (const auto& [key, law] : keys.laws) {
    const std::string subject = path_ + "." + key;
    require_own_name(key);
    // Nothing is known of what it is asked for, but that it is in SI units.
    for (const MeasuredColumn& c : measured_columns(law))
      if (c.argument.unit == "Hz")
        throw ModelError(subject + "." + c.path,
                         fmt::format("Column '{}' goes over '{}' in Hz, cycles a second, and angular velocities in a "
                                     "formula are in rad/s: 1 Hz would count as 1 rad/s. Give '{}' in rad/s or rpm, or "
                                     "without a unit where the formula asks for cycles.",
                                     c.column.name, c.argument.name, c.argument.name));
    std::vector<double> p;
    functions_.push_back({key, law.law, static_cast<int>(numbers_.size())});
    for (const auto& [name, value] : law.numbers) {
      numbers_.emplace_back(name.empty() ? key : key + "." + name, value);
      p.push_back(value);
    }
    const LawJoints joints = law_joints(*law.law, p.data());
    for (const LawJoint& j : joints.all)
      if (joints.jumps(j))
        throw ModelError(subject, fmt::format("This law jumps from {:.6g} to {:.6g} at {:g}. Where the motion comes to "
                                              "that place the formula would, at an instant that nobody knows: let its "
                                              "pieces meet, or lead over the jump within a width (kind = \"steps\").",
                                              j.left, j.right, j.x));
  }
  for (const auto& [key, map] : keys.maps) {
    require_own_name(key);
    functions_.push_back({key, nullptr, static_cast<int>(numbers_.size()), map.surface});
    numbers_.emplace_back(key + ".scale", map.scale);
  }
  used_.assign(own_, false);
  called_.assign(functions_.size(), false);
}

void FormulaReader::require_own_name(const std::string& function) const {
  if (FormulaLaw::has_function(function))
    throw ModelError(path_ + "." + function,
                     fmt::format("'{}' is a function of every formula; choose another name.", function));
}

std::shared_ptr<const FormulaLaw> FormulaReader::read(const std::string& formula, const std::string& key,
                                                      std::vector<std::string>& others, std::size_t most) {
  const std::string subject = path_ + "." + key;
  std::vector<std::string> names;
  for (const auto& [name, value] : numbers_) names.push_back(name);
  std::shared_ptr<const FormulaLaw> law;
  try {
    law = std::make_shared<FormulaLaw>(formula, names, others, functions_);
  } catch (const ModelError& e) {
    throw ModelError(subject, e.bare_message());
  }
  if (names.size() + others.size() > most)
    throw ModelError(
        subject,
        fmt::format("holds {} names{}, of {} at most; split it into several outputs or forces{}.",
                    names.size() + others.size(),
                    names.size() > own_ ? fmt::format(" and numbers of laws ({})", names.size() - own_) : "", most,
                    names.size() > own_ ? ", and take points as data (kind = \"data\", x, y), which have "
                                          "one number"
                                        : ""));
  for (std::size_t k = 0; k < own_; ++k) used_[k] = used_[k] || law->uses(k);
  for (std::size_t i = 0; i < functions_.size(); ++i) called_[i] = called_[i] || law->calls(i);
  return law;
}

void FormulaReader::require_used() const {
  const auto unused = [&](const std::string& key) {
    throw ModelError(path_ + "." + key, fmt::format("'{}' is in no formula here.", key));
  };
  for (std::size_t k = 0; k < own_; ++k)
    if (!used_[k]) unused(numbers_[k].first);
  for (std::size_t i = 0; i < functions_.size(); ++i)
    if (!called_[i]) unused(functions_[i].name);
}

std::vector<int> FormulaReader::add_numbers(MechanismBuilder& builder) const {
  std::vector<int> indices;
  for (const auto& [name, value] : numbers_) indices.push_back(builder.add_number(path_ + "." + name, value));
  return indices;
}

}  // namespace costate
