// What an FMU consists of, for the importer: a ZIP file of stored entries, and modelDescription.xml.
#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace fmu {

using References = std::vector<std::uint32_t>;
namespace fs = std::filesystem;

[[noreturn]] inline void fail(const std::string& text) { throw std::runtime_error(text); }

inline std::string bytes_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Stored entries, by the directory at the end of the file.
inline void unpack(const std::string& file, const fs::path& folder) {
  const auto number = [&](std::size_t at, int size) {
    std::uint64_t x = 0;
    for (int k = size - 1; k >= 0; --k)
      x = x << 8 | static_cast<unsigned char>(file.at(at + static_cast<std::size_t>(k)));
    return static_cast<std::size_t>(x);
  };
  if (file.size() < 22 || number(file.size() - 22, 4) != 0x06054b50) fail("no end of a ZIP file");
  const std::size_t count = number(file.size() - 12, 2);
  std::size_t at = number(file.size() - 6, 4);
  for (std::size_t i = 0; i < count; ++i) {
    if (number(at, 4) != 0x02014b50) fail("no entry of a ZIP directory");
    if (number(at + 10, 2) != 0) fail("a compressed entry");
    const std::size_t size = number(at + 24, 4), name_size = number(at + 28, 2), local = number(at + 42, 4);
    const std::string name = file.substr(at + 46, name_size);
    if (number(local, 4) != 0x04034b50 || file.substr(local + 30, name_size) != name) fail("entries differ");
    const fs::path path = folder / name;
    fs::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary) << file.substr(local + 30 + name_size + number(local + 28, 2), size);
    at += 46 + name_size + number(at + 30, 2) + number(at + 32, 2);
  }
}

/// The elements of a file of XML in order: their names and attributes.
struct Element {
  std::string name;
  std::map<std::string, std::string> attributes;
};
inline std::string unescaped(std::string text) {
  for (const auto& [from, to] :
       {std::pair("&lt;", "<"), {"&gt;", ">"}, {"&quot;", "\""}, {"&#39;", "'"}, {"&amp;", "&"}})
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; ++at)
      text.replace(at, std::strlen(from), to);
  return text;
}
inline std::vector<Element> elements_of(const std::string& xml) {
  std::vector<Element> all;
  for (std::size_t at = 0; (at = xml.find('<', at)) != std::string::npos;) {
    const std::size_t end = xml.find('>', at);
    const std::string tag = xml.substr(at + 1, end - at - 1);
    at = end;
    if (tag[0] == '/' || tag[0] == '?') continue;
    Element e{tag.substr(0, tag.find_first_of(" /")), {}};
    for (std::size_t i = 0; (i = tag.find("=\"", i)) != std::string::npos;) {
      const std::size_t key = tag.rfind(' ', i) + 1, close = tag.find('"', i + 2);
      e.attributes[tag.substr(key, i - key)] = unescaped(tag.substr(i + 2, close - i - 2));
      i = close;
    }
    all.push_back(e);
  }
  return all;
}

struct Description {
  std::map<std::string, std::string> model, exchange, simulation, experiment;
  std::vector<Element> variables;
  References outputs, derivatives, states, parameters, initial;

  explicit Description(const std::string& xml) {
    for (const Element& e : elements_of(xml)) {
      const auto& a = e.attributes;
      const auto reference = [&] { return static_cast<std::uint32_t>(std::stoul(a.at("valueReference"))); };
      if (e.name == "fmiModelDescription") model = a;
      if (e.name == "ModelExchange") exchange = a;
      if (e.name == "CoSimulation") simulation = a;
      if (e.name == "DefaultExperiment") experiment = a;
      if (e.name == "Float64") {
        variables.push_back(e);
        if (a.at("causality") == "parameter") parameters.push_back(reference());
      }
      if (e.name == "Output") outputs.push_back(reference());
      if (e.name == "InitialUnknown") initial.push_back(reference());
      if (e.name == "ContinuousStateDerivative") derivatives.push_back(reference());
    }
    for (const std::uint32_t d : derivatives)
      states.push_back(static_cast<std::uint32_t>(std::stoul(of(d).at("derivative"))));
  }
  const std::map<std::string, std::string>& of(std::uint32_t reference) const {
    for (const Element& v : variables)
      if (std::stoul(v.attributes.at("valueReference")) == reference) return v.attributes;
    fail("no variable " + std::to_string(reference));
  }
};

}  // namespace fmu
