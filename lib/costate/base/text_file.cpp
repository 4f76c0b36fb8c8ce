#include "costate/base/text_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <system_error>

#include "costate/base/error.h"
#include "costate/base/stop.h"

namespace costate {

namespace {

struct Descriptor {
  int value = -1;
  explicit Descriptor(int v) : value(v) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (value >= 0) ::close(value);
  }
};

constexpr int kPoll_ms = 100;

}  // namespace

std::string read_text_file(const std::string& path, std::size_t most, const std::string& what) {
  const auto fail = [&](const std::string& why) -> SceneError {
    return SceneError({path, 0, 0}, fmt::format("{} cannot be read: {}.", what, why));
  };
  const auto reason = [](int error) { return std::generic_category().message(error); };
  if (path.find('\0') != std::string::npos) throw fail("its name holds a null character");
  // A pipe without a writer must not hold the program in open().
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
  if (file.value < 0) throw fail(reason(errno) + "; check the path and its permissions");
  struct stat status {};
  if (::fstat(file.value, &status) != 0) throw fail(reason(errno));
  if (S_ISDIR(status.st_mode)) throw fail("it is a directory");
  if (S_ISREG(status.st_mode) && static_cast<std::size_t>(status.st_size) > most)
    throw fail(fmt::format("it has {} bytes, {} are the limit", status.st_size, most));
  std::string text;
  std::string buffer(1 << 16, '\0');
  for (;;) {
    check_stop();
    const ssize_t count = ::read(file.value, buffer.data(), buffer.size());
    if (count > 0) {
      text.append(buffer.data(), static_cast<std::size_t>(count));
      if (text.size() > most) throw fail(fmt::format("it has more than {} bytes, which is the limit", most));
      continue;
    }
    if (count == 0) {
      // Of a named pipe that no one has opened for writing yet this is no end.
      pollfd of{file.value, POLLIN, 0};
      if (!S_ISFIFO(status.st_mode) || !text.empty() || (::poll(&of, 1, kPoll_ms) > 0 && (of.revents & POLLHUP) != 0))
        return text;
      continue;
    }
    if (errno == EINTR) continue;
    if (errno != EAGAIN && errno != EWOULDBLOCK) throw fail(reason(errno));
    pollfd of{file.value, POLLIN, 0};
    ::poll(&of, 1, kPoll_ms);
  }
}

bool read_number(const std::string& text, double& x) {
  const char *begin = text.data(), *end = begin + text.size();
  if (begin != end && *begin == '+' && begin + 1 != end && begin[1] != '-') ++begin;
  const auto [stop, error] = std::from_chars(begin, end, x);
  return error == std::errc() && stop == end && begin != end && std::isfinite(x);
}

}  // namespace costate
