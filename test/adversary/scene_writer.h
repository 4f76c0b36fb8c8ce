// What writers of random scenes share: the dice, the text so far, and its end.
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "kinds.h"

namespace costate::adversary {

class SceneWriter {
 protected:
  explicit SceneWriter(std::uint64_t seed) : engine_(seed) {}

  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(engine_); }
  bool chance(double p) { return uniform(0, 1) < p; }
  /// One to three of parameters_ stay, in any order.
  void choose_parameters();
  /// With [run]; empty text where the scene cannot be read.
  KindScene finish(const char* kind, double t_end, const char* rtol);

  std::mt19937_64 engine_;
  std::string text_;
  std::vector<std::string> parameters_;
};

}  // namespace costate::adversary
