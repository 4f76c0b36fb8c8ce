#include "targets.h"

#include <fmt/format.h>

#include <algorithm>

#include "costate/named_outputs.h"
#include "costate/objective/sampled_cost.h"

namespace costate::app {

namespace {

constexpr const char* kTarget = "#b3541e";
constexpr const char* kMeasured = "#2a8f5b";
constexpr std::size_t kDots = 1000;  // of a measured channel; more are one blot

/// At these times; empty where the term has none, or one that the motion does not hold.
std::vector<double> target_at(const OutputTerm::Target& target, const Mechanism& mechanism,
                              const TrajectoryTable& motion, const std::vector<double>& times) {
  if (target.output) {
    const Column* c = column_of_output(motion, target.output->name());
    if (!c) return {};
    return times.size() == 1 ? std::vector<double>{c->values.back()} : c->values;
  }
  if (!target.law) return {};
  std::vector<double> numbers, values;
  for (const int n : target.law_numbers) numbers.push_back(mechanism.numbers()[static_cast<std::size_t>(n)].value);
  for (const double t : times) values.push_back(target.law->value(t, numbers.data()));
  return values;
}

SvgCurve measured(const SampleData& data) {
  const std::size_t stride = 1 + (data.times.size() - 1) / kDots;
  SvgCurve dots;
  dots.name = stride == 1 ? "measured" : fmt::format("measured, 1 of {}", stride);
  for (std::size_t k = 0; k < data.times.size(); k += stride) {
    dots.x.push_back(data.times[k]);
    dots.y.push_back(data.values[k]);
  }
  dots.color = kMeasured;
  dots.joined = false;
  return dots;
}

}  // namespace

std::vector<SvgCurve> target_curves(const Scene& scene, const std::string& output, const TrajectoryTable& motion) {
  std::vector<SvgCurve> curves;
  if (motion.time_s.empty()) return curves;
  const auto add = [&](const CostTerm& gated, bool at_end) {
    const CostTerm& term = ungated(gated);
    if (const auto* samples = dynamic_cast<const SampledCost*>(&term)) {
      if (samples->output().name() == output && !samples->data().times.empty())
        curves.push_back(measured(samples->data()));
      return;
    }
    const auto* of = dynamic_cast<const OutputTerm*>(&term);
    if (!of || of->output().name() != output) return;
    SvgCurve c;
    c.x = at_end ? std::vector<double>{motion.time_s.back()} : motion.time_s;
    c.y = target_at(of->target(), *scene.mechanism(), motion, c.x);
    if (c.y.size() != c.x.size()) return;
    c.name = of->target().output ? "target " + of->target().output->name() : "target";
    c.color = kTarget;
    c.dashes = "6 3";
    c.joined = !at_end;
    if (at_end) c.name += " at the end";
    const bool known = std::any_of(curves.begin(), curves.end(),
                                   [&](const SvgCurve& other) { return other.name == c.name && other.y == c.y; });
    if (!known) curves.push_back(std::move(c));
  };
  for (const auto& term : scene.objective().running) add(*term, false);
  for (const auto& term : scene.objective().terminal) add(*term, true);
  return curves;
}

}  // namespace costate::app
