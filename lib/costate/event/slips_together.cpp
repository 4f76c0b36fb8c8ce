// One direction is left of all others by elimination, and has the polynomial of event/slip_behind_impact.h. Several are
// looked for by Newton's iteration on their angles from many starts.
#include "costate/event/slips_together.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "costate/event/slip_behind_impact.h"
#include "costate/linear/shortest_solution.h"

namespace costate {

namespace {
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;
using Way = SlidingContact::Way;

constexpr int kNewtonSteps = 40, kSweeps = 20000;
// Angles that differ by less are one. Of the rates: s x v_t of a solution.
constexpr double kSameAngles = 1e-7, kSolved = 1e-11;
// Of the largest eigenvalue of a response, and of its null vectors: nothing.
constexpr double kSingular = 1e-11, kOfNormals = 1e-6;
// Projections that change rates by less than this part of them have converged.
constexpr double kConverged = 1e-14;
// Angles of each direction on the grid of starts of two, three, four and more.
constexpr std::size_t kAngles[] = {10, 4, 3, 2};

double cross_of(const Vector2d& a, const Vector2d& b) { return a[0] * b[1] - a[1] * b[0]; }
Vector2d turned(const Vector2d& s) { return {-s[1], s[0]}; }

/// The linear equations of given directions: unknown impulses of rows that are held, and of gaps.
class SlipEquations {
 public:
  SlipEquations(const MatrixXd& response, const VectorXd& rates, const std::vector<SlidingContact>& contacts)
      : W_(response), b_(rates), contacts_(contacts) {
    for (std::size_t c = 0; c < contacts.size(); ++c) {
      const SlidingContact& at = contacts[c];
      if (at.way == Way::open) continue;
      unknowns_.push_back({at.rows.front(), c, at.normal, at.given});
      if (at.way == Way::sticks)
        for (std::size_t k = 1; k < at.rows.size(); ++k) unknowns_.push_back({at.rows[k], c, at.along[k - 1], false});
      if (at.way == Way::slides && at.unknown) looked_for_.push_back(c);
    }
  }

  const std::vector<std::size_t>& looked_for() const { return looked_for_; }

  /// v_t of contact c and its derivatives by the angles of the directions that are looked for.
  Vector2d along(std::size_t c) const { return {v_[row(c, 1)], v_[row(c, 2)]}; }
  Vector2d along_by(std::size_t c, std::size_t angle) const {
    const auto a = static_cast<Index>(angle);
    return {v_by_(row(c, 1), a), v_by_(row(c, 2), a)};
  }

  /// False where rows that depend on each other have no common solution.
  bool solve(const Slips& s, bool derivatives) {
    const auto size = static_cast<Index>(unknowns_.size());
    MatrixXd P = MatrixXd::Zero(W_.rows(), size);
    VectorXd c(size);
    for (Index i = 0; i < size; ++i) {
      const Unknown& u = unknowns_[static_cast<std::size_t>(i)];
      P(u.row, i) = 1;
      c[i] = u.target;
      const SlidingContact& at = contacts_[u.contact];
      if (at.way == Way::slides)
        for (std::size_t k = 1; k < at.rows.size(); ++k)
          P(at.rows[k], i) = -at.friction * s[u.contact][static_cast<Index>(k) - 1];
    }
    const MatrixXd WP = W_ * P;
    MatrixXd A(size, size);
    for (Index i = 0; i < size; ++i) {
      const Unknown& u = unknowns_[static_cast<std::size_t>(i)];
      if (u.given)
        A.row(i) = Eigen::RowVectorXd::Unit(size, i);
      else
        A.row(i) = WP.row(u.row);
    }
    const VectorXd x = shortest_solution(A, c);
    if (!x.allFinite() || (A * x - c).norm() > 1e-8 * (c.norm() + A.norm() * x.norm())) return false;
    v_ = b_ + WP * x;
    if (!derivatives) return true;
    v_by_.resize(W_.rows(), static_cast<Index>(looked_for_.size()));
    for (std::size_t a = 0; a < looked_for_.size(); ++a) {
      const SlidingContact& at = contacts_[looked_for_[a]];
      Index own = 0;
      while (unknowns_[static_cast<std::size_t>(own)].contact != looked_for_[a]) ++own;
      const Vector2d across = -at.friction * x[own] * turned(s[looked_for_[a]]);
      const VectorXd moved = W_.col(at.rows[1]) * across[0] + W_.col(at.rows[2]) * across[1];
      VectorXd change(size);
      for (Index i = 0; i < size; ++i) {
        const Unknown& u = unknowns_[static_cast<std::size_t>(i)];
        change[i] = u.given ? 0 : -moved[u.row];
      }
      v_by_.col(static_cast<Index>(a)) = moved + WP * shortest_solution(A, change);
    }
    return true;
  }

