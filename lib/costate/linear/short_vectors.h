// Products of short vectors, two numbers at once wherever they lie: compilers do not take loops that are so short for
// worth it.
#pragma once

namespace costate {

typedef double Pair __attribute__((vector_size(16), aligned(8), may_alias));

[[gnu::always_inline]] inline double dot(const double* a, const double* b, int n) {
  Pair sum{};
  int i = 0;
  for (; i + 1 < n; i += 2) sum += *reinterpret_cast<const Pair*>(a + i) * *reinterpret_cast<const Pair*>(b + i);
  return i < n ? sum[0] + sum[1] + a[i] * b[i] : sum[0] + sum[1];
}

/// out -= c a.
[[gnu::always_inline]] inline void subtract(double c, const double* a, int n, double* out) {
  const Pair factor{c, c};
  int i = 0;
  for (; i + 1 < n; i += 2) *reinterpret_cast<Pair*>(out + i) -= factor * *reinterpret_cast<const Pair*>(a + i);
  if (i < n) out[i] -= c * a[i];
}

}  // namespace costate
