// What a run may be integrated by: the modules of SUNDIALS, fixed steps, explicit schemes (discrete/explicit_scheme.h)
// and Radau IIA (discrete/radau_scheme.h). What is asked about integrators is asked of these.
#pragma once

#include <string>
#include <vector>

#include "costate/problem/problem.h"

namespace costate {

struct Integrator {
  std::string name;     // by this it is chosen
  std::string summary;  // one line for `costate list`
  /// Of a formulation, what it integrates: its residual, its right-hand side, or steps of the formulation's own.
  enum class Form { residual, rhs, steps } form = Form::residual;
  bool discrete = false;      // discrete-tangent and discrete-adjoint differentiate its steps
  bool step_control = false;  // rtol decides on its steps

  bool carries(const Formulation& f) const;
  /// Of the form, for messages: "implicit", "explicit", "fixed-step".
  const char* form_name() const;
};

/// In the order of lists and tables.
const std::vector<Integrator>& integrators();
std::vector<std::string> integrator_names();
/// Throws CapabilityError with near names.
const Integrator& find_integrator(const std::string& name);
bool is_integrator(const std::string& name);
/// Whether rtol says little about the error of a run on it; false for names of other kinds.
bool has_fixed_steps(const std::string& name);
/// Those on which a formulation can run.
std::vector<const Integrator*> integrators_of(const Formulation& f);
/// Throws CapabilityError where the problem's formulation does not run on it.
void require_form(const Problem& problem, const Integrator& integrator);

/// The integrator a problem runs on: its own choice, or the formulation's default.
std::string integrator_of(const Problem& problem);
/// The one whose steps discrete methods differentiate: the problem's own choice where it is such a one, else the
/// formulation's fixed steps (of a motion without events, or where their length is given), else the explicit scheme of
/// the highest order, else Radau IIA of the highest order.
std::string discrete_integrator_of(const Problem& problem);

}  // namespace costate
