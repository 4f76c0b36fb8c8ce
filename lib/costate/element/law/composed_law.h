// Laws composed of other laws, their sum and product; and a sine whose frequency grows with time.
#pragma once

#include <algorithm>
#include <cmath>

#include "costate/element/course.h"
#include "costate/element/law/law_at.h"
#include "costate/element/law/motion_law.h"
#include "costate/element/law/scalar_law.h"

namespace costate {

/// Sum or product of laws; numbers: those of the first, then those of the second, ...
class ComposedLaw final : public ScalarLawOf<ComposedLaw>, public PlacedLaw {
 public:
  enum class Operation { sum, product };
  ComposedLaw(Operation operation, std::vector<std::shared_ptr<const ScalarLaw>> parts)
      : operation_(operation), parts_(std::move(parts)) {
    for (const auto& part : parts_) count_ += part->number_count();
  }
  Operation operation() const { return operation_; }
  const std::vector<std::shared_ptr<const ScalarLaw>>& parts() const { return parts_; }
  int number_count() const override { return count_; }
  void add_kinks(const double* p, std::vector<double>& x) const override {
    for (const auto& part : parts_) {
      part->add_kinks(p, x);
      p += part->number_count();
    }
  }
  void add_curvature_jumps(const double* p, std::vector<double>& x) const override {
    for (const auto& part : parts_) {
      part->add_curvature_jumps(p, x);
      p += part->number_count();
    }
  }
  void add_third_jumps(const double* p, std::vector<double>& x) const override {
    for (const auto& part : parts_) {
      part->add_third_jumps(p, x);
      p += part->number_count();
    }
  }
  /// Of the part whose place it is; that of several may part.
  void add_place_slopes(double x, const double* p, double* slopes) const override {
    const ScalarLaw* owner = nullptr;
    std::size_t first = 0, at = 0;
    for (const auto& part : parts_) {
      std::vector<double> places;
      part->add_kinks(p + at, places);
      part->add_curvature_jumps(p + at, places);
      part->add_third_jumps(p + at, places);
      add_value_jumps(*part, p + at, places);
      if (std::find(places.begin(), places.end(), x) != places.end()) {
        if (owner) {
          std::fill(slopes, slopes + count_, std::nan(""));
          return;
        }
        owner = part.get();
        first = at;
      }
      at += static_cast<std::size_t>(part->number_count());
    }
    if (owner) owner->add_place_slopes(x, p + first, slopes + first);
  }
  void add_places(const double* p, LawPlaces& places) const override {
    for (const auto& part : parts_) {
      add_law_places(*part, p, places);
      p += part->number_count();
    }
  }

  template <class S, class P>
  S physics(const S& x, const P* p) const {
    S result(operation_ == Operation::sum ? 0.0 : 1.0);
    for (const auto& part : parts_) {
      if (operation_ == Operation::sum)
        result += law_at(*part, x, p);
      else
        result *= law_at(*part, x, p);
      p += part->number_count();
    }
    return result;
  }

 private:
  Operation operation_;
  std::vector<std::shared_ptr<const ScalarLaw>> parts_;
  int count_ = 0;
};

/// mean + amplitude sin(phase + omega_0 s + (omega_1 - omega_0) s^2 / (2 (x_1 - x_0))), s = x - x_0: its
/// angular frequency is omega_0 at x_0 and omega_1 at x_1, linear throughout. Numbers: mean, amplitude, x_0,
/// x_1, omega_0, omega_1, phase.
class ChirpLaw final : public ScalarLawOf<ChirpLaw>, public PlacedLaw {
 public:
  int number_count() const override { return 7; }
  void add_places(const double* p, LawPlaces& places) const override {
    constexpr int pieces = 32;
    const double h = (places.to - places.from) / pieces, growth = (p[5] - p[4]) / (p[3] - p[2]);
    const auto frequency = [&](double x) { return std::abs(p[4] + growth * (x - p[2])); };
    for (int k = 0; k < pieces && p[1] != 0; ++k) {
      const double from = places.from + k * h, most = std::max(frequency(from), frequency(from + h));
      if (most > 0) places.waves.push_back({from, from + h, 6.283185307179586476925 / most});
    }
  }

  template <class S, class P>
  S physics(const S& x, const P* p) const {
    using std::sin;
    const S s = x - S(p[2]), growth = (S(p[5]) - S(p[4])) / (S(p[3]) - S(p[2]));
    return S(p[0]) + S(p[1]) * sin(S(p[6]) + s * (S(p[4]) + S(0.5) * growth * s));
  }
};

}  // namespace costate
