#include "truss_motion.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

namespace costate::adversary {

namespace {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

class Motion {
 public:
  explicit Motion(const Truss& t) : t_(t) {
    for (const Point& p : t.points) {
      first_.push_back(p.ground ? -1 : n_);
      if (!p.ground) n_ += 2;
    }
    rows_ = static_cast<int>(t.bars.size() + t.drivers.size());
    for (const Bar& b : t.bars) size_ = std::max(size_, b.length);
  }

  bool start(Vector& q, Vector& v) {
    q.resize(n_);
    std::vector<std::pair<int, double>> given, rates;
    for (std::size_t i = 0; i < t_.points.size(); ++i)
      for (int k = 0; k < 2 && first_[i] >= 0; ++k) {
        q[first_[i] + k] = t_.points[i].x[k];
        if (!t_.points[i].given[k]) continue;
        given.emplace_back(first_[i] + k, t_.points[i].x[k]);
        rates.emplace_back(first_[i] + k, t_.points[i].v[k]);
      }
    const int g = static_cast<int>(given.size());
    Matrix A(rows_ + g, n_);
    Vector r(rows_ + g);
    const auto fill = [&](const std::vector<std::pair<int, double>>& values, const Vector& x) {
      A.topRows(rows_) = jacobian(q);
      A.bottomRows(g).setZero();
      for (int i = 0; i < g; ++i) {
        A(rows_ + i, values[static_cast<std::size_t>(i)].first) = 1;
        r[rows_ + i] = x[values[static_cast<std::size_t>(i)].first] - values[static_cast<std::size_t>(i)].second;
      }
    };
    bool settled = false;
    for (int i = 0; i < 100 && !settled; ++i) {
      fill(given, q);
      r.head(rows_) = constraints(0, q);
      Vector step = A.completeOrthogonalDecomposition().solve(-r);
      const double limit = 0.1 * size_;  // stays on the branch of the guess
      if (step.norm() > limit) step *= limit / step.norm();
      q += step;
      settled = step.norm() < 1e-14 * size_;
    }
    if (constraints(0, q).norm() > 1e-11 * size_) return false;
    v.setZero(n_);
    fill(rates, v);
    r.head(rows_) = phi_t(0);
    Eigen::CompleteOrthogonalDecomposition<Matrix> cod(A);
    v = cod.solve(-r);
    return (A * v + r).norm() < 1e-9 * (1 + v.norm());
  }

  /// (q, v, psi) at the end; false where it cannot be followed.
  bool run(double tolerance, Reference& out) {
    Vector q, v;
    if (!start(q, v)) return false;
    std::vector<double> stops = {0, t_.t_end};
    const auto add = [&](const TimeLaw& law) {
      for (const double b : law.breaks())
        if (b > 0 && b < t_.t_end) stops.push_back(b);
    };
    for (const Force& f : t_.forces) add(f.law);
    for (const Driver& d : t_.drivers) add(d.law);
    for (const Cost& c : t_.costs)
      if (c.from > 0 && c.from < t_.t_end) stops.push_back(c.from);
    std::sort(stops.begin(), stops.end());
    Vector y(2 * n_ + 1);
    y << q, v, 0;
    for (std::size_t s = 0; s + 1 < stops.size(); ++s) {
      if (stops[s + 1] - stops[s] < 1e-14) continue;
      // Behind a kink of a driver the velocities are those that its new rate asks for, by the smallest
      // impulse.
      after_ = stops[s] + 1e-12;
      if (s > 0 && !t_.drivers.empty()) {
        Vector vel = y.segment(n_, n_);
        const Matrix J = jacobian(y.head(n_));
        vel += impulse(J, -(J * vel + phi_t(after_)));
        y.segment(n_, n_) = vel;
      }
      if (!segment(stops[s], stops[s + 1], tolerance, y, out)) return false;
    }
    out.psi = y[2 * n_];
    for (const Cost& c : t_.costs)
      if (c.terminal) out.psi += c.weight * (output(c, y) - c.target);
    return std::isfinite(out.psi);
  }

 private:
  const double* at(int point, const Vector& q) const {
    const auto i = static_cast<std::size_t>(point);
    return first_[i] < 0 ? t_.points[i].x : q.data() + first_[i];
  }

