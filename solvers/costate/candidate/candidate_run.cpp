#include "costate/candidate/candidate_run.h"

#include <fmt/format.h>

#include <cmath>

#include "costate/base/error.h"

namespace costate {

std::vector<std::string> unknown_names(const CandidateAdjoint& candidate, const Mechanism& mechanism, int freedoms) {
  std::vector<std::string> names, independent;
  for (int i = 0; i < freedoms; ++i) independent.push_back(std::to_string(i));
  for (const auto& g : candidate.unknowns())
    for (const auto& name : g.size == 'n'   ? mechanism.coordinate_names()
                            : g.size == 'm' ? mechanism.row_names()
                            : g.size == 'f' ? independent
                                            : mechanism.state_names())
      names.push_back(g.name + "." + name);
  return names;
}

Eigen::VectorXd checked(Eigen::VectorXd x, int size, const char* function, double t) {
  if (x.size() != size)
    throw Error(fmt::format("{}() gave {} entries at t = {:.9g} s, expected {}.", function, x.size(), t, size));
  for (Eigen::Index i = 0; i < x.size(); ++i)
    if (!std::isfinite(x[i]))
      throw Error(fmt::format("{}() gave {} in entry {} at t = {:.9g} s.", function, x[i], i, t));
  return x;
}

CandidateMatrices candidate_matrices(const CandidateAdjoint& candidate, const AdjointBlocks& blocks, int size) {
  CandidateMatrices r;
  r.E.resize(size, size);
  r.A.resize(size, size);
  Eigen::VectorXd zero = Eigen::VectorXd::Zero(size), unit = zero;
  const auto evaluate = [&](const Eigen::VectorXd& x, const Eigen::VectorXd& xp) {
    return checked(candidate.residual(blocks, x, xp), size, "rhs() or residual", blocks.t);
  };
  r.b = evaluate(zero, zero);
  for (int j = 0; j < size; ++j) {
    unit[j] = 1;
    r.A.col(j) = evaluate(unit, zero) - r.b;
    r.E.col(j) = evaluate(zero, unit) - r.b;
    unit[j] = 0;
  }
  // Differences with b lose digits where b is large; what is left of an exact zero is none.
  for (Eigen::Index i = 0; i < size; ++i)
    for (Eigen::Index j = 0; j < size; ++j) {
      if (std::abs(r.E(i, j)) < 4e-16 * std::abs(r.b[i])) r.E(i, j) = 0;
      if (std::abs(r.A(i, j)) < 4e-16 * std::abs(r.b[i])) r.A(i, j) = 0;
    }
  Eigen::VectorXd x(size), xp(size);
  for (int i = 0; i < size; ++i) {
    x[i] = std::sin(1 + 2.3 * i);
    xp[i] = std::cos(2 + 1.7 * i);
  }
  const Eigen::VectorXd linear = r.E * xp + r.A * x + r.b, real = evaluate(x, xp);
  const Eigen::VectorXd size_of_terms = r.E.cwiseAbs() * xp.cwiseAbs() + r.A.cwiseAbs() * x.cwiseAbs() + r.b.cwiseAbs();
  for (int i = 0; i < size; ++i)
    if (std::abs(linear[i] - real[i]) > 1e-8 * size_of_terms.maxCoeff())
      throw Error(
          fmt::format("The backward equations are not linear in mu (row {}, t = {:.9g} s); adjoint equations "
                      "are.",
                      i, blocks.t));
  return r;
}

const AdjointBlocks& BlockCache::at(double t, int chart) {
  const auto known = known_.find({t, chart});
  if (known != known_.end()) return known->second;
  return known_.emplace(std::make_pair(t, chart), source_.at(t, motion_, chart)).first->second;
}

namespace {

/// The unknowns at a point, from the later choice of independent coordinates (2) to the earlier one (1),
/// (5.12).
void change_coordinates(const CandidateAdjoint& candidate, const AdjointBlocks& b2, const AdjointBlocks& b1,
                        Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
  int at = 0, y = -1, yd = -1, z = -1;
  bool second_order = false;
  for (const auto& g : candidate.unknowns()) {
    if (g.name == "mu_y" && g.size == 'f') y = at;
    if ((g.name == "mu_yd" || g.name == "P") && g.size == 'f') yd = at;
    if (g.name == "mu" && g.differential) yd = at;
    if (g.name == "mu_dot") {
      y = at;
      second_order = true;
    }
    if (g.name == "mu_z") z = at;
    at += g.count(b2);
  }
  if (y < 0 || yd < 0)
    throw Error(
        fmt::format("Other independent coordinates are needed from t = {:.9g} s on, and the candidate's unknowns "
                    "can only be transformed when groups of them are called mu_y and mu_yd (or P), or mu and "
                    "mu_dot. Name them so, "
                    "or check on a shorter run (--t-end).",
                    b2.t));
  const auto f = b2.f;
  Eigen::VectorXd mu_y = x.segment(y, f), mu_yd = x.segment(yd, f);
  // mu_yd = My mu, mu_y = rest - My mu_dot with the force states' part of rest.
  const auto rest = [&](const AdjointBlocks& b, const Eigen::VectorXd& mu) {
    Eigen::VectorXd r = -b.g_yd - b.My_dot * mu + b.Cy.transpose() * mu;
    if (z >= 0) r -= b.f_yd.transpose() * x.segment(z, b.nz);
    return r;
  };
  if (second_order) {
    mu_y = rest(b2, mu_yd) - b2.My * mu_y;
    mu_yd = b2.My * mu_yd;
  }
  const Eigen::VectorXd y1 = (b2.B * b1.R).transpose() * mu_y + (b2.B * b1.D).transpose() * mu_yd,
                        yd1 = (b2.B * b1.R).transpose() * mu_yd;
  if (second_order) {
    const Eigen::LDLT<Eigen::MatrixXd> mass(b1.My);
    const Eigen::VectorXd mu = mass.solve(yd1);
    x.segment(yd, f) = mu;
    x.segment(y, f) = mass.solve(rest(b1, mu) - y1);
  } else {
    x.segment(y, f) = y1;
    x.segment(yd, f) = yd1;
  }
  gradient += (b2.B * b1.N_rho).transpose() * mu_y + (b2.B * b1.V_rho).transpose() * mu_yd;
}

}  // namespace

CandidateRun integrate_candidate(const CandidateAdjoint& candidate, BlockCache& blocks, const AdjointBlocks& at_end,
                                 const CandidateStart& start, const std::vector<double>& grid,
                                 const CandidateStage& stage) {
  const double r6 = std::sqrt(6.0);
  const double c[3] = {(4 - r6) / 10, (4 + r6) / 10, 1};
  Eigen::Matrix3d a;
  a << (88 - 7 * r6) / 360, (296 - 169 * r6) / 1800, (-2 + 3 * r6) / 225,  //
      (296 + 169 * r6) / 1800, (88 + 7 * r6) / 360, (-2 - 3 * r6) / 225,   //
      (16 - r6) / 36, (16 + r6) / 36, 1.0 / 9;
  const Eigen::Matrix3d inverse = a.inverse();
  int N = 0;
  for (const auto& g : candidate.unknowns()) N += g.count(at_end);
  const int np = at_end.np;
  CandidateRun r;
  r.gradient = Eigen::VectorXd::Zero(np);
  r.mu.resize(grid.size());
  Eigen::VectorXd x = Eigen::VectorXd::Zero(N);
  stage("terminal()");
  candidate.terminal(at_end, x, r.gradient);
  checked(x, N, "terminal", at_end.t);
  checked(r.gradient, np, "terminal (gradient)", at_end.t);
  r.mu.back() = x;
  Eigen::MatrixXd S(3 * N, 3 * N);
  Eigen::VectorXd right(3 * N);
  int chart = grid.size() > 1 ? blocks.chart(grid[grid.size() - 2], grid.back()) : 0;
  for (std::size_t step = grid.size() - 1; step-- > 0;) {
    const double t0 = grid[step + 1], h = grid[step] - t0;
    if (const int next = blocks.chart(grid[step], t0); next != chart) {
      change_coordinates(candidate, blocks.at(t0, chart), blocks.at(t0, next), x, r.gradient);
      chart = next;
    }
    S.setZero();
    const AdjointBlocks* at[3];
    for (int i = 0; i < 3; ++i) {
      const double t = i == 2 ? grid[step] : t0 + c[i] * h;
      at[i] = &blocks.at(t, chart);
      stage(fmt::format("rhs() or residual() at t = {:.9g} s", t));
      const CandidateMatrices m = candidate_matrices(candidate, *at[i], N);
      for (int j = 0; j < 3; ++j) S.block(i * N, j * N, N, N) = inverse(i, j) * m.E;
      S.block(i * N, i * N, N, N) += h * m.A;
      right.segment(i * N, N) = inverse.row(i).sum() * (m.E * x) - h * m.b;
    }
    for (int i = 0; i < 3 * N; ++i) {
      const double size = S.row(i).cwiseAbs().maxCoeff();
      if (!(size > 0))
        throw Error(
            fmt::format("The backward system is singular at t = {:.9g} s: equation {} has no unknown.", t0, i % N));
      S.row(i) /= size;
      right[i] /= size;
    }
    const Eigen::VectorXd X = S.partialPivLu().solve(right);
    for (Eigen::Index i = 0; i < X.size(); ++i)
      if (!std::isfinite(X[i]))
        throw Error(
            fmt::format("The backward system is singular or its solution grows without bound at t = {:.9g} s "
                        "(unknown {}).",
                        t0, i % N));
    for (int i = 0; i < 3; ++i) {
      stage(fmt::format("integrand() at t = {:.9g} s", at[i]->t));
      r.gradient -= h * a(2, i) * checked(candidate.integrand(*at[i], X.segment(i * N, N)), np, "integrand", at[i]->t);
    }
    x = X.tail(N);
    r.mu[step] = x;
  }
  stage("start_contribution()");
  r.gradient +=
      checked(candidate.start_contribution(blocks.at(grid.front(), chart), x, start.Sq0, start.Sv0, start.Sz0), np,
              "start_contribution", grid.front());
  return r;
}

}  // namespace costate
