// Tests of the optimization journal.
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <limits>
#include <random>
#include <string>

#include "costate/base/error.h"
#include "costate/record/journal.h"
#include "costate/record/json_number.h"
#include "record_temporary_directory.h"

using Catch::Matchers::Contains;
using costate::Journal;
using nlohmann::json;
using record_test::error_of;
using record_test::file_content;
using record_test::FileSizeLimit;
using record_test::put_content;
using record_test::TemporaryDirectory;
namespace fs = std::filesystem;

namespace {

const json kHeader = {{"scene", "[scene]\nname = 1\n"},
                      {"settings", {{"rtol", 1e-6}, {"bounds", {0.1, std::numeric_limits<double>::infinity()}}}}};

void fill(const fs::path& path, int count) {
  Journal journal = Journal::open(path, kHeader, false);
  for (int i = 0; i < count; ++i) journal.append({{"i", i}, {"f", i / 3.0}});
}

}  // namespace

TEST_CASE("journal: append, resume, append", "[record]") {
  const TemporaryDirectory directory;
  const fs::path path = directory / "run.jsonl";
  fill(path, 3);
  {
    Journal journal = Journal::open(path, kHeader, true);
    CHECK(journal.resumed_records() == 3);
    CHECK_FALSE(journal.dropped_partial_record());
    REQUIRE(journal.records().size() == 3);
    CHECK(journal.records()[1].at("f").get<double>() == 1 / 3.0);
    journal.append({{"i", 3}});
    CHECK(journal.records().size() == 4);
    CHECK(journal.resumed_records() == 3);
  }
  CHECK(Journal::open(path, kHeader, true).records().at(3).at("i") == 3);
  // Without resume: a new journal, whatever header the old one had.
  CHECK(Journal::open(path, {{"other", 1}}, false).records().empty());
  CHECK(Journal::open(path, {{"other", 1}}, true).records().empty());
  CHECK(directory.entries() == 1);
}

TEST_CASE("journal: resume without a file or with an empty one begins a new journal", "[record]") {
  const TemporaryDirectory directory;
  const fs::path path = directory.path() / "sub" / "run.jsonl";
  { Journal::open(path, kHeader, true).append({{"i", 0}}); }
  CHECK(Journal::open(path, kHeader, true).records().size() == 1);
  put_content(path, "");
  { CHECK(Journal::open(path, kHeader, true).records().empty()); }
  CHECK(Journal::open(path, kHeader, true).records().empty());
}

TEST_CASE("journal: numbers round-trip bit-exactly", "[record]") {
  const TemporaryDirectory directory;
  const fs::path path = directory / "run.jsonl";
  std::vector<double> numbers = {0.0,
                                 -0.0,
                                 0.1,
                                 1.0 / 3.0,
                                 5e-324,
                                 2.2250738585072014e-308,
                                 1.7976931348623157e308,
                                 1e22,
                                 1e23,
                                 9007199254740993.0,
                                 std::nan(""),
                                 std::numeric_limits<double>::infinity(),
                                 -std::numeric_limits<double>::infinity()};
  std::mt19937_64 random(7);
  while (numbers.size() < 5000) {
    const std::uint64_t bits = random();
    double value = 0.0;
    std::memcpy(&value, &bits, sizeof value);
    if (!std::isnan(value)) numbers.push_back(value);
  }
  { Journal::open(path, kHeader, false).append({{"x", numbers}, {"f", std::nan("")}}); }
  const Journal journal = Journal::open(path, kHeader, true);
  const std::vector<double> back = costate::numbers_from_json(journal.records().at(0).at("x"));
  REQUIRE(back.size() == numbers.size());
  CHECK(std::memcmp(back.data(), numbers.data(), back.size() * sizeof(double)) == 0);
  CHECK(journal.records()[0].at("f") == "nan");
  CHECK_THROWS_AS(costate::number_from_json("nine"), costate::Error);
  CHECK_THROWS_AS(costate::number_from_json(nullptr), costate::Error);
  CHECK_THROWS_AS(costate::numbers_from_json(1.0), costate::Error);
}

