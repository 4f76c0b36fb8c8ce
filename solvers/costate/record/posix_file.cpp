#include "costate/record/posix_file.h"

#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace costate::record_detail {

FileDescriptor::~FileDescriptor() { close(); }

int FileDescriptor::close() {
  if (fd_ < 0) return 0;
  // After EINTR the descriptor is already gone on Linux: never close twice.
  const int result = ::close(std::exchange(fd_, -1));
  return result == 0 || errno == EINTR ? 0 : errno;
}

std::string errno_text(int error_number) { return std::generic_category().message(error_number); }

int write_all(int fd, std::string_view content) {
  while (!content.empty()) {
    const ssize_t written = ::write(fd, content.data(), content.size());
    if (written < 0) {
      if (errno == EINTR) continue;
      return errno;
    }
    content.remove_prefix(static_cast<std::size_t>(written));
  }
  return 0;
}

int sync_to_disk(int fd) {
  while (::fsync(fd) != 0) {
    if (errno == EINTR) continue;
    if (errno == EINVAL || errno == ENOTSUP) return 0;
    return errno;
  }
  return 0;
}

int read_all(int fd, std::string& content) {
  content.clear();
  char buffer[65536];
  for (;;) {
    const ssize_t count = ::read(fd, buffer, sizeof buffer);
    if (count < 0) {
      if (errno == EINTR) continue;
      return errno;
    }
    if (count == 0) return 0;
    content.append(buffer, static_cast<std::size_t>(count));
  }
}

}  // namespace costate::record_detail
