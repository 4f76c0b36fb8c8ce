// A fingerprint of bytes (FNV-1a, 64 bits): for telling whether a file is the one that was read before, and a record
// the one that was written. Every step is a bijection of the state, so that a single changed byte always changes the
// result. It protects against accidents, not against intent.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace costate {

class Digest {
 public:
  void add(std::string_view bytes) {
    for (const char c : bytes) state_ = (state_ ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
  }
  /// 16 hexadecimal digits.
  std::string text() const {
    std::string digits(16, '0');
    for (std::size_t i = 0; i < 16; ++i) digits[15 - i] = "0123456789abcdef"[(state_ >> (4 * i)) & 15U];
    return digits;
  }

 private:
  std::uint64_t state_ = 0xcbf29ce484222325U;
};

}  // namespace costate
