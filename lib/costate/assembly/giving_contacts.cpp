#include "costate/assembly/giving_contacts.h"

#include <Eigen/QR>
#include <algorithm>
#include <set>

#include "costate/mechanism/coordinate_parts.h"

namespace costate {

namespace {
constexpr double kGives = 1e-10;         // of 1/mass
constexpr double kDependentRows = 1e-9;  // as rows of a start are judged
constexpr int kDetermined = 3;           // gaps of a body by the motion alone

/// First rows of contacts that have two rows along the ground.
std::vector<int> spatial_contacts(const Assembly& assembly) {
  std::vector<int> normals;
  const auto& rows = assembly.slidable_rows();
  for (std::size_t i = 1; i < rows.size(); ++i)
    if (rows[i].second == rows[i - 1].second) normals.push_back(rows[i].second);
  return normals;
}

/// Calls visit(row, column, entry of Phi_q).
template <class Visit>
void for_each_entry(const Assembly& assembly, const Visit& visit) {
  const SparsePattern& J = assembly.jacobian();
  for (int j = 0; j < J.cols; ++j)
    for (auto k = J.column_start[static_cast<std::size_t>(j)]; k < J.column_start[static_cast<std::size_t>(j) + 1]; ++k)
      visit(static_cast<int>(J.row[static_cast<std::size_t>(k)]), j, assembly.phi_q[static_cast<std::size_t>(k)]);
}
}  // namespace

GivingContacts::GivingContacts(const Assembly& assembly) {
  const std::vector<int> normals = spatial_contacts(assembly);
  if (normals.size() < 2) return;
  parts_ = coordinate_parts(assembly.mechanism());
  for (const int normal : normals) {
    const SparsePattern& J = assembly.jacobian();
    int column = 0;
    while (J.find(normal, column) < 0) ++column;
    contacts_.push_back({normal, parts_[static_cast<std::size_t>(column)]});
  }
}

bool GivingContacts::is_redundant(const Assembly& assembly, int part) const {
  std::vector<int> row_at(static_cast<std::size_t>(assembly.m()), -1), column_at(parts_.size(), -1);
  int rows = 0, columns = 0;
  for (std::size_t j = 0; j < parts_.size(); ++j)
    if (parts_[j] == part) column_at[j] = columns++;
  const auto of_part = [&](const auto& visit) {
    for_each_entry(assembly, [&](int i, int j, double x) {
      if (x != 0 && assembly.is_there(i) && column_at[static_cast<std::size_t>(j)] >= 0) visit(i, j, x);
    });
  };
  of_part([&](int i, int, double) {
    if (int& at = row_at[static_cast<std::size_t>(i)]; at < 0) at = rows++;
  });
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(columns, rows);
  of_part([&](int i, int j, double x) {
    A(column_at[static_cast<std::size_t>(j)], row_at[static_cast<std::size_t>(i)]) = x;
  });
  for (Eigen::Index i = 0; i < A.cols(); ++i) A.col(i).normalize();
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(A);
  qr.setThreshold(kDependentRows);
  return qr.rank() < A.cols();
}

void GivingContacts::update(const Assembly& assembly) {
  if (contacts_.empty()) return;
  const auto m = static_cast<std::size_t>(assembly.m());
  bool same = there_.size() == m;
  there_.resize(m);
  for (std::size_t i = 0; i < m; ++i) {
    same = same && (there_[i] != 0) == assembly.is_there(static_cast<int>(i));
    there_[i] = assembly.is_there(static_cast<int>(i));
  }
  if (same) return;
  by_row_.assign(m, 0);
  std::set<int> parts;
  for (const SpatialContact& c : contacts_) parts.insert(c.part);
  for (const int part : parts) {
    int closed = 0, stick = 0;
    for (const SpatialContact& c : contacts_) {
      if (c.part != part || !assembly.is_there(c.normal)) continue;
      ++closed;
      if (assembly.is_there(c.normal + 1)) ++stick;
    }
    if ((stick < 2 && closed <= kDetermined) || !is_redundant(assembly, part)) continue;
    for (const SpatialContact& c : contacts_) {
      if (c.part != part || !assembly.is_there(c.normal)) continue;
      double mass = 0;
      for_each_entry(assembly, [&](int i, int j, double x) {
        if (i != c.normal || x == 0 || mass > 0) return;
        if (const auto at = assembly.square().find(j, j); at >= 0) mass = assembly.M[static_cast<std::size_t>(at)];
      });
      const double gives = kGives / (mass > 0 ? mass : 1);
      if (closed > kDetermined) by_row_[static_cast<std::size_t>(c.normal)] = gives;
      for (int k = 1; k < 3; ++k)
        if (assembly.is_there(c.normal + k)) by_row_[static_cast<std::size_t>(c.normal + k)] = gives;
    }
  }
}

}  // namespace costate
