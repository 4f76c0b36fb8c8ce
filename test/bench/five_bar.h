// The five-bar of the benchmarks, through the library: A(0, 0) and B(1, 0) on the ground, points 1(-0.5, 1),
// 2(0.5, 2), 3(1.5, 1), uniform bars A-1, 1-2, 2-3, 3-B of 1, 1.5, 1.5, 1 kg, springs of 100 N/m from point 2 to
// (-0.5, 0) and (1, 0), relaxed at the start; psi = integral over 0..5 s of |r2 - r2(0)|^2, parameters: the two natural
// lengths. (Not the five-bar of models/: this is the geometry of the hand-specialised programs it is compared with.)
#pragma once

#include <array>

#include "costate/problem/problem.h"

namespace costate::bench {

namespace five_bar {
// By fixed-step Runge-Kutta on the variational equations, to all digits given.
inline constexpr double psi = 0.810986853505048;
inline constexpr std::array<double, 2> gradient = {34.2655612525555, -30.7251582049571};
inline constexpr double t_end = 5;  // s
}  // namespace five_bar

/// With default solver options but for t_end.
Problem make_five_bar();

/// |psi / reference - 1| and |gradient - reference| / |reference|.
double psi_error(double psi);
double gradient_error(const std::vector<double>& gradient);

}  // namespace costate::bench
