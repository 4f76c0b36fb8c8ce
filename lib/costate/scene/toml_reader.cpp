#include "costate/scene/toml_reader.h"

#include <fmt/format.h>
#include <toml++/impl/preprocessor.h>
// Of a bracket that a line break or a brace follows it asserts (or lets the compiler assume) what it then looks at and
// refuses.
#undef TOML_ASSERT_ASSUME
#define TOML_ASSERT_ASSUME(expr) static_assert(true)
#include <toml++/toml.h>

#include <algorithm>
#include <cctype>
#include <memory>
#include <sstream>

#include "costate/base/stop.h"

namespace costate {

namespace {

SourceLocation place(const toml::source_region& s, const std::string& file) {
  return {file, static_cast<int>(s.begin.line), static_cast<int>(s.begin.column)};
}

constexpr int kDeepest = 64;
constexpr std::size_t kLongText = 100000;  // characters; parsing more takes long enough to be interrupted

/// Keys of so many parts, and tables nested so deeply, say nothing that a scene means; parsers recurse over them.
void require_shallow(const std::string& text, const std::string& file) {
  int line = 1, depth = 0, dots = 0;
  std::size_t line_start = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '#') {
      while (i + 1 < text.size() && text[i + 1] != '\n') ++i;
    } else if (c == '"' || c == '\'') {
      const bool triple = text.compare(i, 3, std::string(3, c)) == 0;
      std::size_t end = i + (triple ? 3 : 1);
      for (; end < text.size(); ++end) {
        if (text[end] == '\n') {
          if (!triple) break;  // the parser will complain
          ++line;
          line_start = end + 1;
        } else if (c == '"' && text[end] == '\\') {
          ++end;
        } else if (text[end] == c && (!triple || text.compare(end, 3, std::string(3, c)) == 0)) {
          break;
        }
      }
      if (end < text.size() && text[end] == '\n') --end;
      i = triple ? end + 2 : end;
    } else if (c == '\n') {
      ++line;
      line_start = i + 1;
      dots = 0;
    } else if (c == '=' || c == ',') {
      dots = 0;
    } else if (c == '[' || c == '{') {
      dots = 0;
      ++depth;
    } else if (c == ']' || c == '}') {
      dots = 0;
      --depth;
    } else if (c == '.') {
      ++dots;
    }
    if (dots > kDeepest || depth > kDeepest)
      throw SceneError({file, line, static_cast<int>(i - std::min(i, line_start)) + 1},
                       dots > kDeepest ? fmt::format("A key has more than {} parts.", kDeepest)
                                       : fmt::format("Arrays and tables are nested more than {} deep.", kDeepest));
  }
}

/// What the parser complains of in the words of the other messages.
std::string reason_of(const toml::parse_error& e) {
  std::string text(e.description()), place;
  constexpr std::string_view head = "Error while parsing ";
  if (text.rfind(head, 0) == 0) {
    const std::size_t colon = text.find(": ");
    place = text.substr(head.size(), colon == std::string::npos ? colon : colon - head.size());
    text = colon == std::string::npos ? "" : text.substr(colon + 2);
  }
  for (const auto& [from, to] : {std::pair{"encountered end-of-file", "the file ends"},
                                 {"saw EOF", "found the end of the file"},
                                 {", saw ", ", found "}})
    if (const std::size_t at = text.find(from); at != std::string::npos)
      text.replace(at, std::string_view(from).size(), to);
  return place.empty() ? fmt::format("No valid TOML: {}", text) : fmt::format("No valid TOML ({}): {}", place, text);
}

SceneNode convert(const toml::node& from, const std::string& file) {
  SceneNode n;
  n.where = n.key_where = place(from.source(), file);
  const auto before = [](const SceneNode& a, const SceneNode& b) {
    return std::pair(a.key_where.line, a.key_where.column) < std::pair(b.key_where.line, b.key_where.column);
  };
  if (const auto* table = from.as_table()) {
    n.inlined = table->is_inline();
    for (const auto& [key, value] : *table) {
      n.children.push_back(convert(value, file));
      n.children.back().key = std::string(key.str());
      n.children.back().key_where = place(key.source(), file);
    }
    std::stable_sort(n.children.begin(), n.children.end(), before);
  } else if (const auto* array = from.as_array()) {
    n.type = SceneNode::Type::array;
    for (const auto& value : *array) n.children.push_back(convert(value, file));
  } else if (const auto* text = from.as_string()) {
    n.type = SceneNode::Type::text;
    n.text = text->get();
  } else if (const auto* integer = from.as_integer()) {
    n.type = SceneNode::Type::integer;
    n.integer = integer->get();
  } else if (const auto* number = from.as_floating_point()) {
    n.type = SceneNode::Type::number;
    n.number = number->get();
  } else if (const auto* flag = from.as_boolean()) {
    n.type = SceneNode::Type::flag;
    n.flag = flag->get();
  } else {
    n.type = SceneNode::Type::date;
    std::ostringstream out;
    from.visit([&](const auto& value) {
      if constexpr (toml::is_date<decltype(value)> || toml::is_time<decltype(value)> ||
                    toml::is_date_time<decltype(value)>)
        out << value.get();
    });
    n.text = out.str();
  }
  return n;
}

/// Text without quotes, as a shell leaves it: starts like a word and stays on one line.
bool is_bare_text(const std::string& text) {
  return !text.empty() && (std::isalpha(static_cast<unsigned char>(text[0])) || text[0] == '_') &&
         text.find_first_of("\n\r") == std::string::npos;
}

}  // namespace

SceneNode read_toml(const std::string& text, const std::string& file_name) {
  require_shallow(text, file_name);
  try {
    if (text.size() < kLongText)
      return convert(toml::parse(std::string_view(text), std::string_view(file_name)), file_name);
    struct Work {
      std::string text, file_name;
      SceneNode result;
    };
    const auto work = std::make_shared<Work>(Work{text, file_name, {}});
    run_stoppably([work] {
      work->result =
          convert(toml::parse(std::string_view(work->text), std::string_view(work->file_name)), work->file_name);
    });
    return std::move(work->result);
  } catch (const toml::parse_error& e) {
    throw SceneError(place(e.source(), file_name), fmt::format("{}.", reason_of(e)));
  }
}

SceneNode read_toml_value(const std::string& text, const std::string& source_name) {
  std::string why;
  require_shallow(text, source_name);
  try {
    SceneNode root = convert(toml::parse(std::string_view("x = " + text)), source_name);
    if (root.children.size() == 1 && root.children[0].key == "x") {
      SceneNode n = std::move(root.children[0]);
      const auto relocate = [&](const auto& self, SceneNode& node) -> void {
        node.where = node.key_where = {source_name, 0, 0};
        for (auto& c : node.children) self(self, c);
      };
      relocate(relocate, n);
      n.key.clear();
      return n;
    }
    why = "more than one value";
  } catch (const toml::parse_error& e) {
    why = reason_of(e);
  }
  if (is_bare_text(text)) {
    SceneNode n;
    n.type = SceneNode::Type::text;
    n.text = text;
    n.where = n.key_where = {source_name, 0, 0};
    return n;
  }
  throw SceneError({source_name, 0, 0}, fmt::format("'{}' is not a value: {}.", text, why));
}

}  // namespace costate
