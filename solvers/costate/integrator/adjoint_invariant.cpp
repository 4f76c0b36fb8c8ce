#include "costate/integrator/adjoint_invariant.h"

#include "costate/assembly/gathered_state.h"
#include "costate/base/library_class.h"
#include "costate/element/course.h"
#include "costate/element/guarded_force.h"
#include "costate/objective/own_value.h"

namespace costate {

namespace {
/// Whether a law of time is at work between the two, in a force or a running cost: where the run ends it may have
/// nothing to act on (a plate under a wheel that has left it).
bool has_course(const Assembly& assembly, const Objective& objective, double t_start, double t_end) {
  Course course(t_start, t_end);
  const std::vector<double>& all = assembly.numbers();
  for (const auto& f : assembly.mechanism().forces()) {
    std::vector<double> p;
    for (const int number : f->numbers()) p.push_back(all[static_cast<std::size_t>(number)]);
    if (const auto* element = dynamic_cast<const CourseElement*>(f.get()))
      element->add_course(p.data(), course);
    else
      for (const ElementCourse& add : element_courses())
        if (add(*f, p.data(), course)) break;
  }
  for (const auto& term : objective.running) add_cost_course(*term, all, course);
  bool any = false;
  course.for_each_end([&](double) { any = true; });
  return any;
}
/// Whether what a user wrote asks for the time, perhaps for an instant alone.
bool asks_own_for_time(System& system, const StateView& s, Assembly& assembly) {
  const auto asks = [&](const OwnValue& value) { return value && asks_for_time(value, s, assembly); };
  const Mechanism& m = assembly.mechanism();
  for (std::size_t i = 0; i < m.forces().size(); ++i) {
    const Force& f = *m.forces()[i];
    if (is_own(f) && asks(own_value(m, f))) return true;
    const auto* guarded = dynamic_cast<const GuardedForce*>(&f);
    if (!guarded || is_wholly_of_library(typeid(f))) continue;
    const OwnValue guards = [&](const StateView& at, Assembly& a) {
      GatheredState own;
      LocalState local = own.of(f, at, a.numbers());
      local.z = at.z ? at.z + m.state_offsets()[i] : nullptr;
      double sum = 0;
      for (int k = 0; k < guarded->guard_count(); ++k)
        if (!local.z || guarded->guard_armed(k, local.z)) sum += guarded->guard_value(k, local);
      return sum;
    };
    if (asks(guards)) return true;
  }
  for (const auto& term : system.objective().running)
    if (is_own(*term) && !term->needs_accelerations() && asks(own_value(*term))) return true;
  return false;
}
}  // namespace

bool AdjointInvariant::autonomous(System& system, double t_start, double t, const double* y) {
  for (const auto& c : system.assembly().mechanism().constraints())
    if (c->rheonomic()) return false;
  if (has_course(system.assembly(), system.objective(), t_start, t)) return false;
  Assembly assembly(system.assembly().mechanism_ptr(), system.parameters());
  assembly.set_parameters(system.assembly().rho().data());
  StateView s = system.mechanism_state(t, y);
  if (asks_own_for_time(system, s, assembly)) return false;
  struct Terms {
    std::vector<double> M, Q, bias, zdot;
    double g;
    bool operator==(const Terms&) const = default;
  };
  const auto at = [&](double time) {
    s.t = time;
    assembly.calc_dynamics(s);
    return Terms{assembly.M, assembly.Q, assembly.bias, assembly.zdot,
                 system.has_running_cost() ? system.objective().running_value(s, assembly) : 0};
  };
  const Terms here = at(t);
  constexpr int kTimes = 16;
  for (int k = 0; k < kTimes; ++k)
    if (!(at(t_start + (t - t_start) * (k + 0.37) / kTimes) == here)) return false;
  return true;
}

}  // namespace costate
