#include "costate/optimize/curvature.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "costate/analysis/start.h"
#include "costate/base/error.h"
#include "costate/sensitivity/difference_hessian.h"

namespace costate {

namespace {
/// "a; b", without the full stops that sentences among them have.
std::string joined(std::vector<std::string> notes) {
  for (std::string& note : notes)
    if (!note.empty() && note.back() == '.') note.pop_back();
  return fmt::format("{}", fmt::join(notes, "; "));
}

// Against a Hessian's largest entry: from here on what it is off by is said, and what is off by more than that is none.
constexpr double kSaid = 1e-3, kUnknown = 0.3;

class Search {
 public:
  Search(const Problem& problem, const std::string& method, const std::vector<double>& rho,
         const std::vector<const Objective*>& objectives, double loosest)
      : problem_(problem), method_(method), rho_(rho), objectives_(objectives), exact_alone_(loosest > 0) {
    if (loosest > problem_.solver.rtol) problem_.solver.set_rtol(loosest);
  }

  Curvature run() {
    const Formulation& own = find_formulation(problem_.formulation);
    std::vector<std::string> candidates{own.name};
    std::vector<std::string> notes;
    if (const std::string refused = hessian_refusal(own); !refused.empty()) {
      notes.push_back(fmt::format("formulation '{}' has no Hessian-vector products", own.name));
      candidates.clear();
      const std::string rows = redundant_rows();
      std::vector<std::string> left_out;
      for (const Formulation* f : stand_ins(false)) {
        if (!f->make_hessian) continue;
        const bool takes = f->carries_redundancy || rows.empty();
        (takes ? candidates : left_out).push_back(takes ? f->name : "'" + f->name + "'");
      }
      if (!left_out.empty())
        notes.push_back(fmt::format("{} cannot carry its redundant rows ({})", fmt::join(left_out, " and "), rows));
    }
    const auto exact = [](Problem p, const std::vector<double>& at) {
      p.solver.integrator.clear();
      return confirmed_hessian(p, at);
    };
    for (const std::string& name : candidates) try {
        curvature_of(name, exact);
        if (!is_known()) {
          notes.push_back(
              fmt::format("that of '{}' changes by {:.0e} of its largest entry at a tenth of rtol", name, error()));
          break;
        }
        if (!notes.empty()) found_.note = fmt::format("The Hessian is that of '{}': {}.", name, joined(notes));
        if (!exact_alone_) tell_error();
        return found_;
      } catch (const CapabilityError& e) {
        notes.emplace_back(e.what());
        if (!exact_alone_ && by_differences(notes)) return found_;
        break;  // the cost's doing, whatever the formulation
      } catch (const SolverError& e) {
        notes.push_back(fmt::format("'{}' could not continue: {}", name, e.what()));
      } catch (const ModelError& e) {
        notes.push_back(fmt::format("'{}' could not start: {}", name, e.what()));
      }
    return {{}, {}, fmt::format("There is no Hessian: {}.", joined(notes))};
  }

 private:
  /// By the run's own gradients, where nobody has products.
  bool by_differences(std::vector<std::string>& notes) {
    try {
      curvature_of(problem_.formulation, [&](const Problem& p, const std::vector<double>& at) {
        return hessian_by_differences(p, method_, at);
      });
      if (!is_known()) {
        notes.push_back(fmt::format(
            "differences of gradients do not give it, as steps of twice the length change {:.0e} of its largest entry; "
            "a parameter whose 'scale' is far above the way on which psi changes does that",
            error()));
        return false;
      }
      found_.note = fmt::format(
          "The Hessian is made of differences of gradients by {}, and known to some {:.0e} of its largest entry: {}.",
          method_, error(), joined(notes));
      return true;
    } catch (const SolverError& e) {
      notes.push_back(fmt::format("differences of gradients do not give it, as one failed: {}", e.what()));
    } catch (const CapabilityError& e) {
      notes.emplace_back(e.what());
    }
    return false;
  }

  double error() const {
    double largest = 0;
    for (const Hessian& h : found_.of) largest = std::max(largest, h.error);
    return largest;
  }

  /// Where the run at a tenth of rtol failed nothing is said against it.
  bool is_known() const { return !(std::isfinite(error()) && error() > kUnknown); }

  /// What makes the verdict less than it seems.
  void tell_error() {
    if (!(error() > kSaid)) return;
    found_.note += fmt::format(
        "{}{}", found_.note.empty() ? "" : " ",
        std::isfinite(error())
            ? fmt::format("The Hessian is known to some {:.0e} of its largest entry, by what a tenth of rtol changes "
                          "of a product with it. A smaller rtol tells more.",
                          error())
            : "What the Hessian is known to was not found: the run at a tenth of rtol failed.");
  }

  /// Names of the constraint rows that depend on the others at the start.
  std::string redundant_rows() const {
    Assembly assembly(problem_.mechanism, problem_.parameters);
    assembly.set_parameters(rho_.data());
    const Start start = find_start(assembly, problem_.solver.t_start, false);
    const auto rows = problem_.mechanism->row_names();
    std::vector<std::string> names;
    for (const int i : constraint_rank(assembly, problem_.solver.t_start, start.q.data()).dependent_rows)
      names.push_back(rows[static_cast<std::size_t>(i)]);
    return fmt::format("{}", fmt::join(names, ", "));
  }

  template <class Second>
  void curvature_of(const std::string& formulation, const Second& second) {
    Problem p = problem_;
    p.formulation = formulation;
    found_ = {{}, formulation, {}};
    for (const Objective* objective : objectives_) {
      p.objective = *objective;
      found_.of.push_back(second(p, rho_));
    }
  }

  Problem problem_;
  const std::string& method_;
  const std::vector<double>& rho_;
  const std::vector<const Objective*>& objectives_;
  bool exact_alone_;
  Curvature found_;
};

}  // namespace

Curvature find_curvature(const Problem& problem, const std::string& method, const std::vector<double>& rho,
                         const std::vector<const Objective*>& objectives, double loosest) {
  return Search(problem, method, rho, objectives, loosest).run();
}

}  // namespace costate
