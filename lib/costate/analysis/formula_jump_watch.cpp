#include "costate/analysis/formula_jump_watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "costate/assembly/gathered_state.h"
#include "costate/base/error.h"
#include "costate/element/path_function.h"
#include "costate/objective/formula_output.h"

namespace costate {

namespace {
/// Of the formula's values: what is left between two neighbouring numbers of what goes on is far less.
constexpr double kJumps = 1e-6;
constexpr int kHalvings = 60;
/// Of the mean distance of looks.
constexpr double kNearLook = 1e-2;
/// Of the way between two looks: how far beside the place the formula is taken, and nearer than that.
constexpr double kBeside = 1e-9, kNearer = 1e-2;

bool positive(double x) { return x >= 0; }

/// Those that a force's formula begins its arguments with, as far as they are the force's.
std::vector<int> numbers_of(const Force& force, const FormulaLaw& formula) {
  const std::size_t count = std::min(force.numbers().size(), static_cast<std::size_t>(formula.number_count()));
  return {force.numbers().begin(), force.numbers().begin() + static_cast<std::ptrdiff_t>(count)};
}
}  // namespace

FormulaJumpWatch::FormulaJumpWatch(const Mechanism& mechanism, const Objective& objective, Looks looks) {
  for (const auto& force : mechanism.forces()) {
    if (looks == Looks::whole) break;
    const auto* owner = dynamic_cast<const PathFunctionElement*>(force.get());
    for (int i = 0; owner && i < owner->path_functions(); ++i)
      if (!owner->path_function(i).is_polynomial())
        formulas_.push_back({&owner->path_function(i), force->path(), numbers_of(*force, owner->path_function(i)),
                             [force = force.get(), owner, i, own = std::make_shared<GatheredState>()](
                                 const StateView& s, Assembly& assembly, double* x) {
                               owner->path_arguments(i, own->of(*force, s, assembly.numbers()), x);
                             }});
  }
  const bool has_states = std::any_of(mechanism.forces().begin(), mechanism.forces().end(),
                                      [](const auto& force) { return force->states() > 0; });
  for (const auto& term : objective.running)
    for (const FormulaOutput* formula : formulas_of(*term))
      if ((has_states || formula->needs_accelerations()) == (looks == Looks::whole) &&
          !formula->definition().formula().is_polynomial())
        formulas_.push_back(
            {&formula->definition().formula(), "the cost's " + formula->name(), formula->definition().numbers(),
             [formula](const StateView& s, Assembly& assembly, double* x) { formula->arguments(s, assembly, x); }});
}

bool FormulaJumpWatch::is_near(double t) const {
  return looks_ > 0 && t - last_ <= kNearLook * (t - begin_) / static_cast<double>(looks_);
}

void FormulaJumpWatch::look(const StateView& s, Assembly& assembly) {
  if (first_ || is_near(s.t)) return;
  if (looks_++ == 0) begin_ = s.t;
  last_ = s.t;
  for (Formula& f : formulas_) {
    now_.resize(static_cast<std::size_t>(f.law->number_count()));
    try {
      f.arguments(s, assembly, now_.data());
      f.law->look(s.t, now_.data(), terms_);
      const std::vector<double> terms = terms_.values;
      for (std::size_t i = 0; i < terms.size() && terms.size() == f.terms.size() && !first_; ++i)
        if (positive(terms[i]) != positive(f.terms[i])) judge(f, i, s.t, now_, assembly);
      f.terms = terms;
    } catch (const Error&) {  // what says nothing there
      f.terms.clear();
    }
    f.t = s.t;
    f.x = now_;
  }
}

void FormulaJumpWatch::judge(const Formula& f, std::size_t i, double t, const std::vector<double>& x,
                             const Assembly& assembly) {
  std::vector<double> at(x.size());
  const auto go = [&](double w) {
    for (std::size_t k = 0; k < x.size(); ++k) at[k] = (1 - w) * f.x[k] + w * x[k];
  };
  const auto look = [&](double t_of) { return f.law->look(t_of, at.data(), terms_); };
  const auto value = [&](double w) {
    go(w);
    return look(f.t + w * (t - f.t));
  };
  const double first = std::abs(value(0)), size = std::max(first, std::abs(value(1)));  // terms are those of the last
  if (i >= terms_.values.size()) return;
  const bool behind = positive(terms_.values[i]);
  double low = 0, high = 1;
  for (int k = 0; k < kHalvings && high - low > 1e-15; ++k) {
    const double w = 0.5 * (low + high);
    value(w);
    if (i >= terms_.values.size()) return;
    (positive(terms_.values[i]) == behind ? high : low) = w;
  }
  // Beside the place, where 0/0 is no number; and nearer, as what goes on there comes together.
  const auto sides = [&](double beside) { return std::pair(value(low - beside), value(high + beside)); };
  const auto [from, to] = sides(kBeside);
  const auto [from_near, to_near] = sides(kNearer * kBeside);
  const double jump = std::abs(to - from), near = std::abs(to_near - from_near);
  if (!std::isfinite(jump) || !std::isfinite(near)) return;
  if (!(jump > kJumps * std::max({size, std::abs(from), std::abs(to)})) || !(near > 0.5 * jump)) return;
  // What time alone brings about is at an instant that is known, if no parameter moves it.
  go(0);
  look(t);
  if (i < terms_.values.size() && positive(terms_.values[i]) != positive(f.terms[i])) {
    go(low);
    const double t_low = f.t + low * (t - f.t);
    look(t_low);
    const double term = terms_.values[i];
    bool moves = false;
    for (std::size_t k = 0; k < f.numbers.size() && !moves; ++k) {
      if (assembly.number_columns()[static_cast<std::size_t>(f.numbers[k])].empty()) continue;
      go(low);
      at[k] += 1e-6 * std::max(1.0, std::abs(at[k]));
      look(t_low);
      moves = i < terms_.values.size() && std::abs(terms_.values[i] - term) > 1e-9 * std::abs(at[k]);
    }
    if (!moves) return;
  }
  first_ = Jump{f.t + high * (t - f.t), from, to, f.owner};
}

std::optional<std::string> FormulaJumpWatch::met() const {
  if (!first_) return {};
  return fmt::format(
      "Near t = {:.6g} s the formula of '{}' jumps from {:.4g} to {:.4g} as what it depends on passes zero. What the "
      "instant depends on is in no derivative. Write it smooth (tanh(u/w) for abs(u)/u); the method 'differences' "
      "tells "
      "what psi does.",
      first_->t, first_->owner, first_->from, first_->to);
}

}  // namespace costate
