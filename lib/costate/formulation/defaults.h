// What a run takes where neither the scene nor the program says otherwise: the one place where that is decided.
#pragma once

namespace costate {

inline constexpr double kDefaultTolerance = 1e-8;  // relative

/// Baumgarte's stabilisation on IDAS: what an integrator lets the constraints drift by, it takes back within 1/omega,
/// so that long runs keep their lengths; per step it costs what index 1 does (README, "How to choose").
inline constexpr const char* kDefaultFormulation = "baumgarte";
inline constexpr const char* kDefaultMethod = "idas-adjoint";
inline constexpr const char* kDefaultAlgorithm = "lbfgs";

}  // namespace costate
