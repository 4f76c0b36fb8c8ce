// Runs of the library in a process of their own, so that a crash or a hang is a finding, and what is to be
// thought of them.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

namespace costate::adversary {

enum class Outcome { agreed, warned, refused, failed, unjudged, wrong, crashed, hung };
const char* name_of(Outcome outcome);

struct Finding {
  Outcome outcome = Outcome::unjudged;
  std::string run;      // "baumgarte x cvodes-adjoint"
  double error = 0;     // relative, where there is one
  std::string message;  // one line
};

/// What is right, as far as it is known.
struct Truth {
  bool known = false;
  double psi = 0, psi_scale = 1;  // the size that psi's error is measured by, where psi itself vanishes
  double psi_uncertainty = 0;
  std::vector<double> gradient, uncertainty, scales;
};

/// A gradient method on a scene: agreed within `allowed` of the truth, else wrong; refusals and failures with
/// a cause.
Finding run_gradient(const std::string& scene, const std::string& formulation, const std::string& method,
                     const Truth& truth, double allowed = 1e-4);
/// The product of the formulation's Hessian with one direction of all parameters, against differences of gradients by
/// another formulation, over steps of this part of the scales: agreed within `allowed` of the larger of H d and the
/// gradient, or ten times what the Hessian says of its error.
Finding run_hessian(const std::string& scene, const std::string& formulation, const std::string& oracle = "maggi",
                    double step = 2e-3, double allowed = 1e-3);
/// What `find` finds, and how it ends where it does not.
Finding found(const std::string& run, const std::function<void(Finding&)>& find);
/// Every formulation and method that exist together, differences apart.
std::vector<std::pair<std::string, std::string>> combinations();

/// Truth by central differences of whole runs of re-read scenes: each value is written into the scene as a
/// user would. Known where two formulations agree.
Truth truth_by_rereading(const std::string& scene, const std::vector<std::string>& paths,
                         const char* formulation = "maggi", const char* integrator = "dop853");

/// Runs f in a child; its findings, or one that says how it ended.
std::vector<Finding> in_child(const std::function<std::vector<Finding>()>& f, int seconds);

}  // namespace costate::adversary
