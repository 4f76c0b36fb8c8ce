// Text on standard output and error that never throws: a disk that is full or a stream that is closed does not end the
// run that had something to say. Standard output is asked at the end (main) whether all of it got there.
#pragma once

#include <cstdio>
#include <string>
#include <string_view>

namespace costate {

inline void print_text(std::FILE* stream, std::string_view text) noexcept {
  std::fwrite(text.data(), 1, text.size(), stream);
  std::fflush(stream);
}

/// What a scene, a file or a command line holds may be anything; a terminal gets no control characters of theirs: all
/// but line ends become "\x1b".
std::string printable(std::string_view text);

/// A message on standard error: "costate: TEXT", printable, and a line end.
void print_message(std::string_view text);
/// Results for people on standard output, printable.
void print_result(std::string_view text);

}  // namespace costate
