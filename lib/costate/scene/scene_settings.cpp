#include "costate/scene/scene_settings.h"

#include <map>

namespace costate {

namespace {
std::map<std::string, std::vector<std::string>>& table() {
  static std::map<std::string, std::vector<std::string>> words;
  return words;
}
}  // namespace

const std::vector<std::string>& setting_words(const std::string& path) { return table()[path]; }

RegisterSettingWords::RegisterSettingWords(const std::string& path, std::vector<std::string> words) {
  table()[path] = std::move(words);
}

}  // namespace costate
