#include "costate/objective/constant_costs.h"

namespace costate {

namespace {

/// weight (output - target)^power with power 1 or 2.
class ConstantTerm final : public CostTerm {
 public:
  ConstantTerm(std::unique_ptr<Output> output, int power, double target, double weight)
      : output_(std::move(output)), power_(power), target_(target), weight_(weight) {}

  double value(const StateView& s, Assembly& assembly) const override {
    const double d = output_->value(s, assembly) - target_;
    return weight_ * (power_ == 2 ? d * d : d);
  }
  void add_gradient(const StateView& s, Assembly& assembly, double factor, ScalarGradient& g) const override {
    const double slope = power_ == 2 ? 2 * (output_->value(s, assembly) - target_) : 1;
    output_->add_gradient(s, assembly, factor * weight_ * slope, g);
  }
  void add_gradient_change(const StateView& s, Assembly& assembly, const Variation& d,
                           ScalarGradient& g) const override {
    const double slope = power_ == 2 ? 2 * (output_->value(s, assembly) - target_) : 1;
    if (power_ == 2) output_->add_gradient(s, assembly, 2 * weight_ * output_->change(s, assembly, d), g);
    output_->add_gradient_change(s, assembly, d, weight_ * slope, g);
  }
  double change(const StateView& s, Assembly& assembly, const Variation& d) const override {
    const double slope = power_ == 2 ? 2 * (output_->value(s, assembly) - target_) : 1;
    return weight_ * slope * output_->change(s, assembly, d);
  }
  bool needs_accelerations() const override { return output_->needs_accelerations(); }

 private:
  std::unique_ptr<Output> output_;
  int power_;
  double target_, weight_;
};

}  // namespace

std::shared_ptr<const CostTerm> square_cost(const Mechanism& mechanism, const std::string& output, double target,
                                            double weight) {
  return std::make_shared<ConstantTerm>(make_output(mechanism, output), 2, target, weight);
}

std::shared_ptr<const CostTerm> value_cost(const Mechanism& mechanism, const std::string& output, double weight) {
  return std::make_shared<ConstantTerm>(make_output(mechanism, output), 1, 0, weight);
}

}  // namespace costate
