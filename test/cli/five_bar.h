// The numbers of the five-bar that the tool must reproduce.
#pragma once

#include <map>
#include <string>

#include "support/paths.h"

namespace costate::test {

inline const std::string kFiveBar = COSTATE_MODELS_DIR "/five_bar/five_bar.toml";

/// Computed by an independent program (extrapolation in quadruple precision), verified there to 19 digits.
inline constexpr double kPsi = 0.7268774613130026;
inline const std::map<std::string, double> kGradient = {
    {"L01", -4.2288108552406148},    {"L02", 3.2116041029870196},     {"k1", -3.3512803376468219e-03},
    {"k2", -6.8259125375815486e-03}, {"m1", -1.6491042347577481e-01}, {"m2", 3.5935923627237241e-02},
    {"m3", 5.4134999138283913e-01},  {"m4", 3.1670083848349700e-01}};
/// Where psi = 0: the static equilibrium of the initial configuration.
inline constexpr double kOptimalL01 = 2.4319235745745838, kOptimalL02 = 1.8448688868053879;

}  // namespace costate::test
