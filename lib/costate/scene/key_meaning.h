// What kinds, laws and costs say of their keys, beside them in kind/: the meaning alone; type, unit and default follow
// from the calls that read a key (key_reference.h).
#pragma once

#include <string>
#include <vector>

namespace costate {

/// Keys of the same meaning stand together, "x_m, y_m".
struct KeyMeaning {
  std::string keys;
  std::string meaning;
};

/// Static objects of this class declare the keys of a kind ("bar"), a law ("law sine") or a cost ("cost square"). The
/// example is, of a cost, its keys on the output "plate.x"; of a kind, more tables, of forms that its own example
/// leaves out.
struct KindKeys {
  KindKeys(std::string name, std::vector<KeyMeaning> keys, std::string example = {});
};

const std::vector<KeyMeaning>& key_meanings(const std::string& name);
const std::string& key_example(const std::string& name);

}  // namespace costate
