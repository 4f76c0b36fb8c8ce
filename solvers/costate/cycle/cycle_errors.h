// What a cycle may be off by, from searches at several tolerances, two of which may come near each other by chance: one
// alone at a tenth of the tolerance did so to a twentieth or less in 2 of 100 numbers.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "costate/mechanism/parameter.h"

namespace costate {

/// Two searches may agree by chance to a fraction of this, of what others of their numbers do.
inline constexpr double kByChance = 0.3;

/// The largest of a gradient's entries times the parameters' scales.
double scaled_size(const Eigen::VectorXd& by, const ParameterSelection& parameters);
/// The largest of what each entry of x is to be compared with: of positions and speeds together, of lengths or of
/// angles, as speeds of what swings with the period [s], in the entry's own unit; of others by unit.
Eigen::VectorXd comparable_sizes(const std::vector<std::string>& units, double period, const Eigen::VectorXd& x);
/// No position or speed among the entries of x is known to a smaller part of itself than three tenths of the largest
/// error over the largest of what it is comparable with. Errors of what all but rests are rounding and say nothing of
/// each other, unless `anyhow`.
void pool_errors(const std::vector<std::string>& units, double period, const Eigen::VectorXd& x, Eigen::VectorXd& error,
                 bool anyhow = false);

/// By those of a search at a looser tolerance: no entry of a row is known to a smaller part than three tenths of its
/// largest error over its largest derivative, by parameters times their scales, as two may agree by chance.
Eigen::VectorXd derivative_errors(const Eigen::VectorXd& by, const Eigen::VectorXd& loose,
                                  const ParameterSelection& parameters);
/// Of the entries of x, a row each, likewise, each column pooled as x itself is.
Eigen::MatrixXd derivative_errors(const std::vector<std::string>& units, double period, const Eigen::MatrixXd& by,
                                  const Eigen::MatrixXd& loose, const ParameterSelection& parameters);

/// The largest of such errors, scaled, over what is comparable.
double relative_error(const std::vector<std::string>& units, double period, const Eigen::MatrixXd& by,
                      const Eigen::MatrixXd& error, const ParameterSelection& parameters);

}  // namespace costate
