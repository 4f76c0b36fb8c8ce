// [data.NAME]: measured data, for laws (kind/law/data_law_kind.cpp) and for the samples of a cost.
#include "costate/base/error.h"
#include "costate/scene/data_table.h"
#include "costate/scene/key_meaning.h"
#include "costate/scene/open_crg.h"
#include "costate/scene/scene_files.h"
#include "costate/scene/scene_kind.h"

namespace costate {

namespace {

const KindKeys data_keys("data",
                         {{"file",
                           "path of a text file, from the scene: a line of names, perhaps one of units, rows of "
                           "numbers; or a road, NAME.crg"},
                          {"rows", "in its place, rows of numbers"},
                          {"columns", "names with units in brackets, \"angle [deg]\", in the place of the file's own"},
                          {"time", "name of the time's column; by default t or time"},
                          {"time_shift_s", "is added to the times"},
                          {"timed", "false: rows of no time in any order, for maps and laws over another column"},
                          {"separator", "between values; by default the ; tab , or blank of the first line"},
                          {"comment", "what begins a comment"},
                          {"decimal_comma", "whether 1,5 is one and a half"}});

const RegisterSceneKind data_registered({
    .name = "data",
    .phase = ScenePhase::data,
    .summary = "measured data: columns with names and units, of a text file or written here",
    .example = R"(
[gravity]
y_m_per_s2 = -9.81

[data.run7]
columns = ["t [ms]", "push [kN]", "x [mm]"]
rows = [[0, 0.001, 600], [500, 0.004, 604], [1000, -0.002, 590], [2000, 0.003, 560]]

[data.late]
columns = ["clock [s]", "x [m]"]
time = "clock"
time_shift_s = 0.1
rows = [[0, 0.6], [0.4, 0.59], [0.8, 0.57]]

[point.A]
ground = true
x_m = 0
y_m = 0

[point.P]
x_m = 0.6
y_m = -0.8

[bar.rod]
from = "A"
to = "P"
mass_kg = 2

[force.push]
point = "P"
x_N = { kind = "data", data = "run7", column = "push", scale = 1.1 }
y_N = { kind = "data", data = "run7", column = "push", between = "lines", beyond = "hold" }

[start]
given = ["P.x"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          DataFormat f;
          f.columns = table.texts("columns", false);
          f.time = table.text("time", "");
          f.time_shift_s = table.value("time_shift_s", NumberRule::any, 0);
          f.timed = table.flag("timed", f.timed);
          for (const char* key : {"time", "time_shift_s"})
            if (!f.timed && table.has(key)) table.fail(key, "contradicts timed = false.");
          f.separator = table.text("separator", "");
          if (f.separator.size() > 1) table.fail("separator", "must be one character, such as \";\" or \"\\t\".");
          f.comment = table.text("comment", f.comment);
          f.decimal_comma = table.flag("decimal_comma", f.decimal_comma);
          if (!table.has("file")) {
            const auto rows = table.value_rows("rows");
            if (f.columns.empty())
              table.fail("columns", "must name the columns of 'rows': columns = [\"t [s]\", ...].");
            return add_data_table(builder, make_data_table(name, rows, f));
          }
          if (table.has("rows")) table.fail("rows", "contradicts 'file': give one of them.");
          add_data_table(builder, read_named_file(table, "file", [&](const std::string& file) {
                           if (!is_open_crg(file)) return read_data_file(name, file, f);
                           for (const char* key : {"columns", "time", "time_shift_s", "timed", "separator", "comment"})
                             if (table.has(key)) table.fail(key, "is nothing to say of a road in OpenCRG's format.");
                           return read_open_crg(name, file);
                         }));
        },
});

}  // namespace

}  // namespace costate
