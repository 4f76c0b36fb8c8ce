// Where forces begin with a power 1 < n < 2 of a depth d, at touches of contacts and at stops (lib/README.md (13.13)):
// their slope is continuous and zero there, and their second derivative, K n (n - 1) d^(n-2), infinite, though it has
// an integral. Steps across, whose stages see nothing of it, give a second derivative of psi that is off by any amount,
// and what d itself is known to, eps of the size of coordinates, leaves eps^(n-1) of the integral open.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "costate/assembly/assembly.h"

namespace costate {

class SteepBegins {
 public:
  /// Of the mechanism's forces, with the numbers that the assembly has: found once for them, and kept by the thread
  /// until it is asked for those of others.
  static const SteepBegins& of(const Assembly& assembly);

  /// Appends for each place whether the force acts, 1 or 0, as many at every state.
  void append(const StateView& s, std::vector<double>& values) const;
  /// Throws CapabilityError where a force begins or ends between these.
  void refuse_between(const StateView& before, const StateView& after) const;
  /// Of forces whose touches are events, which change their states: the way back has a clock of its own beside these
  /// (HessianAdjoint::run_clock()), t = x^4 of the time t since then, and d^(n-2) dt is x^(4n-5) dx: of bounded slope
  /// from n = 3/2 on. Below that they are refused as well.
  void refuse_changed(double t, const double* z_before, const double* z_after) const;
  /// The smallest n < 2 of those that change between these states, or 2.
  double exponent_between(const double* z_before, const double* z_after) const;

 private:
  /// One place of a law of a deformation, and on which side of it the force acts.
  struct Place {
    double x, side;
  };
  struct OfLaw {
    std::size_t force;
    int origin;  // that of MotionLaw
    bool of_rate;
    std::string name;
    std::vector<Place> places;
  };
  struct OfTouch {
    std::size_t force;
    double exponent;
  };
  SteepBegins() = default;
  explicit SteepBegins(const Assembly& assembly);
  void add_laws(const Force& force, std::size_t k);
  LocalState local(const Mechanism& mechanism, std::size_t k, const StateView& s) const;
  [[noreturn]] static void refuse(double t, const std::string& what);

  std::weak_ptr<const Mechanism> mechanism_;
  std::vector<double> numbers_;
  std::vector<OfLaw> laws_;
  std::vector<OfTouch> touches_, events_;  // of events, those that are not refused too
};

}  // namespace costate
