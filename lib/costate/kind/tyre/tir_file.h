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
  };
  /// Throws SceneError with the file's name and line.
  static TirFile read(const std::string& path);

  bool has(const std::string& name) const { return values_.count(name) > 0; }
  std::vector<std::string> names() const;
  /// A number; the name must be there.
  double number(const std::string& name) const;
  double number(const std::string& name, double otherwise) const { return has(name) ? number(name) : otherwise; }
  std::string text(const std::string& name, const std::string& otherwise) const;
  [[noreturn]] void fail(const std::string& name, const std::string& message) const;

 private:
  std::string path_;
  std::map<std::string, Value> values_;  // by upper-case name
};

}  // namespace costate
