// Tests of atomic file writing.
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <csignal>
#include <filesystem>
#include <stdexcept>
#include <string>

#include "costate/base/error.h"
#include "costate/record/atomic_file.h"
#include "record_temporary_directory.h"

using Catch::Matchers::Contains;
using costate::write_file_atomically;
using record_test::error_of;
using record_test::file_content;
using record_test::put_content;
using record_test::TemporaryDirectory;
namespace fs = std::filesystem;

TEST_CASE("atomic file: writes and replaces content", "[record]") {
  const TemporaryDirectory directory;
  const fs::path path = directory / "a.txt";
  write_file_atomically(path, "first");
  CHECK(file_content(path) == "first");
  const std::string binary("x\0\n\xff", 4);
  write_file_atomically(path, binary);
  CHECK(file_content(path) == binary);
  write_file_atomically(path, "");
  CHECK(file_content(path).empty());
  CHECK(directory.entries() == 1);
}

TEST_CASE("atomic file: an exception leaves the old file and no temporary", "[record]") {
  const TemporaryDirectory directory;
  const fs::path path = directory / "a.txt";
  write_file_atomically(path, "old");
  const auto failing = [](const fs::path& temporary) {
    put_content(temporary, "half of the new cont");
    throw std::logic_error("writer failed");
  };
  CHECK_THROWS_AS(write_file_atomically(path, failing), std::logic_error);
  CHECK(file_content(path) == "old");
  CHECK(directory.entries() == 1);
  CHECK_THROWS_AS(write_file_atomically(directory / "new.txt", failing), std::logic_error);
  CHECK(directory.entries() == 1);
}

TEST_CASE("atomic file: the old file is visible until the writer is done", "[record]") {
  const TemporaryDirectory directory;
  const fs::path path = directory / "a.txt";
  write_file_atomically(path, "old");
  write_file_atomically(path, [&](const fs::path& temporary) {
    CHECK(temporary.parent_path() == path.parent_path());
    CHECK(temporary != path);
    write_file_atomically(directory / "other.txt", "other");  // nested: names do not collide
    put_content(temporary, "new");
    CHECK(file_content(path) == "old");
  });
  CHECK(file_content(path) == "new");
  CHECK(directory.entries() == 2);
}

TEST_CASE("atomic file: creates missing parents, keeps permissions, follows links", "[record]") {
  const TemporaryDirectory directory;
  const fs::path path = directory.path() / "x" / "y" / "a.txt";
  write_file_atomically(path, "deep");
  CHECK(file_content(path) == "deep");

  fs::permissions(path, fs::perms::owner_read | fs::perms::owner_write);
  write_file_atomically(path, "again");
  CHECK(fs::status(path).permissions() == (fs::perms::owner_read | fs::perms::owner_write));

  const fs::path link = directory / "link.txt";
  fs::create_symlink(path, link);
  write_file_atomically(link, "through the link");
  CHECK(fs::is_symlink(link));
  CHECK(file_content(path) == "through the link");
}

TEST_CASE("atomic file: what a killed process left behind is removed, and nothing else", "[record]") {
  const TemporaryDirectory directory;
  const fs::path path = directory / "a.txt";
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    write_file_atomically(path, [](const fs::path& temporary) {
      put_content(temporary, "half");
      ::kill(::getpid(), SIGKILL);
    });
    ::_exit(1);
  }
  ::waitpid(child, nullptr, 0);
  REQUIRE(directory.entries() == 1);  // the temporary
  const std::string left = fs::directory_iterator(directory.path())->path().filename().string();
  // Names that are almost ours: of a process that lives, of another machine, of another program.
  const std::string mine =
      left.substr(0, left.rfind('-', left.rfind('-') - 1) + 1) + std::to_string(::getppid()) + "-0.tmp";
  put_content(directory / mine, "alive");
  std::string elsewhere = left;
  const std::size_t space = left.find("txt.") + 4;
  elsewhere[space] = elsewhere[space] == '0' ? '1' : '0';
  put_content(directory / elsewhere, "elsewhere");
  put_content(directory / ".a.txt.swp", "editor");
  write_file_atomically(path, "whole");
  CHECK_FALSE(fs::exists(directory / left));
  for (const std::string& name : {mine, elsewhere, std::string(".a.txt.swp")}) CHECK(fs::exists(directory / name));
  CHECK(file_content(path) == "whole");
}

TEST_CASE("atomic file: a long file name is no problem", "[record]") {
  const TemporaryDirectory directory;
  const fs::path path = directory / std::string(255, 'n');
  write_file_atomically(path, "content");
  CHECK(file_content(path) == "content");
}

TEST_CASE("atomic file: errors name the path and the reason", "[record]") {
  const TemporaryDirectory directory;
  CHECK_THROWS_AS(write_file_atomically(directory.path(), "x"), costate::Error);
  CHECK_THAT(error_of([&] { write_file_atomically(directory.path(), "x"); }), Contains("is a directory"));
  CHECK_THAT(error_of([&] { write_file_atomically("/dev/null", "x"); }), Contains("device"));
  CHECK_THAT(error_of([&] { write_file_atomically(directory.path().string() + "/", "x"); }), Contains("no file name"));

  put_content(directory / "file", "x");
  const fs::path below_file = directory.path() / "file" / "a.txt";
  const std::string message = error_of([&] { write_file_atomically(below_file, "x"); });
  CHECK_THAT(message, Contains(below_file.string()) && Contains("Not a directory"));
}

TEST_CASE("atomic file: a directory without write permission is reported", "[record]") {
  const TemporaryDirectory directory;
  const fs::path closed = directory / "closed";
  fs::create_directory(closed);
  put_content(closed / "a.txt", "old");
  fs::permissions(directory.path(), fs::perms(0755));
  fs::permissions(closed, fs::perms(0555));
  // Permissions do not bind root: act as an ordinary user for the moment of the attempt.
  const bool root = ::geteuid() == 0;
  const uid_t nobody = 65534;
  const bool dropped = root && ::seteuid(nobody) == 0;
  if (root && !dropped) {
    WARN("running as root and cannot drop privileges: permission check skipped");
    return;
  }
  const std::string message = error_of([&] { write_file_atomically(closed / "a.txt", "new"); });
  if (dropped) REQUIRE(::seteuid(0) == 0);
  fs::permissions(closed, fs::perms(0755));
  CHECK_THAT(message,
             Contains("Permission denied") && Contains((closed / "a.txt").string()) && Contains("another output path"));
  CHECK(file_content(closed / "a.txt") == "old");
}