  Vector constraints(double t, const Vector& q) const {
    Vector r(rows_);
    int row = 0;
    for (const Bar& b : t_.bars) {
      const double *p = at(b.a, q), *o = at(b.b, q);
      r[row++] = std::hypot(o[0] - p[0], o[1] - p[1]) - b.length;
    }
    for (const Driver& d : t_.drivers) r[row++] = at(d.point, q)[d.axis] - d.law.value(t);
    return r;
  }

  Matrix jacobian(const Vector& q) const {
    Matrix J = Matrix::Zero(rows_, n_);
    int row = 0;
    for (const Bar& b : t_.bars) {
      const double *p = at(b.a, q), *o = at(b.b, q);
      const double l = std::hypot(o[0] - p[0], o[1] - p[1]);
      for (int k = 0; k < 2; ++k) {
        if (int i = first_[static_cast<std::size_t>(b.a)]; i >= 0) J(row, i + k) -= (o[k] - p[k]) / l;
        if (int i = first_[static_cast<std::size_t>(b.b)]; i >= 0) J(row, i + k) += (o[k] - p[k]) / l;
      }
      ++row;
    }
    for (const Driver& d : t_.drivers) J(row++, first_[static_cast<std::size_t>(d.point)] + d.axis) = 1;
    return J;
  }

  Vector phi_t(double t) const {
    Vector r = Vector::Zero(rows_);
    int row = static_cast<int>(t_.bars.size());
    for (const Driver& d : t_.drivers) r[row++] = -d.law.rate(t);
    return r;
  }

  /// Phidd = J a + bias.
  Vector bias(double t, const Vector& q, const Vector& v) const {
    Vector r(rows_);
    int row = 0;
    for (const Bar& b : t_.bars) {
      const double *p = at(b.a, q), *o = at(b.b, q);
      double d[2], w[2];
      for (int k = 0; k < 2; ++k) {
        d[k] = o[k] - p[k];
        w[k] = rate(b.b, k, v) - rate(b.a, k, v);
      }
      const double l = std::hypot(d[0], d[1]), ld = (d[0] * w[0] + d[1] * w[1]) / l;
      r[row++] = (w[0] * w[0] + w[1] * w[1] - ld * ld) / l;
    }
    for (const Driver& dr : t_.drivers) r[row++] = -dr.law.second(t);
    return r;
  }

  double length_rate(const Spring& s, const Vector& q, const Vector& v) const {
    const double *p = at(s.a, q), *o = at(s.b, q);
    const double d[2] = {o[0] - p[0], o[1] - p[1]}, l = std::hypot(d[0], d[1]);
    return (d[0] * (rate(s.b, 0, v) - rate(s.a, 0, v)) + d[1] * (rate(s.b, 1, v) - rate(s.a, 1, v))) / l;
  }

  /// Whether a damper changes its branch between two states.
  bool turns(const Vector& y0, const Vector& y1) const {
    for (const Spring& s : t_.springs)
      if (s.kinked &&
          length_rate(s, y0.head(n_), y0.segment(n_, n_)) * length_rate(s, y1.head(n_), y1.segment(n_, n_)) < 0)
        return true;
    return false;
  }

  double rate(int point, int k, const Vector& v) const {
    const int i = first_[static_cast<std::size_t>(point)];
    return i < 0 ? 0 : v[i + k];
  }

  Matrix mass() const {
    Matrix M = Matrix::Zero(n_, n_);
    for (std::size_t i = 0; i < t_.points.size(); ++i)
      for (int k = 0; k < 2 && first_[i] >= 0; ++k) M(first_[i] + k, first_[i] + k) += t_.points[i].mass;
    for (const Bar& b : t_.bars) {
      const int i = first_[static_cast<std::size_t>(b.a)], j = first_[static_cast<std::size_t>(b.b)];
      for (int k = 0; k < 2; ++k) {  // a uniform bar moves linearly between its ends
        if (i >= 0) M(i + k, i + k) += b.mass / 3;
        if (j >= 0) M(j + k, j + k) += b.mass / 3;
        if (i >= 0 && j >= 0) {
          M(i + k, j + k) += b.mass / 6;
          M(j + k, i + k) += b.mass / 6;
        }
      }
    }
    return M;
  }

