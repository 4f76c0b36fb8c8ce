#include "costate/level/dependent_contacts.h"

#include <Eigen/LU>
#include <algorithm>

#include "costate/element/switched_rows.h"
#include "costate/linear/dense_block.h"
#include "costate/mechanism/coordinate_parts.h"

namespace costate {

namespace {
// A dense analysis of so many rows takes milliseconds; larger parts are left as they are.
constexpr std::size_t kMostOfPart = 300;
// Of rows of length 1 over columns of size 1: less is what errors of the motion leave.
constexpr double kDependent = 1e-6;

bool of_euler_parameters(const Constraint& c, const Mechanism& mechanism) {
  return std::all_of(c.coordinates().begin(), c.coordinates().end(),
                     [&](int j) { return mechanism.coordinates()[static_cast<std::size_t>(j)].unit == "1"; });
}
}  // namespace

DependentContacts::DependentContacts(const Mechanism& mechanism) {
  const std::vector<int> part_of_coordinate = constrained_parts(mechanism);
  const auto& constraints = mechanism.constraints();
  std::map<int, std::vector<std::size_t>> of_part;
  for (std::size_t c = 0; c < constraints.size(); ++c)
    if (!constraints[c]->coordinates().empty())
      of_part[part_of_coordinate[static_cast<std::size_t>(constraints[c]->coordinates().front())]].push_back(c);
  for (const auto& [number, own] : of_part) {
    Part part;
    bool joints = false;
    const std::vector<int>* on = nullptr;  // what the first contact is on
    for (const std::size_t c : own) {
      const Constraint& constraint = *constraints[c];
      if (has_switched_rows(constraint)) {
        part.contacts.emplace_back();
        if (!on) on = &constraint.coordinates();
        joints = joints || constraint.coordinates() != *on;
      } else {
        joints = joints || !of_euler_parameters(constraint, mechanism);
      }
      for (int i = 0; i < constraint.rows(); ++i) {
        if (has_switched_rows(constraint)) part.contacts.back().push_back(static_cast<int>(part.rows.size()));
        part.rows.push_back(mechanism.row_offsets()[c] + i);
      }
    }
    if (part.contacts.size() < 2 || !joints || part.rows.size() > kMostOfPart) continue;
    for (int j = 0; j < mechanism.coordinate_count(); ++j)
      if (part_of_coordinate[static_cast<std::size_t>(j)] == number) part.coordinates.push_back(j);
    places_.resize(static_cast<std::size_t>(mechanism.row_count()));
    for (std::size_t k = 0; k < part.rows.size(); ++k)
      places_[static_cast<std::size_t>(part.rows[k])] = {static_cast<int>(parts_.size()), static_cast<int>(k)};
    parts_.push_back(std::move(part));
  }
}

// Asked of all rows at each evaluation: joints' are there always, and are passed by.
bool DependentContacts::depends(int i, const Assembly& assembly) const {
  if (part_of(i) < 0) return false;
  const Part& part = parts_[static_cast<std::size_t>(part_of(i))];
  const int own = places_[static_cast<std::size_t>(i)].at;
  bool of_contact = false, same = !part.there.empty();
  for (const std::vector<int>& contact : part.contacts)
    for (const int at : contact) {
      const auto k = static_cast<std::size_t>(at);
      of_contact = of_contact || at == own;
      same = same && (part.there[k] != 0) == assembly.is_there(part.rows[k]);
    }
  if (!of_contact) return false;
  if (!same) {
    std::vector<char> there(part.rows.size());
    for (std::size_t k = 0; k < there.size(); ++k) there[k] = assembly.is_there(part.rows[k]) ? 1 : 0;
    auto known = part.known.find(there);
    if (known == part.known.end()) {
      std::vector<char> depend = find(part, assembly);
      if (depend.empty()) return false;
      known = part.known.emplace(there, std::move(depend)).first;
    }
    part.there = std::move(there);
    part.depend = known->second;
  }
  return part.depend[static_cast<std::size_t>(own)] != 0;
}

// Of the kernel N of the transposed rows that are there, those rows depend whose entries are not zero. A contact whose
// part of N no other contact's goes with shares with joints alone.
std::vector<char> DependentContacts::find(const Part& part, const Assembly& assembly) {
  const auto m = static_cast<Eigen::Index>(part.rows.size()), n = static_cast<Eigen::Index>(part.coordinates.size());
  Eigen::MatrixXd J = dense_block(assembly.jacobian(), assembly.phi_q.data(), part.rows, part.coordinates);
  for (Eigen::Index j = 0; j < n; ++j)
    if (const double size = J.col(j).cwiseAbs().maxCoeff(); size > 0) J.col(j) /= size;
  std::vector<Eigen::Index> there;
  std::vector<Eigen::Index> place(static_cast<std::size_t>(m), -1);
  for (Eigen::Index i = 0; i < m; ++i) {
    if (!assembly.is_there(part.rows[static_cast<std::size_t>(i)])) continue;
    const double length = J.row(i).norm();
    if (length == 0) return {};  // just switched on: its Jacobian is not there yet
    J.row(i) /= length;
    place[static_cast<std::size_t>(i)] = static_cast<Eigen::Index>(there.size());
    there.push_back(i);
  }
  std::vector<char> depend(part.rows.size(), 0);
  if (there.empty()) return depend;
  Eigen::FullPivLU<Eigen::MatrixXd> lu;
  lu.setThreshold(kDependent);
  lu.compute(J(there, Eigen::all).transpose());
  if (lu.dimensionOfKernel() == 0) return depend;
  const Eigen::MatrixXd N = lu.kernel();
  std::vector<std::vector<Eigen::Index>> of_contacts;
  std::vector<Eigen::Index> all;
  for (const auto& contact : part.contacts) {
    of_contacts.emplace_back();
    for (const int at : contact)
      if (const Eigen::Index k = place[static_cast<std::size_t>(at)]; k >= 0) of_contacts.back().push_back(k);
    all.insert(all.end(), of_contacts.back().begin(), of_contacts.back().end());
  }
  const auto rank_of = [&](const std::vector<Eigen::Index>& rows) -> Eigen::Index {
    if (rows.empty()) return 0;
    Eigen::FullPivLU<Eigen::MatrixXd> of;
    of.setThreshold(kDependent);
    return of.compute(N(rows, Eigen::all)).rank();
  };
  const Eigen::Index rank = rank_of(all);
  for (const auto& contact : of_contacts) {
    std::vector<Eigen::Index> others;
    for (const Eigen::Index k : all)
      if (std::find(contact.begin(), contact.end(), k) == contact.end()) others.push_back(k);
    if (rank_of(others) < rank) return depend;
  }
  const double size = N.cwiseAbs().maxCoeff();
  for (const Eigen::Index k : all)
    depend[static_cast<std::size_t>(there[static_cast<std::size_t>(k)])] =
        N.row(k).cwiseAbs().maxCoeff() > kDependent * size ? 1 : 0;
  return depend;
}

}  // namespace costate
