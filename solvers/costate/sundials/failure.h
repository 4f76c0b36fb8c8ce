// The report of an integrator's failure: what, when, at which step, the worst components by name, and what the elements
// say of the state there.
#pragma once

#include <cstdlib>
#include <functional>
#include <initializer_list>
#include <string>
#include <vector>

#include "costate/formulation/system.h"

namespace costate {

/// The name of a flag that SUNDIALS returned, by one of its APIs (sundials/ida_api.h).
template <class Api>
std::string flag_name_of(int flag) {
  char* name = Api::flag_name(flag);
  std::string text = name ? name : std::to_string(flag);
  std::free(name);
  return text;
}

struct FailureContext {
  std::string what;     // "IDAS could not continue the simulation"
  std::string message;  // the library's own text
  std::string flag;     // "IDA_CONV_FAILURE"
  double t = 0, step = 0;
  long steps = 0;
  const double* weights = nullptr;  // of the error norm, size() entries
  const double* errors = nullptr;   // estimated local errors
  const double* rates = nullptr;    // time derivatives, named when there are no errors to name
  std::string elements;             // elements_at()
};

/// What the elements say at the state y of the motion (analysis/complaints.h); empty where there is none, or y is null.
std::string elements_at(System& system, double t, const double* y);
/// The same at the first of these times at which they say anything; `state` gives y, or null.
std::string elements_at(System& system, std::initializer_list<double> times,
                        const std::function<const double*(double t)>& state);

/// Behind the integrator's name, for a run that would take `all` steps at its pace, of `most` allowed.
std::string pace_message(double all, long most);

/// Weighted local errors above all others come first; advice depends on the flag.
std::string failure_report(const FailureContext& c, const std::vector<Unknown>& unknowns);

/// The unknowns of a backward run, by the names of those that they belong to.
std::vector<Unknown> adjoint_names(std::vector<Unknown> unknowns);

}  // namespace costate
