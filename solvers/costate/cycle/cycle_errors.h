// What a cycle may be off by, from two searches at two tolerances, which may come near each other by chance.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "costate/cycle/section.h"
#include "costate/mechanism/parameter.h"

namespace costate {

/// Of positions and speeds among the entries of x: none is known to a smaller part of itself than three tenths of the
/// largest error, of lengths or of angles, over the largest of those; speeds count as what swings with the period [s].
void pool_errors(const std::vector<SectionCoordinate>& coordinates, double period, const Eigen::VectorXd& x,
                 Eigen::VectorXd& error);

/// By those of a search at a looser tolerance: no entry of a row is known to a smaller part than three tenths of its
/// largest error over its largest derivative, by parameters times their scales, as two may agree by chance.
Eigen::VectorXd derivative_errors(const Eigen::VectorXd& by, const Eigen::VectorXd& loose,
                                  const std::vector<Parameter>& parameters);
/// Of the entries of x, a row each, likewise, each column pooled as x itself is.
Eigen::MatrixXd derivative_errors(const std::vector<SectionCoordinate>& coordinates, double period,
                                  const Eigen::MatrixXd& by, const Eigen::MatrixXd& loose,
                                  const std::vector<Parameter>& parameters);

}  // namespace costate
