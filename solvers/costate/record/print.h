// Text on standard output and error that never throws: a disk that is full or a stream that is closed does not end the
// run that had something to say. Standard output is asked at the end (main) whether all of it got there.
#pragma once

#include <cstdio>
#include <string_view>

namespace costate {

inline void print_text(std::FILE* stream, std::string_view text) noexcept {
  std::fwrite(text.data(), 1, text.size(), stream);
  std::fflush(stream);
}

}  // namespace costate
