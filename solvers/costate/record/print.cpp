#include "costate/record/print.h"

#include <fmt/format.h>

namespace costate {

std::string printable(std::string_view text) {
  std::string r;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto code = static_cast<unsigned char>(text[i]);
    // U+0080 to U+009F, in UTF-8, are control characters of eight bits.
    const bool of_eight_bits = code == 0xc2 && i + 1 < text.size() && static_cast<unsigned char>(text[i + 1]) < 0xa0;
    if ((code < 0x20 && code != '\n') || code == 0x7f || of_eight_bits)
      r += fmt::format("\\x{:02x}", of_eight_bits ? static_cast<unsigned char>(text[++i]) : code);
    else
      r += text[i];
  }
  return r;
}

void print_message(std::string_view text) { print_text(stderr, "costate: " + printable(text) + "\n"); }

void print_result(std::string_view text) { print_text(stdout, printable(text)); }

}  // namespace costate
