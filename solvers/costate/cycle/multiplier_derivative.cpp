#include "costate/cycle/multiplier_derivative.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <optional>

#include "costate/base/error.h"
#include "costate/base/stop.h"
#include "costate/cycle/cycle_errors.h"
#include "costate/integrator/unknown_sizes.h"
#include "costate/problem/scaled_gradient.h"

namespace costate {

namespace {

using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

// The runs beside the cycle keep tolerances this much smaller, the first that the formulation gets on with, but no
// smaller than kTightest.
constexpr double kTighter[] = {0.01, 0.1, 1}, kTightest = 1e-12;
// First step along the eigenvector, in parts of the fixed point's entries; an entry near zero has this part of the
// largest in its place.
constexpr double kFirstDistance = 0.05, kSmallEntry = 0.1;
// Of entries' natural sizes: below the one all of them are zero, and the other is taken in their place.
constexpr double kRests = 1e-6, kOfSize = 0.1;
constexpr int kLevels = 7;           // steps h, h/2, ... h/64 at most
constexpr double kConverged = 1e-9;  // relative; no more levels then
// The largest modulus has no derivative where another one is within this of it, or where left and right eigenvector are
// as nearly orthogonal as this.
constexpr double kTie = 1e-7, kDefective = 1e-7;
constexpr double kSmallest = 1e-9;  // a modulus below is that of no multiplier
// What the runs' own errors make of a difference is told by one of runs at this many times their tolerance.
constexpr double kLooser = 10;
// Exact second derivatives are taken at this part of that tolerance besides, but not below the other one.
constexpr double kTighterSecond = 0.1, kTightestSecond = 1e-13;

/// The largest multiplier with its eigenvectors, u^T w = 1.
struct Leading {
  std::complex<double> m;
  VectorXcd u, w;
};

Leading leading(const MatrixXd& A) {
  const auto none = [] { return CapabilityError("The largest multiplier has no derivative: there is none."); };
  if (A.rows() == 0) throw none();
  const Eigen::EigenSolver<MatrixXd> right(A), left(A.transpose().eval());
  if (right.info() != Eigen::Success || left.info() != Eigen::Success) throw none();
  const VectorXcd m = right.eigenvalues();
  Eigen::Index k = 0;
  m.cwiseAbs().maxCoeff(&k);
  if (m[k].imag() < 0)  // of a pair the one above the real axis
    for (Eigen::Index i = 0; i < m.size(); ++i)
      if (std::abs(m[i] - std::conj(m[k])) < kTie * std::abs(m[k])) k = i;
  const double size = std::abs(m[k]);
  if (size < kSmallest) throw CapabilityError("The largest multiplier has no derivative: all of them are zero.");
  for (Eigen::Index i = 0; i < m.size(); ++i)
    if (i != k && std::abs(m[i]) > (1 - kTie) * size &&
        !(m[k].imag() != 0 && std::abs(m[i] - std::conj(m[k])) <= kTie * size))
      throw CapabilityError(
          fmt::format("The largest modulus has no derivative here: {:.9g} {:+.9g} i and {:.9g} {:+.9g} i share it.",
                      m[k].real(), m[k].imag(), m[i].real(), m[i].imag()));
  Leading r{m[k], {}, right.eigenvectors().col(k)};
  Eigen::Index same = 0;
  (left.eigenvalues().array() - m[k]).abs().minCoeff(&same);
  r.u = left.eigenvectors().col(same);
  const std::complex<double> product = r.u.transpose() * r.w;
  if (std::abs(product) < kDefective * r.u.norm() * r.w.norm())
    throw CapabilityError(fmt::format(
        "The largest multiplier {:.9g} {:+.9g} i has no derivative here: two of them meet.", m[k].real(), m[k].imag()));
  r.u /= product;
  return r;
}

bool same_events(const std::vector<RunEvent>& a, const std::vector<RunEvent>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const RunEvent& x, const RunEvent& y) { return x.name == y.name && x.mode == y.mode; });
}

/// The motion beside the cycle is another one: its step is too long.
struct OtherEvents {};

