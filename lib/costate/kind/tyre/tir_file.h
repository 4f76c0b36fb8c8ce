// Tyre property files (.tir): sections, NAME = number or 'text', comments after $ or !. What a file says is
// kept with the line that it stands in.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "costate/base/error.h"

namespace costate {

class TirFile {
 public:
  struct Value {
    std::string text;  // without quotes
    int line = 0;
    int again = 0;  // the line of another value, or 0
  };
  /// Throws SceneError with the file's name and line.
  static TirFile read(const std::string& path);

  bool has(const std::string& name) const { return values_.count(name) > 0; }
  std::vector<std::string> names() const;
  /// A number; the name must be there, and throws where its line, or that of another value, says what it is not.
  double number(const std::string& name) const;
  double number(const std::string& name, double otherwise) const { return has(name) ? number(name) : otherwise; }
  std::string text(const std::string& name, const std::string& otherwise) const;
  /// Whether it is there, once, and its text a number.
  bool is_number(const std::string& name) const;
  [[noreturn]] void fail(const std::string& name, const std::string& message) const;

 private:
  const Value& value(const std::string& name) const;
  std::string path_;
  std::map<std::string, Value> values_;  // by upper-case name; those of [UNITS] are none
};

}  // namespace costate
