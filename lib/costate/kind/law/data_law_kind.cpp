// The law { kind = "data", ... }: a curve through the points of a table of data.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/base/error.h"
#include "costate/element/law/data_law.h"
#include "costate/kind/law/law_table.h"
#include "costate/scene/data_table.h"
#include "costate/scene/key_meaning.h"

namespace costate {

namespace {

struct Points {
  std::vector<double> x, y;
  std::string source, column = {}, unit = {}, argument = {}, argument_unit = {};
};

/// Of a table of data.
Points table_points(SceneTable& t) {
  const std::string name = t.text("data"), wanted = t.text("column"), over = t.text("over", "");
  const auto at = [&](const std::string& key, const auto& find) {
    try {
      return find();
    } catch (const ModelError& e) {
      throw ModelError(t.path(key), e.bare_message());
    }
  };
  const auto table = at("data", [&] { return find_data_table(name); });
  const DataColumn* y = at("column", [&] { return &table->column(wanted); });
  const DataColumn* x = over.empty() ? at("data", [&] { return &table->time_column(); })
                                     : at("over", [&] { return &table->column(over); });
  std::vector<std::size_t> rows;
  for (std::size_t k = 0; k < x->values.size(); ++k)
    if (std::isfinite(x->values[k]) && std::isfinite(y->values[k])) rows.push_back(k);
  if (!over.empty())
    std::sort(rows.begin(), rows.end(), [&](std::size_t a, std::size_t b) { return x->values[a] < x->values[b]; });
  Points p;
  p.source = fmt::format("Column '{}' of {}", wanted, table->source);
  p.column = wanted;
  p.unit = y->unit;
  p.argument = x->name;
  p.argument_unit = x->unit;
  for (const std::size_t k : rows) {
    p.x.push_back(x->values[k]);
    p.y.push_back(y->values[k]);
  }
  return p;
}

LawOptions read_data_law(SceneTable& t) {
  const auto between = t.one_of("between", {"spline", "lines"}, "spline") == "lines" ? DataLaw::Between::lines
                                                                                     : DataLaw::Between::spline;
  const std::string beyond = t.one_of("beyond", {"refuse", "hold", "tangent", "repeat"}, "refuse");
  const double scale = t.value("scale", NumberRule::any, 1);
  Points points;
  if (t.has("x")) {
    for (const char* key : {"data", "column", "over"})
      if (t.has(key)) t.fail(key, "contradicts 'x': give points, or a column of data.");
    points.x = t.values("x");
    points.y = t.values("y");
    points.source = "The data of this law";
  } else {
    points = table_points(t);
  }
  return {std::make_shared<DataLaw>(std::move(points.x), std::move(points.y), between,
                                    beyond == "hold"      ? DataLaw::Beyond::hold
                                    : beyond == "tangent" ? DataLaw::Beyond::tangent
                                    : beyond == "repeat"  ? DataLaw::Beyond::repeat
                                                          : DataLaw::Beyond::refuse,
                                    points.source, points.column, points.unit, points.argument, points.argument_unit),
          {{"scale", scale}}};
}

const KindKeys data_law_keys("law data",
                             {{"data", "name of a table of data, [data.NAME]"},
                              {"column", "whose values it goes through"},
                              {"over", "the column of its argument; by default the time"},
                              {"between", "points: a natural cubic spline, or straight lines"},
                              {"beyond", "the first and the last point: refused, their values, tangents, or all again"},
                              {"x, y", "points written here, in the place of 'data'"},
                              {"scale", "of the values"}});

const RegisterLawKind data_law(
    {.name = "data",
     .summary = "scale times the curve through a column of measured data, [data.NAME], or through x, y",
     .example =
         R"({ kind = "data", x = [-3, -1, 0, 0.5, 2, 3], y = [0.1, 0.4, -0.2, 0, 0.3, 0.2], beyond = "tangent" })",
     .read = read_data_law});

}  // namespace

}  // namespace costate