/// The return's tangents beside the fixed point.
class Beside {
 public:
  Beside(const ReturnMap& map, const VectorXd& x, const std::vector<double>& positions, int np, double tighter)
      : map_(map), x_(x), positions_(positions), np_(np) {
    const SolverOptions& s = map.problem().solver;
    const double rtol = std::min(s.rtol, std::max(tighter * s.rtol, kTightest));
    map_.set_tolerance(rtol, s.absolute() * rtol / s.rtol);
    // The fixed point at this tolerance: one of Newton's steps from that of the search.
    const auto& free = map.section().free();
    const auto k = static_cast<Eigen::Index>(free.size());
    const MapValue v = map_.evaluate(x_, positions_, MapDerivatives::state);
    const MatrixXd A = MatrixXd::Identity(k, k) - v.next_x(free, free);
    const VectorXd dx = A.partialPivLu().solve((v.next - x_)(free));
    for (std::size_t i = 0; i < free.size(); ++i) x_[free[i]] += dx[static_cast<Eigen::Index>(i)];
    map_.onto_section(x_, positions_);
    at_ = map_.evaluate(x_, positions_, MapDerivatives::all);
    counters += v.counters;
    counters += at_.counters;
  }

  Counters counters;
  /// P_x of the free entries, and the derivatives of (x, rho) by rho.
  MatrixXd state() const { return at_.next_x(map_.section().free(), map_.section().free()); }
  /// u^T (D_w P_x, D_w P_rho) of the free entries by exact second derivatives.
  VectorXcd curvature(const Leading& lead) {
    const auto& free = map_.section().free();
    const auto k = static_cast<Eigen::Index>(free.size());
    const Eigen::Index directions = lead.m.imag() == 0 ? 1 : 2;
    MatrixXd u = MatrixXd::Zero(map_.section().size(), directions), w = u;
    for (Eigen::Index i = 0; i < k; ++i) {
      const int at = free[static_cast<std::size_t>(i)];
      u(at, 0) = lead.u[i].real();
      w(at, 0) = lead.w[i].real();
      if (directions == 1) continue;
      u(at, 1) = lead.u[i].imag();
      w(at, 1) = lead.w[i].imag();
    }
    VectorXcd sum = VectorXcd::Zero(k + np_);
    const std::complex<double> one[2] = {1, {0, 1}};
    const std::vector<MatrixXd> all = map_.curvature(x_, positions_, u, w, counters);
    for (Eigen::Index a = 0; a < directions; ++a) {
      const MatrixXd& of_a = all[static_cast<std::size_t>(a)];
      MatrixXd own(k + np_, directions);
      own << of_a(free, Eigen::all), of_a.middleRows(map_.section().size(), np_);
      for (Eigen::Index b = 0; b < directions; ++b) sum += one[a] * one[b] * own.col(b);
    }
    return sum;
  }
  MatrixXd along_branch() const {
    const MatrixXd P = state();
    MatrixXd r(P.rows() + np_, np_);
    const MatrixXd P_rho = at_.next_rho(map_.section().free(), Eigen::seqN(0, np_));
    r << (MatrixXd::Identity(P.rows(), P.rows()) - P).partialPivLu().solve(P_rho), MatrixXd::Identity(np_, np_);
    return r;
  }

  /// h at the first level of a direction of the free entries, 0 where there is none.
  double first_step(const VectorXd& along) const {
    const double largest = x_.cwiseAbs().maxCoeff();
    // What rests where it is (a pendulum that hangs straight while its pivot is shaken) has no size of its own.
    bool rests = true;
    for (const int i : map_.section().free()) rests = rests && std::abs(x_[i]) < kRests * size_of(i);
    double most = 0;
    for (std::size_t k = 0; k < map_.section().free().size(); ++k) {
      const int i = map_.section().free()[k];
      const double size = rests ? kOfSize * size_of(i) : std::max(std::abs(x_[i]), kSmallEntry * largest);
      most = std::max(most, std::abs(along[static_cast<Eigen::Index>(k)]) / size);
    }
    return most > 0 ? kFirstDistance / most : 0;
  }
  /// ([P_x, P_rho](x + h a) - [P_x, P_rho](x - h a))/(2 h) of the free entries.
  MatrixXd difference(const VectorXd& along, double h) { return (tangents(along, h) - tangents(along, -h)) / (2 * h); }
  /// Times this, but no smaller than `tightest`.
  void change_tolerance(double factor, double tightest = 0) {
    const SolverOptions& s = map_.problem().solver;
    const double rtol = std::max(factor * s.rtol, std::min(tightest, s.rtol));
    map_.set_tolerance(rtol, s.absolute() * rtol / s.rtol);
  }

