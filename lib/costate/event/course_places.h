// Where a smooth quantity passes given values along a step, or turns near one of them: from looks at it in order, and
// more of them where these tell of a passage or a turn.
#pragma once

#include <functional>
#include <vector>

namespace costate {

class CoursePlaces {
 public:
  /// A place is known to this part of the step.
  static constexpr double kPlaced = 1e-7;

  /// Appends to `places` parts of the step, of those a little beyond its ends as well. `u` and `course`: looks at the
  /// quantity, from 0 to 1; `knots` in order; `at` looks once more, within [0, 1].
  static void find(const std::vector<double>& u, const std::vector<double>& course, const std::vector<double>& knots,
                   const std::function<double(double)>& at, std::vector<double>& places);

 private:
  struct Look {
    double u, x;
  };
  CoursePlaces(const std::vector<double>& knots, const std::function<double(double)>& at, std::vector<double>& places)
      : knots_(knots), at_(at), places_(places) {}

  template <class Meet>
  void each_between(double a, double b, const Meet& meet) const;
  void put(double u);
  /// Of all knots between two looks.
  void add_passages(const Look& a, const Look& b);
  double passage(Look a, Look b, double knot) const;
  /// Between two looks, where the quantity turns about there, beyond the farthest look of these, by the parabola
  /// through three; `range` is that of all.
  void add_turn(const Look& a, const Look& b, double edge, const Look& turn, double range);

  const std::vector<double>& knots_;
  const std::function<double(double)>& at_;
  std::vector<double>& places_;
};

}  // namespace costate
