// Small POSIX utilities shared by the files of record/: an owning file descriptor, complete writes and
// the text of errno. Internal to record/; nothing here is part of the public interface of the library.
#pragma once

#include <string>
#include <string_view>
#include <utility>

namespace costate::record_detail {

/// Owns a POSIX file descriptor and closes it; -1 means "none".
class FileDescriptor {
 public:
  FileDescriptor() = default;
  explicit FileDescriptor(int fd) : fd_(fd) {}
  FileDescriptor(FileDescriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  ~FileDescriptor();

  [[nodiscard]] int get() const { return fd_; }
  [[nodiscard]] bool valid() const { return fd_ >= 0; }

  /// Closes now; returns 0, or the errno of close(2).
  int close();

 private:
  int fd_ = -1;
};

/// The text of an errno value, e.g. "No space left on device" (thread-safe strerror).
[[nodiscard]] std::string errno_text(int error_number);

/// Writes all of `content`, through short writes and EINTR. Returns 0 or the errno of write(2).
[[nodiscard]] int write_all(int fd, std::string_view content);

/// fsync(2), through EINTR; file systems that cannot sync (EINVAL, ENOTSUP) count as done. 0 or errno.
[[nodiscard]] int sync_to_disk(int fd);

/// Reads the rest of the file from its current position into `content`. Returns 0 or the errno of read(2).
[[nodiscard]] int read_all(int fd, std::string& content);

}  // namespace costate::record_detail