 private:
  /// What an entry may be like: the mechanism's length, a radian, or these over a period.
  double size_of(int i) const {
    const std::string& unit = map_.section().coordinates()[static_cast<std::size_t>(i)].unit;
    const double size = unit.starts_with("m") ? length_size(*map_.problem().mechanism) : 1;
    return unit.ends_with("/s") ? size / at_.time : size;
  }

  MatrixXd tangents(const VectorXd& along, double h) {
    check_stop();
    const auto& free = map_.section().free();
    VectorXd x = x_;
    for (std::size_t i = 0; i < free.size(); ++i) x[free[i]] += h * along[static_cast<Eigen::Index>(i)];
    map_.onto_section(x, positions_);
    const MapValue v = map_.evaluate(x, positions_, MapDerivatives::all);
    counters += v.counters;
    if (!same_events(v.events, at_.events)) throw OtherEvents();
    MatrixXd r(static_cast<Eigen::Index>(free.size()), static_cast<Eigen::Index>(free.size()) + np_);
    r << v.next_x(free, free), v.next_rho(free, Eigen::seqN(0, np_));
    return r;
  }

  ReturnMap map_;
  VectorXd x_;
  const std::vector<double>& positions_;
  int np_;
  MapValue at_;
};

/// |m|' of what m' is by u^T D.
VectorXd of_modulus(const Leading& lead, const Eigen::RowVectorXcd& u_D, const MatrixXd& by) {
  const VectorXcd of_all = (u_D * by).transpose();
  return (std::conj(lead.m) / std::abs(lead.m) * of_all).real();
}

/// By exact second derivatives; the error is what another tolerance makes of it, a tighter one where that can be run.
void differentiate_exactly(Beside& beside, const Leading& lead, const MatrixXd& by, MultiplierDerivative& r) {
  const auto at = [&](Beside& tolerance) { return of_modulus(lead, tolerance.curvature(lead).transpose(), by); };
  r.by_rho = at(beside);
  Beside tighter = beside, looser = beside;
  tighter.change_tolerance(kTighterSecond, kTightestSecond);
  looser.change_tolerance(kLooser);
  try {
    const VectorXd before = r.by_rho;
    r.by_rho = at(tighter);
    r.error = (r.by_rho - before).cwiseAbs();
    beside.counters = tighter.counters;
  } catch (const SolverError&) {
    r.error = (at(looser) - r.by_rho).cwiseAbs();
    beside.counters = looser.counters;
  }
}

