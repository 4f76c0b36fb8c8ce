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

bool positive(double x) { return x >= 0; }
}  // namespace

FormulaJumpWatch::FormulaJumpWatch(const Mechanism& mechanism, const Objective& objective) {
  for (const auto& force : mechanism.forces()) {
    const auto* owner = dynamic_cast<const PathFunctionElement*>(force.get());
    for (int i = 0; owner && i < owner->path_functions(); ++i)
      if (!owner->path_function(i).is_polynomial())
        formulas_.push_back({&owner->path_function(i), force->path(),
                             [force = force.get(), owner, i, own = std::make_shared<GatheredState>()](
                                 const StateView& s, Assembly& assembly, double* x) {
                               owner->path_arguments(i, own->of(*force, s, assembly.numbers()), x);
                             }});
  }
  const bool has_states = std::any_of(mechanism.forces().begin(), mechanism.forces().end(),
                                      [](const auto& force) { return force->states() > 0; });
  for (const auto& term : objective.running)
    for (const FormulaOutput* formula : formulas_of(*term))
      if (!has_states && !formula->needs_accelerations() && !formula->definition().formula().is_polynomial())
        formulas_.push_back(
            {&formula->definition().formula(), "the cost's " + formula->name(),
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
        if (positive(terms[i]) != positive(f.terms[i])) judge(f, i, s.t, now_);
      f.terms = terms;
    } catch (const Error&) {  // what says nothing there
      f.terms.clear();
    }
    f.t = s.t;
    f.x = now_;
  }
}

void FormulaJumpWatch::judge(const Formula& f, std::size_t i, double t, const std::vector<double>& x) {
  std::vector<double> at(x.size());
  const auto value = [&](double t_of, double w) {
    for (std::size_t k = 0; k < x.size(); ++k) at[k] = (1 - w) * f.x[k] + w * x[k];
    return f.law->look(t_of, at.data(), terms_);
  };
  // What time alone brings about is at an instant that is known.
  value(t, 0);
  if (i >= terms_.values.size() || positive(terms_.values[i]) != positive(f.terms[i])) return;
  double low = 0, high = 1, from = value(f.t, 0), to = value(t, 1);
  double size = std::max(std::abs(from), std::abs(to));
  const bool behind = positive(terms_.values[i]);
  for (int k = 0; k < kHalvings && high - low > 1e-15; ++k) {
    const double w = 0.5 * (low + high), y = value(f.t + w * (t - f.t), w);
    if (i >= terms_.values.size()) return;
    size = std::max(size, std::abs(y));
    (positive(terms_.values[i]) == behind ? high : low) = w;
    (positive(terms_.values[i]) == behind ? to : from) = y;
  }
  if (std::abs(to - from) > kJumps * size || !std::isfinite(to - from))
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
