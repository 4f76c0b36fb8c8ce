#include "costate/objective/output.h"

#include <fmt/format.h>

#include <functional>
#include <string_view>
#include <unordered_map>

#include "costate/assembly/second_terms.h"
#include "costate/base/error.h"
#include "costate/mechanism/multiplier_unit.h"
#include "costate/objective/all_outputs.h"
#include "costate/objective/cycle_output.h"
#include "costate/objective/formula_output.h"
#include "costate/objective/local_output.h"
#include "costate/objective/point_output.h"
#include "costate/objective/work_hint.h"

namespace costate {

void Output::add_gradient(const StateView&, Assembly&, double, ScalarGradient&) const {
  throw CapabilityError(fmt::format("Output '{}' has no derivatives and cannot be part of a cost.", name_));
}

double Output::change(const StateView&, Assembly&, const Variation&) const {
  throw CapabilityError(fmt::format(
      "Output '{}' has no derivative along a motion, which Hessians, second-order adjoints and ends of runs "
      "by an event need.",
      name_));
}

void Output::require_rates(const Variation& d) const {
  if (needs_accelerations() && !d.a)
    throw CapabilityError(
        fmt::format("Output '{}' depends on accelerations or multipliers and has no time derivative, which a run needs "
                    "that ends by an event.",
                    name_));
}

void Output::add_gradient_change(const StateView&, Assembly&, const Variation&, double, ScalarGradient&) const {
  throw CapabilityError(fmt::format("Output '{}' has no second derivatives, which Hessians need.", name_));
}

namespace {

class Time final : public Output {
 public:
  Time() : Output("time", "s") {}
  std::optional<std::vector<int>> depends_on() const override { return std::vector<int>{}; }
  double value(const StateView& s, Assembly&) const override { return s.t; }
  void add_gradient(const StateView&, Assembly&, double, ScalarGradient&) const override {}
  double change(const StateView&, Assembly&, const Variation& d) const override { return d.t; }
  void add_gradient_change(const StateView&, Assembly&, const Variation&, double, ScalarGradient&) const override {}
};

/// One entry of q, v, a, lambda or z.
class Entry final : public Output {
 public:
  enum class Of { q, v, a, lambda, z };
  Entry(std::string name, std::string unit, Of of, int index)
      : Output(std::move(name), std::move(unit)), of_(of), i_(index) {}
  bool needs_accelerations() const override { return of_ == Of::a || of_ == Of::lambda; }
  std::optional<std::vector<int>> depends_on() const override {
    if (needs_accelerations()) return std::nullopt;
    return of_ == Of::z ? std::vector<int>{} : std::vector<int>{i_};
  }
  double value(const StateView& s, Assembly&) const override {
    switch (of_) {
      case Of::q:
        return s.q[i_];
      case Of::v:
        return s.v[i_];
      case Of::a:
        return s.a[i_];
      case Of::lambda:
        return s.lambda[i_];
      case Of::z:
        return s.z[i_];
    }
    return 0;
  }
  void add_gradient(const StateView&, Assembly&, double factor, ScalarGradient& g) const override {
    switch (of_) {
      case Of::q:
        g.q[i_] += factor;
        break;
      case Of::v:
        g.v[i_] += factor;
        break;
      case Of::a:
        g.a[i_] += factor;
        break;
      case Of::lambda:
        g.lambda[i_] += factor;
        break;
      case Of::z:
        g.z[i_] += factor;
        break;
    }
  }
  double change(const StateView&, Assembly&, const Variation& d) const override {
    require_rates(d);
    switch (of_) {
      case Of::q:
        return d.q[i_];
      case Of::v:
        return d.v[i_];
      case Of::a:
        return d.a[i_];
      case Of::lambda:
        return d.lambda[i_];
      case Of::z:
        return d.z[i_];
    }
    return 0;
  }
  void add_gradient_change(const StateView&, Assembly&, const Variation&, double, ScalarGradient&) const override {}

 private:
  Of of_;
  int i_;
};

class ElementOutput final : public LocalOutput {
 public:
  ElementOutput(std::string name, const Measure& m, int index, const Element& e, int row, int rows, int state,
                int states)
      : LocalOutput(std::move(name), m.unit, e.coordinates(), e.numbers(), row, rows, state, states),
        element_(e),
        index_(index),
        accelerations_(m.needs_accelerations) {}
  bool needs_accelerations() const override { return accelerations_; }

 protected:
  PathDual evaluate(const MeasureArguments& x) const override { return element_.measure(index_, x); }
  bool evaluate_value(const ValueArguments& x, double& value) const override {
    return element_.measure_value(index_, x, value);
  }