TEST_CASE("journal: every truncation is recovered from", "[record]") {
  const TemporaryDirectory directory;
  const fs::path path = directory / "run.jsonl";
  fill(path, 3);
  const std::string whole = file_content(path);
  const std::size_t header_end = whole.find('\n') + 1;
  const std::size_t last_line = whole.rfind('\n', whole.size() - 2) + 1;
  for (std::size_t size = last_line; size < whole.size(); ++size) {
    CAPTURE(size);
    put_content(path, whole.substr(0, size));
    {
      Journal journal = Journal::open(path, kHeader, true);
      CHECK(journal.records().size() == 2);
      CHECK(journal.dropped_partial_record() == (size != last_line));
      CHECK(fs::file_size(path) == last_line);
      journal.append({{"i", 2}, {"f", 2 / 3.0}});
    }
    CHECK(file_content(path) == whole);
  }
  put_content(path, whole.substr(0, header_end));
  { CHECK(Journal::open(path, kHeader, true).records().empty()); }
  put_content(path, whole.substr(0, header_end - 1));
  CHECK_THAT(error_of([&] { (void)Journal::open(path, kHeader, true); }), Contains("within its header"));
}

TEST_CASE("journal: a damaged record is cut off with all after it", "[record]") {
  const TemporaryDirectory directory;
  const fs::path path = directory / "run.jsonl";
  fill(path, 4);
  const std::string whole = file_content(path);
  const std::size_t first = whole.find('\n') + 1, second = whole.find('\n', first) + 1,
                    third = whole.find('\n', second) + 1;
  // Every byte of the second record, replaced by another: what is read is what was written, or it is cut off.
  for (std::size_t at = second; at + 1 < third; ++at) {
    CAPTURE(at);
    std::string content = whole;
    content[at] = content[at] == '7' ? '8' : '7';
    put_content(path, content);
    const Journal journal = Journal::open(path, kHeader, true);
    REQUIRE(journal.records().size() == 1);
    CHECK(journal.records()[0].at("i") == 0);
    CHECK_THAT(journal.damage(), Contains("record 2 is damaged"));
    CHECK(file_content(path) == whole.substr(0, second));
  }
  // Records that are whole, but not in their place.
  put_content(path, whole.substr(0, first) + whole.substr(second));
  CHECK(Journal::open(path, kHeader, true).records().empty());
  // What the caller cannot have written.
  put_content(path, whole);
  {
    Journal journal = Journal::open(path, kHeader, true);
    CHECK(journal.damage().empty());
    journal.keep(2, "its length");
    CHECK_THAT(journal.damage(), Contains("record 3 is damaged (its length)"));
    journal.append({{"i", 2}, {"f", 2 / 3.0}});
  }
  CHECK(Journal::open(path, kHeader, true).records().size() == 3);
  put_content(path, "{\"costate_journal\":oops\n");
  CHECK_THAT(error_of([&] { (void)Journal::open(path, kHeader, true); }), Contains("header") && Contains("damaged"));
}

TEST_CASE("journal: a header of another run is refused, naming the keys", "[record]") {
  const TemporaryDirectory directory;
  const fs::path path = directory / "run.jsonl";
  fill(path, 1);
  const std::string before = file_content(path);
  const auto message = [&](const json& header) { return error_of([&] { (void)Journal::open(path, header, true); }); };
  json other = kHeader;
  other["settings"]["rtol"] = 1e-8;
  CHECK_THAT(message(other), Contains("'settings/rtol': the journal has 1e-06, this run has 1e-08"));
  other = kHeader;
  other["scene"] = "[scene]\nname = 2\n";
  CHECK_THAT(message(other), Contains("'scene': the texts differ from line 2 on"));
  other = kHeader;
  other["seed"] = 1;
  CHECK_THAT(message(other), Contains("'seed': the journal has none, this run has 1"));
  other = kHeader;
  other.erase("scene");
  CHECK_THAT(message(other), Contains("'scene'") && Contains("this run has none"));
  other = kHeader;
  other["settings"]["bounds"][1] = 3;
  CHECK_THAT(message(other), Contains("'settings/bounds/1': the journal has \"inf\", this run has 3"));
  CHECK_THAT(message(json::array()), Contains("another run"));
  CHECK(file_content(path) == before);
}

