#include <support/costs.h>

namespace costate::test {

std::shared_ptr<const CostTerm> output_term(const Mechanism& mechanism, const std::string& output, int power,
                                            const std::string& weight, std::shared_ptr<const ScalarLaw> target,
                                            const std::vector<std::string>& target_numbers) {
  OutputTerm::Target t;
  t.law = std::move(target);
  for (const auto& path : target_numbers) t.law_numbers.push_back(mechanism.number(path));
  return std::make_shared<OutputTerm>(make_output(mechanism, output), power, mechanism.number(weight), t);
}

std::shared_ptr<const CostTerm> output_difference(const Mechanism& mechanism, const std::string& output,
                                                  const std::string& other, const std::string& weight) {
  OutputTerm::Target t;
  t.output = make_output(mechanism, other);
  return std::make_shared<OutputTerm>(make_output(mechanism, output), 2, mechanism.number(weight), t);
}

}  // namespace costate::test
