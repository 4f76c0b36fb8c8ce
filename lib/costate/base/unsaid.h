// Notices of a part of the work by itself: of runs made to judge another one, whose notices are nobody's concern, and
// of attempts, the last of which speaks for them all.
#pragma once

#include <string>
#include <vector>

#include "costate/base/notice.h"

namespace costate {

/// While it lives notices of this thread are its own; with its end they go, and those from before are there again.
class Unsaid {
 public:
  Unsaid() : before_(take_notices()) {}
  Unsaid(const Unsaid&) = delete;
  Unsaid& operator=(const Unsaid&) = delete;
  ~Unsaid() {
    take_notices();
    for (const auto& sentence : before_) notice(sentence);
  }

 private:
  std::vector<std::string> before_;
};

/// While it lives notices of this thread are its own; with its end they stand behind those from before.
class OwnNotices {
 public:
  OwnNotices() : before_(take_notices()) {}
  OwnNotices(const OwnNotices&) = delete;
  OwnNotices& operator=(const OwnNotices&) = delete;
  ~OwnNotices() {
    const std::vector<std::string> own = take_notices();
    for (const auto& sentence : before_) notice(sentence);
    for (const auto& sentence : own) notice(sentence);
  }
  std::vector<std::string> all() const {
    std::vector<std::string> own = take_notices();
    for (const auto& sentence : own) notice(sentence);
    return own;
  }
  /// What was said so far is not to stand.
  void forget() const { take_notices(); }

 private:
  std::vector<std::string> before_;
};

}  // namespace costate
