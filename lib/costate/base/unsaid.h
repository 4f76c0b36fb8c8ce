// Runs made to judge another one: what they notice is nobody's concern.
#pragma once

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

}  // namespace costate
