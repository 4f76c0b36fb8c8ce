#include "costate/level/fixed_times.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "costate/base/error.h"
#include "costate/element/course.h"
#include "costate/element/law/hidden_jumps.h"
#include "costate/element/law/motion_law.h"
#include "costate/level/time_laws.h"
#include "costate/objective/sampled_cost.h"

namespace costate {

namespace {

/// Times of one kind of one element or cost, as functions of its numbers.
struct Times {
  std::vector<int> numbers;  // in the mechanism
  std::string kind_of_owner, owner;
  std::function<void(const double*, std::vector<double>&)> add;
  std::function<void(double, const double*, double*)> add_slopes;
  const char *what, *instead;
  bool kink = false;

  std::vector<double> at(const std::vector<double>& p) const {
    std::vector<double> times;
    add(p.data(), times);
    return times;
  }
};

/// Those of a list of times or of a law of time, in its order.
template <class Of>
std::vector<double> local_numbers(const Of& of, const std::vector<double>& numbers) {
  std::vector<double> p;
  for (const int number : of.numbers) p.push_back(numbers[static_cast<std::size_t>(number)]);
  return p;
}

/// Of drivers, and of forces that hold a driver's rate.
std::vector<Times> driven_times(const Mechanism& mechanism) {
  std::vector<Times> all;
  for (const auto& pointer : mechanism.constraints()) {
    const Constraint* c = pointer.get();
    if (!c->rheonomic()) continue;
    const auto slopes = [c](double t, const double* p, double* by) { c->add_time_slopes(t, p, by); };
    all.push_back({c->numbers(), c->kind(), c->name(),
                   [c](const double* p, std::vector<double>& times) { c->add_kinks(p, times); }, slopes, "kink",
                   "slope", true});
    all.push_back({c->numbers(), c->kind(), c->name(),
                   [c](const double* p, std::vector<double>& times) { c->add_acceleration_jumps(p, times); }, slopes,
                   "jump of its second derivative", "second derivative"});
  }
  for (const auto& f : mechanism.forces())
    if (const auto* owner = dynamic_cast<const MotionLawElement*>(f.get()))
      all.push_back({f->numbers(), f->kind(), f->name(),
                     [owner](const double* p, std::vector<double>& times) { owner->add_force_jumps(p, times); },
                     [owner](double t, const double* p, double* by) { owner->add_time_slopes(t, p, by); },
                     "kink or jump under a force that holds its rate", "slope"});
  return all;
}

/// Of the same elements those at which derivatives of their equations by what moves the time are the first to jump.
std::vector<Times> bent_times(const Mechanism& mechanism) {
  std::vector<Times> all;
  for (const auto& pointer : mechanism.constraints())
    if (const Constraint* c = pointer.get(); c->rheonomic())
      all.push_back({c->numbers(), c->kind(), c->name(),
                     [c](const double* p, std::vector<double>& times) { c->add_third_jumps(p, times); },
                     [c](double t, const double* p, double* by) { c->add_time_slopes(t, p, by); },
                     "jump of its third derivative", "third derivative"});
  for (const auto& f : mechanism.forces())
    if (const auto* owner = dynamic_cast<const MotionLawElement*>(f.get()))
      all.push_back({f->numbers(), f->kind(), f->name(),
                     [owner](const double* p, std::vector<double>& times) { owner->add_force_bends(p, times); },
                     [owner](double t, const double* p, double* by) { owner->add_time_slopes(t, p, by); },
                     "jump of its second derivative under a force that holds its rate", "second derivative"});
  return all;
}

/// A law of time's jumps that it knows of, and within the run those that it does not.
void add_jumps(const ScalarLaw& law, const double* p, double t_start, double t_end, std::vector<double>& times) {
  add_value_jumps(law, p, times);
  for (const HiddenJump& j : HiddenJumps(law, p, t_start, t_end).of(JumpOf::value))
    if (std::none_of(times.begin(), times.end(), [&](double t) { return std::abs(t - j.x) <= 1e-12 * std::abs(t); }))
      times.push_back(j.x);
}

/// Of an element whose numbers parameters move: where its laws of time jump within the run and do not tell.
void add_hidden_times(const Element& e, const ParameterSelection& parameters, double t_start, double t_end, JumpOf of,
                      const char* what, const char* instead, std::vector<Times>& all) {
  const auto* course = dynamic_cast<const CourseElement*>(&e);
  const std::vector<int>& numbers = e.numbers();
  if (!course || std::none_of(numbers.begin(), numbers.end(), [&](int n) { return is_moved(n, parameters); })) return;
  all.push_back({numbers, e.kind(), e.name(),
                 [=](const double* p, std::vector<double>& times) {
                   Course laws([&](const ScalarLaw& law, const double* own, double shift, double rate) {
                     for (const HiddenJump& j : HiddenJumps(law, own, t_start, t_end, shift, rate).of(of))
                       times.push_back(j.x);
                   });
                   course->add_course(p, laws);
                 },
                 [](double, const double*, double*) {}, what, instead});
}

/// Those, and of forces and costs whose laws of time jump; what laws do not know of is looked for between the two
/// times.
std::vector<Times> all_times(const Mechanism& mechanism, const Objective& objective,
                             const ParameterSelection& parameters, double t_start, double t_end) {
  std::vector<Times> all = driven_times(mechanism);
  for (const auto& c : mechanism.constraints())
    if (c->rheonomic())
      add_hidden_times(*c, parameters, t_start, t_end, JumpOf::curvature, "jump of its second derivative",
                       "second derivative", all);
  for (const auto& f : mechanism.forces())
    if (dynamic_cast<const MotionLawElement*>(f.get()))
      add_hidden_times(*f, parameters, t_start, t_end, JumpOf::slope, "kink under a force that holds its rate", "slope",
                       all);
  for (const TimeLaw& of : moved_laws_of_time(mechanism, objective, parameters)) {
    const ScalarLaw* law = of.law;
    all.push_back({of.numbers, of.kind, of.name,
                   [law, t_start, t_end](const double* p, std::vector<double>& times) {
                     add_jumps(*law, p, t_start, t_end, times);
                   },
                   [law](double t, const double* p, double* by) { law->add_place_slopes(t, p, by); }, "jump", "value"});
  }
  return all;
}

std::vector<double> by_numbers(const Times& times, const std::vector<double>& p, double t) {
  std::vector<double> slopes(p.size(), 0);
  times.add_slopes(t, p.data(), slopes.data());
  return slopes;
}

std::vector<double> by_parameters(const Times& times, const ParameterSelection& parameters,
                                  const std::vector<double>& p, double t) {
  const std::vector<double> slopes = by_numbers(times, p, t);
  std::vector<double> by;
  for (const auto& parameter : parameters.parameters) {
    double sum = 0;
    for (const auto& [number, factor] : parameter.bindings)
      for (std::size_t k = 0; k < p.size(); ++k)
        if (times.numbers[k] == number) sum += factor * slopes[k];
    by.push_back(sum);
  }
  return by;
}

bool moves(const std::vector<double>& by) {
  return std::any_of(by.begin(), by.end(), [](double d) { return d != 0; });
}

struct Nearby {
  std::vector<double> numbers, times;
};
/// With number k changed by as much as the law allows: breaks are in order.
Nearby times_nearby(const Times& times, const std::vector<double>& p, std::size_t k) {
  constexpr double kFarthest = 1e-3, kNearest = 1e-12;
  for (double part = kFarthest;; part *= 0.1)
    for (const double sign : {1.0, -1.0}) try {
        std::vector<double> changed = p;
        changed[k] += sign * part * std::max(1.0, std::abs(p[k]));
        return {changed, times.at(changed)};
      } catch (const Error&) {
        if (part < kNearest && sign < 0) throw;
      }
}

/// The name of a parameter that moves the time t of an element with the numbers p, or nothing; where what is known is
/// `carried`, of one that moves it in a way that is not known.
std::string mover(const Times& times, const ParameterSelection& parameters, const std::vector<double>& p, double t,
                  bool carried) {
  const std::vector<double> known = carried ? by_numbers(times, p, t) : std::vector<double>(p.size(), 0);
  for (const auto& parameter : parameters.parameters)
    for (const auto& [number, factor] : parameter.bindings)
      for (std::size_t k = 0; k < p.size(); ++k) {
        if (times.numbers[k] != number) continue;
        if (std::isnan(known[k])) return parameter.name;
        if (known[k] != 0) continue;
        const std::vector<double> then = times_nearby(times, p, k).times;
        if (std::find(then.begin(), then.end(), t) == then.end()) return parameter.name;
      }
  return {};
}

constexpr double kTogether = 1e-12;  // of times that coincide, in parts of them

/// What happens where a run begins or ends happens in it or not, by which way a parameter moves it.
void require_within(const Times& times, const ParameterSelection& parameters, const std::vector<double>& p, double t,
                    double t_start, double t_end) {
  for (const double edge : {t_start, t_end}) {
    if (std::abs(t - edge) > kTogether * std::max(1.0, std::abs(edge))) continue;
    const std::string name = mover(times, parameters, p, t, false);
    if (!name.empty())
      throw CapabilityError(fmt::format(
          "Parameter '{}' moves the time t = {:.6g} s at which the law of {} '{}' has a {}, and the run {} there: the "
          "derivative is another one on either side. Let the run {} a little {}, or keep the number fixed.",
          name, t, times.kind_of_owner, times.owner, times.what, edge == t_start ? "begins" : "ends",
          edge == t_start ? "begin" : "end", edge == t_start ? "earlier" : "later"));
  }
}

/// The name of a parameter whose changes move time i of an element in another way, or nothing.
std::string bender(const Times& times, const ParameterSelection& parameters, const std::vector<double>& p,
                   std::size_t i) {
  const std::vector<double> all = times.at(p), slopes = by_numbers(times, p, all[i]);
  for (const auto& parameter : parameters.parameters)
    for (const auto& [number, factor] : parameter.bindings)
      for (std::size_t k = 0; k < p.size(); ++k) {
        if (times.numbers[k] != number) continue;
        const Nearby there = times_nearby(times, p, k);
        if (there.times.size() != all.size()) return parameter.name;
        const std::vector<double> then = by_numbers(times, there.numbers, there.times[i]);
        for (std::size_t l = 0; l < p.size(); ++l)
          if (is_moved(times.numbers[l], parameters) &&
              std::abs(then[l] - slopes[l]) > kTogether * std::max(1.0, std::abs(slopes[l])))
            return parameter.name;
      }
  return {};
}

std::vector<double> sample_times(const Objective& objective) {
  std::vector<double> times;
  if (const SampleTerm* samples = sample_term(objective)) times = samples->times();
  for (const auto& term : objective.terminal)
    if (const auto* cost = dynamic_cast<const SampledCost*>(term.get()))
      times.insert(times.end(), cost->data().times.begin(), cost->data().times.end());
  return times;
}

struct Instant {
  double t;
  std::vector<double> by;
  std::string owner;
};

void require_together(const std::vector<Instant>& instants, const ParameterSelection& parameters) {
  for (std::size_t i = 0; i < instants.size(); ++i)
    for (std::size_t k = i + 1; k < instants.size(); ++k) {
      const Instant &a = instants[i], &b = instants[k];
      if (b.t - a.t > kTogether * std::max(1.0, std::abs(b.t))) break;
      for (std::size_t j = 0; j < a.by.size(); ++j)
        if (std::abs(a.by[j] - b.by[j]) > kTogether * std::max(std::abs(a.by[j]), std::abs(b.by[j])))
          throw CapabilityError(
              fmt::format("At t = {:.6g} s jumps of '{}' and of '{}' coincide, and parameter '{}' moves them apart: "
                          "what each of them does to the derivative is not told apart, and it may be another one on "
                          "either side. Move one of them a little, keep the number fixed, or take the method "
                          "'differences'.",
                          a.t, a.owner, b.owner, parameters.parameters[j].name));
    }
}

}  // namespace

std::vector<double> driver_kinks(const Mechanism& mechanism, const std::vector<double>& numbers) {
  std::vector<double> times;
  for (const Times& list : driven_times(mechanism))
    if (list.kink) list.add(local_numbers(list, numbers).data(), times);
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

std::vector<double> jump_times(const Mechanism& mechanism, const Objective& objective,
                               const std::vector<double>& numbers) {
  std::vector<double> times;
  for (const Times& list : driven_times(mechanism)) list.add(local_numbers(list, numbers).data(), times);
  for (const TimeLaw& of : laws_of_time(mechanism, objective))
    add_value_jumps(*of.law, local_numbers(of, numbers).data(), times);
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

std::vector<double> kinks_of_moved_laws(const Mechanism& mechanism, const Objective& objective,
                                        const ParameterSelection& parameters, const std::vector<double>& numbers) {
  std::vector<double> times;
  for (const TimeLaw& of : moved_laws_of_time(mechanism, objective, parameters))
    of.law->add_kinks(local_numbers(of, numbers).data(), times);
  // Of posts under tyres what moves; of drivers all places, at which a number may open what is closed now.
  for (const Times& list : bent_times(mechanism)) {
    const std::vector<double> p = local_numbers(list, numbers);
    for (const double t : list.at(p))
      if (moves(by_parameters(list, parameters, p, t))) times.push_back(t);
  }
  for (const double t : places_of_moved_drivers(mechanism, parameters, numbers)) times.push_back(t);
  return times;
}

std::vector<MovingInstant> moving_instants(const Mechanism& mechanism, const Objective& objective,
                                           const ParameterSelection& parameters, const std::vector<double>& numbers,
                                           bool with_bends) {
  std::vector<MovingInstant> instants;
  if (parameters.parameters.empty()) return instants;
  std::vector<Times> lists = all_times(mechanism, objective, parameters, 0, 0);
  if (with_bends)
    for (Times& list : bent_times(mechanism)) lists.push_back(std::move(list));
  for (const Times& list : lists) {
    const std::vector<double> p = local_numbers(list, numbers);
    for (const double t : list.at(p)) {
      std::vector<double> by = by_parameters(list, parameters, p, t);
      if (moves(by)) instants.push_back({t, std::move(by)});
    }
  }
  const auto earlier = [](const MovingInstant& a, const MovingInstant& b) { return a.t < b.t; };
  const auto same = [](const MovingInstant& a, const MovingInstant& b) { return a.t == b.t; };
  std::stable_sort(instants.begin(), instants.end(), earlier);
  instants.erase(std::unique(instants.begin(), instants.end(), same), instants.end());
  return instants;
}

void require_even_times(const Mechanism& mechanism, const Objective& objective, const ParameterSelection& parameters,
                        const std::vector<double>& numbers, double t_start, double t_end) {
  std::vector<Times> lists = all_times(mechanism, objective, parameters, t_start, t_end);
  const std::size_t first_bent = lists.size();
  for (Times& list : bent_times(mechanism)) lists.push_back(std::move(list));
  std::vector<Instant> instants;
  for (std::size_t l = 0; l < lists.size(); ++l) {
    const Times& list = lists[l];
    const std::vector<double> p = local_numbers(list, numbers), times = list.at(p);
    for (std::size_t i = 0; i < times.size(); ++i) {
      if (l >= first_bent) require_within(list, parameters, p, times[i], t_start, t_end);
      if (!(t_start < times[i] && times[i] < t_end)) continue;
      instants.push_back(
          {times[i], by_parameters(list, parameters, p, times[i]), list.kind_of_owner + "." + list.owner});
      if (const std::string name = bender(list, parameters, p, i); !name.empty())
        throw CapabilityError(fmt::format(
            "Parameter '{}' moves the time t = {:.6g} s at which the law of {} '{}' has a {}, and not evenly: "
            "that time's second derivative is not known. Keep this number fixed, or take differences of "
            "gradients.",
            name, times[i], list.kind_of_owner, list.owner, list.what));
    }
  }
  std::stable_sort(instants.begin(), instants.end(), [](const Instant& a, const Instant& b) { return a.t < b.t; });
  require_together(instants, parameters);
}

void require_fixed_times(const Mechanism& mechanism, const Objective& objective, const ParameterSelection& parameters,
                         const std::vector<double>& numbers, double t_start, double t_end, bool carried) {
  std::vector<Instant> instants;
  bool any = false;
  for (const Times& list : all_times(mechanism, objective, parameters, t_start, t_end)) {
    const std::vector<double> p = local_numbers(list, numbers);
    for (const double t : list.at(p)) {
      require_within(list, parameters, p, t, t_start, t_end);
      if (!(t_start < t && t < t_end)) continue;
      const std::string name = mover(list, parameters, p, t, carried);
      if (!name.empty())
        throw CapabilityError(fmt::format(
            "Parameter '{}' moves the time t = {:.6g} s at which the law of {} '{}' has a {}; {}. Keep this "
            "number fixed, take a law with a continuous {}, or the method {}'differences'.",
            name, t, list.kind_of_owner, list.owner, list.what,
            carried ? "how is not known" : "this method carries gradients across these at fixed times only",
            list.instead, carried ? "" : "'idas-adjoint' or "));
      if (carried)
        instants.push_back({t, by_parameters(list, parameters, p, t), list.kind_of_owner + "." + list.owner});
      any = any || (carried && moves(instants.back().by));
    }
  }
  if (!any) return;
  // What jumps there at a fixed time is not carried along.
  for (const TimeLaw& law : laws_of_time(mechanism, objective)) {
    std::vector<double> times;
    add_value_jumps(*law.law, local_numbers(law, numbers).data(), times);
    for (const double t : times) {
      const bool known = std::any_of(instants.begin(), instants.end(), [&](const Instant& at) {
        return at.t == t && at.owner == law.kind + "." + law.name;
      });
      if (!known && t_start < t && t < t_end)
        instants.push_back({t, std::vector<double>(parameters.parameters.size(), 0), law.kind + "." + law.name});
    }
  }
  for (const double t : sample_times(objective))
    instants.push_back({t, std::vector<double>(parameters.parameters.size(), 0), "a sample"});
  std::stable_sort(instants.begin(), instants.end(), [](const Instant& a, const Instant& b) { return a.t < b.t; });
  require_together(instants, parameters);
}

}  // namespace costate
