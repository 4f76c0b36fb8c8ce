#include "costate/scene/toml_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <tuple>

namespace costate {

namespace {

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    switch (c) {
      case '"':
        out += "\\\"";
        break;
      case '\\':
        out += "\\\\";
        break;
      case '\n':
        out += "\\n";
        break;
      case '\t':
        out += "\\t";
        break;
      case '\r':
        out += "\\r";
        break;
      default:
        if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
          out += fmt::format("\\u{:04X}", static_cast<unsigned>(c));
        else if (c == '\xc2' && i + 1 < text.size() && static_cast<unsigned char>(text[i + 1]) < 0xa0)
          // Control characters of eight bits, U+0080 to U+009F, in UTF-8.
          out += fmt::format("\\u{:04X}", static_cast<unsigned>(static_cast<unsigned char>(text[++i])));
        else
          out += c;
    }
  }
  return out + '"';
}

std::string key_text(const std::string& key) {
  const bool bare = !key.empty() && std::all_of(key.begin(), key.end(), [](unsigned char c) {
    return (c < 0x80 && std::isalnum(c)) || c == '_' || c == '-';
  });
  return bare ? key : quoted(key);
}

std::string value_text(const SceneNode& n) {
  switch (n.type) {
    case SceneNode::Type::text:
      return quoted(n.text);
    case SceneNode::Type::integer:
      return fmt::format("{}", n.integer);
    case SceneNode::Type::number:
      return toml_number(n.number);
    case SceneNode::Type::flag:
      return n.flag ? "true" : "false";
    case SceneNode::Type::date:
      return n.text;
    case SceneNode::Type::array: {
      std::string out = "[";
      for (std::size_t i = 0; i < n.children.size(); ++i) out += (i ? ", " : "") + value_text(n.children[i]);
      return out + "]";
    }
    case SceneNode::Type::table: {
      if (n.children.empty()) return "{}";
      std::string out = "{";
      for (std::size_t i = 0; i < n.children.size(); ++i)
        out += (i ? ", " : " ") + key_text(n.children[i].key) + " = " + value_text(n.children[i]);
      return out + " }";
    }
  }
  return {};
}

bool is_section(const SceneNode& n) { return (n.is_table() && !n.inlined) || n.is_table_array(); }

using Place = std::tuple<int, int, int>;  // part, line, column

/// A table with a header of its own.
struct Section {
  std::string header;  // "[spring.S1]", empty for the root
  const SceneNode* table;
  Place place;  // where it stands: no earlier than its parent
};

/// Tables that an override added have no line and come last.
Place place_of(const SceneNode& n) {
  constexpr int last = std::numeric_limits<int>::max();
  if (n.where.line == 0) return {last, last, n.where.column};
  return {n.part, n.where.line, n.where.column};
}

void collect(const SceneNode& table, const std::string& path, Place at_least, std::vector<Section>& out) {
  for (const auto& child : table.children) {
    if (!is_section(child)) continue;
    const std::string name = path.empty() ? key_text(child.key) : path + "." + key_text(child.key);
    const auto add = [&](const SceneNode& section, const std::string& header, bool needed) {
      const auto place = std::max(at_least, place_of(section));
      if (needed) out.push_back({header, &section, place});
      collect(section, name, place, out);
    };
    if (child.is_array()) {
      for (const auto& item : child.children) add(item, "[[" + name + "]]", true);
      continue;
    }
    // A table with nothing but tables below it, like 'spring' in [spring.S1], needs no header.
    const bool only_a_path =
        !child.children.empty() && std::all_of(child.children.begin(), child.children.end(), is_section);
    add(child, "[" + name + "]", !only_a_path);
  }
}

}  // namespace

std::string toml_number(double x) {
  if (std::isnan(x)) return "nan";
  if (std::isinf(x)) return x > 0 ? "inf" : "-inf";
  std::string text = fmt::format("{}", x);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

std::string write_toml(const SceneNode& root) {
  std::vector<Section> sections{{"", &root, {0, 0, 0}}};
  collect(root, "", {0, 0, 0}, sections);
  std::stable_sort(sections.begin(), sections.end(),
                   [](const Section& a, const Section& b) { return a.place < b.place; });
  std::string out;
  for (const auto& section : sections) {
    if (!section.header.empty()) out += (out.empty() ? "" : "\n") + section.header + "\n";
    for (const auto& child : section.table->children)
      if (!is_section(child)) out += key_text(child.key) + " = " + value_text(child) + "\n";
  }
  return out;
}

namespace {
/// As in braces and brackets, on one line.
void set_inline(SceneNode& n) {
  n.inlined = n.is_table();
  for (auto& c : n.children) set_inline(c);
}

}  // namespace

std::string toml_value(SceneNode node) {
  set_inline(node);
  return value_text(node);
}

void add_overrides(const SceneNode& table, const std::string& path, std::vector<std::string>& out) {
  for (const auto& c : table.children) {
    const std::string name = path.empty() ? c.key : path + "." + c.key;
    if (c.is_table() && !c.inlined)
      add_overrides(c, name, out);
    else
      out.push_back(name + "=" + toml_value(c));
  }
}

}  // namespace costate
