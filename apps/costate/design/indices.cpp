#include "indices.h"

#include <fmt/format.h>

#include <cmath>

namespace costate::app {

namespace {

/// Mean of numbers and the standard error of it.
struct Mean {
  double sum = 0, squares = 0;
  std::size_t count = 0;
  void add(double x) {
    sum += x;
    squares += x * x;
    ++count;
  }
  double value() const { return sum / static_cast<double>(count); }
  double error() const {
    const double n = static_cast<double>(count), spread = squares - n * value() * value();
    return count > 1 ? std::sqrt(std::max(0.0, spread) / (n - 1) / n) : HUGE_VAL;
  }
};

Json named_numbers(const std::vector<std::string>& names, const std::vector<double>& values) {
  Json j = Json::object();
  for (std::size_t i = 0; i < names.size(); ++i) j[names[i]] = values[i];
  return j;
}

/// What is measured at a point: psi, or an output at the end.
double measured(const Json& row, const std::string& quantity) {
  const Json* value = nullptr;
  if (quantity == "psi") {
    for (const char* key : {"psi", "psi_after"})
      if (row.contains(key)) value = &row[key];
  } else if (row.contains("outputs") && row["outputs"].contains(quantity)) {
    value = &row["outputs"][quantity];
  }
  return value && value->is_number() ? value->get<double>() : std::nan("");
}

Json of_blocks(const std::vector<Json>& rows, const std::vector<std::string>& paths, const std::string& quantity) {
  std::vector<double> values;
  for (const Json& r : rows) values.push_back(measured(r, quantity));
  const SobolIndices s = sobol_indices(values, paths.size());
  if (s.blocks < 2 || !(s.variance > 0)) return {};
  Json j;
  j["blocks"] = s.blocks;
  j["mean"] = s.mean;
  j["variance"] = s.variance;
  j["first"] = named_numbers(paths, s.first);
  j["first_error"] = named_numbers(paths, s.first_error);
  j["total"] = named_numbers(paths, s.total);
  j["total_error"] = named_numbers(paths, s.total_error);
  return j;
}

/// Of independent points: those of a block share numbers, so its mean counts as one for the errors. A bound is the
/// quotient of two means, of slopes' squares and of (f - f0)^2, whose error is to first order that of the mean of
/// (slope^2 - bound (f - f0)^2) / Var(f).
Json of_slopes(const std::vector<Json>& rows, const std::vector<std::string>& paths) {
  const std::size_t width = rows.front().contains("blocks") ? paths.size() + 2 : 1;
  // Of each block the points that have psi and slopes.
  std::vector<std::vector<const Json*>> blocks((rows.size() + width - 1) / width);
  Mean psi;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const double f = measured(rows[k], "psi");
    if (!std::isfinite(f) || !rows[k].contains("slopes") || rows[k]["slopes"].size() != paths.size()) continue;
    psi.add(f);
    blocks[k / width].push_back(&rows[k]);
  }
  if (psi.count < 2) return {};
  const double variance = std::pow(psi.error(), 2) * static_cast<double>(psi.count);
  if (!(variance > 0)) return {};
  std::erase_if(blocks, [](const auto& points) { return points.empty(); });
  const auto over_blocks = [&](const auto& value) {
    Mean all;
    for (const auto& points : blocks) {
      Mean own;
      for (const Json* r : points) own.add(value(*r));
      all.add(own.value());
    }
    return all;
  };
  std::vector<double> bound, error;
  for (const std::string& path : paths) {
    const auto square = [&](const Json& r) { return std::pow(r["slopes"][path].get<double>(), 2); };
    const double most = over_blocks(square).value() / variance;
    bound.push_back(most);
    error.push_back(over_blocks([&](const Json& r) {
                      return square(r) - most * std::pow(measured(r, "psi") - psi.value(), 2);
                    }).error() /
                    variance);
  }
  Json j;
  j["points"] = psi.count;
  j["mean"] = psi.value();
  j["variance"] = variance;
  j["total_bound"] = named_numbers(paths, bound);
  j["total_bound_error"] = named_numbers(paths, error);
  return j;
}

}  // namespace

SobolIndices sobol_indices(const std::vector<double>& values, std::size_t numbers) {
  SobolIndices s;
  const std::size_t width = numbers + 2;
  std::vector<const double*> blocks;
  for (std::size_t at = 0; at + width <= values.size(); at += width) {
    bool finite = true;
    for (std::size_t i = 0; i < width; ++i) finite = finite && std::isfinite(values[at + i]);
    if (finite) blocks.push_back(values.data() + at);
  }
  s.blocks = blocks.size();
  if (blocks.empty()) return s;
  const double count = 2 * static_cast<double>(blocks.size());
  for (const double* b : blocks) s.mean += (b[0] + b[1]) / count;
  for (const double* b : blocks) s.variance += (std::pow(b[0] - s.mean, 2) + std::pow(b[1] - s.mean, 2)) / (count - 1);
  for (std::size_t i = 0; i < numbers; ++i) {
    Mean first, total;
    for (const double* b : blocks) {
      first.add((b[1] - s.mean) * (b[2 + i] - b[0]) / s.variance);
      total.add(std::pow(b[0] - b[2 + i], 2) / (2 * s.variance));
    }
    s.first.push_back(first.value());
    s.first_error.push_back(first.error());
    s.total.push_back(total.value());
    s.total_error.push_back(total.error());
  }
  return s;
}

Json sensitivity_json(const std::vector<Json>& rows) {
  Json j = Json::object();
  if (rows.empty() || !rows.front().contains("varied")) return {};
  std::vector<std::string> paths;
  for (const auto& [path, value] : rows.front()["varied"].items()) paths.push_back(path);
  if (rows.front().contains("blocks")) {
    std::vector<std::string> quantities = {"psi"};
    for (const Json& r : rows)
      if (quantities.size() == 1 && r.contains("outputs"))
        for (const auto& [name, value] : r["outputs"].items()) quantities.push_back(name);
    for (const std::string& quantity : quantities)
      if (Json one = of_blocks(rows, paths, quantity); !one.is_null()) j[quantity] = std::move(one);
  }
  if (Json slopes = of_slopes(rows, paths); !slopes.is_null())
    for (const auto& [key, value] : slopes.items())
      if (!j.contains("psi") || !j["psi"].contains(key)) j["psi"][key] = value;
  return j.empty() ? Json() : j;
}

std::string sensitivity_text(const Json& sensitivity) {
  std::string text;
  for (const auto& [quantity, s] : sensitivity.items()) {
    const bool indices = s.contains("first"), bounds = s.contains("total_bound");
    text += fmt::format("    of the variance of {}, {:.4g}:{}{}\n", quantity, s["variance"].get<double>(),
                        indices ? "   first-order           total" : "", bounds ? "   at most (gradients)" : "");
    for (const auto& [path, unused] : s[indices ? "first" : "total_bound"].items()) {
      text += fmt::format("      {:<40}", path);
      if (indices)
        text += fmt::format(" {:>7.4f} +- {:<7.2g} {:>7.4f} +- {:<7.2g}", s["first"][path].get<double>(),
                            s["first_error"][path].get<double>(), s["total"][path].get<double>(),
                            s["total_error"][path].get<double>());
      if (bounds)
        text += fmt::format(" {:>7.4f} +- {:<7.2g}", s["total_bound"][path].get<double>(),
                            s["total_bound_error"][path].get<double>());
      text += "\n";
    }
  }
  return text;
}

}  // namespace costate::app