  /// Of one direction that is looked for, all others being known: its own three rows alone. Nothing where the others'
  /// rows, which may depend on each other, have no common solution without it.
  std::optional<StrikingPoint> reduced() const {
    const std::size_t own = looked_for_.front();
    std::vector<SlidingContact> others = contacts_;
    others[own].way = Way::open;
    SlipEquations rest(W_, b_, others);
    Slips s;
    for (const SlidingContact& at : others) s.push_back(at.slip);
    StrikingPoint point;
    point.friction = contacts_[own].friction;
    point.given = contacts_[own].given;
    if (!rest.solve(s, false)) return std::nullopt;
    for (std::size_t i = 0; i < 3; ++i) point.before[static_cast<Index>(i)] = rest.v_[row(own, i)];
    point.normal = contacts_[own].normal;
    if (!point.given) point.normal += b_[row(own, 0)] - point.before[0];
    // By a unit impulse of each of its rows, which the others answer.
    for (SlidingContact& at : others) at.normal = at.along[0] = at.along[1] = 0;
    for (std::size_t j = 0; j < 3; ++j) {
      const VectorXd column = W_.col(row(own, j));
      for (SlidingContact& at : others) {
        if (at.way == Way::open) continue;
        if (!at.given) at.normal = -column[at.rows.front()];
        for (std::size_t k = 1; k < at.rows.size(); ++k) at.along[k - 1] = -column[at.rows[k]];
      }
      SlipEquations answer(W_, column, others);
      if (!answer.solve(s, false)) return std::nullopt;
      for (std::size_t i = 0; i < 3; ++i)
        point.response(static_cast<Index>(i), static_cast<Index>(j)) = answer.v_[row(own, i)];
    }
    return point;
  }

 private:
  struct Unknown {
    int row;
    std::size_t contact;
    double target;
    bool given;
  };
  Index row(std::size_t c, std::size_t k) const { return contacts_[c].rows[k]; }

