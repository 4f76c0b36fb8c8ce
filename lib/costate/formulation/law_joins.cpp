#include "costate/formulation/law_joins.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "costate/base/error.h"
#include "costate/element/course.h"
#include "costate/element/gap_element.h"
#include "costate/element/law/hidden_jumps.h"
#include "costate/element/law/motion_law.h"
#include "costate/element/path_function.h"

namespace costate {

namespace {

/// Of its own size: what a driver's position may differ by, and what a parameter opens beyond rounding.
constexpr double kDriverJoin = 1e-6, kOpened = 1e-6;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Of a parameter's scale: what shows whether it moves a place, and whether pieces part there to first order.
constexpr double kMoved = 1e-3, kParting = 1e-4;
/// Of drivers' pieces that are asked for; a law that repeats has more, all of one kind.
constexpr std::size_t kMostPieces = 1000;

double before(double x) { return std::nextafter(x, -kInfinity); }

std::vector<double> local(const Element& e, int first, int count, const std::vector<double>& numbers) {
  std::vector<double> p;
  for (int k = 0; k < count; ++k)
    p.push_back(numbers[static_cast<std::size_t>(e.numbers()[static_cast<std::size_t>(first + k)])]);
  return p;
}

/// The numbers with a parameter moved by a part of its scale.
std::vector<double> moved(const Parameter& parameter, std::vector<double> numbers, double part = 1) {
  for (const auto& [number, factor] : parameter.bindings)
    numbers[static_cast<std::size_t>(number)] += part * factor * parameter.scale;
  return numbers;
}

[[noreturn]] void refuse_parameter(const std::string& parameter, const char* what, const std::string& law,
                                   const char* at, double x, const char* because) {
  throw CapabilityError(fmt::format(
      "Parameter '{}' opens a {} in the law '{}' at {} = {:g}, where its pieces meet now: {}. Bind the numbers of both "
      "sides to "
      "the parameter so that they go on meeting, or take a law that is continuous whatever its numbers are (piecewise "
      "with joins = \"continued\", steps, smooth_steps, table).",
      parameter, what, law, at, x, because));
}

/// The joints with a parameter moved by its scale, or by a part of that where the law has none then (breaks that would
/// no longer increase).
LawJoints joints_with(const Force& f, const MotionLaw& law, const Parameter& parameter,
                      const std::vector<double>& numbers) {
  for (double part = 1; part >= kMoved; part *= 0.1) try {
      return joints_of(f, law, moved(parameter, numbers, part));
    } catch (const ModelError&) {
    }
  return joints_of(f, law, numbers);
}

/// Where a parameter moves a place it must move both sides together, to first order: what parts them is looked at a
/// little to either side.
void require_joined_places(const Force& f, const MotionLaw& law, const Parameter& parameter,
                           const std::vector<double>& numbers, const LawJoints& now) {
  const LawJoints less = joints_of(f, law, moved(parameter, numbers, -kParting)),
                  more = joints_of(f, law, moved(parameter, numbers, kParting));
  if (less.all.size() != now.all.size() || more.all.size() != now.all.size()) return;
  for (std::size_t k = 0; k < now.all.size(); ++k) {
    const LawJoint &a = less.all[k], &b = more.all[k];
    if (a.x == b.x) continue;
    const double jump = (b.right - b.left) - (a.right - a.left);
    if (std::abs(jump) > 2 * kParting * kOpened * now.value)
      refuse_parameter(parameter.name, "jump", fmt::format("{}.{}", f.path(), law.key), "x", now.all[k].x,
                       "it moves this place, and a force that jumps has no gradients here");
  }
}

void require_joined_force(const Force& f, const MotionLaw& law, const ParameterSelection& parameters,
                          const std::vector<double>& numbers) {
  const std::string name = fmt::format("{}.{}", f.path(), law.key);
  const LawJoints now = joints_of(f, law, numbers);
  const auto refuse = [&](const char* what, double left, double right, double x, const char* of_what) {
    throw CapabilityError(
        fmt::format("The {} '{}' jumps from {:.6g} to {:.6g} at x = {:g}. Where a motion comes to that place, its "
                    "force jumps at an instant that moves with every parameter: no gradient here knows that. Let its "
                    "pieces meet{}, lead over the jump within a width (a law of the kind 'steps'), or take the method "
                    "'differences'.",
                    what, name, left, right, x, of_what));
  };
  for (const LawJoint& j : now.all) {
    if (now.jumps(j)) refuse("law", j.left, j.right, j.x, " (joins = \"value\")");
    if (law.by_slope && now.bends(j)) refuse("slope of the law", j.left_slope, j.right_slope, j.x, " with one slope");
  }
  for (const auto& parameter : parameters.parameters) {
    const LawJoints then = joints_with(f, law, parameter, numbers);
    if (then.all.size() != now.all.size()) continue;
    require_joined_places(f, law, parameter, numbers, now);
    for (std::size_t k = 0; k < now.all.size(); ++k) {
      const LawJoint &a = now.all[k], &b = then.all[k];
      if (b.x != a.x) continue;  // it moves: see there
      const double jump = (b.right - b.left) - (a.right - a.left),
                   bend = (b.right_slope - b.left_slope) - (a.right_slope - a.left_slope);
      // Where a law is zero, the last number before the place is not yet.
      if (std::abs(jump) > kOpened * std::max(now.value, then.value) + std::numeric_limits<double>::min() ||
          (law.by_slope && std::abs(bend) > kOpened * std::max(now.slope, then.slope)))
        refuse_parameter(parameter.name, "jump", name, "x", a.x, "a force that jumps has no gradients here");
    }
  }
}

/// The constraint at rest at the origin: what its law of time alone makes of phi, phid and their derivatives.
class AtRest {
 public:
  AtRest(const Constraint& c, const std::vector<double>& numbers)
      : c_(c), p_(local(c, 0, static_cast<int>(c.numbers().size()), numbers)), zero_(kMaxLocal, 0.0) {}
  const std::vector<double>& numbers() const { return p_; }
  std::vector<double> phi(double t) const {
    std::vector<double> r(static_cast<std::size_t>(c_.rows()), 0);
    c_.calc_phi(state(t), r.data());
    return r;
  }
  /// phid, then phidd.
  std::vector<double> rates(double t) const {
    const auto rows = static_cast<std::size_t>(c_.rows());
    std::vector<double> r(2 * rows, 0);
    c_.calc_phi_t(state(t), r.data());
    c_.calc_bias(state(t), r.data() + rows);
    return r;
  }
  /// Of a place t, per a parameter's scale.
  double movement(double t, const Parameter& parameter) const {
    std::vector<double> slopes(p_.size(), 0);
    c_.add_time_slopes(t, p_.data(), slopes.data());
    double sum = 0;
    for (const auto& [number, factor] : parameter.bindings)
      for (std::size_t k = 0; k < p_.size(); ++k)
        if (c_.numbers()[k] == number) sum += factor * parameter.scale * slopes[k];
    return sum;
  }
  /// By a parameter, per its scale: phi, then phid.
  std::vector<double> change(double t, const Parameter& parameter) const {
    const auto rows = static_cast<std::size_t>(c_.rows());
    std::vector<double> sum(2 * rows, 0);
    for (const auto& [number, factor] : parameter.bindings)
      for (std::size_t k = 0; k < p_.size(); ++k) {
        if (c_.numbers()[k] != number) continue;
        std::vector<double> phi(rows, 0), phid(rows, 0), phidd(rows, 0), reaction(kMaxLocal, 0);
        c_.calc_number_partial(state(t), static_cast<int>(k), phi.data(), phid.data(), phidd.data(), reaction.data());
        for (std::size_t i = 0; i < rows; ++i) {
          sum[i] += factor * parameter.scale * phi[i];
          sum[rows + i] += factor * parameter.scale * phid[i];
        }
      }
    return sum;
  }

