// What a user may set of a formulation: the constants of its constraints' stabilization, of its fixed steps, and what
// formulations of one's own add. An option is described once, beside what reads it, and registered with the
// formulations that have it; a scene's [formulation], the command line, `costate list` and summaries go by the
// descriptions.
#pragma once

#include <limits>
#include <map>
#include <string>
#include <vector>

#include "costate/mechanism/number_rule.h"

namespace costate {

class FormulationOptions;

/// A number, or a word among `words`.
struct FormulationOption {
  std::string key;   // of [formulation]; its unit stands at its end: "baumgarte_omega_rad_per_s"
  std::string help;  // one line
  double number = 0;
  NumberRule rule = NumberRule::any;
  double upper = std::numeric_limits<double>::infinity();
  std::vector<std::string> words = {};  // empty for a number; else the first one is the default
  std::string flag = {};                // of the command line, "--penalty-alpha"; empty: there it is set by --set

  bool is_number() const { return words.empty(); }
  /// Empty where x may be its value, else what is wrong: "must be positive".
  std::string objection(double x) const;
  std::string objection(const std::string& word) const;
  /// What the options have, or the default.
  double number_in(const FormulationOptions& options) const;
  const std::string& word_in(const FormulationOptions& options) const;
};

/// Values of options; what is not set has its default.
class FormulationOptions {
 public:
  // Throw CapabilityError for a key that no formulation has, and for what the option's description does not allow.
  void set(const std::string& key, double value);
  void set(const std::string& key, const std::string& word);
  double number(const std::string& key) const;
  const std::string& word(const std::string& key) const;

 private:
  friend struct FormulationOption;
  std::map<std::string, double> numbers_;
  std::map<std::string, std::string> words_;
};

/// The options of all formulations, by key.
const std::map<std::string, FormulationOption>& formulation_options();
/// Throws CapabilityError with near names.
const FormulationOption& find_formulation_option(const std::string& key);
/// Several formulations may have the same option; two of one key that differ throw std::logic_error.
void add_formulation_option(const FormulationOption& option);

}  // namespace costate
