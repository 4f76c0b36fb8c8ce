// The HDF5 file of a study: to the bit the numbers of its CSV files, with what is missing and why.
#include <hdf5.h>
#include <signal.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <functional>
#include <map>

#include "csv_table.h"
#include "process.h"
#include "support/paths.h"

using namespace costate::test;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

namespace {

const std::string kPendulum = COSTATE_MODELS_DIR "/damped_pendulum/damped_pendulum.toml";

/// One column as it is in the file.
struct Column {
  std::string heading;  // empty without one
  long long place = -1;
  std::vector<double> numbers;
  std::vector<std::string> texts;
};

std::vector<std::string> texts_in(hid_t type, std::size_t count, const std::function<herr_t(void*)>& read) {
  std::vector<char*> pointers(count, nullptr);
  REQUIRE(read(pointers.data()) >= 0);
  std::vector<std::string> texts;
  for (char* p : pointers) {
    texts.emplace_back(p == nullptr ? "" : p);
    H5free_memory(p);
  }
  CHECK(H5Tis_variable_str(type) > 0);
  return texts;
}

std::string text_attribute(hid_t object, const char* name) {
  const hid_t attribute = H5Aopen(object, name, H5P_DEFAULT), type = H5Aget_type(attribute);
  const auto text = texts_in(type, 1, [&](void* to) { return H5Aread(attribute, type, to); });
  H5Tclose(type);
  H5Aclose(attribute);
  return text.front();
}

Column read_column(hid_t object) {
  Column c;
  if (H5Aexists(object, "heading") > 0) {
    c.heading = text_attribute(object, "heading");
    const hid_t attribute = H5Aopen(object, "column", H5P_DEFAULT);
    H5Aread(attribute, H5T_NATIVE_LLONG, &c.place);
    H5Aclose(attribute);
  }
  const hid_t space = H5Dget_space(object), type = H5Dget_type(object);
  const auto count = static_cast<std::size_t>(H5Sget_simple_extent_npoints(space));
  if (H5Tget_class(type) == H5T_STRING) {
    c.texts = texts_in(type, count, [&](void* to) { return H5Dread(object, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, to); });
  } else {
    CHECK(H5Tequal(type, H5T_IEEE_F64LE) > 0);
    c.numbers.resize(count);
    REQUIRE(H5Dread(object, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, c.numbers.data()) >= 0);
  }
  H5Tclose(type);
  H5Sclose(space);
  return c;
}

/// All columns of a group, by path below it.
std::map<std::string, Column> read_group(const std::filesystem::path& path, const std::string& group) {
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  REQUIRE(file >= 0);
  CHECK(text_attribute(file, "format") == "costate-study");
  const hid_t at = H5Gopen2(file, group.c_str(), H5P_DEFAULT);
  REQUIRE(at >= 0);
  std::vector<std::string> names;
  H5Lvisit(
      at, H5_INDEX_NAME, H5_ITER_INC,
      [](hid_t, const char* name, const H5L_info_t*, void* to) {
        static_cast<std::vector<std::string>*>(to)->emplace_back(name);
        return herr_t{0};
      },
      &names);
  std::map<std::string, Column> columns;
  for (const auto& name : names) {
    const hid_t object = H5Oopen(at, name.c_str(), H5P_DEFAULT);
    if (H5Iget_type(object) == H5I_DATASET) columns[name] = read_column(object);
    H5Oclose(object);
  }
  H5Gclose(at);
  H5Fclose(file);
  return columns;
}

bool same_bits(double a, double b) { return (std::isnan(a) && std::isnan(b)) || std::memcmp(&a, &b, sizeof a) == 0; }

/// Column by column, bit by bit.
void check_same(const std::map<std::string, Column>& columns, const Table& csv) {
  std::size_t headed = 0;
  for (const auto& [path, c] : columns) {
    INFO(path);
    if (c.heading.empty()) continue;
    ++headed;
    CHECK(csv.heading.at(static_cast<std::size_t>(c.place)) == c.heading);
    if (c.texts.empty()) {
      const auto right = csv.column(c.heading);
      REQUIRE(c.numbers.size() == right.size());
      for (std::size_t i = 0; i < right.size(); ++i) CHECK(same_bits(c.numbers[i], right[i]));
    } else {
      CHECK(c.texts == csv.texts(c.heading));
    }
  }
  CHECK(headed == csv.heading.size());
}

}  // namespace

