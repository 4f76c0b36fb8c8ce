// Whether a row of 'costate check' is right: each component of its gradient, and psi, against the reference.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "costate/problem/problem.h"

namespace costate::app {

// Of gradients and of motions alike.
inline constexpr double kForgiven = 1e4;    // what may be forgiven without a warning, of the largest one, in rtol
inline constexpr double kTolerable = 1e-2;  // farther off, a result is wrong, whatever it converges to
inline constexpr double kSoft = 1e-3;       // what soft constraints may cost without a warning

/// `inaccurate`: it converges to the reference, but is farther from it than its tolerance lets one expect.
enum class Verdict { ok, inaccurate, disagreement, cut, failed, refused };
const char* name_of(Verdict verdict);

/// What rows are measured by. Components are the gradient's, each times its parameter's scale, and psi behind them.
struct Yardstick {
  ParameterSelection parameters;
  std::string formulation, method;
  double rtol = 0, rtol_of_scene = 0;
  GradientResult result;
  std::vector<double> components, uncertainty;  // of the reference; how far it may be from the truth
  /// The largest component of the gradient, here or a hundredth of the parameters away: what errors are relative to,
  /// also where the gradient vanishes, as at an optimum.
  double size = 0;
  /// The cost's terms, each integrated by its amount: what psi, and a gradient that is zero everywhere, are lost in.
  double cost = 0;
  /// What psi changes by where the states are off by their absolute tolerances all along: at rest all that there is.
  double by_states = 0;
  /// How far the reference's formulation and method are off at the scene's own tolerance; relative.
  double own_error = 0;
  /// False: differences share none with the reference, and what rows tend to at tighter tolerances tells nothing.
  bool has_digits = true;

  std::vector<double> components_of(const GradientResult& r) const;
  std::string name(std::size_t component) const;
  /// What a component may be at this tolerance where the truth is zero.
  double noise(double tolerance) const {
    constexpr double kMany = 100;
    return kMany * tolerance * (cost + by_states / rtol_of_scene);
  }
  /// Where the gradient is not to be told from zero, here or nearby, that a row may be off by without a word; 0
  /// elsewhere.
  double zero() const {
    constexpr double kPart = 0.1;
    const double most = noise(rtol_of_scene);
    return size <= most ? kPart * most : 0;
  }
  /// What a reported error is relative to.
  double unit() const;
  double unit_of(std::size_t component) const;
};

struct Judgement {
  Verdict verdict = Verdict::ok;
  double error = 0;                // the largest, in units of the yardstick
  std::string worst;               // "parameter L01" or "psi": the component farthest beyond what is allowed
  double found = 0, expected = 0;  // there, as the row and the reference have it
  std::string remark;              // why it is forgiven and how much, or why not
};

/// Runs a method; may throw Cut and errors.
using RunMethod = std::function<GradientResult(const Problem&, const std::string& method)>;

/// The rule is in apps/README.md.
Judgement judge(const Yardstick& yardstick, const Problem& problem, const std::string& method,
                const GradientResult& result, const RunMethod& run);

}  // namespace costate::app
