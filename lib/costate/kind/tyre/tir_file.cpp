#include "costate/kind/tyre/tir_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <sstream>

#include "costate/base/letters.h"
#include "costate/base/text_file.h"

namespace costate {

namespace {

/// Throws where a file's unit is none of SI.
void require_si(const SourceLocation& place, const std::string& name, const std::string& text) {
  constexpr const char* units[][3] = {{"LENGTH", "METER", "METRE"}, {"FORCE", "NEWTON", "N"},
                                      {"ANGLE", "RADIAN", "RAD"},   {"MASS", "KG", "KILOGRAM"},
                                      {"TIME", "SECOND", "SEC"},    {"PRESSURE", "PASCAL", "PA"}};
  for (const auto& [quantity, unit, also] : units) {
    if (name != quantity) continue;
    std::string found = in_capitals(text);
    if (found.size() > 3 && found.back() == 'S') found.pop_back();
    if (found != unit && found != also)
      throw SceneError(place, fmt::format("{} must be '{}', found '{}': convert the file to SI units.", name, unit,
                                          in_capitals(text)));
  }
}

}  // namespace

TirFile TirFile::read(const std::string& path) {
  std::istringstream in(
      read_text_file(path, 16 << 20, "This tyre property file, whose path is relative to the scene,"));
  TirFile file;
  file.path_ = path;
  std::string line, section;
  for (int number = 1; std::getline(in, line); ++number) {
    line = trimmed(line.substr(0, line.find_first_of("$!")));
    if (line.empty() || line[0] == '{') continue;
    if (line[0] == '[') {
      if (line.back() != ']')
        throw SceneError({path, number, 1}, fmt::format("Expected ']' at the end of '{}'.", line));
      section = in_capitals(line.substr(1, line.size() - 2));
      continue;
    }
    const auto equals = line.find('=');
    if (equals == std::string::npos) {
      if (section == "SHAPE" || section == "MDI_HEADER") continue;  // tables and free text
      throw SceneError({path, number, 1}, fmt::format("Expected NAME = value, found '{}'.", line));
    }
    const std::string name = in_capitals(trimmed(line.substr(0, equals)));
    std::string value = trimmed(line.substr(equals + 1));
    if (value.size() >= 2 && (value[0] == '\'' || value[0] == '"')) value = trimmed(value.substr(1, value.size() - 2));
    if (name.empty() || value.empty())
      throw SceneError({path, number, 1}, fmt::format("Expected NAME = value, found '{}'.", line));
    // Elsewhere MASS is the tyre's, and LENGTH may be any.
    if (section == "UNITS" || section.empty()) require_si({path, number, 1}, name, value);
    if (section == "UNITS") continue;
    const auto [at, is_new] = file.values_.try_emplace(name, Value{value, number, 0});
    if (!is_new && at->second.text != value) at->second.again = number;
  }
  return file;
}

std::vector<std::string> TirFile::names() const {
  std::vector<std::string> r;
  for (const auto& [name, value] : values_) r.push_back(name);
  return r;
}

double TirFile::number(const std::string& name) const {
  const std::string& text = value(name).text;
  double x = 0;
  if (!read_number(text, x)) fail(name, fmt::format("must be a number, found '{}'.", text));
  return x;
}

std::string TirFile::text(const std::string& name, const std::string& otherwise) const {
  return has(name) ? value(name).text : otherwise;
}

bool TirFile::is_number(const std::string& name) const {
  double x = 0;
  return has(name) && values_.at(name).again == 0 && read_number(values_.at(name).text, x);
}

const TirFile::Value& TirFile::value(const std::string& name) const {
  const Value& v = values_.at(name);
  if (v.again > 0)
    throw SceneError({path_, v.again, 1},
                     fmt::format("{} has another value in line {}, {}: keep one of the two.", name, v.line, v.text));
  return v;
}

void TirFile::fail(const std::string& name, const std::string& message) const {
  throw SceneError({path_, has(name) ? values_.at(name).line : 0, has(name) ? 1 : 0},
                   fmt::format("{} {}", name, message));
}

}  // namespace costate
