// What the chains of chain.h are made of, planar and in space, for every program that runs them.
#pragma once

#include <array>
#include <cmath>

namespace costate::bench {

// Of a bar: m, kg, m (an anchor's depth and natural length), N/m, N s/m.
inline constexpr double kChainLength = 0.2, kChainMass = 0.1, kChainDepth = 1, kChainStiffness = 5, kChainDamping = 0.2,
                        kChainGravity = 9.81;
/// The joint at the end of bar i, and its anchor.
inline std::array<double, 3> planar_chain_point(int i) {
  const double step = kChainLength * std::sqrt(0.5);
  return {step * i, -step * i, 0};
}
inline std::array<double, 3> planar_chain_anchor(int i) {
  const auto p = planar_chain_point(i);
  return {p[0], p[1] - kChainDepth, 0};
}

inline std::array<double, 3> spatial_chain_point(int i) { return {kChainLength * i, 0, 0}; }
inline std::array<double, 3> spatial_chain_anchor(int i) {
  return {kChainLength * i, -0.8 * kChainDepth, (i % 2 == 0 ? 0.3 : -0.6) * kChainDepth};
}
inline constexpr std::array<double, 3> kSpatialInertia = {1e-4, 4e-4, 4e-4};  // kg m^2, about the centre

}  // namespace costate::bench
