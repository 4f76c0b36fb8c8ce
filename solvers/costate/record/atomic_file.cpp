#include "costate/record/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <mutex>
#include <set>
#include <string>
#include <system_error>

#include "costate/base/digest.h"
#include "costate/base/error.h"
#include "costate/record/nothing_to_save.h"
#include "costate/record/posix_file.h"

namespace costate {
namespace {

namespace fs = std::filesystem;
using record_detail::errno_text;
using record_detail::FileDescriptor;

// Follows a symbolic link, and refuses what rename(2) must not replace (directories, devices, pipes).
fs::path resolve_target(const fs::path& path) {
  if (path.filename().empty()) {
    throw Error(fmt::format("cannot write '{}': the path has no file name; give the path of a file", path.string()));
  }
  std::error_code code;
  fs::path target = path;
  if (fs::is_symlink(path, code)) {
    target = fs::weakly_canonical(path, code);
    if (code) target = path;
  }
  const fs::file_status status = fs::status(target, code);
  if (fs::is_directory(status)) {
    throw Error(fmt::format("cannot write '{}': it is a directory; give the path of a file inside it", path.string()));
  }
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    throw Error(
        fmt::format("cannot write '{}': it is a device or pipe and cannot be replaced atomically; "
                    "write to a regular file",
                    path.string()));
  }
  return target;
}

void create_parent(const fs::path& directory, const fs::path& path) {
  std::error_code code;
  fs::create_directories(directory, code);
  if (code || !fs::is_directory(directory)) {
    const std::string reason = code ? code.message() : errno_text(ENOTDIR);
    throw Error(
        fmt::format("cannot write '{}': creating the directory '{}' failed: {}; create it yourself or "
                    "choose another output path",
                    path.string(), directory.string(), reason));
  }
}

// Tells this machine and its space of process ids from others that may share a directory, so that the id in a
// temporary's name can be trusted.
const std::string& process_space() {
  static const std::string text = [] {
    char host[256] = {}, space[256] = {};
    ::gethostname(host, sizeof host - 1);
    if (::readlink("/proc/self/ns/pid", space, sizeof space - 1) < 0) space[0] = 0;
    Digest digest;
    digest.add(host);
    digest.add(space);
    return digest.text();
  }();
  return text;
}

// What a process that was killed left behind: temporaries with a name of ours, this user's, whose process is gone. A
// directory is looked through once by each process.
void remove_abandoned(const fs::path& directory) {
  static std::mutex mutex;
  static std::set<fs::path> seen;
  {
    const std::lock_guard<std::mutex> guard(mutex);
    std::error_code code;
    if (!seen.insert(fs::weakly_canonical(directory, code)).second) return;
  }
  std::error_code code;
  for (fs::directory_iterator entry(directory, code), end; !code && entry != end; entry.increment(code)) {
    const std::string name = entry->path().filename().string();
    // .NAME.SPACE-PID-COUNT.tmp
    const std::string mark = "." + process_space() + "-";
    const std::size_t at = name.rfind(mark);
    if (at == std::string::npos || at < 2 || name[0] != '.' || name.size() < 4 ||
        name.substr(name.size() - 4) != ".tmp")
      continue;
    int pid = 0, count = 0, used = 0;
    const std::string rest = name.substr(at + mark.size());
    if (std::sscanf(rest.c_str(), "%d-%d.tmp%n", &pid, &count, &used) != 2 || used != static_cast<int>(rest.size()) ||
        pid <= 0)
      continue;
    struct stat status {};
    if (::lstat(entry->path().c_str(), &status) != 0 || !S_ISREG(status.st_mode) || status.st_uid != ::geteuid())
      continue;
    if (::kill(pid, 0) != 0 && errno == ESRCH) ::unlink(entry->path().c_str());
  }
}

// Reserves a new empty file next to the target; the name is unique in this process (counter) and, through
// O_EXCL, against all others.
fs::path reserve_temporary(const fs::path& directory, const fs::path& target, const fs::path& path) {
  static std::atomic<unsigned long> counter{0};
  remove_abandoned(directory);
  const std::string name = target.filename().string().substr(0, 180);
  for (;;) {
    fs::path temporary =
        directory / fmt::format(".{}.{}-{}-{}.tmp", name, process_space(), ::getpid(), counter.fetch_add(1));
    const FileDescriptor file(::open(temporary.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0666));
    if (file.valid()) return temporary;
    if (errno == EEXIST) continue;
    throw Error(
        fmt::format("cannot write '{}': creating a file in '{}' failed: {}; check that you may write to "
                    "this directory, or choose another output path",
                    path.string(), directory.string(), errno_text(errno)));
  }
}

class TemporaryGuard {
 public:
  explicit TemporaryGuard(fs::path temporary) : temporary_(std::move(temporary)), at_once_(temporary_.string()) {}
  TemporaryGuard(const TemporaryGuard&) = delete;
  TemporaryGuard& operator=(const TemporaryGuard&) = delete;
  ~TemporaryGuard() {
    if (!temporary_.empty()) ::unlink(temporary_.c_str());
  }
  void release() { temporary_.clear(); }

 private:
  fs::path temporary_;
  RemovedAtOnce at_once_;
};

void sync_file(const fs::path& temporary, const fs::path& path) {
  FileDescriptor file(::open(temporary.c_str(), O_RDONLY | O_CLOEXEC));
  int failed = file.valid() ? record_detail::sync_to_disk(file.get()) : errno;
  if (failed == 0) failed = file.close();
  if (failed != 0) {
    throw Error(
        fmt::format("cannot write '{}': flushing it to disk failed: {}; check the free space and the "
                    "state of the disk",
                    path.string(), errno_text(failed)));
  }
}

}  // namespace

void write_file_atomically(const fs::path& path, const std::function<void(const fs::path& temporary)>& write) {
  const fs::path target = resolve_target(path);
  const fs::path directory = target.has_parent_path() ? target.parent_path() : fs::path(".");
  create_parent(directory, path);
  const fs::path temporary = reserve_temporary(directory, target, path);
  TemporaryGuard guard(temporary);

  write(temporary);

  struct stat old_file {};
  if (::stat(target.c_str(), &old_file) == 0) {
    // Best effort: the owner of the temporary may always do this; a file system without modes may refuse.
    [[maybe_unused]] const int ignored = ::chmod(temporary.c_str(), old_file.st_mode & 07777);
  }
  sync_file(temporary, path);
  if (::rename(temporary.c_str(), target.c_str()) != 0) {
    throw Error(
        fmt::format("cannot write '{}': renaming the finished file failed: {}; check the permissions of "
                    "the directory '{}'",
                    path.string(), errno_text(errno), directory.string()));
  }
  guard.release();

  // The new name itself must survive a power loss too; the content is safe in any case.
  const FileDescriptor parent(::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  [[maybe_unused]] const int ignored = parent.valid() ? record_detail::sync_to_disk(parent.get()) : 0;
}

void write_file_atomically(const fs::path& path, std::string_view content) {
  write_file_atomically(path, [&](const fs::path& temporary) {
    FileDescriptor file(::open(temporary.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC));
    int failed = file.valid() ? record_detail::write_all(file.get(), content) : errno;
    if (failed == 0) failed = file.close();
    if (failed != 0) {
      throw Error(
          fmt::format("cannot write '{}': writing {} bytes failed: {}; check the free space and the "
                      "permissions",
                      path.string(), content.size(), errno_text(failed)));
    }
  });
}

}  // namespace costate
