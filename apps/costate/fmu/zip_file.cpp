#include "zip_file.h"

#include <array>
#include <cstdint>

#include "costate/base/error.h"

namespace costate::app {

namespace {

/// CRC-32 of ISO 3309, the reflected polynomial 0xEDB88320.
std::uint32_t crc32_of(const std::string& bytes) {
  static const auto table = [] {
    std::array<std::uint32_t, 256> t{};
    for (std::uint32_t i = 0; i < 256; ++i) {
      t[i] = i;
      for (int k = 0; k < 8; ++k) t[i] = (t[i] & 1U) != 0 ? t[i] >> 1U ^ 0xEDB88320U : t[i] >> 1U;
    }
    return t;
  }();
  std::uint32_t c = 0xFFFFFFFFU;
  for (const char byte : bytes) c = table[(c ^ static_cast<unsigned char>(byte)) & 0xFFU] ^ c >> 8U;
  return ~c;
}

void put(std::string& to, std::uint64_t x, int bytes) {
  for (int k = 0; k < bytes; ++k) to += static_cast<char>(x >> (8 * k) & 0xFFU);
}

}  // namespace

std::string zip_bytes(const std::vector<std::pair<std::string, std::string>>& entries) {
  constexpr std::uint32_t kLocal = 0x04034b50, kCentral = 0x02014b50, kEnd = 0x06054b50;
  constexpr std::uint32_t kDate = 1U << 5U | 1U;  // 1980-01-01: the same scene gives the same bytes
  std::string file, directory;
  for (const auto& [path, content] : entries) {
    const std::uint64_t offset = file.size();
    // From the version needed, 20 for 2.0, to the length of an extra field, alike in both headers: names in UTF-8,
    // stored.
    std::string common;
    put(common, 20, 2);
    put(common, 0x0800, 2);
    put(common, 0, 2);
    put(common, 0, 2);
    put(common, kDate, 2);
    put(common, crc32_of(content), 4);
    put(common, content.size(), 4);
    put(common, content.size(), 4);
    put(common, path.size(), 2);
    put(common, 0, 2);
    put(file, kLocal, 4);
    file += common + path + content;
    put(directory, kCentral, 4);
    put(directory, 3U << 8U | 20U, 2);  // made by Unix
    directory += common;
    put(directory, 0, 2);  // comment
    put(directory, 0, 2);  // disk
    put(directory, 0, 2);  // internal attributes
    put(directory, 0100644U << 16U, 4);
    put(directory, offset, 4);
    directory += path;
  }
  if (file.size() + directory.size() > 0xFFFFFFFFU) throw Error("The files are too large for one file of ZIP (4 GB).");
  const std::uint64_t at = file.size();
  file += directory;
  put(file, kEnd, 4);
  put(file, 0, 4);
  put(file, entries.size(), 2);
  put(file, entries.size(), 2);
  put(file, directory.size(), 4);
  put(file, at, 4);
  put(file, 0, 2);
  return file;
}

}  // namespace costate::app
