// The vector d = r_j - r_i between two planar points, with its derivatives on the joined local coordinates
// (those of i, then those of j) and joined numbers. Shared by every constraint and force between two points.
#pragma once

#include "costate/element/point/planar_point.h"

namespace costate {

class PlanarVector {
 public:
  static constexpr int kMax = 2 * PlanarPoint::kMaxCoordinates;
  using Vector = Eigen::Vector2d;
  using Jacobian = Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::ColMajor, 2, kMax>;

  PlanarVector(PlanarPoint i, PlanarPoint j) : i_(std::move(i)), j_(std::move(j)) {}

  const PlanarPoint& from() const { return i_; }
  const PlanarPoint& to() const { return j_; }
  int size() const { return i_.size() + j_.size(); }
  int number_count() const { return static_cast<int>(i_.numbers().size() + j_.numbers().size()); }
  std::vector<int> coordinates() const { return joined(i_.coordinates(), j_.coordinates()); }
  std::vector<int> numbers() const { return joined(i_.numbers(), j_.numbers()); }

  template <class S>
  void value(const S* q, const S* p, S* d) const {
    S xi{}, yi{}, xj{}, yj{};
    i_.position(q, p, xi, yi);
    j_.position(q + i_.size(), p + i_.numbers().size(), xj, yj);
    d[0] = xj - xi;
    d[1] = yj - yi;
  }
  template <class S>
  void rate(const S* q, const S* v, const S* p, S* d) const {
    S xi{}, yi{}, xj{}, yj{};
    i_.velocity(q, v, p, xi, yi);
    j_.velocity(q + i_.size(), v + i_.size(), p + i_.numbers().size(), xj, yj);
    d[0] = xj - xi;
    d[1] = yj - yi;
  }
  Vector acceleration(const double* q, const double* v, const double* a, const double* p) const {
    double xi{}, yi{}, xj{}, yj{};
    const int n = i_.size();
    i_.acceleration(q, v, a, p, xi, yi);
    j_.acceleration(q + n, v + n, a + n, p + i_.numbers().size(), xj, yj);
    return {xj - xi, yj - yi};
  }

  Jacobian jacobian(const double* q, const double* p) const {
    Jacobian J(2, size());
    PlanarPoint::Jacobian Ji(2, i_.size()), Jj(2, j_.size());
    i_.jacobian(q, p, Ji);
    j_.jacobian(q + i_.size(), p + i_.numbers().size(), Jj);
    J << -Ji, Jj;
    return J;
  }
  Jacobian jacobian_dot(const double* q, const double* v, const double* p) const {
    Jacobian J(2, size());
    PlanarPoint::Jacobian Ji(2, i_.size()), Jj(2, j_.size());
    i_.jacobian_dot(q, v, p, Ji);
    j_.jacobian_dot(q + i_.size(), v + i_.size(), p + i_.numbers().size(), Jj);
    J << -Ji, Jj;
    return J;
  }
  Jacobian acceleration_partial(const double* q, const double* v, const double* a, const double* p) const {
    Jacobian J(2, size());
    PlanarPoint::Jacobian Ji(2, i_.size()), Jj(2, j_.size());
    const int n = i_.size();
    i_.acceleration_partial(q, v, a, p, Ji);
    j_.acceleration_partial(q + n, v + n, a + n, p + i_.numbers().size(), Jj);
    J << -Ji, Jj;
    return J;
  }
  /// H += (d_q^T f)_q.
  template <class Matrix>
  void add_curvature(const double* q, const double* p, const Vector& f, Matrix& H, int offset = 0) const {
    constexpr int k = PlanarPoint::curvature_index;
    if (i_.kind() == PlanarPoint::Kind::on_body) H(offset + k, offset + k) -= i_.curvature(q, p, f);
    const int n = i_.size();
    if (j_.kind() == PlanarPoint::Kind::on_body)
      H(offset + n + k, offset + n + k) += j_.curvature(q + n, p + i_.numbers().size(), f);
  }

 private:
  static std::vector<int> joined(std::vector<int> a, const std::vector<int>& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
  }
  PlanarPoint i_, j_;
};

}  // namespace costate
