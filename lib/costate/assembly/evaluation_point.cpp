#include "costate/assembly/evaluation_point.h"

#include <algorithm>
#include <cstring>

namespace costate {

long EvaluationPoint::move_to(double t, std::initializer_list<std::span<const double>> parts) {
  std::size_t size = 0;
  for (const auto& part : parts) size += part.size();
  bool here = assembly_.knows(id_) && values_.size() == size && std::memcmp(&t_, &t, sizeof t) == 0;
  const double* x = values_.data();
  for (const auto& part : parts) {
    here = here && (part.empty() || std::memcmp(x, part.data(), part.size_bytes()) == 0);
    x += part.size();
  }
  if (here) return id_;
  t_ = t;
  values_.resize(size);
  double* to = values_.data();
  for (const auto& part : parts) to = std::copy(part.begin(), part.end(), to);
  return id_ = assembly_.new_point();
}

}  // namespace costate
