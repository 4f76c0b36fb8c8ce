#include "costate/objective/output.h"

namespace costate {

void ScalarGradient::resize(const Assembly& x) {
  q.setZero(x.n());
  v.setZero(x.n());
  a.setZero(x.n());
  lambda.setZero(x.m());
  z.setZero(x.nz());
  rho.setZero(x.np());
}

void ScalarGradient::set_zero() {
  for (auto* x : {&q, &v, &a, &lambda, &z, &rho}) x->setZero();
}

void ScalarGradient::add(double factor, const ScalarGradient& other) {
  q += factor * other.q;
  v += factor * other.v;
  a += factor * other.a;
  lambda += factor * other.lambda;
  z += factor * other.z;
  rho += factor * other.rho;
}

void ScalarGradient::add_number(const Assembly& assembly, int number, double x) {
  for (const auto& [column, c] : assembly.number_columns()[number]) rho[column] += c * x;
}

}  // namespace costate