  const MatrixXd& W_;
  const VectorXd& b_;
  const std::vector<SlidingContact>& contacts_;
  std::vector<Unknown> unknowns_;
  std::vector<std::size_t> looked_for_;
  VectorXd v_;
  MatrixXd v_by_;
};

/// Newton's iteration on the angles, damped; whether it has found a solution.
bool find_slips(SlipEquations& equations, Slips& s) {
  const auto& of = equations.looked_for();
  const auto size = static_cast<Index>(of.size());
  VectorXd off(size);
  double scale = 0;
  const auto look = [&](const Slips& at, bool derivatives) {
    if (!equations.solve(at, derivatives)) return false;
    scale = 0;
    for (Index i = 0; i < size; ++i) {
      const Vector2d v = equations.along(of[static_cast<std::size_t>(i)]);
      off[i] = cross_of(at[of[static_cast<std::size_t>(i)]], v);
      scale = std::max(scale, v.norm());
    }
    return off.allFinite();
  };
  for (int k = 0; k < kNewtonSteps; ++k) {
    if (!look(s, true)) return false;
    if (off.norm() <= 1e-15 * scale) return true;
    MatrixXd slope(size, size);
    for (Index i = 0; i < size; ++i) {
      const std::size_t c = of[static_cast<std::size_t>(i)];
      for (Index j = 0; j < size; ++j) slope(i, j) = cross_of(s[c], equations.along_by(c, static_cast<std::size_t>(j)));
      slope(i, i) += cross_of(turned(s[c]), equations.along(c));
    }
    VectorXd step = shortest_solution(slope, -off);
    if (!step.allFinite()) return false;
    if (const double longest = step.cwiseAbs().maxCoeff(); longest > 0.6) step *= 0.6 / longest;
    const double before = off.norm();
    const Slips from = s;
    bool better = false;
    for (int halving = 0; halving < 8 && !better; ++halving, step /= 2) {
      for (Index i = 0; i < size; ++i) {
        const std::size_t c = of[static_cast<std::size_t>(i)];
        s[c] = (std::cos(step[i]) * from[c] + std::sin(step[i]) * turned(from[c])).normalized();
      }
      better = look(s, false) && off.norm() < before;
    }
    if (better) continue;
    s = from;
    break;  // by rounding, or in a valley without a solution
  }
  return look(s, false) && off.norm() <= kSolved * scale;
}

bool are_same(const Slips& a, const Slips& b) {
  for (std::size_t c = 0; c < a.size(); ++c)
    if ((a[c] - b[c]).norm() > kSameAngles) return false;
  return true;
}

/// Where directions are looked for from: all the same, as of a body that goes straight; all by a grid; the guesses.
std::vector<Slips> starts_of(const SlipEquations& equations, const std::vector<SlidingContact>& contacts,
                             const std::vector<Slips>& guesses) {
  Slips known;
  for (const SlidingContact& at : contacts) known.push_back(at.way == Way::slides ? at.slip : Vector2d(0, 0));
  const auto& of = equations.looked_for();
  std::vector<Slips> starts;
  for (const Slips& guess : guesses) {
    Slips s = known;
    bool all = true;
    for (const std::size_t c : of) {
      all = all && guess[c].norm() > 0;
      if (all) s[c] = guess[c].normalized();
    }
    if (all) starts.push_back(s);
  }
  const std::size_t angles = kAngles[std::clamp<std::size_t>(of.size(), 2, 5) - 2];
  std::size_t count = 1;
  for (std::size_t k = 0; k < of.size(); ++k) count *= angles;
  for (std::size_t i = 0; i < count; ++i) {
    Slips s = known;
    std::size_t rest = i;
    for (std::size_t k = 0; k < of.size(); ++k, rest /= angles) {
      // Not in line with the rows, nor with each other.
      const double angle = 2 * std::numbers::pi * (static_cast<double>(rest % angles) + 0.13 + 0.07 * double(k)) /
                           static_cast<double>(angles);
      s[of[k]] = {std::cos(angle), std::sin(angle)};
    }
    starts.push_back(s);
  }
  for (int i = 0; i < 12; ++i) {
    Slips s = known;
    const double angle = 2 * std::numbers::pi * (i + 0.3) / 12;
    for (const std::size_t c : of) s[c] = {std::cos(angle), std::sin(angle)};
    starts.push_back(s);
  }
  return starts;
}

}  // namespace

SlipsTogether slips_together(const MatrixXd& response, const VectorXd& rates,
                             const std::vector<SlidingContact>& contacts, const std::vector<Slips>& guesses) {
  SlipEquations equations(response, rates, contacts);
  Slips known;
  for (const SlidingContact& at : contacts) known.push_back(at.way == Way::slides ? at.slip : Vector2d(0, 0));
  SlipsTogether result;
  const auto& of = equations.looked_for();
  if (of.empty()) {
    result.found.push_back(known);
    return result;
  }
  if (const auto alone = of.size() == 1 ? equations.reduced() : std::nullopt) {
    for (const Vector2d& s : slips_behind(*alone)) {
      Slips one = known;
      one[of.front()] = s;
      result.found.push_back(one);
    }
    return result;
  }
  for (Slips& s : starts_of(equations, contacts, guesses)) {
    ++result.starts;
    if (!find_slips(equations, s)) continue;
    const auto same = [&](const Slips& other) { return are_same(s, other); };
    if (std::none_of(result.found.begin(), result.found.end(), same)) result.found.push_back(s);
  }
  return result;
}

VectorXd rates_by_projection(const MatrixXd& response, const VectorXd& rates,
                             const std::vector<SlidingContact>& contacts) {
  VectorXd v = rates, p = VectorXd::Zero(rates.size());
  double moved = 0;
  const auto push = [&](int row, double to) {
    const double change = to - p[row];
    v += response.col(row) * change;
    moved = std::max(moved, response(row, row) * std::abs(change));
    p[row] = to;
  };
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    moved = 0;
    for (const SlidingContact& at : contacts) {
      const int n = at.rows.front();
      const double least = at.given ? at.normal : 0, asked = at.given ? 0 : rates[n] + at.normal;
      push(n, std::max(least, p[n] - (v[n] - asked) / response(n, n)));
      if (at.rows.size() < 2) continue;
      Vector2d t(0, 0);
      double soft = 0;
      for (std::size_t k = 1; k < at.rows.size(); ++k) soft = std::max(soft, response(at.rows[k], at.rows[k]));
      for (std::size_t k = 1; k < at.rows.size(); ++k)
        t[static_cast<Index>(k) - 1] =
            p[at.rows[k]] - (v[at.rows[k]] - rates[at.rows[k]] - at.along[k - 1]) / (1.5 * soft);
      if (const double most = at.friction * p[n]; t.norm() > most) t *= most / t.norm();
      for (std::size_t k = 1; k < at.rows.size(); ++k) push(at.rows[k], t[static_cast<Index>(k) - 1]);
    }
    if (!(moved > kConverged * rates.cwiseAbs().maxCoeff())) break;
  }
  return v;
}

