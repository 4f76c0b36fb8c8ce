// What reading a scene tells about its keys: while a recorder is there, every getter of SceneTable in this thread
// reports what it was asked for. The reference of keys is made from it (key_reference.h); otherwise it costs nothing.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "costate/mechanism/number_rule.h"

namespace costate {

struct KeyRead {
  std::string key;
  std::string what;             // "a number", "an array of strings"; empty where only its presence was asked for
  std::string default_value;    // as a scene writes it, or empty: none
  bool may_be_missing = false;  // it has a default, or was asked for whether it is there
  NumberRule rule = NumberRule::any;
};

class KeyRecorder {
 public:
  /// Begins; what recorded before goes on when this one ends.
  KeyRecorder();
  ~KeyRecorder();
  KeyRecorder(const KeyRecorder&) = delete;
  KeyRecorder& operator=(const KeyRecorder&) = delete;

  /// The keys that the table at each path was asked for, in the order of asking.
  const std::map<std::string, std::vector<KeyRead>>& tables() const { return tables_; }

  /// The one that records in this thread, or null.
  static KeyRecorder* current();
  /// `what` and `default_value` count where nothing was said of the key before.
  void add(const std::string& table, const std::string& key, const std::string& what, bool may_be_missing,
           const std::string& default_value = {}, NumberRule rule = NumberRule::any);

 private:
  std::map<std::string, std::vector<KeyRead>> tables_;
  KeyRecorder* before_;
};

}  // namespace costate
