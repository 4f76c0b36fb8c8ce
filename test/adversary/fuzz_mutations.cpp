// The fuzzer's changes to a text.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <iterator>

#include "adversary/fuzz_inputs.h"
#include "costate/kind/law/law_table.h"
#include "costate/scene/scene_kind.h"

namespace costate::fuzz {

namespace {

// In percent, of the kinds of inputs, in their order.
constexpr std::size_t kShares[kKinds] = {36, 8, 6, 12, 8, 6, 8, 8, 4, 4};

bool in_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '.'; }

const char* const kExtremes[] = {"0",     "-1",    "1e308", "-1e308", "1e-320",
                                 "nan",   "inf",   "-inf",  "1e999",  "99999999999999999999",
                                 "1e-12", "1e12",  "-0.0",  "1e-300", "0x7fffffffffffffff",
                                 "1e16",  "1e3300"};

const char* const kValues[] = {"true",
                               "\"\"",
                               "\"A\"",
                               "\"b\"",
                               "[]",
                               "[1, 2]",
                               "[0, 0, 0]",
                               "[1e308, 1e308, 1e308]",
                               "{}",
                               "[[]]",
                               "1979-05-27",
                               "{ kind = \"sine\" }",
                               "{ kind = \"formula\", formula = \"1/t\" }",
                               "{ kind = \"formula\", formula = \"log(-1)\" }",
                               "{ kind = \"table\", x = [0, 0], y = [1, 2] }",
                               "\"a.b\"",
                               "{ P = { x_m = 1, y_m = 2 } }",
                               "[\"P.x\", \"P.y\"]",
                               "\"\\u0000\"",
                               "\"\\u001b[31m\"",
                               "'"};

const char* const kLines[] = {"point = { P = { x_m = 1, y_m = 2 } }",
                              "[bar.b]",
                              "[point.P]",
                              "include = [\"fuzz.toml\"]",
                              "include = [\"/dev/zero\"]",
                              "remove = [\"*\"]",
                              "[[cost.running]]\nkind = \"square\"\noutput = \"P.x\"",
                              "[[cost.terminal]]\nkind = \"linear\"\noutput = \"energy\"",
                              "[start]\nequilibrium = true",
                              "ground = true",
                              "[run]\nt_end_s = 1",
                              "[run]\nt_end_s = 1\nformulation = \"maggi\"\nmethod = \"cvodes-adjoint\"",
                              "a.b.c.d.e = 1",
                              "[a]",
                              "[[a]]",
                              "= 1",
                              "x_m = 1",
                              "mass_kg = 0",
                              "[parameter.p]\nnumber = \"gravity.y_m_per_s2\"",
                              "[parameter.q]\nnumber = \"point.P.x_m\"\nlower = 1\nupper = 0"};

std::string part(const std::string& s, std::pair<std::size_t, std::size_t> r) {
  return s.substr(r.first, r.second - r.first);
}

}  // namespace

Mutator::Mutator(const std::vector<Input>& corpus, std::uint64_t seed) : corpus_(corpus), engine_(seed) {
  by_kind_.resize(std::size(kShares));
  for (const Input& input : corpus) by_kind_[static_cast<std::size_t>(input.kind)].push_back(&input);
}

Input Mutator::make() {
  std::size_t at = pick(100), kind = 0;
  while (kind + 1 < std::size(kShares) && at >= kShares[kind]) at -= kShares[kind++];
  const auto& list = by_kind_[kind].empty() ? by_kind_[0] : by_kind_[kind];
  Input input = *list[pick(list.size())];
  do change(input);
  while (chance(20));
  return input;
}

Mutator::Range Mutator::line(const std::string& s) {
  const std::size_t at = pick(s.size());
  const std::size_t before = at == 0 ? std::string::npos : s.rfind('\n', at - 1), end = s.find('\n', at);
  return {before == std::string::npos ? 0 : before + 1, end == std::string::npos ? s.size() : end};
}

Mutator::Range Mutator::number(const std::string& s) {
  for (int tries = 0; tries < 8; ++tries) {
    std::size_t at = s.find_first_of("0123456789", pick(s.size()));
    if (at == std::string::npos) continue;
    while (at > 0 && in_word(s[at - 1])) --at;
    if (!std::isdigit(static_cast<unsigned char>(s[at])) && s[at] != '.') continue;
    std::size_t end = at;
    while (end < s.size() && (in_word(s[end]) || ((s[end] == '-' || s[end] == '+') && std::tolower(s[end - 1]) == 'e')))
      ++end;
    if (at > 0 && s[at - 1] == '-') --at;
    return {at, end};
  }
  return {0, 0};
}

Mutator::Range Mutator::quoted(const std::string& s) {
  const auto [begin, end] = line(s);
  const std::size_t a = s.find('"', begin), b = a == std::string::npos ? a : s.find('"', a + 1);
  if (b == std::string::npos || b >= end) {
    const std::size_t c = s.find('"', pick(s.size())), d = c == std::string::npos ? c : s.find('"', c + 1);
    return d == std::string::npos ? Range{0, 0} : Range{c, d + 1};
  }
  return {a, b + 1};
}

Mutator::Range Mutator::table(const std::string& s) {
  const std::size_t at = s.find("\n[", pick(s.size()));
  if (at == std::string::npos) return {0, 0};
  const std::size_t end = s.find("\n[", at + 2);
  return {at + 1, end == std::string::npos ? s.size() : end + 1};
}

Mutator::Range Mutator::key(const std::string& s) {
  const auto [begin, end] = line(s);
  const std::size_t equals = s.find_first_of("=:", begin);
  if (equals == std::string::npos || equals >= end) return {0, 0};
  std::size_t last = equals;
  while (last > begin && s[last - 1] == ' ') --last;
  return {begin, last};
}

