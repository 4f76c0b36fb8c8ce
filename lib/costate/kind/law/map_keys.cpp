#include "costate/kind/law/map_keys.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "costate/base/error.h"
#include "costate/scene/data_table.h"

namespace costate {

namespace {

struct Grid {
  std::vector<double> x, y, z;  // z[j * nx + i]
  std::string source;
};

Grid written_grid(SceneTable& t) {
  for (const char* key : {"data", "column", "over"})
    if (t.has(key)) t.fail(key, "contradicts 'x': give points, or columns of data.");
  Grid g;
  g.source = "The map";
  g.x = t.values("x");
  g.y = t.values("y");
  const auto rows = t.value_rows("z");
  if (rows.size() != g.y.size())
    t.fail("z", fmt::format("must be a row of values for each y, {}; found {}.", g.y.size(), rows.size()));
  for (std::size_t j = 0; j < rows.size(); ++j) {
    if (rows[j].size() != g.x.size())
      t.fail("z", fmt::format("must hold a value for each x, {}, in every row; row {} holds {}.", g.x.size(), j + 1,
                              rows[j].size()));
    g.z.insert(g.z.end(), rows[j].begin(), rows[j].end());
  }
  return g;
}

/// The different values of a column, in their order.
std::vector<double> places(const DataColumn& column) {
  std::vector<double> all;
  for (const double v : column.values)
    if (std::isfinite(v)) all.push_back(v);
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

/// Of rows x, y, z in any order: each pair once.
Grid measured_grid(SceneTable& t) {
  const std::string name = t.text("data"), column = t.text("column");
  const auto [over_x, over_y] = t.text_pair("over");
  const auto at = [&](const std::string& key, const auto& find) {
    try {
      return find();
    } catch (const ModelError& e) {
      throw ModelError(t.path(key), e.bare_message());
    }
  };
  const auto table = at("data", [&] { return find_data_table(name); });
  const DataColumn* z = at("column", [&] { return &table->column(column); });
  const DataColumn* x = at("over", [&] { return &table->column(over_x); });
  const DataColumn* y = at("over", [&] { return &table->column(over_y); });
  Grid g;
  g.source = fmt::format("Column '{}' of {}", column, table->source);
  g.x = places(*x);
  g.y = places(*y);
  std::map<std::pair<double, double>, double> found;  // by (y, x)
  for (std::size_t k = 0; k < z->values.size(); ++k) {
    if (!std::isfinite(x->values[k]) || !std::isfinite(y->values[k]) || !std::isfinite(z->values[k])) continue;
    if (!found.emplace(std::pair(y->values[k], x->values[k]), z->values[k]).second)
      t.fail("data", fmt::format("holds two values of '{}' at {} = {:.9g}, {} = {:.9g} (SI units).", column, over_x,
                                 x->values[k], over_y, y->values[k]));
  }
  for (const double b : g.y)
    for (const double a : g.x) {
      const auto value = found.find({b, a});
      if (value == found.end())
        t.fail("data", fmt::format("holds no value of '{}' at {} = {:.9g}, {} = {:.9g} (SI units). A map needs one at "
                                   "each of its {} x {} pairs.",
                                   column, over_x, a, over_y, b, g.x.size(), g.y.size()));
      g.z.push_back(value->second);
    }
  return g;
}

}  // namespace

bool is_map(SceneTable& table, const std::string& key) {
  if (!table.is_table(key)) return false;
  SceneTable of = table.table(key);
  return of.is_text("kind") && of.text("kind") == "map";
}

MapOptions read_map(SceneTable t) {
  t.text("kind");
  const auto between = t.one_of("between", {"spline", "lines"}, "spline") == "lines" ? PointSurface::Between::lines
                                                                                     : PointSurface::Between::spline;
  const std::string beyond = t.one_of("beyond", {"refuse", "hold", "tangent"}, "refuse");
  MapOptions map;
  map.scale = t.value("scale", NumberRule::any, 1);
  Grid grid = t.has("x") ? written_grid(t) : measured_grid(t);
  try {
    map.surface = std::make_shared<PointSurface>(std::move(grid.x), std::move(grid.y), grid.z, between,
                                                 beyond == "hold"      ? PointSurface::Beyond::hold
                                                 : beyond == "tangent" ? PointSurface::Beyond::tangent
                                                                       : PointSurface::Beyond::refuse,
                                                 grid.source);
  } catch (const ModelError& e) {
    throw ModelError(t.path(), e.bare_message());
  }
  return map;
}

}  // namespace costate
