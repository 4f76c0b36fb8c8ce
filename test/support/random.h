// Reproducible random numbers: the same on every machine and standard library (mt19937 is, distributions are not).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <random>

namespace costate::test {

class Random {
 public:
  explicit Random(std::uint32_t seed) : engine_(seed) {}
  /// Uniform in [-1, 1).
  double number() { return 2 * (engine_() / 4294967296.0) - 1; }
  Eigen::VectorXd vector(Eigen::Index n) {
    Eigen::VectorXd x(n);
    for (Eigen::Index i = 0; i < n; ++i) x[i] = number();
    return x;
  }

 private:
  std::mt19937 engine_;
};

}  // namespace costate::test
