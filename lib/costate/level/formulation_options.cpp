#include "costate/level/formulation_options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "costate/base/error.h"

namespace costate {

namespace {
std::map<std::string, FormulationOption>& table() {
  static std::map<std::string, FormulationOption> options;
  return options;
}

const FormulationOption& find(const std::string& key, bool number) {
  const FormulationOption& o = find_formulation_option(key);
  if (o.is_number() != number)
    throw CapabilityError(fmt::format("The formulation's option '{}' is {}.", key,
                                      number ? fmt::format("one of {}", fmt::join(o.words, ", ")) : "a number"));
  return o;
}
}  // namespace

const std::map<std::string, FormulationOption>& formulation_options() { return table(); }

const FormulationOption& find_formulation_option(const std::string& key) {
  const auto found = table().find(key);
  if (found != table().end()) return found->second;
  std::vector<std::string> keys;
  for (const auto& [name, option] : table()) keys.push_back(name);
  throw CapabilityError(fmt::format("No formulation has an option '{}'.{}", key, suggestion(key, keys)));
}

void add_formulation_option(const FormulationOption& o) {
  const auto [at, is_new] = table().emplace(o.key, o);
  const FormulationOption& known = at->second;
  if (!is_new && (known.help != o.help || known.number != o.number || known.rule != o.rule || known.upper != o.upper ||
                  known.words != o.words || known.flag != o.flag))
    throw std::logic_error("two formulations describe their option '" + o.key + "' differently");
}

std::string FormulationOption::objection(double x) const {
  if (!std::isfinite(x)) return "must be finite";
  if (const char* wrong = violation(rule, x)) return wrong;
  return x > upper ? fmt::format("must not be above {:g}", upper) : "";
}

std::string FormulationOption::objection(const std::string& word) const {
  if (std::find(words.begin(), words.end(), word) != words.end()) return {};
  return fmt::format("must be one of {}", fmt::join(words, ", "));
}

double FormulationOption::number_in(const FormulationOptions& options) const {
  const auto found = options.numbers_.find(key);
  return found == options.numbers_.end() ? number : found->second;
}

const std::string& FormulationOption::word_in(const FormulationOptions& options) const {
  const auto found = options.words_.find(key);
  return found == options.words_.end() ? words.front() : found->second;
}

void FormulationOptions::set(const std::string& key, double value) {
  if (const std::string wrong = find(key, true).objection(value); !wrong.empty())
    throw CapabilityError(fmt::format("The formulation's option '{}' {}, found {}.", key, wrong, value));
  numbers_[key] = value;
}

void FormulationOptions::set(const std::string& key, const std::string& word) {
  if (const std::string wrong = find(key, false).objection(word); !wrong.empty())
    throw CapabilityError(fmt::format("The formulation's option '{}' {}, found '{}'.", key, wrong, word));
  words_[key] = word;
}

double FormulationOptions::number(const std::string& key) const { return find(key, true).number_in(*this); }

const std::string& FormulationOptions::word(const std::string& key) const { return find(key, false).word_in(*this); }

}  // namespace costate
