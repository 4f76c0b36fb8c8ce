#include "costate/event/resting_contacts.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "costate/event/spatial_slip.h"
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

/// All changes of the columns' amounts that add up to nothing: orthonormal.
MatrixXd null_space(const MatrixXd& columns) {
  Eigen::ColPivHouseholderQR<MatrixXd> qr(columns.transpose());
  qr.setThreshold(kDepends);
  const MatrixXd Q = qr.householderQ();
  return Q.rightCols(columns.cols() - qr.rank());
}
}  // namespace

RestingContacts::RestingContacts(Assembly& assembly, const std::vector<WatchedContact>& contacts)
    : assembly_(assembly), contacts_(contacts) {
  const auto in_space = [](const WatchedContact& c) { return slides_in_space(c); };
  several_in_space_ = std::count_if(contacts.begin(), contacts.end(), in_space) > 1;
  if (!several_in_space_) return;
  part_of_coordinate_ = coordinate_parts(assembly.mechanism());
  part_of_row_.assign(static_cast<std::size_t>(assembly.m()), -1);
  const SparsePattern& J = assembly.jacobian();
  for (int j = 0; j < J.cols; ++j)
    for (auto k = J.column_start[static_cast<std::size_t>(j)]; k < J.column_start[static_cast<std::size_t>(j) + 1]; ++k)
      part_of_row_[static_cast<std::size_t>(J.row[static_cast<std::size_t>(k)])] =
          part_of_coordinate_[static_cast<std::size_t>(j)];
}

RestingCone RestingContacts::cone_of(const WatchedContact& c, const StateView& s, int first) const {
  const int number = c.contact->sticking_number();
  const bool rough = number >= 0 && rows_of(c, s) > 1;
  return {
      first, rows_of(c, s),
      rough ? assembly_.numbers()[static_cast<std::size_t>(c.force->numbers()[static_cast<std::size_t>(number)])] : 0};
}

const RestingContacts::Held* RestingContacts::find(int contact, const StateView& s, ImpulseBalance& balance,
                                                   bool anyhow) {
  if (!several_in_space_ || !s.lambda) return nullptr;
  const WatchedContact& own = contacts_[static_cast<std::size_t>(contact)];
  if (own.first_row < 0 || !is_closed(own, s)) return nullptr;
  bool in_space = false, within = true;
  modes_.clear();
  for (const WatchedContact& c : contacts_) {
    if (c.part != own.part || c.first_row < 0) continue;
    const bool closed = is_closed(c, s);
    modes_.push_back(!closed ? 0 : slides(c, s) ? 2 : 1);
    in_space = in_space || (closed && slides_in_space(c));
    if (!closed) continue;
    const VectorXd forces = -Eigen::Map<const VectorXd>(s.lambda + c.first_row, c.contact->row_count());
    within = within && margin_of(cone_of(c, s, 0), forces) > 0;
  }
  if (!in_space || (within && !anyhow)) return nullptr;
  places_.clear();
  for (int i = 0; i < assembly_.n(); ++i)
    if (part_of_coordinate_[static_cast<std::size_t>(i)] == own.part) places_.push_back(s.q[i]);
  if (known_.part != own.part || known_.modes != modes_ || known_.places != places_ ||
      known_.numbers != assembly_.numbers()) {
    known_ = {own.part, modes_, places_, assembly_.numbers(), find_groups(own.part, s, balance)};
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

std::vector<RestingContacts::Group> RestingContacts::find_groups(int part, const StateView& s,
                                                                 ImpulseBalance& balance) const {
  balance.prepare(s);
  const SparsePattern& J = assembly_.jacobian();
  const std::vector<double>& values = assembly_.reaction_jacobian();
  // What slides has its friction in the row of its gap, and rows along the ground that hold nothing.
  std::vector<int> column(static_cast<std::size_t>(assembly_.m()), -1), rows;
  for (int i = 0; i < assembly_.m(); ++i) {
    const auto idle = [&](const WatchedContact& c) {
      return c.first_row >= 0 && slides(c, s) && i > c.first_row && i < c.first_row + c.contact->row_count();
    };
    if (part_of_row_[static_cast<std::size_t>(i)] != part || !assembly_.is_there(i) ||
        std::any_of(contacts_.begin(), contacts_.end(), idle))
      continue;
    column[static_cast<std::size_t>(i)] = static_cast<int>(rows.size());
    rows.push_back(i);
  }
  std::vector<int> coordinates;
  for (int j = 0; j < J.cols; ++j)
    if (part_of_coordinate_[static_cast<std::size_t>(j)] == part) coordinates.push_back(j);
  MatrixXd by_row = MatrixXd::Zero(static_cast<Index>(coordinates.size()), static_cast<Index>(rows.size()));
  for (std::size_t j = 0; j < coordinates.size(); ++j) {
    const auto at = static_cast<std::size_t>(coordinates[j]);
    for (auto k = J.column_start[at]; k < J.column_start[at + 1]; ++k)
      if (const int c = column[static_cast<std::size_t>(J.row[static_cast<std::size_t>(k)])]; c >= 0)
        by_row(static_cast<Index>(j), c) = values[static_cast<std::size_t>(k)];
  }
  const MatrixXd all = null_space(by_row);
  if (all.cols() == 0) return {};
  struct Member {
    int contact, first, count;
  };
  std::vector<Member> members;
  for (std::size_t c = 0; c < contacts_.size(); ++c) {
    const WatchedContact& of = contacts_[c];
    if (of.part != part || of.first_row < 0 || !is_closed(of, s)) continue;
    const int first = column[static_cast<std::size_t>(of.first_row)], count = rows_of(of, s);
    if (first >= 0 && all.middleRows(first, count).norm() > kNoPart)
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

}  // namespace costate
