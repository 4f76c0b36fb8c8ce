// The vector d = r_j - r_i between two spatial points, with its derivatives on the joined local coordinates
// (those of i, then those of j) and joined numbers.
#pragma once

#include "costate/element/point/spatial_point.h"

namespace costate {

class SpatialVector {
 public:
  static constexpr int kMax = 2 * SpatialPoint::kMaxCoordinates;
  using Vector = Vector3;
  using Jacobian = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, kMax>;

  SpatialVector(SpatialPoint i, SpatialPoint j) : i_(std::move(i)), j_(std::move(j)) {}

  const SpatialPoint& from() const { return i_; }
  const SpatialPoint& to() const { return j_; }
  int size() const { return i_.size() + j_.size(); }
  int number_count() const { return static_cast<int>(i_.numbers().size() + j_.numbers().size()); }
  std::vector<int> coordinates() const { return joined(i_.coordinates(), j_.coordinates()); }
  std::vector<int> numbers() const { return joined(i_.numbers(), j_.numbers()); }

  template <class S>
  void value(const S* q, const S* p, S* d) const {
    S a[3], b[3];
    i_.position(q, p, a);
    j_.position(q + i_.size(), p + first_numbers(), b);
    for (int k = 0; k < 3; ++k) d[k] = b[k] - a[k];
  }
  template <class S>
  void rate(const S* q, const S* v, const S* p, S* d) const {
    S a[3], b[3];
    i_.velocity(q, v, p, a);
    j_.velocity(q + i_.size(), v + i_.size(), p + first_numbers(), b);
    for (int k = 0; k < 3; ++k) d[k] = b[k] - a[k];
  }
  Vector acceleration(const double* q, const double* v, const double* a, const double* p) const {
    Vector ri, rj;
    const int n = i_.size();
    i_.acceleration(q, v, a, p, ri.data());
    j_.acceleration(q + n, v + n, a + n, p + first_numbers(), rj.data());
    return rj - ri;
  }
  Jacobian jacobian(const double* q, const double* p) const {
    return difference(i_.jacobian(q, p), j_.jacobian(q + i_.size(), p + first_numbers()));
  }
  Jacobian jacobian_dot(const double* q, const double* v, const double* p) const {
    const int n = i_.size();
    return difference(i_.jacobian_dot(q, v, p), j_.jacobian_dot(q + n, v + n, p + first_numbers()));
  }
  Jacobian acceleration_partial(const double* q, const double* v, const double* a, const double* p) const {
    const int n = i_.size();
    return difference(i_.acceleration_partial(q, v, a, p),
                      j_.acceleration_partial(q + n, v + n, a + n, p + first_numbers()));
  }
  /// H += (d_q^T f)_q.
  template <class Matrix>
  void add_curvature(const double*, const double* p, const Vector& f, Matrix& H) const {
    constexpr int k = SpatialPoint::curvature_index;
    const int n = i_.size();
    if (i_.kind() == SpatialPoint::Kind::on_body) H.block(k, k, 4, 4) -= i_.curvature(p, f);
    if (j_.kind() == SpatialPoint::Kind::on_body) H.block(n + k, n + k, 4, 4) += j_.curvature(p + first_numbers(), f);
  }

 private:
  std::size_t first_numbers() const { return i_.numbers().size(); }
  Jacobian difference(const SpatialPoint::Jacobian& from, const SpatialPoint::Jacobian& to) const {
    Jacobian J(3, size());
    J << -from, to;
    return J;
  }
  static std::vector<int> joined(std::vector<int> a, const std::vector<int>& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
  }
  SpatialPoint i_, j_;
};

}  // namespace costate
