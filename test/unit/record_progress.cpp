// Tests of the progress display and of interruption.
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <string>
#include <thread>

#include "costate/record/interrupt.h"
#include "costate/record/progress.h"

using Catch::Matchers::Contains;
using costate::Progress;
using costate::ProgressOptions;

namespace {

// What `action` prints through a Progress with these options.
template <class Action>
std::string printed(ProgressOptions options, Action action) {
  std::FILE* stream = std::tmpfile();
  REQUIRE(stream != nullptr);
  options.stream = stream;
  {
    Progress progress(options);
    action(progress);
  }
  std::string text(static_cast<std::size_t>(std::ftell(stream)), '\0');
  std::rewind(stream);
  REQUIRE(std::fread(text.data(), 1, text.size(), stream) == text.size());
  std::fclose(stream);
  return text;
}

ProgressOptions options(bool quiet, bool verbose, bool terminal) {
  ProgressOptions result;
  result.quiet = quiet;
  result.verbose = verbose;
  result.is_terminal = terminal;
  return result;
}

}  // namespace

TEST_CASE("progress: shows one rewritten line on a terminal and clears it", "[record]") {
  const std::string text = printed(options(false, false, true), [](Progress& progress) {
    progress.start(0.0);
    std::this_thread::sleep_for(std::chrono::milliseconds(60));
    progress.update(2.5, 10.0, 123);
  });
  CHECK_THAT(text,
             Contains("t = 2.5 of 10 s") && Contains(" 25 %") && Contains("123 steps") && Contains("simulated s/s"));
  CHECK(text.find('\n') == std::string::npos);
  CHECK(text.substr(text.size() - 4) == "\r\x1b[K");
}

TEST_CASE("progress: is rate limited", "[record]") {
  const auto begin = std::chrono::steady_clock::now();
  const std::string text = printed(options(false, false, true), [&](Progress& progress) {
    long steps = 0;
    while (std::chrono::steady_clock::now() < begin + std::chrono::milliseconds(250)) {
      ++steps;
      progress.update(1e-9 * static_cast<double>(steps), 1.0, steps);
    }
  });
  // On a busy machine it took longer than that.
  const auto taken = std::chrono::steady_clock::now() - begin;
  std::size_t shown = 0;
  for (std::size_t at = text.find("t = "); at != std::string::npos; at = text.find("t = ", at + 1)) ++shown;
  CHECK(shown >= 2);
  CHECK(shown <= 1 + static_cast<std::size_t>(taken / std::chrono::milliseconds(100)));
}

TEST_CASE("progress: lines stay, and obey quiet and verbose", "[record]") {
  const auto action = [](Progress& progress) {
    progress.update(1.0, 2.0, 1);
    progress.line("evaluation 1");
  };
  CHECK_THAT(printed(options(false, false, true), action), Contains("\r\x1b[Kevaluation 1\n"));
  CHECK(printed(options(false, true, false), action) == "evaluation 1\n");
  CHECK(printed(options(false, false, false), action).empty());
  CHECK(printed(options(true, true, true), action).empty());
  CHECK(printed(options(true, true, false), action).empty());
}

TEST_CASE("progress: a time span of zero is complete", "[record]") {
  const auto action = [](Progress& progress) { progress.update(0.0, 0.0, 0); };
  CHECK_THAT(printed(options(false, false, true), action), Contains("100 %"));
}

TEST_CASE("interrupt: the first signal sets the flag", "[record]") {
  struct sigaction old_int {};
  struct sigaction old_term {};
  sigaction(SIGINT, nullptr, &old_int);
  sigaction(SIGTERM, nullptr, &old_term);
  std::signal(SIGINT, SIG_DFL);  // the test may run in the background, where SIGINT is ignored
  std::signal(SIGTERM, SIG_DFL);
  costate::install_interrupt_handler();
  CHECK_FALSE(costate::interrupted());
  CHECK_NOTHROW(costate::throw_if_interrupted());
  const int number = GENERATE(SIGINT, SIGTERM);
  std::raise(number);
  CHECK(costate::interrupted());
  CHECK_THROWS_AS(costate::throw_if_interrupted(), costate::Interrupted);
  try {
    costate::throw_if_interrupted();
  } catch (const costate::Interrupted& error) {
    CHECK(error.signal_number() == number);
  }
  costate::install_interrupt_handler();
  CHECK_FALSE(costate::interrupted());
  sigaction(SIGINT, &old_int, nullptr);
  sigaction(SIGTERM, &old_term, nullptr);
}

TEST_CASE("interrupt: the second signal kills, an ignored signal stays ignored", "[record]") {
  const bool ignored = GENERATE(false, true);
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    std::signal(SIGTERM, SIG_DFL);
    std::signal(SIGINT, ignored ? SIG_IGN : SIG_DFL);
    costate::install_interrupt_handler();
    std::raise(SIGINT);
    if (costate::interrupted() == ignored) ::_exit(1);
    std::raise(SIGINT);
    ::_exit(2);
  }
  int status = 0;
  REQUIRE(::waitpid(child, &status, 0) == child);
  if (ignored) {
    CHECK((WIFEXITED(status) && WEXITSTATUS(status) == 2));
  } else {
    CHECK((WIFSIGNALED(status) && WTERMSIG(status) == SIGINT));
  }
}
