#include "costate/scene/key_recorder.h"

#include <algorithm>

namespace costate {

namespace {
thread_local KeyRecorder* recorder = nullptr;
}

KeyRecorder::KeyRecorder() : before_(recorder) { recorder = this; }

KeyRecorder::~KeyRecorder() { recorder = before_; }

KeyRecorder* KeyRecorder::current() { return recorder; }

void KeyRecorder::add(const std::string& table, const std::string& key, const std::string& what, bool may_be_missing,
                      const std::string& default_value, NumberRule rule) {
  auto& reads = tables_[table];
  auto r = std::find_if(reads.begin(), reads.end(), [&](const auto& x) { return x.key == key; });
  if (r == reads.end()) {
    reads.emplace_back().key = key;
    r = reads.end() - 1;
  }
  if (r->what.empty()) r->what = what;
  if (r->default_value.empty()) r->default_value = default_value;
  if (rule != NumberRule::any) r->rule = rule;
  r->may_be_missing = r->may_be_missing || may_be_missing;
}

}  // namespace costate