 private:
  const Element& element_;
  int index_;
  bool accelerations_;
};

/// T = v^T M v / 2 of the whole mechanism, with T_q = (v^T (M v)_q) / 2 and T_v = M v.
class KineticEnergy final : public Output {
 public:
  KineticEnergy() : Output("energy.kinetic", "J") {}
  double value(const StateView& s, Assembly& assembly) const override { return assembly.kinetic_energy(s); }
  void add_gradient(const StateView& s, Assembly& assembly, double factor, ScalarGradient& g) const override {
    assembly.add_kinetic_energy_gradient(s, factor, g.q.data(), g.v.data(), g.rho.data());
  }
  double change(const StateView& s, Assembly& assembly, const Variation& d) const override {
    return kinetic_energy_change(s, assembly, d);
  }
  void add_gradient_change(const StateView& s, Assembly& assembly, const Variation& d, double factor,
                           ScalarGradient& g) const override {
    add_kinetic_energy_gradient_change(s, assembly, d, factor,
                                       {g.q.data(), g.v.data(), nullptr, nullptr, nullptr, g.rho.data()});
  }
};

class PotentialEnergy final : public Output {
 public:
  explicit PotentialEnergy(bool total) : Output(total ? "energy.total" : "energy.potential", "J"), total_(total) {}
  double value(const StateView& s, Assembly& assembly) const override {
    return assembly.potential_energy(s) + (total_ ? assembly.kinetic_energy(s) : 0);
  }

 private:
  bool total_;
};

const char* const kSuffix[3] = {"", "_dot", "_ddot"};

std::string rate_unit(const std::string& unit, int order) {
  return order == 0 ? unit : order == 1 ? unit + "/s" : unit + "/s^2";
}

/// "NAME.measure"; of elements of different kinds that share name and measure, "kind.NAME.measure".
class MeasureNames {
 public:
  MeasureNames(const Mechanism& m, std::optional<std::string_view> wanted) {
    const auto collect = [&](const auto& list) {
      for (const auto& e : list)
        if (may_be_of(*e, wanted)) by_name_[e->name()].push_back(e.get());
    };
    collect(m.bodies());
    collect(m.constraints());
    collect(m.forces());
  }
  static bool may_be_of(const Element& e, std::optional<std::string_view> wanted) {
    if (!wanted || wanted->starts_with(e.name())) return true;
    const std::size_t dot = wanted->find('.');  // behind a kind
    return dot != std::string_view::npos && wanted->substr(dot + 1).starts_with(e.name());
  }
  std::string of(const Element& e, const Measure& measure) const {
    for (const Element* other : by_name_.at(e.name()))
      if (other != &e)
        for (const Measure& m : other->measures())
          if (m.name == measure.name) return e.path() + "." + measure.name;
    return e.name() + "." + measure.name;
  }