Mutator::Range Mutator::value(const std::string& s) {
  const Range k = key(s);
  if (k.second == 0) return {0, 0};
  const std::size_t equals = s.find_first_of("=:", k.second), end = s.find('\n', equals);
  return {equals + 1, end == std::string::npos ? s.size() : end};
}

std::string Mutator::other_number(const std::string& old) {
  const double x = std::strtod(old.c_str(), nullptr);
  switch (pick(10)) {
    case 0:
      return fmt::format("{}", -x);
    case 1:
      return fmt::format("{}", 2 * x);
    case 2:
      return fmt::format("{}", 0.5 * x);
    case 3:
      return fmt::format("{}", x + 1);
    case 4:
      return fmt::format("{:.0f}", x);
    case 5:
      return fmt::format("{}", x * 1e-3);
    case 6:
      return fmt::format("{}", x * 1e3);
    case 7:
      return "0";
    case 8:
      return fmt::format("{}", x * (0.9 + 0.001 * static_cast<double>(pick(200))));
    default:
      return kExtremes[pick(std::size(kExtremes))];
  }
}

void Mutator::change(Input& input) {
  if (input.text.empty()) return;
  if (chance(12))
    change_roughly(input.text);
  else
    change_gently(input.text);
}

void Mutator::change_gently(std::string& s) {
  const auto replace = [&](Range r, const std::string& by) {
    if (r.second > r.first) s.replace(r.first, r.second - r.first, by);
  };
  switch (pick(20)) {
    case 0:
    case 1:
    case 2:
    case 3:
    case 4:
    case 5: {
      const Range r = number(s);
      replace(r, other_number(part(s, r)));
      break;
    }
    case 6:
    case 7: {  // a name for another of the same text
      const Range from = quoted(s);
      const std::string name = part(s, from);
      replace(quoted(s), name);
      break;
    }
    case 8: {  // numbers change places
      const Range a = number(s);
      const std::string x = part(s, a);
      replace(number(s), x);
      break;
    }
    case 9: {  // a key less
      const auto [b, e] = line(s);
      s.erase(b, e - b + (e < s.size()));
      break;
    }
    case 10: {  // a table less
      const Range r = table(s);
      replace(r, "");
      break;
    }
    case 11: {  // a table twice, under another name
      const Range r = table(s);
      std::string copy = part(s, r);
      const std::size_t close = copy.find(']');
      if (close != std::string::npos && chance(80)) copy.insert(close, "2");
      s.insert(r.second, copy);
      break;
    }
    case 12: {  // two values change places
      const Range a = value(s);
      const std::string x = part(s, a);
      const Range b = value(s);
      const std::string y = part(s, b);
      if (a.second <= b.first) {
        replace(b, x);
        replace(a, y);
      }
      break;
    }
    case 13: {  // a key for another of the same text
      const Range a = key(s);
      const std::string x = part(s, a);
      replace(key(s), x);
      break;
    }
    case 14: {  // another type
      const Range r = value(s);
      const std::string x = part(s, r);
      if (r.second == 0) break;
      replace(r, chance(25)   ? fmt::format(" [{}]", x)
                 : chance(30) ? fmt::format(" \"{}\"", x)
                              : fmt::format(" {}", kValues[pick(std::size(kValues))]));
      break;
    }
    case 15: {  // a law for a number
      const auto& laws = law_kinds();
      replace(value(s), " " + laws[pick(laws.size())].example);
      break;
    }
    case 16: {  // another kind
      const std::size_t at = s.find("\n[", pick(s.size()));
      const std::size_t dot = at == std::string::npos ? at : s.find_first_of(".]\n", at + 2);
      if (dot != std::string::npos && s[dot] == '.')
        s.replace(at + 2, dot - at - 2, scene_kinds()[pick(scene_kinds().size())].name);
      break;
    }
    case 17: {  // of an example
      const auto& kinds = scene_kinds();
      const std::string& example = kinds[pick(kinds.size())].example;
      const Range r = table(example);
      s += "\n" + part(example, r);
      break;
    }
    case 18: {  // a list longer or shorter
      const std::size_t at = s.find(", ", pick(s.size()));
      if (at == std::string::npos) break;
      const std::size_t end = s.find_first_of(",]\n", at + 2);
      if (end == std::string::npos) break;
      if (chance(50))
        s.erase(at, end - at);
      else
        s.insert(at, s.substr(at, end - at));
      break;
    }
    default:
      s.insert(line(s).first, std::string(kLines[pick(std::size(kLines))]) + "\n");
  }
}

void Mutator::change_roughly(std::string& s) {
  switch (pick(7)) {
    case 0:
      s[pick(s.size())] = static_cast<char>(engine_() % 256);
      break;
    case 1:
      s.erase(pick(s.size()), 1 + pick(8));
      break;
    case 2: {  // a line of another input
      const std::string& other = corpus_[pick(corpus_.size())].text;
      const auto [b, e] = line(other);
      s.insert(line(s).first, other.substr(b, e - b) + "\n");
      break;
    }
    case 3:
      s.resize(pick(s.size()));
      break;
    case 4: {
      const auto [b, e] = line(s);
      s.insert(b, s.substr(b, e - b) + "\n");
      break;
    }
    case 5: {
      const Range r = number(s);
      if (r.second > r.first) s.replace(r.first, r.second - r.first, kValues[pick(std::size(kValues))]);
      break;
    }
    default:
      s.insert(pick(s.size()), 1, "[]{}=\"'#.,\n\\-\t"[pick(14)]);
  }
  if (s.empty()) s = "\n";
}

}  // namespace costate::fuzz