TEST_CASE("journal: a file that is not a journal is never touched", "[record]") {
  const TemporaryDirectory directory;
  const fs::path path = directory / "scene.toml";
  put_content(path, "[scene]\n");
  const bool resume = GENERATE(true, false);
  CHECK_THAT(error_of([&] { (void)Journal::open(path, kHeader, resume); }), Contains("not a Costate journal"));
  CHECK(file_content(path) == "[scene]\n");
}

TEST_CASE("journal: two runs cannot share a journal", "[record]") {
  const TemporaryDirectory directory;
  const fs::path path = directory / "run.jsonl";
  Journal journal = Journal::open(path, kHeader, false);
  journal.append({{"i", 1}});
  CHECK(Journal::in_use(path));
  const bool resume = GENERATE(true, false);
  CHECK_THAT(error_of([&] { (void)Journal::open(path, kHeader, resume); }), Contains("in use by another run"));
  const Journal moved = std::move(journal);
  CHECK(moved.records().size() == 1);
}

TEST_CASE("journal: text that is not UTF-8 is refused and nothing is written", "[record]") {
  const TemporaryDirectory directory;
  const fs::path path = directory / "run.jsonl";
  Journal journal = Journal::open(path, kHeader, false);
  const auto size = fs::file_size(path);
  CHECK_THROWS_AS(journal.append({{"text", "\xff"}}), costate::Error);
  CHECK(fs::file_size(path) == size);
}

TEST_CASE("journal: a full disk is an error and leaves complete records only", "[record]") {
  const TemporaryDirectory directory;
  const fs::path path = directory / "run.jsonl";
  const json record = {{"x", std::string(1000, 'x')}};
  {
    Journal journal = Journal::open(path, kHeader, false);
    std::string message;
    {
      const FileSizeLimit limit(4096);
      while (message.empty()) message = error_of([&] { journal.append(record); });
    }
    CHECK_THAT(message, Contains("run.jsonl") && Contains("File too large"));
    CHECK(journal.records().size() == 3);
    CHECK(file_content(path).back() == '\n');
    journal.append(record);  // there is space again
  }
  const Journal journal = Journal::open(path, kHeader, true);
  CHECK(journal.records() == std::vector<json>(4, record));
  CHECK_FALSE(journal.dropped_partial_record());
}

TEST_CASE("journal: survives kill -9 at any moment", "[record]") {
  const TemporaryDirectory directory;
  const fs::path path = directory / "run.jsonl";
  int channel[2];
  REQUIRE(::pipe(channel) == 0);
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    try {
      Journal journal = Journal::open(path, kHeader, false);
      for (int i = 0;; ++i) {
        journal.append({{"i", i}, {"x", std::vector<double>(500, 1.0 / (i + 3))}});
        if (::write(channel[1], &i, sizeof i) != sizeof i) ::_exit(1);
      }
    } catch (...) {
      ::_exit(2);
    }
  }
  ::close(channel[1]);
  int acknowledged = -1;
  for (int i = 0; i < 20; ++i) REQUIRE(::read(channel[0], &acknowledged, sizeof acknowledged) == sizeof acknowledged);
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  while (::read(channel[0], &acknowledged, sizeof acknowledged) == sizeof acknowledged) continue;
  ::close(channel[0]);
  const Journal journal = Journal::open(path, kHeader, true);
  REQUIRE(journal.records().size() >= static_cast<std::size_t>(acknowledged) + 1);
  for (std::size_t i = 0; i < journal.records().size(); ++i) CHECK(journal.records()[i].at("i") == i);
}