  Vector forces(double t, const Vector& q, const Vector& v) const {
    Vector F = Vector::Zero(n_);
    const auto push = [&](int point, int k, double f) {
      const int i = first_[static_cast<std::size_t>(point)];
      if (i >= 0) F[i + k] += f;
    };
    for (std::size_t i = 0; i < t_.points.size(); ++i)
      for (int k = 0; k < 2; ++k) push(static_cast<int>(i), k, t_.points[i].mass * t_.gravity[k]);
    for (const Bar& b : t_.bars)
      for (int k = 0; k < 2; ++k) {
        push(b.a, k, b.mass * t_.gravity[k] / 2);
        push(b.b, k, b.mass * t_.gravity[k] / 2);
      }
    for (const Spring& s : t_.springs) {
      const double *p = at(s.a, q), *o = at(s.b, q);
      const double d[2] = {o[0] - p[0], o[1] - p[1]}, l = std::hypot(d[0], d[1]);
      const double ld = length_rate(s, q, v);
      const double tension = s.stiffness * (l - s.length) + (s.kinked && ld > 0 ? s.damping_out : s.damping) * ld;
      for (int k = 0; k < 2; ++k) {
        push(s.a, k, tension * d[k] / l);
        push(s.b, k, -tension * d[k] / l);
      }
    }
    for (const Force& f : t_.forces) push(f.point, f.axis, f.law.value(t));
    return F;
  }

  Vector impulse(const Matrix& J, const Vector& change) const {
    if (rows_ == 0) return Vector::Zero(n_);
    Matrix K = Matrix::Zero(n_ + rows_, n_ + rows_);
    K.topLeftCorner(n_, n_) = mass();
    K.topRightCorner(n_, rows_) = J.transpose();
    K.bottomLeftCorner(rows_, n_) = J;
    Vector b = Vector::Zero(n_ + rows_);
    b.tail(rows_) = change;
    return K.completeOrthogonalDecomposition().solve(b).head(n_);
  }

  double output(const Cost& c, const Vector& y) const {
    const int i = first_[static_cast<std::size_t>(c.point)];
    return y[(c.rate ? n_ : 0) + i + c.axis];
  }

  Vector derivative(double t, const Vector& y) const {
    const Vector q = y.head(n_), v = y.segment(n_, n_);
    Matrix K = Matrix::Zero(n_ + rows_, n_ + rows_);
    const Matrix M = mass(), J = jacobian(q);
    const double unit = std::max(M.diagonal().maxCoeff(), 1e-300);
    K.topLeftCorner(n_, n_) = M / unit;
    K.topRightCorner(n_, rows_) = J.transpose();
    K.bottomLeftCorner(rows_, n_) = J;
    Vector b(n_ + rows_);
    b << forces(t, q, v) / unit, -bias(t, q, v);
    const Vector x =
        t_.redundant ? Vector(K.completeOrthogonalDecomposition().solve(b)) : Vector(K.partialPivLu().solve(b));
    Vector f(2 * n_ + 1);
    f << v, x.head(n_), 0;
    for (const Cost& c : t_.costs) {
      if (c.terminal || t < c.from) continue;
      const double e = output(c, y) - c.target;
      f[2 * n_] += c.weight * e * e;
    }
    return f;
  }