 private:
  LocalState state(double t) const {
    LocalState s;
    s.t = t;
    s.q = s.v = s.a = s.lambda = s.z = zero_.data();
    s.p = p_.data();
    return s;
  }
  const Constraint& c_;
  std::vector<double> p_, zero_;
};

/// The largest of entries begin ... end of value(t) along the run, on both sides of the places and between them.
template <class Value>
double largest(const Value& value, std::size_t begin, std::size_t end, const std::vector<double>& places,
               double t_start, double t_end) {
  constexpr int samples = 16;
  double size = 0;
  const auto look = [&](double t) {
    const std::vector<double> x = value(t);
    for (std::size_t i = begin; i < end; ++i) size = std::max(size, std::abs(x[i]));
  };
  for (int k = 0; k <= samples; ++k) look(t_start + (t_end - t_start) * k / samples);
  double last = t_start;
  for (const double t : places) {
    for (const double part : {0.3, 0.5, 0.7}) look(last + part * (t - last));
    look(before(t));
    look(t);
    last = t;
  }
  return size;
}

/// Whether a and b differ by more than this in any of entries begin ... end.
bool differ(const std::vector<double>& a, const std::vector<double>& b, std::size_t begin, std::size_t end,
            double allowed) {
  for (std::size_t i = begin; i < end; ++i)
    if (std::abs(b[i] - a[i]) > allowed) return true;
  return false;
}

/// Where the pieces of a driver's law end within t_start < t < t_end.
std::vector<double> places_of(const Constraint& c, const std::vector<double>& p, double t_start, double t_end) {
  std::vector<double> places;
  const auto* element = dynamic_cast<const CourseElement*>(&c);
  if (!element) return places;
  Course course(t_start, t_end);
  element->add_course(p.data(), course);
  course.for_each_end([&](double t) {
    if (t > t_start && t < t_end) places.push_back(t);
  });
  std::sort(places.begin(), places.end());
  places.erase(std::unique(places.begin(), places.end()), places.end());
  if (places.size() > kMostPieces) places.resize(kMostPieces);
  return places;
}

/// Throws where a law of the driver has a jump or a kink that it does not tell of.
void refuse_hidden(const Constraint& c, const std::vector<double>& p, double t_start, double t_end) {
  const auto* element = dynamic_cast<const CourseElement*>(&c);
  if (!element) return;
  Course laws([&](const ScalarLaw& law, const double* numbers, double shift, double rate) {
    const HiddenJumps hidden(law, numbers, t_start, t_end, shift, rate);
    std::vector<double> declared;
    law.add_kinks(numbers, declared);
    for (const JumpOf of : {JumpOf::value, JumpOf::slope})
      for (const HiddenJump& j : hidden.of(of)) {
        const double at = rate * (j.x - shift);
        const auto is_there = [&](double x) { return std::abs(x - at) <= 1e-12 * std::abs(x); };
        if (std::any_of(declared.begin(), declared.end(), is_there)) continue;
        throw CapabilityError(fmt::format(
            "The law of '{}' has a {} at t = {:.9g} s, its {} from {:.6g} to {:.6g}, that its formula does not show: "
            "what "
            "is driven {}, of which the equations of accelerations know nothing. Write it as a law of the kind "
            "'piecewise' (joins = \"value\" for a kink), whose places are known, or smooth.",
            c.path(), of == JumpOf::value ? "jump" : "kink", j.x, of == JumpOf::value ? "value" : "slope", j.left,
            j.right, of == JumpOf::value ? "cannot jump" : "is given a blow there"));
      }
  });
  element->add_course(p.data(), laws);
}

}  // namespace

void require_joined_laws(const Mechanism& mechanism, const ParameterSelection& parameters,
                         const std::vector<double>& numbers, double t_start, double t_end) {
  for (const auto& f : mechanism.forces()) {
    std::vector<MotionLaw> laws;
    if (const auto* owner = dynamic_cast<const MotionLawElement*>(f.get())) owner->add_motion_laws(laws);
    if (const auto* formulas = dynamic_cast<const FormulaElement*>(f.get())) formulas->add_formula_laws(laws);
    for (const MotionLaw& law : laws) require_joined_force(*f, law, parameters, numbers);
  }
  for (const auto& c : mechanism.constraints()) {
    if (!c->rheonomic()) continue;
    const AtRest rest(*c, numbers);
    std::vector<double> kinks;
    c->add_kinks(rest.numbers().data(), kinks);
    std::vector<double> ends = kinks;  // what bounds pieces, other than where courses look
    c->add_acceleration_jumps(rest.numbers().data(), ends);
    const auto rows = static_cast<std::size_t>(c->rows());
    const std::vector<double> places = places_of(*c, rest.numbers(), t_start, t_end);
    if (places.empty()) continue;
    const auto rates = [&](double t) { return rest.rates(t); };
    const double of_rates = kOpened * largest(rates, 0, rows, places, t_start, t_end),
                 of_rates_of_rates = kOpened * largest(rates, rows, 2 * rows, places, t_start, t_end);
    for (const auto& parameter : parameters.parameters) {
      const auto change = [&](double t) { return rest.change(t, parameter); };
      const double of_phi = kOpened * largest(change, 0, rows, places, t_start, t_end),
                   of_phid = kOpened * largest(change, rows, 2 * rows, places, t_start, t_end);
      // Moved by little: courses halve the way to a
      // place, and the half of the way to one that has moved twice as far is where it was.
      const std::vector<double> p = local(*c, 0, static_cast<int>(c->numbers().size()),
                                          moved(parameter, numbers, kMoved)),
                                then = places_of(*c, p, t_start, t_end);
      for (const double t : places) {
        const bool stays = std::find(then.begin(), then.end(), t) != then.end(),
                   end = std::find(ends.begin(), ends.end(), t) != ends.end();
        if (!stays && !end) continue;
        std::vector<double> left = change(before(t)), right = change(t);
        double rounding_phi = 0, rounding_phid = 0;
        // d/drho of both sides at the moved place; with a kink that is there the slopes may change. Another place may
        // be where one that moves was.
        if (const double movement = end ? rest.movement(t, parameter) : 0; movement != 0) {
          if (!std::isfinite(movement)) continue;
          rounding_phi = std::abs(movement) * of_rates;
          rounding_phid = std::abs(movement) * of_rates_of_rates;
          const std::vector<double> left_rates = rest.rates(before(t)), right_rates = rest.rates(t);
          for (std::size_t i = 0; i < 2 * rows; ++i) {
            left[i] += movement * left_rates[i];
            right[i] += movement * right_rates[i];
          }
        }
        const bool jump = differ(left, right, 0, rows, std::max(of_phi, rounding_phi)),
                   kink = std::find(kinks.begin(), kinks.end(), t) == kinks.end() &&
                          differ(left, right, rows, 2 * rows, std::max(of_phid, rounding_phid));
        if (jump || kink)
          refuse_parameter(parameter.name, jump ? "jump" : "kink", c->path(), "t", t,
                           "what is driven would have to jump");
      }
    }
  }
}

void require_joined_drivers(const Mechanism& mechanism, const std::vector<double>& numbers, double t_start,
                            double t_end) {
  for (const auto& c : mechanism.constraints()) {
    if (!c->rheonomic()) continue;
    const AtRest rest(*c, numbers);
    refuse_hidden(*c, rest.numbers(), t_start, t_end);
    const std::vector<double> places = places_of(*c, rest.numbers(), t_start, t_end);
    if (places.empty()) continue;
    const double allowed = kDriverJoin * largest([&](double t) { return rest.phi(t); }, 0,
                                                 static_cast<std::size_t>(c->rows()), places, t_start, t_end);
    for (const double t : places) {
      const std::vector<double> left = rest.phi(before(t)), right = rest.phi(t);
      if (differ(left, right, 0, left.size(), allowed))
        throw CapabilityError(
            fmt::format("The law of '{}' jumps at t = {:g} s, its constraint from {:.6g} to {:.6g}: what is "
                        "driven cannot. Let its pieces meet there to {:g} of their values.",
                        c->path(), t, left[0], right[0], kDriverJoin));
    }
  }
}

Bends bends_of(const Mechanism& mechanism, const std::vector<double>& numbers) {
  Bends bends = Bends::none;
  for (const auto& f : mechanism.forces()) {
    if (const auto* course = dynamic_cast<const CourseElement*>(f.get()); course && course->tracks() > 0)
      return Bends::anywhere;
    std::vector<MotionLaw> laws;
    if (const auto* owner = dynamic_cast<const MotionLawElement*>(f.get())) owner->add_motion_laws(laws);
    for (const MotionLaw& owned : laws)
      if (!owned.followed() && !joints_of(*f, owned, numbers).all.empty()) return Bends::anywhere;
    if (const auto* gaps = dynamic_cast<const GapElement*>(f.get()); gaps && gaps->gap_count() > 0)
      bends = Bends::at_touches;
  }
  return bends;
}

}  // namespace costate
