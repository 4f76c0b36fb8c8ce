// What weights pull back through the derivative blocks of an assembly, element by element: blocks stay local, so that
// neither sparse sums of them are formed nor products with those.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "costate/assembly/assembly.h"

namespace costate {

class PulledPartials {
 public:
  /// Of a mechanism without switched rows. The assembly outlives this.
  explicit PulledPartials(Assembly& assembly);

  /// At (t, q, v, a, lambda, z), with the numbers of the assembly and all weights but those of states there:
  ///   q += factor (K^T s1 + (c0 phi_q + c1 phid_q + c2 phidd_q)^T s2 - f_q^T sz)
  ///   v += factor (C^T s1 + (c1 phi_q + 2 c2 phid_q)^T s2 - f_v^T sz),   z += factor (-Q_z^T s1 - f_z^T sz)
  void add(const StateView& s, const Assembly::ParameterWeights& w, double factor, double* q, double* v, double* z);

 private:
  template <class Kind>
  struct Part {
    const Kind* element;
    std::size_t numbers;  // into numbers_
    int first;            // row of a constraint, state of a force
    std::optional<RestRegion> rest;
  };
  template <class Kind>
  void append(const Kind& element, int first, std::vector<Part<Kind>>& to);
  template <class Kind>
  void take_numbers(std::vector<Part<Kind>>& parts);
  template <class Kind>
  LocalState gather(const Part<Kind>& part, const StateView& s);
  void pull_bodies(const StateView& s);
  void pull_forces(const StateView& s, const double* of_states, double factor, double* z);
  void pull_constraints(const StateView& s, const Assembly::ParameterWeights& w);
  /// The weights of an element's coordinates; and what it has pulled becomes part of the whole.
  void begin(const std::vector<int>& coordinates);
  void end(const std::vector<int>& coordinates);

  Assembly& assembly_;
  std::vector<Part<Body>> bodies_;  // whose forces of inertia vary
  std::vector<Part<Force>> forces_;
  std::vector<Part<Constraint>> constraints_;
  std::vector<double> numbers_, scratch_;
  long numbers_at_ = 0;  // the identity of a point that they were taken at
  // Of the present element.
  double q_[kMaxLocal] = {}, v_[kMaxLocal] = {}, a_[kMaxLocal] = {};
  double weights_[kMaxLocal] = {}, of_q_[kMaxLocal] = {}, of_v_[kMaxLocal] = {};
  // And of all.
  const double* force_weights_ = nullptr;
  double factor_ = 0;
  double *to_q_ = nullptr, *to_v_ = nullptr;
};

}  // namespace costate
