// Tests of the trajectory table and its HDF5 and CSV files.
#include <hdf5.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <string>
#include <thread>

#include "costate/base/error.h"
#include "costate/record/csv_file.h"
#include "costate/record/hdf5_file.h"
#include "costate/record/json_number.h"
#include "costate/record/trajectory_table.h"
#include "record_temporary_directory.h"

using Catch::Matchers::Contains;
using costate::read_csv;
using costate::read_hdf5;
using costate::TrajectoryTable;
using costate::write_csv;
using costate::write_hdf5;
using record_test::error_of;
using record_test::file_content;
using record_test::FileSizeLimit;
using record_test::put_content;
using record_test::TemporaryDirectory;
namespace fs = std::filesystem;

namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0);
}

void check_same(const TrajectoryTable& a, const TrajectoryTable& b) {
  CHECK(same_bits(a.time_s, b.time_s));
  CHECK(a.events == b.events);
  REQUIRE(a.columns.size() == b.columns.size());
  for (std::size_t i = 0; i < a.columns.size(); ++i) {
    CAPTURE(i, a.columns[i].name);
    CHECK(a.columns[i].name == b.columns[i].name);
    CHECK(a.columns[i].unit == b.columns[i].unit);
    CHECK(a.columns[i].group == b.columns[i].group);
    CHECK(same_bits(a.columns[i].values, b.columns[i].values));
  }
}

TrajectoryTable sample_table(std::size_t rows) {
  TrajectoryTable table;
  table.columns = {{"P1.x", "m", "coordinates", {}},
                   {"P1.x", "m/s", "velocities", {}},
                   {"P0.x", "m", "coordinates", {}},
                   {"joint \"a\", part [b]", "", "multipliers", {}},
                   {"Winkel φ", "°", "outputs", {}}};
  for (std::size_t i = 0; i < rows; ++i) {
    table.time_s.push_back(0.1 * static_cast<double>(i));
    for (std::size_t k = 0; k < table.columns.size(); ++k) {
      table.columns[k].values.push_back(std::sin(static_cast<double>(i * 7 + k)) / 3.0);
    }
  }
  table.events = {{0.01, "contact.foot: touch", "closed", 0.25}, {0.02, "contact.foot: release", "open", -0.25}};
  table.scene_text = "[scene]\nname = \"Vierergelenk – test\"\n" + std::string(100000, '#') + "\n";
  table.settings = {{"rtol", 1e-8}, {"method", "radau"}, {"limits", {0.1, -3}}, {"nested", {{"on", true}}}};
  return table;
}

}  // namespace

TEST_CASE("hdf5: round trip keeps everything", "[record]") {
  const TemporaryDirectory directory;
  const std::size_t rows = GENERATE(0, 1, 5, 4096, 4097, 40000);
  const TrajectoryTable table = sample_table(rows);
  write_hdf5(directory / "a.h5", table);
  const TrajectoryTable back = read_hdf5(directory / "a.h5");
  check_same(table, back);
  CHECK(back.scene_text == table.scene_text);
  CHECK(back.settings == table.settings);
  CHECK(directory.entries() == 1);
}

TEST_CASE("hdf5: special values, empty texts, no columns", "[record]") {
  const TemporaryDirectory directory;
  TrajectoryTable table;
  write_hdf5(directory / "empty.h5", table);
  check_same(table, read_hdf5(directory / "empty.h5"));
  CHECK(read_hdf5(directory / "empty.h5").scene_text.empty());
  CHECK(read_hdf5(directory / "empty.h5").settings.is_null());

  table.time_s = {0, 1, 2, 3, 4, 5};
  table.columns = {{"u", "", "states", {-0.0, kInf, -kInf, std::nan(""), 5e-324, 1.7976931348623157e308}}};
  table.settings = {{"bound", kInf}};
  write_hdf5(directory / "a.h5", table);
  const TrajectoryTable back = read_hdf5(directory / "a.h5");
  check_same(table, back);
  CHECK(costate::number_from_json(back.settings.at("bound")) == kInf);
}

