#include "json_text.h"

#include <fmt/format.h>

#include <charconv>
#include <utility>

namespace costate::app {

std::string json_text(const Json& json) {
  const std::string text = json.dump(1, ' ', false, Json::error_handler_t::replace);
  std::string r;
  r.reserve(text.size());
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '"') quoted = !quoted;
    if (quoted && text[i] == '\\') r += text[i++];  // what follows is no end
    // -0 is a zero.
    const bool zero = !quoted && text.compare(i, 4, "-0.0") == 0;
    if (zero && (i + 4 == text.size() || (text[i + 4] != 'e' && (text[i + 4] < '0' || text[i + 4] > '9')))) continue;
    // Control characters of seven bits are escaped; of eight, U+0080 to U+009F in UTF-8, they may stand in JSON, but
    // not on a terminal.
    if (text[i] == '\x7f')
      r += "\\u007f";
    else if (text[i] == '\xc2' && i + 1 < text.size() && static_cast<unsigned char>(text[i + 1]) < 0xa0)
      r += fmt::format("\\u{:04x}", static_cast<unsigned>(static_cast<unsigned char>(text[++i])));
    else
      r += text[i];
  }
  return r;
}

void KeyedObject::set(const std::string& key, Json value) {
  auto& entries = object_.get_ref<Json::object_t&>();
  const auto [place, is_new] = places_.emplace(key, entries.size());
  if (is_new)
    entries.push_back({key, std::move(value)});
  else
    (entries.begin() + static_cast<std::ptrdiff_t>(place->second))->second = std::move(value);
}

Json KeyedObject::take() {
  places_.clear();
  return std::exchange(object_, Json::object());
}

double rounded(double x) {
  const std::string text = fmt::format("{:.3g}", x);
  double r = x;
  std::from_chars(text.data(), text.data() + text.size(), r);  // the smallest numbers, too, which stod refuses
  return r;
}

Json named(const std::vector<std::string>& names, const std::vector<double>& values) {
  KeyedObject j;
  for (std::size_t i = 0; i < names.size(); ++i) j.set(names[i], values[i]);
  return j.take();
}

}  // namespace costate::app
