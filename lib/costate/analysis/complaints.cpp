#include "costate/analysis/complaints.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <vector>

#include "costate/base/error.h"
#include "costate/element/complaint.h"

namespace costate {

namespace {

constexpr std::size_t kTold = 4;  // elements that complain

template <class Elements>
void add_complaints(Assembly& assembly, const Elements& elements, const StateView& s, std::vector<std::string>& all) {
  for (const auto& e : elements) {
    const auto* complaining = dynamic_cast<const ComplainingElement*>(e.get());
    if (!complaining) continue;
    std::vector<std::string> said;
    complaining->add_complaints(assembly.gather(*e, 0, s), said);
    if (!said.empty()) all.push_back(fmt::format("{} {}", e->path(), fmt::join(said, ", ")));
  }
}

/// The diagonal of M.
std::vector<double> inertias(Assembly& assembly, const StateView& s) {
  std::vector<double> inertia(static_cast<std::size_t>(assembly.n()), 0.0);
  for (const auto& b : assembly.mechanism().bodies()) {
    const auto& c = b->coordinates();
    const int k = static_cast<int>(c.size());
    Eigen::MatrixXd block = Eigen::MatrixXd::Zero(k, k);
    LocalMatrix M(block.data(), k, k);
    b->calc_mass(assembly.gather(*b, 0, s), M);
    for (int i = 0; i < k; ++i) inertia[static_cast<std::size_t>(c[static_cast<std::size_t>(i)])] += M(i, i);
  }
  return inertia;
}

struct Extreme {
  double value = 0;
  const Force* force = nullptr;
  int coordinate = -1;  // global, of the largest entry
  void offer(double x, const Force& f, int k) {
    // What is no number is beyond all.
    if (!std::isfinite(x)) x = HUGE_VAL;
    if (x > value) *this = {x, &f, k};
  }
};

void measure(const Force& f, const LocalState& local, const std::vector<double>& inertia, Extreme& largest,
             Extreme& steepest) {
  const auto& c = f.coordinates();
  const int n = static_cast<int>(c.size()), nz = f.states();
  const auto mass = [&](int i) { return inertia[static_cast<std::size_t>(c[static_cast<std::size_t>(i)])]; };
  const auto global = [&](int i) { return c[static_cast<std::size_t>(i)]; };
  double Q[kMaxLocal] = {}, zdot[kMaxLocal] = {};
  f.calc_force(local, Q, zdot);
  for (int i = 0; i < n; ++i)
    if (mass(i) > 0) largest.offer(std::abs(Q[i]) / mass(i), f, global(i));
  std::vector<Eigen::MatrixXd> blocks{Eigen::MatrixXd::Zero(n, n),  Eigen::MatrixXd::Zero(n, n),
                                      Eigen::MatrixXd::Zero(n, nz), Eigen::MatrixXd::Zero(nz, n),
                                      Eigen::MatrixXd::Zero(nz, n), Eigen::MatrixXd::Zero(nz, nz)};
  std::vector<LocalMatrix> maps;
  for (auto& b : blocks) maps.emplace_back(b.data(), b.rows(), b.cols());
  f.calc_partials(local, {maps[0], maps[1], maps[2], maps[3], maps[4], maps[5]});
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const double m = std::sqrt(mass(i) * mass(j));
      if (!(m > 0)) continue;
      steepest.offer(std::sqrt(std::abs(maps[0](i, j)) / m), f, global(i));
      steepest.offer(std::abs(maps[1](i, j)) / m, f, global(i));
    }
  for (int i = 0; i < nz; ++i)
    for (int j = 0; j < nz; ++j) steepest.offer(std::abs(maps[5](i, j)), f, -1);
}

}  // namespace

std::string dependent_row(Assembly& assembly, const StateView& s, int most) {
  constexpr double near = 0.05, redundant = 1e-10, part = 0.2;
  const int m = assembly.m(), n = assembly.n();
  if (m > most || m == 0) return {};
  assembly.calc_jacobian(s);
  const SparsePattern& J = assembly.jacobian();
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(n, m);
  for (int j = 0; j < J.cols; ++j)
    for (auto k = J.column_start[j]; k < J.column_start[j + 1]; ++k) rows(j, J.row[k]) = assembly.phi_q[k];
  if (!rows.allFinite()) return {};
  std::vector<int> there;
  for (int i = 0; i < m; ++i)
    if (const double size = rows.col(i).norm(); assembly.is_there(i) && size > 0) {
      rows.col(static_cast<Eigen::Index>(there.size())) = rows.col(i) / size;
      there.push_back(i);
    }
  const auto count = static_cast<Eigen::Index>(there.size());
  if (count == 0 || count > n) return {};
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(rows.leftCols(count), Eigen::ComputeThinV);
  Eigen::Index least = count - 1;  // in falling order
  while (least > 0 && svd.singularValues()[least] <= redundant && svd.singularValues()[least - 1] <= near) --least;
  if (svd.singularValues()[least] > near) return {};
  const Eigen::VectorXd share = svd.matrixV().col(least).cwiseAbs();
  std::vector<std::string> names;
  const std::vector<std::string> all = assembly.mechanism().row_names();
  for (Eigen::Index k = 0; k < count; ++k)
    if (share[k] >= part * share.maxCoeff())
      names.push_back(all[static_cast<std::size_t>(there[static_cast<std::size_t>(k)])]);
  if (names.size() > kTold) {
    names.resize(kTold);
    names.push_back("...");
  }
  return fmt::format(
      "Rows {} depend on each other to within {:.1e} of 1: redundant, or the mechanism locks there or passes a "
      "singular "
      "position.",
      fmt::join(names, ", "), svd.singularValues()[least]);
}

std::string element_complaints(Assembly& assembly, const StateView& s) {
  const Mechanism& m = assembly.mechanism();
  std::vector<std::string> sentences, said;
  add_complaints(assembly, m.bodies(), s, said);
  add_complaints(assembly, m.constraints(), s, said);
  add_complaints(assembly, m.forces(), s, said);
  if (const std::size_t all = said.size(); all > kTold) {
    said.resize(kTold);
    said.push_back(fmt::format("{} more", all - kTold));
  }
  if (!said.empty()) sentences.push_back(fmt::format("At its limit: {}.", fmt::join(said, "; ")));
  if (std::string row = dependent_row(assembly, s); !row.empty()) sentences.push_back(std::move(row));
  Extreme largest, steepest;
  const std::vector<double> inertia = inertias(assembly, s);
  for (const auto& f : m.forces()) {
    try {
      measure(*f, assembly.gather(*f, 0, s), inertia, largest, steepest);
    } catch (const StepError&) {
      sentences.push_back(fmt::format("Not defined there: {}.", f->path()));
    }
  }
  if (largest.force) {
    const Coordinate& c = m.coordinates()[static_cast<std::size_t>(largest.coordinate)];
    sentences.push_back(fmt::format(
        "Largest force: {} (alone it accelerates {} by {:.2g} {}/s^2){}.", largest.force->path(), c.name, largest.value,
        c.unit == "1" ? "1" : c.unit,
        steepest.force == largest.force ? fmt::format(", also the steepest ({:.2g} 1/s)", steepest.value) : ""));
  }
  if (steepest.force && steepest.force != largest.force)
    sentences.push_back(fmt::format("Steepest force: {} ({:.2g} 1/s).", steepest.force->path(), steepest.value));
  return fmt::format("{}", fmt::join(sentences, " "));
}

}  // namespace costate
