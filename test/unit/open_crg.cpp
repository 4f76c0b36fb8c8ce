// Roads in OpenCRG's ASCII formats as columns of data: heights worked by hand, and what is refused.
#include "costate/scene/open_crg.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>

#include "costate/base/error.h"
#include "record_temporary_directory.h"

using namespace costate;
using Catch::Contains;

namespace {

std::shared_ptr<DataTable> read(const std::string& text) {
  const record_test::TemporaryDirectory here;
  const std::string file = (here.path() / "road.crg").string();
  std::ofstream(file) << text;
  return read_open_crg("R", file);
}

}  // namespace

TEST_CASE("open crg: heights are those of the reference line, plus banking times v, plus the grid's") {
  const auto road = read(R"($CT
a road of four rows   ! and a comment
$
$ROAD_CRG             ! of 1.5 m
REFERENCE_LINE_START_U   = 10
REFERENCE_LINE_START_Z   = 2.0   ! m
REFERENCE_LINE_INCREMENT = 0.5
* nothing
$
$KD_Definition
#:LRFI
D:reference line banking,m/m
D:reference line phi,rad
D:reference line slope,m/m
D:long section at v =  0.500,m
D:long section at v = -1.250,m
$
$$$$$$$$10$$$$$$$$20
 0.0100000**unused****unused** 0.0010000 0.0020000
 0.0200000 0.3000000 0.1000000-0.0010000-0.0020000
 0.0300000 0.3000000-0.2000000 0.0000000*missing**
 0.0000000 0.3000000 0.0000000 0.0050000 0.0000000
)");
  REQUIRE(road->columns.size() == 3);
  CHECK(&road->time_column() == &road->columns[0]);
  CHECK(road->column("u").values == std::vector<double>{10, 10.5, 11, 11.5});
  // The reference line: 2, 2.05, 1.95, 1.95.
  const std::vector<double> left = road->column("v=0.5").values, right = road->column("v=-1.25").values;
  const double expected_left[] = {2 + 0.005 + 0.001, 2.05 + 0.01 - 0.001, 1.95 + 0.015, 1.95 + 0.005},
               expected_right[] = {2 - 0.0125 + 0.002, 2.05 - 0.025 - 0.002, NAN, 1.95};
  for (std::size_t i = 0; i < 4; ++i) {
    CAPTURE(i);
    CHECK(std::abs(left[i] - expected_left[i]) < 1e-15 * 10);
    CHECK((std::isnan(expected_right[i]) ? std::isnan(right[i]) : std::abs(right[i] - expected_right[i]) < 1e-14));
  }
}

TEST_CASE("open crg: sections by number, wide fields, rows of several lines") {
  std::string text =
      "$ROAD_CRG\nLONG_SECTION_V_RIGHT = -0.3\nLONG_SECTION_V_INCREMENT = 0.1\n$\n$KD_DEFINITION\n#:LDFI\n"
      "U:reference line u,m,5.0,0.25\n";
  for (int k = 1; k <= 6; ++k) text += "D:long section " + std::to_string(k) + ",m\n";
  text += "$\n$$\n";
  for (int row = 0; row < 2; ++row) {
    for (int k = 1; k <= 6; ++k) {
      std::string field = std::to_string(10 * row + k) + ".25";
      text += std::string(20 - field.size(), ' ') + field + (k == 4 || k == 6 ? "\n" : "");
    }
  }
  const auto road = read(text);
  CHECK(road->column("u").values == std::vector<double>{5, 5.25});
  CHECK(road->column("v=-0.3").values == std::vector<double>{1.25, 11.25});
  CHECK(road->column("v=0").values == std::vector<double>{4.25, 14.25});
  CHECK(road->column("v=0.2").values == std::vector<double>{6.25, 16.25});
  // A row that ends too early.
  CHECK_THROWS_WITH(read(text.substr(0, text.rfind("15.25"))), Contains("6 values") || Contains("Expected a number"));
}

TEST_CASE("open crg: what is no straight road of text is refused with its line") {
  const std::string head = "$ROAD_CRG\nREFERENCE_LINE_INCREMENT = 1\n$\n",
                    sections = "D:long section 1,m\nD:long section 2,m\n$\n$$\n",
                    rows = " 0.0000000 0.0000000\n 0.0000000 0.0000000\n";
  CHECK(read(head + "$KD_Definition\n#:LRFI\n" + sections + rows)->columns.size() == 3);
  const auto refused = [&](const std::string& text, const std::string& line, const std::string& why) {
    CAPTURE(text);
    CHECK_THROWS_WITH(read(text), Contains(line) && Contains(why));
  };
  refused(head + "$KD_Definition\n#:KRBI\n" + sections + rows, ":5:", "KRBI");
  refused(head + "$KD_Definition\n" + sections + rows, "", "#:LRFI");
  refused(head + "$KD_Definition\n#:LRFI\n" + sections + " 0.0000000 0.0x00000\n", ":10:11", "0.0x00000");
  refused(head + "$KD_Definition\n#:LRFI\n" + sections + " 0.0000000 0.0000000\n", "", "two rows");
  refused(head + "$KD_Definition\n#:LRFI\nD:long section 1,mm\n" + sections + rows, ":6:", "'m'");
  refused(head + "$KD_Definition\n#:LRFI\nD:long section at v = 0,m\n" + sections + rows, ":7:", "not both");
  refused(head + "$KD_Definition\n#:LRFI\nD:friction,1\n" + sections + rows, ":6:", "friction");
  refused(head + "$ROAD_CRG_MODS\nSCALE_Z_GRID = 2\n$\n", ":5:", "SCALE_Z_GRID");
  refused(head + "$ROAD_CRG_FILE\nother.crg\n$\n", ":4:", "other files");
  refused("$ROAD_CRG\nREFERENCE_LINE_INCREMENT = 0\n$\n$KD_Definition\n#:LRFI\n" + sections + rows, "", "positive");
  refused("$ROAD_CRG\nREFERENCE_LINE_INCREMENT\n$\n", ":2:", "NAME = number");
  refused(head, "", "data are missing");
  refused(head + "$KD_Definition\n#:LRFI\nD:reference line phi,rad\n" + sections +
              "**unused** 0.0000000 0.0000000\n 0.0000000 0.0000000 0.0000000\n 0.0100000 0.0000000 0.0000000\n",
          ":13:", "bends");
  // Keys that say something else than what is read.
  refused("$ROAD_CRG\nREFERENCE_LINE_INCREMENT = 1\nREFERENCE_LINE_END_Z = 0.1\n$\n$KD_Definition\n#:LRFI\n" +
              sections + rows,
          "", "REFERENCE_LINE_END_Z is 0.1 m, and the slopes lead to 0 m");
  refused(
      "$ROAD_CRG\nREFERENCE_LINE_INCREMENT = 1\nLONG_SECTION_V_RIGHT = -1\nLONG_SECTION_V_LEFT = 1\n$\n"
      "$KD_Definition\n#:LRFI\n" +
          sections + rows,
      "", "LONG_SECTION_V_LEFT is 1 m, and 2 long sections from -1 m on, 0.01 m apart, end at -0.99 m");
}