void differentiate_by_differences(Beside& beside, const Leading& lead, const MatrixXd& by, MultiplierDerivative& r) {
  const Eigen::Index k = lead.w.size(), np = by.cols();
  const VectorXd directions[2] = {lead.w.real(), lead.w.imag()};
  double steps[2];
  for (int i = 0; i < 2; ++i) steps[i] = lead.m.imag() == 0 && i == 1 ? 0 : beside.first_step(directions[i]);
  r.by_rho.setZero(np);
  r.error.setConstant(np, std::numeric_limits<double>::infinity());
  // Ridders' tableau of each entry, as method 'differences' has it.
  std::vector<std::vector<VectorXd>> a;
  std::string refused;
  const auto change = [&](double scale) -> VectorXd {
    MatrixXcd D = MatrixXcd::Zero(k, k + np);
    for (int i = 0; i < 2; ++i)
      if (steps[i] > 0) D += std::complex<double>(i == 0, i == 1) * beside.difference(directions[i], scale * steps[i]);
    return of_modulus(lead, lead.u.transpose() * D, by);
  };
  double scale = 1, last_scale = 1;  // of the steps; of the shortest that an answer was taken from
  VectorXd at_last;
  for (int level = 0; level < kLevels; ++level, scale /= 2) {
    VectorXd d;
    try {
      d = change(scale);
    } catch (const SolverError& e) {
      refused = e.what();
      a.clear();
      continue;
    } catch (const OtherEvents&) {
      refused = "other events in another order";
      a.clear();
      continue;
    }
    a.push_back({d});
    const std::size_t n = a.size() - 1;
    double power = 4;
    for (std::size_t j = 1; j <= n; ++j, power *= 4) {
      a[n].push_back((power * a[n][j - 1] - a[n - 1][j - 1]) / (power - 1));
      for (Eigen::Index p = 0; p < np; ++p) {
        const double e = std::max(std::abs(a[n][j][p] - a[n][j - 1][p]), std::abs(a[n][j][p] - a[n - 1][j - 1][p]));
        if (e > r.error[p]) continue;
        r.error[p] = e;
        r.by_rho[p] = a[n][j][p];
        last_scale = scale;
        at_last = d;
      }
    }
    if (n == 0) continue;
    const double size = r.by_rho.cwiseAbs().maxCoeff();
    if (r.error.maxCoeff() <= kConverged * size) break;
    // From here on smaller steps show errors of the runs alone.
    if (n > 2 && (a[n][n] - a[n - 1][n - 1]).cwiseAbs().maxCoeff() > 4 * r.error.maxCoeff()) break;
  }
  if (np > 0 && !r.error.allFinite())
    throw CapabilityError(fmt::format(
        "The largest multiplier has no derivative here that could be computed: beside the cycle the motion is another "
        "one ({}).",
        refused));
  if (np > 0) try {
      beside.change_tolerance(kLooser);
      r.error = r.error.cwiseMax((change(last_scale) - at_last).cwiseAbs());
    } catch (const SolverError&) {  // what cannot be run more loosely is not told
    } catch (const OtherEvents&) {
    }
}

/// No entry is known better than three tenths of the largest error, in the parameters' scales: two tolerances may come
/// near each other by chance, and entries that are zero are sums of others.
void pool(const ParameterSelection& parameters, MultiplierDerivative& d) {
  const VectorXd scale = scales(parameters).head(d.error.size());
  d.error = d.error.cwiseMax(kByChance * scaled_size(d.error, parameters) * scale.cwiseInverse());
}

}  // namespace

MultiplierDerivative multiplier_derivative(const ReturnMap& map, const VectorXd& x,
                                           const std::vector<double>& positions, int parameters) {
  std::optional<Beside> made;
  for (const double tighter : kTighter) try {
      made.emplace(map, x, positions, parameters, tighter);
      break;
    } catch (const SolverError&) {
      if (tighter == 1) throw;
    }
  Beside& beside = *made;
  const Leading lead = leading(beside.state());
  const MatrixXd by = beside.along_branch();
  MultiplierDerivative r;
  if (parameters > 0) try {
      differentiate_exactly(beside, lead, by, r);
      r.counters = beside.counters;
      pool(map.problem().parameters, r);
      return r;
    } catch (const CapabilityError& e) {
      r.not_exact = e.what();
    } catch (const SolverError& e) {
      const std::string all = e.what();  // of which the first sentence says where
      r.not_exact = all.substr(0, all.find(". "));
    }
  differentiate_by_differences(beside, lead, by, r);
  r.counters = beside.counters;
  pool(map.problem().parameters, r);
  return r;
}

std::string multiplier_method(const MultiplierDerivative& d) {
  const double size = d.by_rho.size() > 0 ? d.by_rho.cwiseAbs().maxCoeff() : 0;
  const double error = size > 0 ? d.error.maxCoeff() / size : 0;
  constexpr double kSaid = 1e-6;  // one sentence for all evaluations of an optimization that are within it
  const bool nothing = d.by_rho.size() > 0 && (d.by_rho.cwiseAbs().array() <= d.error.array()).all();
  const std::string known =
      nothing ? fmt::format("zero within its estimated error, {:.0e} at most", d.error.maxCoeff())
              : fmt::format("estimated error {} of the largest entry",
                            error <= kSaid ? fmt::format("below {:.0e}", kSaid) : fmt::format("{:.0e}", error));
  if (d.not_exact.empty()) return "exact second derivatives of the return, " + known;
  return fmt::format(
      "differences of tangents along its eigenvector, extrapolated; {}; second derivatives of the return "
      "are not known here: {}",
      known, d.not_exact);
}

}  // namespace costate
