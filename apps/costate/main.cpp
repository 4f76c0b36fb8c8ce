// costate: simulation, exact gradients and design optimization of multibody systems from scene files.
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "command.h"
#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/record/interrupt.h"
#include "costate/record/nothing_to_save.h"
#include "costate/record/print.h"
#include "guide.h"
#include "study/ranks.h"

namespace {

/// A failed run: the message on standard error and, with --json, the one object on standard output. What was noticed on
/// the way, the cause perhaps, comes with it.
int complain(bool json, const char* status, const std::string& message, int code) {
  const std::vector<std::string> warnings = costate::take_notices();
  costate::app::print_warnings(warnings);
  costate::print_message(code == costate::app::kFailed ? costate::app::with_guide(message) : message);
  if (json) {
    costate::app::Json j;
    j["status"] = status;
    j["error"] = message;
    if (const std::string guide = costate::app::guide_to(message); !guide.empty()) j["guide"] = guide;
    j["warnings"] = warnings;
    std::puts(costate::app::json_text(j).c_str());
  }
  return code;
}

/// Descriptors 0 to 2 that the caller has closed would be given to the next file that is opened, a journal, say. In
/// their place: nothing to read, a standard output that cannot be written (as it was), and an error stream without a
/// reader.
void hold_standard_descriptors() {
  const int modes[] = {O_RDONLY, O_RDONLY, O_WRONLY};
  for (int fd = 0; fd < 3; ++fd)
    if (::fcntl(fd, F_GETFD) < 0 && errno == EBADF) {
      const int opened = ::open("/dev/null", modes[fd]);  // the lowest that is free, this one
      if (opened >= 0 && opened != fd) {
        ::dup2(opened, fd);
        ::close(opened);
      }
    }
}

/// Standard output may be a full disk: a result that did not get there is a failure.
int flushed(int code) {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
  costate::print_message(fmt::format("standard output cannot be written: {}", std::strerror(errno)));
  return code != 0 ? code : costate::app::kFailed;
}

}  // namespace

int main(int argc, char** argv) {
  hold_standard_descriptors();
  costate::app::CommandLine line;
  // What ends a study on a rank behind the first before the ranks have met, each of them meets.
  const auto told_elsewhere = [&] {
    return argc > 1 && std::string_view(argv[1]) == "study" && costate::app::is_told_by_first_rank();
  };
  try {
    line.parse(argc, argv);
  } catch (const costate::app::UsageError& e) {
    if (told_elsewhere()) return costate::app::kUsage;
    // The parser gave up somewhere, possibly before it came to --json.
    const bool json = std::any_of(argv + 1, argv + argc, [](std::string_view a) { return a == "--json"; });
    const int code = complain(json, "failed", e.what(), costate::app::kUsage);
    costate::print_text(stderr, "Run 'costate --help' or 'costate COMMAND --help'.\n");
    return flushed(code);
  }
  if (!line.action()) return flushed(0);
  costate::install_interrupt_handler();
  // These compute one thing and write it at the end.
  constexpr std::string_view short_ones[] = {"simulate", "gradient", "equilibrium", "modes",
                                             "sweep",    "list",     "dump",        "draw"};
  std::optional<costate::NothingToSave> nothing_to_save;
  if (std::find(std::begin(short_ones), std::end(short_ones), std::string_view(argv[1])) != std::end(short_ones))
    nothing_to_save.emplace(line.common().json);
  try {
    const int code = line.action()();
    costate::app::print_warnings(costate::take_notices());  // of commands without a summary
    return flushed(code);
  } catch (const costate::Interrupted& e) {
    return flushed(complain(line.common().json, "interrupted", e.what(), 128 + e.signal_number()));
  } catch (const costate::app::UsageError& e) {
    if (told_elsewhere()) return costate::app::kUsage;
    return flushed(complain(line.common().json, "failed", e.what(), costate::app::kUsage));
  } catch (const std::bad_alloc&) {
    const std::string& scene = line.common().scene;
    return flushed(complain(line.common().json, "failed",
                            (scene.empty() ? "" : scene + ": ") +
                                "There is not enough memory for this: fewer parameters, points or elements need less.",
                            costate::app::kFailed));
  } catch (const std::exception& e) {
    if (told_elsewhere()) return costate::app::kFailed;
    return flushed(complain(line.common().json, "failed", e.what(), costate::app::kFailed));
  }
}
