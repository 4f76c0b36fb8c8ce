#include "costate/mechanism/taken_number.h"

#include <utility>

namespace costate {

int add_taken_number(MechanismBuilder& builder, const std::string& path, double value, std::vector<int> coordinates,
                     std::vector<int> numbers, NumberRule rule, const std::string& written_as) {
  auto taken = std::make_shared<TakenNumber>();
  taken->number = builder.add_number(path, value, rule);
  taken->written_as = written_as;
  taken->coordinates = std::move(coordinates);
  taken->numbers = std::move(numbers);
  const int number = taken->number;
  builder.add_shared_part("taken " + path, std::move(taken));
  return number;
}

}  // namespace costate
