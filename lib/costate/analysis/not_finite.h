// What an element computes must be a number: a formula outside its domain (log(-1), 1/t at 0), or numbers so large that
// they overflow, are named as that and not as what follows from them.
#pragma once

#include <string>
#include <utility>

#include "costate/assembly/assembly.h"
#include "costate/base/error.h"

namespace costate {

/// Something of an element is not finite at time t; the subject is the element's path. Scene::located adds which of its
/// laws it may be, and then `report`: what an integrator says that it ended.
class NotFinite : public ModelError {
 public:
  NotFinite(std::string subject, const std::string& message, double time, std::string said = {})
      : ModelError(std::move(subject), message), t(time), report(std::move(said)) {}
  const double t;
  const std::string report;
};

/// What ended a run is that something is not finite beyond a time that no step gets over.
class RunNotFinite : public SolverError {
 public:
  RunNotFinite(const NotFinite& what_is, const std::string& report)
      : SolverError(what_is.what() + (report.empty() ? "" : " " + report)),
        cause(what_is.subject(), what_is.bare_message(), what_is.t, report) {}
  const NotFinite cause;
};

/// Throws NotFinite if M, Q, zdot, phi, phi_q, phi_t or bias, as `assembly` holds them, are not finite; `s` is the
/// state that they were computed at (v and z null where only the constraints were).
void require_finite(Assembly& assembly, const StateView& s);
/// Throws SolverError if K or C, as `assembly` holds them at time t, are not finite.
void require_finite_partials(const Assembly& assembly, double t);

}  // namespace costate