 private:
  std::unordered_map<std::string, std::vector<const Element*>> by_name_;
};

/// Calls visit(name, factory) for every output until it returns true; where one name is wanted, only for those of
/// things (coordinates, points, elements, ...) whose own name it begins with, so that the names of all others are not
/// made.
template <class Visit>
bool for_each_output(const Mechanism& m, std::optional<std::string_view> wanted, Visit&& visit) {
  using Factory = std::function<std::unique_ptr<Output>()>;
  const auto may_be_of = [&](std::string_view thing) { return !wanted || wanted->starts_with(thing); };
  for (int i = 0; i < m.coordinate_count(); ++i) {
    const auto& c = m.coordinates()[i];
    if (!may_be_of(c.name)) continue;
    for (int order = 0; order < 3; ++order) {
      const std::string name = c.name + kSuffix[order];
      const Entry::Of of[3] = {Entry::Of::q, Entry::Of::v, Entry::Of::a};
      if (visit(name, Factory([&, i, order, name] {
                  return std::make_unique<Entry>(name, rate_unit(c.unit, order), of[order], i);
                })))
        return true;
    }
  }
  for (const auto& p : m.points()) {
    if (p.kind() == PlanarPoint::Kind::ground || p.kind() == PlanarPoint::Kind::free) continue;
    if (!may_be_of(p.name())) continue;
    for (int component = 0; component < 2; ++component)
      for (int order = 0; order < 3; ++order) {
        const std::string name = p.name() + (component == 0 ? ".x" : ".y") + kSuffix[order];
        if (visit(name, Factory([&, component, order, name] {
                    return std::make_unique<PointOutput<PlanarPoint>>(name, rate_unit("m", order), p, component, order);
                  })))
          return true;
      }
  }
  for (const auto& p : m.spatial_points()) {
    if (p.kind() == SpatialPoint::Kind::ground || p.kind() == SpatialPoint::Kind::free) continue;
    if (!may_be_of(p.name())) continue;
    for (int component = 0; component < 3; ++component)
      for (int order = 0; order < 3; ++order) {
        const std::string name = p.name() + "." + "xyz"[component] + kSuffix[order];
        if (visit(name, Factory([&, component, order, name] {
                    return std::make_unique<PointOutput<SpatialPoint>>(name, rate_unit("m", order), p, component,
                                                                       order);
                  })))
          return true;
      }
  }
  const MeasureNames names(m, wanted);
  const auto elements = [&](const auto& list, auto row_of, auto rows_of, auto state_of, auto states_of) {
    for (std::size_t k = 0; k < list.size(); ++k) {
      if (!MeasureNames::may_be_of(*list[k], wanted)) continue;
      const auto measures = list[k]->measures();
      for (std::size_t i = 0; i < measures.size(); ++i) {
        const std::string name = names.of(*list[k], measures[i]);
        if (visit(name, Factory([&, k, i, name] {
                    return std::make_unique<ElementOutput>(name, measures[i], static_cast<int>(i), *list[k], row_of(k),
                                                           rows_of(k), state_of(k), states_of(k));
                  })))
          return true;
      }
    }
    return false;
  };
  const auto none = [](std::size_t) { return 0; };
  if (elements(m.bodies(), none, none, none, none)) return true;
  if (elements(
          m.constraints(), [&](std::size_t k) { return m.row_offsets()[k]; },
          [&](std::size_t k) { return m.constraints()[k]->rows(); }, none, none))
    return true;
  if (elements(
          m.forces(), none, none, [&](std::size_t k) { return m.state_offsets()[k]; },
          [&](std::size_t k) { return m.forces()[k]->states(); }))
    return true;
  for (const auto& f : m.forces())
    if (const auto* defined = dynamic_cast<const DefinedOutput*>(f.get()); defined && may_be_of(defined->name()))
      if (visit(defined->name(), Factory([&m, defined] { return make_formula_output(m, *defined); }))) return true;
  const auto rows = may_be_of("lambda.") ? m.row_names() : std::vector<std::string>{};
  const auto units = may_be_of("lambda.") ? multiplier_units(m) : rows;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::string name = "lambda." + rows[i], unit = units[i];
    if (visit(name,
              Factory([=] { return std::make_unique<Entry>(name, unit, Entry::Of::lambda, static_cast<int>(i)); })))
      return true;
  }
  const auto states = may_be_of("z.") ? m.state_names() : std::vector<std::string>{};
  const auto units_of_states = may_be_of("z.") ? state_units(m) : states;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const std::string name = "z." + states[i], unit = units_of_states[i];
    if (visit(name, Factory([=] { return std::make_unique<Entry>(name, unit, Entry::Of::z, static_cast<int>(i)); })))
      return true;
  }
  return visit("energy.kinetic", Factory([] { return std::make_unique<KineticEnergy>(); })) ||
         visit("energy.potential", Factory([] { return std::make_unique<PotentialEnergy>(false); })) ||
         visit("energy.total", Factory([] { return std::make_unique<PotentialEnergy>(true); })) ||
         visit("time", Factory([] { return std::make_unique<Time>(); }));
}

}  // namespace

std::unique_ptr<Output> make_output(const Mechanism& mechanism, const std::string& name) {
  std::unique_ptr<Output> result;
  for_each_output(mechanism, name, [&](const std::string& candidate, const auto& factory) {
    if (candidate != name) return false;
    result = factory();
    return true;
  });
  if (!result) result = make_cycle_output(mechanism, name);
  if (!result) {
    std::vector<std::string> known = output_names(mechanism);
    const bool cyclic = name.starts_with("cycle.");
    if (cyclic) known = cycle_value_names();
    throw ModelError(
        "", fmt::format("There is no output '{}'.{}{}{}", name, suggestion(name, known), work_hint(mechanism, name),
                        cyclic ? " Those of a cycle belong to scenes with a table [cycle]." : ""));
  }
  result->set_made_for(mechanism.signature());
  return result;
}

std::vector<std::string> output_names(const Mechanism& mechanism) {
  std::vector<std::string> names;
  for_each_output(mechanism, {}, [&](const std::string& name, const auto&) {
    names.push_back(name);
    return false;
  });
  return names;
}

std::vector<std::unique_ptr<Output>> make_outputs(const Mechanism& mechanism, const std::vector<std::string>& names) {
  std::vector<std::unique_ptr<Output>> outputs(names.size());
  std::unordered_multimap<std::string_view, std::size_t> wanted;
  for (std::size_t i = 0; i < names.size(); ++i) wanted.emplace(names[i], i);
  for_each_output(mechanism, {}, [&](const std::string& name, const auto& factory) {
    const auto [first, last] = wanted.equal_range(name);
    for (auto at = first; at != last; ++at) outputs[at->second] = factory();
    wanted.erase(first, last);  // the first of a name counts
    return wanted.empty();
  });
  for (const auto& [name, i] : wanted) outputs[i] = make_output(mechanism, names[i]);
  return outputs;
}

std::vector<std::unique_ptr<Output>> make_all_outputs(const Mechanism& mechanism) {
  std::vector<std::unique_ptr<Output>> outputs;
  for_each_output(mechanism, {}, [&](const std::string&, const auto& factory) {
    outputs.push_back(factory());
    return false;
  });
  return outputs;
}

}  // namespace costate