TEST_CASE("study: its HDF5 file has the numbers of its tables, to the bit") {
  const WorkingDirectory here;
  // A negative stiffness is refused, by its run.
  write_text(
      here / "s.toml",
      "title = \"Cycles and more\"\n[[run]]\nname = \"short\"\noptions = { max_evaluations = 2, no_certificate = "
      "true }\nscene = \"" +
          kPendulum + "\"\n[[design]]\nname = \"ends\"\nscene = \"" + kPendulum +
          "\"\ntask = \"simulate\"\nkind = \"sobol\"\ncount = 3\noutputs = [\"P.x\"]\n[design.vary]\n"
          "\"spring.strut.stiffness_N_per_m\" = { from = 10, to = 30 }\n"
          "[[design]]\nname = \"cycles\"\nscene = \"" COSTATE_MODELS_DIR
          "/cycles/rayleigh.toml\"\ntask = \"cycle\"\nkind = \"grid\"\noptions = { no_estimate = true, rtol = "
          "1e-7 }\n[design.vary]\nstiffness = { from = 1, to = -1, steps = 2 }\n");
  const Json j = costate_json({"study", "s.toml", "--output", "out"}, here.path(), 1);
  const auto file = here / "out/study.h5";
  const auto runs = read_group(file, "/runs"), ends = read_group(file, "/designs/ends"),
             cycles = read_group(file, "/designs/cycles");
  check_same(runs, read_table(file_text(here / "out/study.csv")));
  check_same(ends, read_table(file_text(here / "out/ends.csv")));
  check_same(cycles, read_table(file_text(here / "out/cycles.csv")));

  CHECK(runs.at("name").texts ==
        std::vector<std::string>{"short", "ends.1", "ends.2", "ends.3", "cycles.1", "cycles.2"});
  CHECK(runs.at("psi_after").numbers.at(0) == j.at("runs").at(0).at("psi_after").get<double>());
  CHECK(ends.at("outputs/P.x").numbers.at(2) == j.at("runs").at(3).at("outputs").at("P.x").get<double>());
  CHECK(ends.at("varied/spring.strut.stiffness_N_per_m").numbers.at(0) == 20);
  CHECK(cycles.at("varied/stiffness").numbers == std::vector<double>{1, -1});
  CHECK(cycles.at("status").texts == std::vector<std::string>{"ok", "failed"});
  CHECK(cycles.at("outputs/stable").numbers.at(0) == 1);
  for (const char* name : {"psi", "outputs/period_s", "outputs/multiplier", "outputs/stable", "gradient/push",
                           "period_gradient/stiffness"}) {
    INFO(name);
    CHECK(std::isfinite(cycles.at(name).numbers.at(0)));
    CHECK(std::isnan(cycles.at(name).numbers.at(1)));
  }
  CHECK(cycles.at("error").texts.at(0).empty());
  CHECK(cycles.at("error").texts.at(1) == j.at("runs").at(5).at("error"));
  CHECK_FALSE(cycles.at("error").texts.at(1).empty());
}

TEST_CASE("study: the HDF5 file of one that is interrupted says so") {
  const WorkingDirectory here;
  write_text(here / "s.toml", "[[design]]\nname = \"d\"\nscene = \"" + kPendulum +
                                  "\"\ntask = \"simulate\"\nkind = \"sobol\"\ncount = 2\noptions = { t_end = 20000 }\n"
                                  "[design.vary]\n\"spring.strut.stiffness_N_per_m\" = { from = 10, to = 30 }\n");
  Process p(COSTATE_EXECUTABLE, {"study", "s.toml", "--output", "out", "--jobs", "1"}, here.path());
  REQUIRE(p.wait_until([&] { return std::filesystem::exists(here / "out/d.1/log.txt"); }));
  p.send(SIGINT);
  CHECK(p.finish().status == 130);
  const auto d = read_group(here / "out/study.h5", "/designs/d");
  check_same(d, read_table(file_text(here / "out/d.csv")));
  CHECK(d.at("status").texts == std::vector<std::string>{"interrupted", "interrupted"});
  CHECK((std::isnan(d.at("psi").numbers.at(0)) && std::isnan(d.at("psi").numbers.at(1))));
}
