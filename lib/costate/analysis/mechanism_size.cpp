#include "costate/analysis/mechanism_size.h"

#include <algorithm>

namespace costate {

std::optional<double> extent_of(const Assembly& assembly, const Eigen::VectorXd& q) {
  const Mechanism& m = assembly.mechanism();
  std::vector<double> lengths;
  for (int i = 0; i < assembly.n(); ++i)
    if (m.coordinates()[static_cast<std::size_t>(i)].unit == "m") lengths.push_back(q[i]);
  const auto local = [&](const auto& point, double* at, double* p) {
    for (std::size_t i = 0; i < point.coordinates().size(); ++i) at[i] = q[point.coordinates()[i]];
    for (std::size_t i = 0; i < point.numbers().size(); ++i)
      p[i] = assembly.numbers()[static_cast<std::size_t>(point.numbers()[i])];
  };
  for (const auto& point : m.points()) {
    double at[PlanarPoint::kMaxCoordinates] = {}, p[PlanarPoint::kMaxNumbers] = {}, r[2];
    local(point, at, p);
    point.position(at, p, r[0], r[1]);
    lengths.insert(lengths.end(), r, r + 2);
  }
  for (const auto& point : m.spatial_points()) {
    double at[SpatialPoint::kMaxCoordinates] = {}, p[3] = {}, r[3];
    local(point, at, p);
    point.position(at, p, r);
    lengths.insert(lengths.end(), r, r + 3);
  }
  if (lengths.empty()) return {};
  const auto [low, high] = std::minmax_element(lengths.begin(), lengths.end());
  return *high - *low > kNoLength ? *high - *low : 1;
}

}  // namespace costate