// Of two solutions (Delta v)^T W^+ Delta v = Delta p^T Delta v <= -Delta p_n^T mu Delta |v_t|, as each lies in the cone
// of v_n + mu |v_t| and v_t dual to that of p; and Delta p_n = (W^+ Delta v)_n, where what W leaves open of p is along
// the ground. So with max(mu (W^+)_nn mu) max(W_tt) < 1 Delta v is 0.
bool has_one_solution(const MatrixXd& response, const std::vector<SlidingContact>& contacts) {
  std::vector<int> rows, normals, along;
  std::vector<double> friction;
  for (const SlidingContact& at : contacts) {
    if (at.given || at.slip.norm() > 0) return false;
    normals.push_back(static_cast<int>(rows.size()));
    friction.push_back(at.rows.size() > 1 ? at.friction : 0);
    for (std::size_t k = 0; k < at.rows.size(); ++k) {
      if (k > 0) along.push_back(at.rows[k]);
      rows.push_back(at.rows[k]);
    }
  }
  if (along.empty()) return true;
  const MatrixXd W = response(rows, rows);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> own(W);
  const double least = kSingular * own.eigenvalues().maxCoeff();
  MatrixXd inverse = MatrixXd::Zero(W.rows(), W.rows());
  for (Index i = 0; i < W.rows(); ++i) {
    const VectorXd x = own.eigenvectors().col(i);
    if (own.eigenvalues()[i] > least)
      inverse += x * x.transpose() / own.eigenvalues()[i];
    else if (x(normals).cwiseAbs().maxCoeff() > kOfNormals)
      return false;
  }
  const VectorXd mu = Eigen::Map<const VectorXd>(friction.data(), static_cast<Index>(friction.size()));
  const MatrixXd stiff = mu.asDiagonal() * inverse(normals, normals) * mu.asDiagonal();
  const MatrixXd soft = response(along, along);
  const auto largest = [](const MatrixXd& A) {
    return Eigen::SelfAdjointEigenSolver<MatrixXd>(A, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();
  };
  return largest(stiff) * largest(soft) < 1;
}

}  // namespace costate