  bool segment(double from, double to, double tolerance, Vector& y, Reference& out) const {
    static const double c[] = {0, 0.2, 0.3, 0.8, 8.0 / 9, 1, 1};
    static const double a[7][6] = {{},
                                   {0.2},
                                   {3.0 / 40, 9.0 / 40},
                                   {44.0 / 45, -56.0 / 15, 32.0 / 9},
                                   {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
                                   {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
                                   {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84}};
    static const double e[] = {71.0 / 57600, 0, -71.0 / 16695, 71.0 / 1920, -17253.0 / 339200, 22.0 / 525, -1.0 / 40};
    // Laws are evaluated inside the segment: a kink at its border belongs to the neighbour.
    const auto inside = [&](double t) { return std::min(std::max(t, from + 1e-13), to - 1e-13); };
    double t = from, h = std::min(1e-4, (to - from) / 10);
    Vector k[7], next;
    k[0] = derivative(inside(t), y);
    const auto attempt = [&] {
      for (int i = 1; i < 7; ++i) {
        next = y;
        for (int j = 0; j < i; ++j) next += h * a[i][j] * k[j];
        k[i] = derivative(inside(t + c[i] * h), next);
      }
    };
    for (long steps = 0; t < to; ++steps) {
      if (steps > 30000) return false;  // stiff: nothing for an explicit scheme
      h = std::min(h, to - t);
      attempt();
      // A step ends where a damper turns: across it errors are of low order, differ from run to run, and differences
      // would hold them. The first turn is met by halves, and passed by as little as matters to no digit.
      if (next.allFinite() && turns(y, next)) {
        double low = 0, high = h;
        for (int i = 0; i < 30; ++i) {
          h = 0.5 * (low + high);
          attempt();
          (turns(y, next) ? high : low) = h;
        }
        h = high;
        attempt();
      }
      Vector error = Vector::Zero(y.size());
      for (int i = 0; i < 7; ++i) error += h * e[i] * k[i];
      double norm = 0;
      for (int i = 0; i < y.size(); ++i) {
        const double unit = i < 2 * n_ ? size_ : std::max(std::abs(y[i]), 1e-6 * size_ * size_);
        norm = std::max(norm, std::abs(error[i]) / (tolerance * (unit + std::abs(next[i]))));
      }
      if (!std::isfinite(norm)) return false;
      if (norm <= 1) {
        t = to - t <= h * (1 + 1e-12) ? to : t + h;
        y = next;
        project(t, to, y);
        k[0] = derivative(inside(t), y);
        if (rows_ > 0) {
          const Eigen::VectorXd sigma = jacobian(y.head(n_)).jacobiSvd().singularValues();
          const int rank = rows_ - (t_.redundant ? 1 : 0);
          if (rank > 0 && rank <= sigma.size()) out.regularity = std::min(out.regularity, sigma[rank - 1] / sigma[0]);
        }
        out.speed = std::max(out.speed, y.segment(n_, n_).lpNorm<Eigen::Infinity>());
        if (out.regularity < 1e-7) return false;
      }
      h *= std::min(4.0, std::max(0.2, 0.9 * std::pow(std::max(norm, 1e-10), -0.2)));
      if (h < 1e-13) return false;
    }
    return true;
  }

  void project(double t, double to, Vector& y) const {
    if (rows_ == 0) return;
    Vector q = y.head(n_);
    for (int i = 0; i < 2; ++i) q -= jacobian(q).completeOrthogonalDecomposition().solve(constraints(t, q));
    y.head(n_) = q;
    const Matrix J = jacobian(q);
    const Vector v = y.segment(n_, n_);
    y.segment(n_, n_) -= J.completeOrthogonalDecomposition().solve(J * v + phi_t(std::min(t, to - 1e-13)));
  }

  const Truss& t_;
  std::vector<int> first_;
  int n_ = 0, rows_ = 0;
  double size_ = 1e-300, after_ = 0;
};

}  // namespace

Reference follow(const Truss& truss, double tolerance) {
  Reference r;
  Motion motion(truss);
  r.found = motion.run(tolerance, r);
  return r;
}

Reference reference(const Truss& truss, double part) {
  constexpr double tolerance = 1e-11;
  Reference r = follow(truss, tolerance);
  if (!r.found) return r;
  const Reference rough = follow(truss, 10 * tolerance);
  if (!rough.found) {
    r.found = false;
    return r;
  }
  r.psi_error = std::abs(r.psi - rough.psi);
  for (const Parameter& p : truss.parameters) {
    const double step = part * 2e-3 * std::max(truss.scale(p), std::abs(truss.number(p)));
    // Three steps and two extrapolations: two steps alone may agree by chance where they are too long. What the errors
    // of the motions leave of a difference tells the shortest step at another tolerance.
    double d[4];
    for (int k = 0; k < 4; ++k) {
      const double h = step / (1 << std::min(k, 2)), at = k < 3 ? tolerance : 10 * tolerance;
      Truss up = truss, down = truss;
      up.number(p) += h;
      down.number(p) -= h;
      const Reference a = follow(up, at), b = follow(down, at);
      if (!a.found || !b.found) {
        r.found = false;
        return r;
      }
      d[k] = (a.psi - b.psi) / (2 * h);
    }
    const double coarse = (4 * d[1] - d[0]) / 3, fine = (4 * d[2] - d[1]) / 3;
    r.gradient.push_back((16 * fine - coarse) / 15);
    // Where a damper stands on its bend at the start, psi holds |h| h, and differences fall by a half.
    const double last = std::abs(d[2] - d[1]), before = std::abs(d[1] - d[0]);
    const double bent = last > 0.35 * before ? 2 * last : 0;
    r.gradient_error.push_back(std::max({std::abs(r.gradient.back() - fine), 0.1 * std::abs(d[3] - d[2]), bent}));
  }
  return r;
}

}  // namespace costate::adversary
