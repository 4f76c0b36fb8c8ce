#include "costate/analysis/complaints.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

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
