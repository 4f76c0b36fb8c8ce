#include "costate/scene/key_meaning.h"

#include <map>

namespace costate {

namespace {
struct Declared {
  std::vector<KeyMeaning> keys;
  std::string example;
};
std::map<std::string, Declared>& table() {
  static std::map<std::string, Declared> kinds;
  return kinds;
}
}  // namespace

KindKeys::KindKeys(std::string name, std::vector<KeyMeaning> keys, std::string example) {
  table()[std::move(name)] = {std::move(keys), std::move(example)};
}

const std::vector<KeyMeaning>& key_meanings(const std::string& name) { return table()[name].keys; }

const std::string& key_example(const std::string& name) { return table()[name].example; }

}  // namespace costate
