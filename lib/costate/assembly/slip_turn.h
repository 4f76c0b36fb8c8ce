// How the direction sigma = w/|w| of a slip in space turns with its velocity w:
//   sigma' = T w',  T = (1 - sigma sigma^T)/|w|,   T' = -(sigma' sigma^T + sigma sigma'^T + (sigma.w') T)/|w|.
#pragma once

#include <Eigen/Core>

namespace costate {

class SlipTurn {
 public:
  SlipTurn(const Eigen::Vector2d& direction, double speed) : sigma(direction), speed_(speed) {
    const Eigen::Vector2d across(-sigma[1], sigma[0]);
    T = across * across.transpose() / speed;
  }
  /// T' along dw.
  Eigen::Matrix2d change(const Eigen::Vector2d& dw) const {
    const Eigen::Vector2d turn = T * dw;
    return -(turn * sigma.transpose() + sigma * turn.transpose() + sigma.dot(dw) * T) / speed_;
  }

  Eigen::Vector2d sigma;
  Eigen::Matrix2d T;

 private:
  double speed_;
};

}  // namespace costate
