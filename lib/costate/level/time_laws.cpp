#include "costate/level/time_laws.h"

#include <algorithm>

#include "costate/element/course.h"
#include "costate/objective/sampled_cost.h"
#include "costate/objective/weighted_cost.h"

namespace costate {

namespace {

/// Calls add(law, first of its numbers among the element's) for the element's own laws of time.
template <class Add>
void for_each_time_law(const Element& element, const std::vector<double>& p, const Add& add) {
  Course laws([&](const ScalarLaw& law, const double* numbers, double shift, double rate) {
    // Not what is made up of an element's laws on the way, nor posts under a wheel, of which tyres tell themselves.
    if (shift == 0 && rate == 1 && numbers >= p.data() && numbers + law.number_count() <= p.data() + p.size())
      add(law, static_cast<std::size_t>(numbers - p.data()));
  });
  if (const auto* course = dynamic_cast<const CourseElement*>(&element)) return course->add_course(p.data(), laws);
  for (const ElementCourse& course : element_courses())
    if (course(element, p.data(), laws)) return;
}

}  // namespace

std::vector<TimeLaw> laws_of_time(const Mechanism& mechanism, const Objective& objective) {
  std::vector<TimeLaw> all;
  const auto add = [&](const ScalarLaw& law, std::vector<int> numbers, const std::string& kind,
                       const std::string& name) {
    all.push_back({&law, std::move(numbers), kind, name});
  };
  const std::vector<double> base = mechanism.base_numbers();
  for (const auto& force : mechanism.forces()) {
    const std::vector<int>& own = force->numbers();
    std::vector<double> p;
    for (const int n : own) p.push_back(base[static_cast<std::size_t>(n)]);
    for_each_time_law(*force, p, [&](const ScalarLaw& law, std::size_t first) {
      const auto begin = own.begin() + static_cast<std::ptrdiff_t>(first);
      add(law, {begin, begin + law.number_count()}, force->kind(), force->name());
    });
  }
  for (const auto& term : objective.running) {
    if (const WeightedTerm* weighted = weighted_term(*term))
      add(weighted->law(), weighted->law_numbers(), "cost", "weight");
    if (const auto* of = dynamic_cast<const OutputTerm*>(&ungated(*term)); of && of->target().law)
      add(*of->target().law, of->target().law_numbers, "cost", "target");
  }
  return all;
}

bool is_moved(int number, const ParameterSelection& parameters) {
  return std::any_of(parameters.parameters.begin(), parameters.parameters.end(), [&](const Parameter& p) {
    return std::any_of(p.bindings.begin(), p.bindings.end(), [&](const auto& b) { return b.first == number; });
  });
}

std::vector<double> places_of_moved_drivers(const Mechanism& mechanism, const ParameterSelection& parameters,
                                            const std::vector<double>& numbers) {
  LawPlaces places;
  for (const auto& c : mechanism.constraints()) {
    const std::vector<int>& own = c->numbers();
    if (!c->rheonomic() || std::none_of(own.begin(), own.end(), [&](int n) { return is_moved(n, parameters); }))
      continue;
    std::vector<double> p;
    for (const int n : own) p.push_back(numbers[static_cast<std::size_t>(n)]);
    for_each_time_law(*c, p,
                      [&](const ScalarLaw& law, std::size_t first) { add_law_places(law, p.data() + first, places); });
  }
  return places.sharp;
}

std::vector<TimeLaw> moved_laws_of_time(const Mechanism& mechanism, const Objective& objective,
                                        const ParameterSelection& parameters) {
  std::vector<TimeLaw> all = laws_of_time(mechanism, objective);
  std::erase_if(all, [&](const TimeLaw& law) {
    return std::none_of(law.numbers.begin(), law.numbers.end(), [&](int n) { return is_moved(n, parameters); });
  });
  return all;
}

}  // namespace costate
