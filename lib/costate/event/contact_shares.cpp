#include "costate/event/contact_shares.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "costate/base/derivatives_wanted.h"
#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/event/contact_gap.h"
#include "costate/event/spatial_slip.h"
#include "costate/linear/dense_block.h"
#include "costate/mechanism/coordinate_parts.h"

namespace costate {

namespace {
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Of unit changes of forces: no part of one.
constexpr double kNoPart = 1e-9;
// Rows that depend on others but for this much of them depend on them.
constexpr double kDepends = 1e-10;
// Of the acceleration by one share of friction: less is left by others of directions that are one, and that errors
// turn; of errors that turn by this nothing is said.
constexpr double kTellsApart = 1e-5, kOfErrors = 30, kTellsAll = 0.1;
// Of what a share would do to the largest inertia: less is what rows that hold a body give.
constexpr double kHeldByOthers = 1e-6;

/// The way in which a contact slides, a unit vector, of the plane by its state.
VectorXd way_of(const WatchedContact& c, const StateView& s, const Assembly& assembly) {
  if (!slides_in_space(c)) return VectorXd::Constant(1, s.z[c.sliding_state]);
  const VectorXd w = slip_of(c, s, assembly);
  return w.norm() > 0 ? VectorXd(w.normalized()) : w;
}
/// Its rows along the ground.
std::vector<int> rows_along(const WatchedContact& c) {
  std::vector<int> rows;
  for (int k = 1; k < c.contact->row_count(); ++k) rows.push_back(c.first_row + k);
  return rows;
}

/// All changes of the columns' amounts that add up to nothing: orthonormal.
MatrixXd null_space(const MatrixXd& columns) {
  Eigen::ColPivHouseholderQR<MatrixXd> qr(columns.transpose());
  qr.setThreshold(kDepends);
  const MatrixXd Q = qr.householderQ();
  return Q.rightCols(columns.cols() - qr.rank());
}
}  // namespace

ContactShares::ContactShares(Assembly& assembly, const std::vector<WatchedContact>& contacts)
    : assembly_(assembly), contacts_(contacts) {
  const auto in_space = [](const WatchedContact& c) { return slides_in_space(c); };
  several_in_space_ = std::count_if(contacts.begin(), contacts.end(), in_space) > 1;
  if (contacts.size() < 2) return;
  part_of_coordinate_ = coordinate_parts(assembly.mechanism());
  part_of_row_.assign(static_cast<std::size_t>(assembly.m()), -1);
  const SparsePattern& J = assembly.jacobian();
  for (int j = 0; j < J.cols; ++j)
    for (auto k = J.column_start[static_cast<std::size_t>(j)]; k < J.column_start[static_cast<std::size_t>(j) + 1]; ++k)
      part_of_row_[static_cast<std::size_t>(J.row[static_cast<std::size_t>(k)])] =
          part_of_coordinate_[static_cast<std::size_t>(j)];
}

RestingCone ContactShares::cone_of(const WatchedContact& c, const StateView& s, int first) const {
  const int count = rows_of(c, s);
  return {first, count, count > 1 ? contact_number(c, c.contact->sticking_number(), assembly_) : 0};
}

const ContactShares::Held* ContactShares::find(int contact, const StateView& s, ImpulseBalance& balance, double error,
                                               bool anyhow) {
  if (!several_in_space_ || !s.lambda) return nullptr;
  const WatchedContact& own = contacts_[static_cast<std::size_t>(contact)];
  if (own.first_row < 0 || !is_closed(own, s)) return nullptr;
  bool in_space = false, within = true;
  for (const WatchedContact& c : contacts_) {
    if (c.part != own.part || c.first_row < 0 || !is_closed(c, s)) continue;
    in_space = in_space || slides_in_space(c);
    const VectorXd forces = -Eigen::Map<const VectorXd>(s.lambda + c.first_row, c.contact->row_count());
    within = within && margin_of(cone_of(c, s, 0), forces) > 0;
  }
  if (!in_space || (within && !anyhow)) return nullptr;
  std::vector<char> modes = modes_of(own.part, s);
  std::vector<double> places;
  for (const int j : coordinates_of(own.part)) places.push_back(s.q[j]);
  for (const WatchedContact& c : contacts_)
    if (c.part == own.part && c.first_row >= 0 && is_closed(c, s) && slides(c, s)) {
      const VectorXd way = way_of(c, s, assembly_);
      places.insert(places.end(), way.begin(), way.end());
    }
  if (known_.part != own.part || known_.modes != modes || known_.places != places ||
      known_.numbers != assembly_.numbers()) {
    known_ = {own.part, std::move(modes), std::move(places), assembly_.numbers(),
              find_groups(own.part, s, balance, error)};
    held_.reset();
  }
  for (const Group& g : known_.groups) {
    const auto at = std::find(g.contacts.begin(), g.contacts.end(), contact);
    if (at == g.contacts.end()) continue;
    VectorXd forces(static_cast<Index>(g.rows.size()));
    for (Index i = 0; i < forces.size(); ++i) forces[i] = -s.lambda[g.rows[static_cast<std::size_t>(i)]];
    if (!(held_ && held_->group == &g && shared_ == forces)) {
      shared_ = forces;
      auto shares = best_shares(g.cones, forces, g.moves_nothing);
      if (!shares) return nullptr;
      held_ = {&g, 0, *std::move(shares)};
    }
    held_->own = static_cast<std::size_t>(at - g.contacts.begin());
    return &*held_;
  }
  return nullptr;
}

std::vector<char> ContactShares::modes_of(int part, const StateView& s) const {
  std::vector<char> modes;
  for (const WatchedContact& c : contacts_)
    if (c.part == part && c.first_row >= 0) modes.push_back(!is_closed(c, s) ? 0 : slides(c, s) ? 2 : 1);
  return modes;
}

std::vector<int> ContactShares::rows_of_part(int part, const StateView& s) const {
  std::vector<int> rows;
  for (int i = 0; i < assembly_.m(); ++i) {
    const auto goes_along = [&](const WatchedContact& c) {
      return c.first_row >= 0 && slides(c, s) && i > c.first_row && i < c.first_row + c.contact->row_count();
    };
    if (part_of_row_[static_cast<std::size_t>(i)] == part && assembly_.is_there(i) &&
        std::none_of(contacts_.begin(), contacts_.end(), goes_along))
      rows.push_back(i);
  }
  return rows;
}

std::vector<int> ContactShares::coordinates_of(int part) const {
  std::vector<int> coordinates;
  for (int j = 0; j < assembly_.n(); ++j)
    if (part_of_coordinate_[static_cast<std::size_t>(j)] == part) coordinates.push_back(j);
  return coordinates;
}

// lambda_k = -mu lambda_n sigma_k of the rows along the ground.
MatrixXd ContactShares::friction_of(int part, const StateView& s, const std::vector<int>& rows) const {
  const std::vector<int> coordinates = coordinates_of(part);
  MatrixXd friction = MatrixXd::Zero(static_cast<Index>(coordinates.size()), static_cast<Index>(rows.size()));
  for (const WatchedContact& c : contacts_)
    if (const auto at = std::find(rows.begin(), rows.end(), c.first_row);
        at != rows.end() && is_closed(c, s) && slides(c, s))
      friction.col(at - rows.begin()) -=
          contact_number(c, c.contact->friction_number(), assembly_) *
          dense_block(assembly_.jacobian(), assembly_.reaction_jacobian().data(), rows_along(c), coordinates)
              .transpose() *
          way_of(c, s, assembly_);
  return friction;
}

MatrixXd ContactShares::accelerations(const MatrixXd& forces, const std::vector<int>& coordinates,
                                      ImpulseBalance& balance) const {
  MatrixXd a = MatrixXd::Zero(assembly_.n(), forces.cols());
  std::vector<double> b;
  for (Index i = 0; i < forces.cols(); ++i) {
    if (forces.col(i).isZero(0)) continue;
    b.assign(static_cast<std::size_t>(assembly_.n() + assembly_.m()), 0);
    for (std::size_t j = 0; j < coordinates.size(); ++j)
      b[static_cast<std::size_t>(coordinates[j])] = forces(static_cast<Index>(j), i);
    balance.solve(b.data());
    a.col(i) = Eigen::Map<const VectorXd>(b.data(), assembly_.n());
  }
  return a;
}

// Changes n of shares do nothing where (Phi_q^T + D^T) n = 0. Directions that errors turn tell no shares apart: those
// with Phi_q^T n = 0 whose friction D^T n accelerates by no more than that do nothing, with what goes with them in
// other rows, d orthogonal to them, (Phi_q^T + D^T)(n + d) = 0.
MatrixXd ContactShares::idle_changes(int part, const StateView& s, const std::vector<int>& rows,
                                     ImpulseBalance& balance, double error) const {
  const std::vector<int> coordinates = coordinates_of(part);
  const MatrixXd by_row = dense_block(assembly_.jacobian(), assembly_.phi_q.data(), rows, coordinates).transpose(),
                 friction = friction_of(part, s, rows);
  const MatrixXd all = null_space(by_row + friction);
  if (friction.isZero(0)) return all;
  MatrixXd idle = null_space(by_row);
  if (idle.cols() <= all.cols()) return all;
  double slowest = std::numeric_limits<double>::infinity();
  for (const WatchedContact& c : contacts_)
    if (c.part == part && c.first_row >= 0 && is_closed(c, s) && slides(c, s))
      slowest = std::min(slowest, slip_of(c, s, assembly_).norm());
  if (const double tells_apart = kTellsApart + kOfErrors * error / slowest; tells_apart < kTellsAll) {
    const MatrixXd each = accelerations(friction, coordinates, balance);
    const Eigen::JacobiSVD<MatrixXd> svd(each * idle, Eigen::ComputeFullV);
    const double alone = each.colwise().norm().maxCoeff();
    Index told = 0;
    while (told < svd.singularValues().size() && svd.singularValues()[told] > tells_apart * alone) ++told;
    if (idle.cols() - told <= all.cols()) return all;
    idle *= svd.matrixV().rightCols(idle.cols() - told);
  }
  const MatrixXd others = null_space(idle.transpose()), sum = (by_row + friction) * others;
  idle += others * sum.completeOrthogonalDecomposition().solve(-friction * idle);
  const Eigen::HouseholderQR<MatrixXd> qr(idle);
  return qr.householderQ() * MatrixXd::Identity(idle.rows(), idle.cols());
}

std::vector<ContactShares::Group> ContactShares::find_groups(int part, const StateView& s, ImpulseBalance& balance,
                                                             double error) const {
  balance.prepare(s);
  const std::vector<int> rows = rows_of_part(part, s);
  const MatrixXd all = idle_changes(part, s, rows, balance, error);
  if (all.cols() == 0) return {};
  struct Member {
    int contact, first, count;
  };
  std::vector<Member> members;
  for (std::size_t c = 0; c < contacts_.size(); ++c) {
    const WatchedContact& of = contacts_[c];
    if (of.part != part || of.first_row < 0 || !is_closed(of, s)) continue;
    const auto at = std::find(rows.begin(), rows.end(), of.first_row);
    const int first = static_cast<int>(at - rows.begin()), count = rows_of(of, s);
    if (at != rows.end() && all.middleRows(first, count).norm() > kNoPart)
      members.push_back({static_cast<int>(c), first, count});
  }
  // Those whose shares change together.
  const auto linked = [&](const Member& a, const Member& b) {
    return (all.middleRows(a.first, a.count) * all.middleRows(b.first, b.count).transpose()).norm() > kNoPart;
  };
  std::vector<std::size_t> group_of(members.size());
  for (std::size_t a = 0; a < members.size(); ++a) {
    group_of[a] = a;
    for (std::size_t b = 0; b < a; ++b)
      if (linked(members[a], members[b]))
        for (std::size_t c = 0, from = group_of[b]; c <= a; ++c)
          if (group_of[c] == from) group_of[c] = group_of[a];
  }
  std::vector<Group> groups;
  for (std::size_t a = 0; a < members.size(); ++a) {
    Group g;
    bool in_space = false;
    std::vector<int> own;
    for (std::size_t b = 0; b < members.size(); ++b) {
      if (group_of[b] != a) continue;
      const WatchedContact& c = contacts_[static_cast<std::size_t>(members[b].contact)];
      in_space = in_space || slides_in_space(c);
      g.contacts.push_back(members[b].contact);
      g.cones.push_back(cone_of(c, s, static_cast<int>(own.size())));
      for (int r = 0; r < members[b].count; ++r) {
        own.push_back(members[b].first + r);
        g.rows.push_back(c.first_row + r);
      }
    }
    if (!in_space) continue;
    const Eigen::JacobiSVD<MatrixXd> svd(all(own, Eigen::all), Eigen::ComputeThinU);
    Index rank = 0;
    while (rank < svd.singularValues().size() && svd.singularValues()[rank] > kNoPart) ++rank;
    g.moves_nothing = svd.matrixU().leftCols(rank);
    groups.push_back(std::move(g));
  }
  return groups;
}

// With changes of shares n that do nothing by normal forces, Phi_q^T n = 0, friction that slides does what the
// friction's part D of the reactions' Jacobian makes of them, D^T n: a, as the constraints leave it.
void ContactShares::require_determined(const StateView& s, ImpulseBalance& balance, double error, int only) {
  if (contacts_.size() < 2) return;
  std::vector<int> parts;
  for (const WatchedContact& c : contacts_)
    if (c.first_row >= 0 && is_closed(c, s) && slides(c, s) && (only < 0 || c.part == only) &&
        std::find(parts.begin(), parts.end(), c.part) == parts.end())
      parts.push_back(c.part);
  for (const int part : parts) {
    std::vector<char> modes = modes_of(part, s);
    std::vector<const WatchedContact*> sliding;
    double slowest = std::numeric_limits<double>::infinity();
    for (const WatchedContact& c : contacts_) {
      if (c.part != part || c.first_row < 0 || !is_closed(c, s) || !slides(c, s)) continue;
      sliding.push_back(&c);
      // What has just begun has its direction by its offset, without an error.
      const double speed = slip_of(c, s, assembly_).norm();
      if (only < 0 || speed > 2 * kSlidingOffset) slowest = std::min(slowest, speed);
    }
    const double tells_apart = kTellsApart + kOfErrors * error / slowest;
    if (modes.size() < 2 || !(tells_apart < kTellsAll)) continue;
    const auto known = depend_.find({part, modes});
    if (known != depend_.end() && !known->second) continue;
    balance.prepare(s);
    const std::vector<int> rows = rows_of_part(part, s), coordinates = coordinates_of(part);
    const MatrixXd none =
        null_space(dense_block(assembly_.jacobian(), assembly_.phi_q.data(), rows, coordinates).transpose());
    depend_[{part, std::move(modes)}] = none.cols() > 0;
    if (none.cols() == 0) continue;
    const MatrixXd friction = friction_of(part, s, rows);
    // What each share of one newton does by itself.
    const MatrixXd each = accelerations(friction, coordinates, balance);
    const double alone = each.colwise().norm().maxCoeff();
    double inertia = 0;
    for (const int j : coordinates)
      if (const auto at = assembly_.square().find(j, j); at >= 0)
        inertia = std::max(inertia, std::abs(assembly_.M[static_cast<std::size_t>(at)]));
    if (!(alone * inertia > kHeldByOthers * friction.cwiseAbs().maxCoeff())) continue;
    if (!((each * none).norm() > tells_apart * alone)) {
      if (DerivativesWanted::by_anybody()) tell_kinks(sliding, rows, each, none);
      continue;
    }
    std::vector<std::string> names;
    for (const WatchedContact* c : sliding) names.push_back(c->force->path());
    throw SolverError(fmt::format(
        "At t = {:.9g} s more contacts hold bodies than determine who bears how much of their weight, and those that "
        "slide ({}) do so in different directions, or with different friction: the motion is not determined. Let fewer "
        "contacts hold one body (three in space, two in the plane), or take kind = \"compliant\".",
        s.t, fmt::join(names, ", ")));
  }
}

// By a coefficient of friction mu_i of its own what share i does changes by each_i/mu_i.
void ContactShares::tell_kinks(const std::vector<const WatchedContact*>& sliding, const std::vector<int>& rows,
                               const MatrixXd& each, const MatrixXd& none) const {
  bool turn = false;
  std::vector<std::string> unlike, names;
  const double size = each.norm();
  for (const Parameter& p : assembly_.parameters().parameters) {
    MatrixXd change = MatrixXd::Zero(each.rows(), none.cols());
    for (const WatchedContact* c : sliding) {
      const Index i = std::find(rows.begin(), rows.end(), c->first_row) - rows.begin();
      const int number = c->force->numbers()[static_cast<std::size_t>(c->contact->friction_number())];
      const double mu = contact_number(*c, c->contact->friction_number(), assembly_);
      for (const auto& [bound, factor] : p.bindings)
        if (bound == number && mu > 0) change += factor / mu * p.scale * each.col(i) * none.row(i);
    }
    if (change.norm() > kTellsApart * size) unlike.push_back(p.name);
  }
  for (const WatchedContact* c : sliding) {
    names.push_back(c->force->path());
    turn = turn || slides_in_space(*c);
  }
  if (turn) unlike.emplace_back("what turns a body");
  if (unlike.empty()) return;
  notice(fmt::format(
      "Contacts that slide ({}) are more than determine who bears how much of a weight. They do so alike, so "
      "that the motion is determined; by parameters that make them unlike ({}) psi has a kink, and "
      "derivatives are those with the shares that the formulation chooses.",
      fmt::join(names, ", "), fmt::join(unlike, ", ")));
}

}  // namespace costate