TEST_CASE("hdf5: the file has the documented layout and is reproducible", "[record]") {
  const TemporaryDirectory directory;
  write_hdf5(directory / "a.h5", sample_table(10));
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));  // a stored time stamp would differ
  write_hdf5(directory / "b.h5", sample_table(10));
  CHECK((file_content(directory / "a.h5") == file_content(directory / "b.h5")));

  const hid_t file = H5Fopen((directory / "a.h5").c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  REQUIRE(file >= 0);
  for (const char* path : {"time", "scene", "settings", "coordinates/P1.x", "velocities/P1.x", "events/time",
                           "events/name", "events/mode", "events/jump"}) {
    CAPTURE(path);
    CHECK(H5Lexists(file, path, H5P_DEFAULT) > 0);
  }
  CHECK(H5Aexists(file, "format") > 0);
  CHECK(H5Aexists(file, "format_version") > 0);
  CHECK(H5Aexists_by_name(file, "time", "unit", H5P_DEFAULT) > 0);
  CHECK(H5Aexists_by_name(file, "coordinates/P1.x", "unit", H5P_DEFAULT) > 0);
  H5Fclose(file);
}

TEST_CASE("hdf5: long tables are compressed", "[record]") {
  const TemporaryDirectory directory;
  TrajectoryTable table;
  table.time_s.assign(100000, 1.0);
  write_hdf5(directory / "a.h5", table);
  CHECK(fs::file_size(directory / "a.h5") < 50000);
}

