#include "costate/analysis/modes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "costate/analysis/picks.h"
#include "costate/analysis/row_space.h"
#include "costate/analysis/spread_roots.h"
#include "costate/assembly/friction_rows.h"
#include "costate/assembly/rolling_rows.h"
#include "costate/assembly/slip_directions.h"
#include "costate/base/error.h"
#include "costate/element/constraint/euler_norm.h"
#include "costate/element/point/rotation.h"
#include "costate/linear/to_dense.h"

namespace costate {

using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace {

constexpr int kMostCoordinates = 500;
// Instants, of 1/|largest eigenvalue|: along the motion, and with time alone, which finds a stiffness at its turn, too.
constexpr double kAlongMotion = 1e-4, kInTime = 0.1;
// A row of this part of the largest entries is their rounding.
constexpr double kNoEntry = 1e-7;

/// Phi_r, by which reactions act.
MatrixXd reaction_rows(const Assembly& assembly) {
  std::vector<double> rows;
  calc_reaction_rows(assembly, rows);
  return to_dense(assembly.jacobian(), rows.data());
}

/// Accelerations and multipliers at (q, v, z), by the null spaces of rows and reactions.
void calc_accelerations(Assembly& assembly, const RowSpace& rows, const RowSpace& reactions, Modes& r) {
  const MatrixXd M = to_dense(assembly.square(), assembly.M.data()), N = rows.null_space();
  const VectorXd Q = Eigen::Map<const VectorXd>(assembly.Q.data(), assembly.n()),
                 bias = Eigen::Map<const VectorXd>(assembly.bias.data(), assembly.m());
  r.a = rows.solve(-bias);
  if (N.cols() > 0 && assembly.sliding_rows().empty()) {
    r.a += N * (N.transpose() * M * N).ldlt().solve(N.transpose() * (Q - M * r.a));
  } else if (N.cols() > 0) {
    const MatrixXd N_r = reactions.null_space();
    r.a += N * (N_r.transpose() * M * N).partialPivLu().solve(N_r.transpose() * (Q - M * r.a));
  }
  r.lambda = reactions.solve_transposed(Q - M * r.a);
  add_friction_multipliers(assembly, r.lambda.data());
}

/// T of the header at Euler parameters taken from `p`: those of q, v or a give T, T' or T''. Where `names` is
/// not null the directions are written there.
MatrixXd calc_directions(const Mechanism& m, const VectorXd& p, bool constant_part, std::vector<ModeDirection>* names) {
  const int n = m.coordinate_count();
  std::vector<const EulerNormConstraint*> turned(static_cast<std::size_t>(n), nullptr);
  for (const auto& c : m.constraints())
    if (const auto* norm = dynamic_cast<const EulerNormConstraint*>(c.get()))
      for (const int i : norm->coordinates()) turned[static_cast<std::size_t>(i)] = norm;
  MatrixXd T = MatrixXd::Zero(n, n);
  int column = 0;
  for (int i = 0; i < n; ++i) {
    const auto* body = turned[static_cast<std::size_t>(i)];
    const auto& c = m.coordinates()[static_cast<std::size_t>(i)];
    if (!body) {
      if (constant_part) T(i, column) = 1;
      if (names) names->push_back({c.name, c.unit});
      ++column;
    } else if (body->coordinates().front() == i) {
      double e[4];
      for (std::size_t k = 0; k < 4; ++k) e[k] = p[body->coordinates()[k]];
      const Matrix34 E = global_rate_matrix(e);
      for (int axis = 0; axis < 3; ++axis, ++column) {
        for (int k = 0; k < 4; ++k) T(body->coordinates()[static_cast<std::size_t>(k)], column) = E(axis, k) / 2;
        if (names) names->push_back({body->name() + ".turn_" + "xyz"[axis], "rad"});
      }
    }
  }
  return T.leftCols(column);
}

/// At a point with its accelerations and multipliers, which are put into `r`: what stands on the right of (14.1) before
/// the constraints are taken out, in directions x, and the constraints' own terms.
struct Point {
  MatrixXd T, T1, T2, M, C, K, Mx, Cx, Kx, J, J1, J2;
  RowSpace rows, reactions;  // of J, and of Phi_r T: the same where nothing slides
};

/// X T, where rows that no direction moves (the norms of Euler parameters) are zero but for rounding.
MatrixXd in_directions(const MatrixXd& X, const MatrixXd& T) {
  MatrixXd J = X * T;
  for (Eigen::Index i = 0; i < J.rows(); ++i)
    if (J.row(i).norm() < 1e-12 * X.row(i).norm()) J.row(i).setZero();
  return J;
}

Point solve_point(Assembly& assembly, double t, Modes& r, std::vector<ModeDirection>* names) {
  Point p;
  const Mechanism& mechanism = assembly.mechanism();
  StateView s{t, r.q.data(), r.v.data(), nullptr, nullptr, r.z.data()};
  assembly.calc_dynamics(s);
  p.rows.compute(to_dense(assembly.jacobian(), assembly.phi_q.data()));
  const bool slides = !assembly.sliding_rows().empty();
  p.reactions = p.rows;
  if (slides) p.reactions.compute(reaction_rows(assembly));
  calc_accelerations(assembly, p.rows, p.reactions, r);
  s.a = r.a.data();
  s.lambda = r.lambda.data();
  assembly.calc_dynamics(s);
  assembly.calc_partials(s);
  std::vector<double> slip_q, slip_v;
  add_slip_forces(assembly, s, slip_q, slip_v);
  p.T = calc_directions(mechanism, r.q, true, names);
  p.T1 = calc_directions(mechanism, r.v, false, nullptr);
  p.T2 = calc_directions(mechanism, r.a, false, nullptr);
  const auto square = [&](const std::vector<double>& x) { return to_dense(assembly.square(), x.data()); };
  const auto constraint = [&](const std::vector<double>& x) { return to_dense(assembly.jacobian(), x.data()); };
  p.M = square(assembly.M);
  p.K = square(assembly.K);
  p.C = square(assembly.C);
  p.Mx = p.T.transpose() * p.M * p.T;
  p.Cx = p.T.transpose() * (p.C * p.T + 2 * p.M * p.T1);
  p.Kx = p.T.transpose() * (p.K * p.T + p.C * p.T1 + p.M * p.T2);
  const MatrixXd phi_q = constraint(assembly.phi_q), phid_q = constraint(assembly.phid_q),
                 phidd_q = constraint(assembly.phidd_q);
  p.J = in_directions(phi_q, p.T);
  p.rows.compute(p.J);
  p.reactions = p.rows;
  if (slides) p.reactions.compute(in_directions(reaction_rows(assembly), p.T));
  p.J1 = phi_q * p.T1 + phid_q * p.T;
  p.J2 = phi_q * p.T2 + 2 * phid_q * p.T1 + phidd_q * p.T;
  return p;
}

/// The linear system s' = A s for s = (u, u'/w, dz/d), with u the directions y in which the masses are 1 and
/// w, d scales that make the blocks comparable; the map U from u to all directions, d, and the directions'
/// masses.
struct LinearMotion {
  MatrixXd A, U, M;  // A by (14.1), M of all directions
  VectorXd d;
  MatrixXd terms;           // the sum of the absolute values of the terms of each entry of A
  std::vector<int> states;  // which z are
};

/// Those that something depends on: others, as the work of a force, are integrals along the motion and take no part in
/// it.
std::vector<int> states_that_act(const MatrixXd& Q_z, const MatrixXd& f_z) {
  std::vector<int> states;
  for (Eigen::Index i = 0; i < f_z.cols(); ++i)
    if ((Q_z.col(i).array() != 0).any() || (f_z.col(i).array() != 0).any()) states.push_back(static_cast<int>(i));
  return states;
}

/// Columns N with X N = 0 that leave apart what X does not couple: by elimination, so that the stiffness of one body is
/// not mixed with that of another.
MatrixXd null_columns(const MatrixXd& X, const RowSpace& rows) {
  const Eigen::Index n = X.cols(), f = n - rows.rank();
  if (f == 0) return MatrixXd(n, 0);
  if (rows.rank() == 0) return MatrixXd::Identity(n, n);
  Eigen::FullPivLU<MatrixXd> lu(X);
  lu.setThreshold(1e-9);
  return lu.rank() == rows.rank() ? MatrixXd(lu.kernel()) : rows.null_space();
}

/// What entries of K are sums of: of the Euler parameters of one body these are reactions and forces times its lever
/// arms, and the norm's multiplier, any of which may cancel in one entry (a free spin beside a pendulum's weight), and
/// stand in another.
MatrixXd stiffness_terms(const Mechanism& m, const MatrixXd& K) {
  MatrixXd terms = K.cwiseAbs();
  for (const auto& c : m.constraints())
    if (dynamic_cast<const EulerNormConstraint*>(c.get())) {
      const auto& e = c->coordinates();
      const double largest = terms(e, e).maxCoeff();
      for (const int i : e)
        for (const int j : e) terms(i, j) = largest;
    }
  return terms;
}

LinearMotion linearize(Assembly& assembly, double t, Modes& r) {
  const Point p = solve_point(assembly, t, r, &r.directions);
  const auto& [T, T1, T2, M, C, K, Mx, Cx, Kx, J, J1, J2, rows, reactions] = p;
  const Eigen::LDLT<MatrixXd> metric(T.transpose() * T);
  r.acceleration = metric.solve(T.transpose() * (r.a - T1 * metric.solve(T.transpose() * r.v)));
  const MatrixXd R = null_columns(J, rows);
  const MatrixXd D = -rows.solve(J1 * R), A = -rows.solve(J2 * R + 2 * J1 * D);
  const MatrixXd My = R.transpose() * Mx * R;
  const MatrixXd all_Q_z = to_dense(assembly.force_state(), assembly.Q_z.data()),
                 all_f_z = to_dense(assembly.state_state(), assembly.f_z.data());
  const std::vector<int> states = states_that_act(all_Q_z, all_f_z);
  const auto nz = static_cast<Eigen::Index>(states.size());
  const MatrixXd Q_z = pick_columns(all_Q_z, states), f_z = pick_columns(pick_rows(all_f_z, states), states),
                 f_q = pick_rows(to_dense(assembly.state_force(), assembly.f_q.data()), states),
                 f_v = pick_rows(to_dense(assembly.state_force(), assembly.f_v.data()), states);
  const Eigen::Index f = R.cols();
  r.degrees_of_freedom = static_cast<int>(f);
  const Eigen::LLT<MatrixXd> llt(My);
  if (f > 0 && llt.info() != Eigen::Success)
    throw ModelError("",
                     "Modes: a motion that the constraints allow has no mass, so that its acceleration is "
                     "not determined.");
  const MatrixXd V = f > 0 ? MatrixXd(llt.matrixU().solve(MatrixXd::Identity(f, f))) : MatrixXd(0, 0);
  // What takes the multipliers out in front of the equations, with the masses 1 there, too.
  MatrixXd L = (R * V).transpose();
  if (!assembly.sliding_rows().empty() && f > 0) {
    const MatrixXd left = null_columns(reactions.matrix(), reactions).transpose();
    const Eigen::FullPivLU<MatrixXd> masses(left * Mx * R * V);
    if (left.rows() != f || !masses.isInvertible())
      throw ModelError("",
                       "Modes: friction of what slides takes up all of a motion's acceleration (Painleve's paradox), "
                       "so that it is not determined.");
    L = masses.solve(left);
  }
  const MatrixXd stiffness = L * (Kx * R + Cx * D + Mx * A) * V, damping = L * (Cx * R + 2 * Mx * D) * V;
  double w = std::max(std::sqrt(stiffness.norm()), damping.norm());
  if (!(w > 0)) w = 1;
  LinearMotion motion{MatrixXd::Zero(2 * f + nz, 2 * f + nz), R * V, Mx, VectorXd::Ones(nz), {}, states};
  motion.A.block(0, f, f, f) = w * MatrixXd::Identity(f, f);
  if (f > 0) motion.A.middleRows(f, f) << -stiffness / w, -damping, L * T.transpose() * Q_z / w;
  if (nz > 0) motion.A.bottomRows(nz) << f_q * T * R * V + f_v * (T1 * R + T * D) * V, f_v * T * R * V * w, f_z;
  // What these entries are sums of.
  const MatrixXd most = (T * R * V).cwiseAbs(), most_d = (T * D * V).cwiseAbs() + (T1 * R * V).cwiseAbs(),
                 most_a = (T * A * V).cwiseAbs() + 2 * (T1 * D * V).cwiseAbs() + (T2 * R * V).cwiseAbs(),
                 most_left = (L * T.transpose()).cwiseAbs();
  motion.terms = motion.A.cwiseAbs();
  if (f > 0)
    motion.terms.middleRows(f, f) << most_left *
                                         (stiffness_terms(assembly.mechanism(), K) * most + C.cwiseAbs() * most_d +
                                          M.cwiseAbs() * most_a) /
                                         w,
        most_left * (C.cwiseAbs() * most + 2 * M.cwiseAbs() * most_d), most_left * Q_z.cwiseAbs() / w;
  if (nz > 0)
    motion.terms.bottomRows(nz) << f_q.cwiseAbs() * most + f_v.cwiseAbs() * most_d, f_v.cwiseAbs() * most * w,
        f_z.cwiseAbs();
  motion.terms = motion.terms.cwiseMax(motion.A.cwiseAbs());
  for (Eigen::Index i = 0; i < nz; ++i) {
    const Eigen::Index at = 2 * f + i;
    const double self = std::abs(motion.A(at, at)), row = motion.A.row(at).cwiseAbs().sum() - self,
                 column = motion.A.col(at).cwiseAbs().sum() - self;
    if (!(row > 0) || !(column > 0)) continue;
    motion.d[i] = std::sqrt(row / column);
    for (MatrixXd* X : {&motion.A, &motion.terms}) {
      X->row(at) /= motion.d[i];
      X->col(at) *= motion.d[i];
    }
  }
  return motion;
}

struct Coefficients {
  MatrixXd M, C, K;
};

/// Those of (14.1) with the projector on what the constraints allow for R, which depends on no choice of a basis.
Coefficients coefficients_at(Assembly& assembly, double t, Modes at) {
  const Point p = solve_point(assembly, t, at, nullptr);
  const MatrixXd N = p.rows.null_space(), P = N * N.transpose(), D = -p.rows.solve(p.J1 * P),
                 A = -p.rows.solve(p.J2 * P + 2 * p.J1 * D), N_r = p.reactions.null_space(), L = N_r * N_r.transpose();
  return {L * p.Mx * P, L * (p.Cx * P + 2 * p.Mx * D), L * (p.Kx * P + p.Cx * D + p.Mx * A)};
}

/// The largest change of an entry, of the largest in its row and its column.
double change_of(const Coefficients& a, const Coefficients& b, double rate) {
  // In units of forces for directions that move by one in 1/rate.
  const MatrixXd size = a.M.cwiseAbs() * rate * rate + a.C.cwiseAbs() * rate + a.K.cwiseAbs(),
                 change = (b.M - a.M).cwiseAbs() * rate * rate + (b.C - a.C).cwiseAbs() * rate + (b.K - a.K).cwiseAbs();
  double most = 0;
  for (Eigen::Index i = 0; i < size.rows(); ++i)
    for (Eigen::Index j = 0; j < size.cols(); ++j) {
      const double scale =
          std::max(std::sqrt(size.row(i).maxCoeff() * size.col(j).maxCoeff()), kNoEntry * size.maxCoeff());
      if (scale > 0) most = std::max(most, change(i, j) / scale);
    }
  return most;
}

/// Scaled so that the direction that moves most is 1; with shares in the kinetic energy.
void finish(Mode& mode, const MatrixXd& M) {
  Eigen::Index at = 0;
  const double moves = mode.shape.size() > 0 ? mode.shape.cwiseAbs().maxCoeff(&at) : 0;
  std::complex<double> scale = moves > 0 ? mode.shape[at] : 1.0;
  if (mode.z.size() > 0 && !(moves > 1e-12 * mode.z.cwiseAbs().maxCoeff())) {
    mode.z.cwiseAbs().maxCoeff(&at);
    scale = mode.z[at];
  }
  mode.shape /= scale;
  mode.z /= scale;
  mode.share = (mode.shape.conjugate().array() * (M * mode.shape).array()).real().abs();
  const double sum = mode.share.sum();
  if (sum > 0) mode.share /= sum;
}

}  // namespace

double Mode::frequency_Hz() const { return eigenvalue.imag() / (2 * std::numbers::pi); }
double Mode::damping_ratio() const { return -eigenvalue.real() / std::abs(eigenvalue); }

Modes find_modes(Assembly& assembly, double t, const Start& start) {
  if (assembly.n() > kMostCoordinates)
    throw CapabilityError(
        fmt::format("Modes are computed with full matrices, which serves up to {} coordinates; this "
                    "mechanism has {}. Take a part of it.",
                    kMostCoordinates, assembly.n()));
  assembly.switch_rows(start.z.data());
  refuse_rolling(assembly, "A linearization");
  Modes r;
  r.q = start.q;
  r.v = start.v;
  r.z = start.z;
  const LinearMotion motion = linearize(assembly, t, r);
  const Roots found = find_roots(motion.A, motion.terms);
  r.zero_eigenvalues = found.zeros;
  const Eigen::Index size = motion.A.rows(), f = motion.U.cols();
  for (const Root& root : found.roots) {
    Mode mode;
    mode.eigenvalue = root.value;
    mode.relative_error = root.error / std::abs(root.value);
    mode.shape = motion.U.cast<std::complex<double>>() * root.vector.head(f);
    mode.z = VectorXcd::Zero(assembly.nz());
    for (Eigen::Index i = 0; i < size - 2 * f; ++i)
      mode.z[motion.states[static_cast<std::size_t>(i)]] = motion.d[i] * root.vector[2 * f + i];
    finish(mode, motion.M);
    r.modes.push_back(std::move(mode));
  }
  std::sort(r.modes.begin(), r.modes.end(),
            [](const Mode& a, const Mode& b) { return std::abs(a.eigenvalue) < std::abs(b.eigenvalue); });
  return r;
}

double coefficient_change(Assembly& assembly, double t, const Modes& modes) {
  if (modes.modes.empty()) return 0;
  const double rate = std::abs(modes.modes.back().eigenvalue);
  // Between a little before and a little behind: what this motion leaves out, of second order, cancels.
  double spin = 0;  // of whose turn h is a smaller part yet: what it leaves out, of third order, does not cancel
  for (const auto& c : assembly.mechanism().constraints())
    if (dynamic_cast<const EulerNormConstraint*>(c.get())) {
      double square = 0;
      for (const int i : c->coordinates()) square += modes.v[i] * modes.v[i];
      spin = std::max(spin, 2 * std::sqrt(square));
    }
  double h = kAlongMotion / std::max(rate, 10 * spin);
  const auto along_motion = [&](double by) {
    Modes there = modes;
    there.q += by * modes.v + 0.5 * by * by * modes.a;
    there.v += by * modes.a;
    return coefficients_at(assembly, t + by, there);
  };
  double along = change_of(along_motion(-h), along_motion(h), rate);
  // Entries that are nothing but rounding change by as much over no time at all.
  constexpr double kNoTime = 1e-6, kRounding = 10;
  if (along <= kRounding * change_of(along_motion(0), along_motion(kNoTime * h), rate)) along = 0;
  along /= 2 * h * rate;
  const Coefficients here = coefficients_at(assembly, t, modes);
  h = kInTime / rate;
  return std::max(along, change_of(here, coefficients_at(assembly, t + h, modes), rate) / kInTime);
}

}  // namespace costate