TEST_CASE("hdf5: foreign, damaged and missing files are reported", "[record]") {
  const TemporaryDirectory directory;
  CHECK_THAT(error_of([&] { (void)read_hdf5(directory / "none.h5"); }),
             Contains("none.h5") && Contains("no such file"));
  put_content(directory / "text.h5", "not hdf5");
  CHECK_THAT(error_of([&] { (void)read_hdf5(directory / "text.h5"); }), Contains("not an HDF5 file"));
  CHECK_THROWS_AS(read_hdf5(directory.path()), costate::Error);

  const hid_t file = H5Fcreate((directory / "other.h5").c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  H5Fclose(file);
  CHECK_THAT(error_of([&] { (void)read_hdf5(directory / "other.h5"); }), Contains("not a Costate trajectory"));

  write_hdf5(directory / "a.h5", sample_table(1000));
  fs::resize_file(directory / "a.h5", fs::file_size(directory / "a.h5") / 2);
  CHECK_THAT(error_of([&] { (void)read_hdf5(directory / "a.h5"); }), Contains("a.h5") && Contains("truncated"));
}

TEST_CASE("hdf5: a failing write keeps the old file", "[record]") {
  const TemporaryDirectory directory;
  const TrajectoryTable table = sample_table(3);
  write_hdf5(directory / "a.h5", table);
  TrajectoryTable bad = table;
  bad.scene_text = std::string("a\0b", 3);
  CHECK_THAT(error_of([&] { write_hdf5(directory / "a.h5", bad); }), Contains("a.h5") && Contains("zero byte"));
  check_same(table, read_hdf5(directory / "a.h5"));
  CHECK(directory.entries() == 1);
}

TEST_CASE("hdf5 and csv: a full disk is an error and keeps the old file", "[record]") {
  const TemporaryDirectory directory;
  const TrajectoryTable table = sample_table(3);
  write_hdf5(directory / "a.h5", table);
  write_csv(directory / "a.csv", table);
  const TrajectoryTable large = sample_table(20000);
  std::string hdf5_error;
  std::string csv_error;
  {
    const FileSizeLimit limit(8192);
    hdf5_error = error_of([&] { write_hdf5(directory / "a.h5", large); });
    csv_error = error_of([&] { write_csv(directory / "a.csv", large); });
  }
  CHECK_THAT(hdf5_error, Contains("a.h5") && Contains("File too large"));
  CHECK_THAT(csv_error, Contains("a.csv") && Contains("File too large"));
  check_same(table, read_hdf5(directory / "a.h5"));
  TrajectoryTable columns = table;
  columns.events.clear();  // a table of columns has no place for them
  check_same(columns, read_csv(directory / "a.csv"));
  CHECK(directory.entries() == 2);
}

TEST_CASE("trajectory table: inconsistent tables are rejected", "[record]") {
  const TemporaryDirectory directory;
  TrajectoryTable table = sample_table(3);
  CHECK_NOTHROW(table.require_consistent());
  std::string expected;
  SECTION("slash in a name") {
    table.columns[0].name = "P1/x";
    expected = "must not contain '/'";
  }
  SECTION("slash in a group") {
    table.columns[0].group = "a/b";
    expected = "must not contain '/'";
  }
  SECTION("empty name") {
    table.columns[0].name = "";
    expected = "must not be empty";
  }
  SECTION("dot") {
    table.columns[0].name = ".";
    expected = "must not be '.'";
  }
  SECTION("reserved group") {
    table.columns[0].group = "time";
    expected = "reserved";
  }
  SECTION("control character") {
    table.columns[0].name = "a\nb";
    expected = "control characters";
  }
  SECTION("not UTF-8") {
    table.columns[0].unit = "\xff";
    expected = "UTF-8";
  }
  SECTION("length") {
    table.columns[2].values.pop_back();
    expected = "2 values but there are 3 time instants";
  }
  SECTION("twice") {
    table.columns[2].name = "P1.x";
    expected = "more than once";
  }
  CHECK_THAT(error_of([&] { table.require_consistent(); }), Contains(expected));
  CHECK_THAT(error_of([&] { write_hdf5(directory / "a.h5", table); }), Contains(expected));
  CHECK_THAT(error_of([&] { write_csv(directory / "a.csv", table); }), Contains(expected));
  CHECK(directory.entries() == 0);
}

TEST_CASE("trajectory table: find", "[record]") {
  const TrajectoryTable table = sample_table(1);
  CHECK(table.find("velocities", "P1.x") == &table.columns[1]);
  CHECK(table.find("velocities", "P2.x") == nullptr);
}

TEST_CASE("csv: header, quoting and shortest digits", "[record]") {
  const TemporaryDirectory directory;
  TrajectoryTable table;
  table.time_s = {0, 0.1};
  table.columns = {{"P1.x", "m", "coordinates", {1.0 / 3.0, -0.0}}, {"a,\"b\"", "", "outputs", {1e300, std::nan("")}}};
  write_csv(directory / "a.csv", table);
  CHECK(file_content(directory / "a.csv") ==
        "time [s],coordinates/P1.x [m],\"outputs/a,\"\"b\"\"\"\n"
        "0,0.3333333333333333,1e+300\n"
        "0.1,-0,nan\n");
}

TEST_CASE("csv: round trip", "[record]") {
  const TemporaryDirectory directory;
  TrajectoryTable table = sample_table(GENERATE(0, 1, 20000));
  table.events.clear();  // CSV has none
  if (!table.time_s.empty()) table.columns[1].values[0] = -kInf;
  write_csv(directory / "a.csv", table);
  check_same(table, read_csv(directory / "a.csv"));
  CHECK(directory.entries() == 1);
}

TEST_CASE("csv: malformed files give the line number", "[record]") {
  const TemporaryDirectory directory;
  const fs::path path = directory / "a.csv";
  CHECK_THAT(error_of([&] { (void)read_csv(path); }), Contains("No such file"));
  put_content(path, "t,x\n");
  CHECK_THAT(error_of([&] { (void)read_csv(path); }), Contains("line 1"));
  put_content(path, "time [s],states/u []\r\n0,1\r\n1\r\n");
  CHECK_THAT(error_of([&] { (void)read_csv(path); }), Contains("line 3: 1 fields"));
  put_content(path, "time [s],states/u\n0,1\n1,zwei\n");
  CHECK_THAT(error_of([&] { (void)read_csv(path); }), Contains("line 3: 'zwei'"));
}
