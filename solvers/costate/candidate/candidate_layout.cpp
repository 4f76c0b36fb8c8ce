#include "costate/candidate/candidate_layout.h"

#include <fmt/format.h>

#include <algorithm>

#include "costate/base/error.h"

namespace costate {

namespace {

std::string where(const std::string& group, bool differential) {
  if (differential) return "the equation of " + group + "'";
  if (group == "mu") return "the definition of P";
  if (group == "nu") return "the constraint on mu";
  if (group == "kappa") return "the constraint on mu_q";
  return "the algebraic equation of " + group;
}

}  // namespace

std::unique_ptr<CandidateLayout> CandidateLayout::make(const CandidateAdjoint& candidate, const AdjointBlocks& sizes,
                                                       std::string& why) {
  const auto groups = candidate.unknowns();
  const auto find = [&](const std::string& name) {
    for (std::size_t i = 0; i < groups.size(); ++i)
      if (groups[i].name == name) return static_cast<int>(i);
    return -1;
  };
  auto layout = std::make_unique<CandidateLayout>();
  std::vector<std::string> names;
  for (const auto& g : groups) names.push_back(g.name);
  layout->model_ = make_adjoint_model(candidate.formulation(), names);
  std::vector<int> first;
  for (const auto& g : groups) {
    first.push_back(layout->candidate_size_);
    layout->candidate_size_ += g.count(sizes);
  }
  std::vector<char> used(groups.size(), 0);
  std::string known;
  for (const auto& g : layout->model_->unknowns()) {
    known += (known.empty() ? "" : ", ") + g.name;
    const int count = g.count(sizes);
    int at = find(g.name);
    if (at < 0 && (g.name == "mu_v" || g.name == "mu_yd")) at = find("P");
    if (at < 0 && g.name == "P" && g.size == 'f') at = find("mu_yd");
    if (at < 0 && g.name != "mu_z") {
      why = fmt::format("there is no group of unknowns '{}'", g.name);
    } else if (at >= 0 && (groups[static_cast<std::size_t>(at)].size != g.size ||
                           groups[static_cast<std::size_t>(at)].differential != g.differential)) {
      why = fmt::format("the group '{}' should have size '{}' and be {}", g.name, g.size,
                        g.differential ? "differential" : "algebraic");
    }
    if (at >= 0) used[static_cast<std::size_t>(at)] = 1;
    if (count == 0) continue;
    layout->blocks_.push_back({g.name, where(g.name, g.differential), layout->size_, count, g.differential, at >= 0});
    for (int i = 0; i < count; ++i) layout->place_.push_back(at < 0 ? -1 : first[static_cast<std::size_t>(at)] + i);
    layout->size_ += count;
  }
  for (std::size_t i = 0; i < groups.size(); ++i)
    if (!used[i] && groups[i].count(sizes) > 0)
      why = fmt::format("the group of unknowns '{}' is not known here", groups[i].name);
  if (!why.empty()) {
    why = fmt::format("No comparison term by term: {}. For formulation '{}' that needs the groups {}.", why,
                      candidate.formulation(), known);
    return nullptr;
  }
  for (std::size_t k = 0; k < layout->blocks_.size(); ++k)
    if (!layout->blocks_[k].differential) layout->order_.push_back(static_cast<int>(k));
  return layout;
}

Eigen::VectorXd CandidateLayout::to_candidate(const Eigen::VectorXd& x) const {
  Eigen::VectorXd y = Eigen::VectorXd::Zero(candidate_size_);
  for (int i = 0; i < size_; ++i)
    if (place_[static_cast<std::size_t>(i)] >= 0) y[place_[static_cast<std::size_t>(i)]] = x[i];
  return y;
}

Eigen::VectorXd CandidateLayout::from_candidate(const Eigen::VectorXd& y) const {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(size_);
  for (int i = 0; i < size_; ++i)
    if (place_[static_cast<std::size_t>(i)] >= 0) x[i] = y[place_[static_cast<std::size_t>(i)]];
  return x;
}

Eigen::MatrixXd CandidateLayout::flow(const CandidateAdjoint& candidate, const AdjointBlocks& b,
                                      const Eigen::MatrixXd& x) const {
  const CandidateMatrices s = candidate_matrices(candidate, b, candidate_size_);
  std::vector<int> differential, algebraic, columns;
  for (int i = 0; i < candidate_size_; ++i)
    (s.E.row(i).cwiseAbs().maxCoeff() > 0 ? differential : algebraic).push_back(i);
  for (const Block& k : blocks_)
    for (int i = 0; k.differential && k.present && i < k.count; ++i)
      columns.push_back(place_[static_cast<std::size_t>(k.first + i)]);
  if (differential.size() != columns.size())
    throw Error(fmt::format("{} equations hold derivatives, for {} differential unknowns", differential.size(),
                            columns.size()));
  const auto D = static_cast<Eigen::Index>(columns.size());
  Eigen::MatrixXd E(D, D);
  double rest = s.E.cwiseAbs().sum();
  for (Eigen::Index i = 0; i < D; ++i)
    for (Eigen::Index j = 0; j < D; ++j) {
      E(i, j) = s.E(differential[static_cast<std::size_t>(i)], columns[static_cast<std::size_t>(j)]);
      rest -= std::abs(E(i, j));
    }
  if (rest > 1e-12 * s.E.cwiseAbs().sum()) throw Error("derivatives of algebraic unknowns occur");
  Eigen::MatrixXd y(candidate_size_, x.cols());
  for (Eigen::Index j = 0; j < x.cols(); ++j) y.col(j) = s.b + s.A * to_candidate(x.col(j));
  Eigen::MatrixXd right(D, x.cols());
  for (Eigen::Index i = 0; i < D; ++i) right.row(i) = -y.row(differential[static_cast<std::size_t>(i)]);
  const Eigen::FullPivLU<Eigen::MatrixXd> lu(E);
  if (D > 0 && !lu.isInvertible()) throw Error("the derivatives of the differential unknowns are not determined");
  const Eigen::MatrixXd rates = D > 0 ? Eigen::MatrixXd(lu.solve(right)) : right;
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(size_, x.cols());
  Eigen::Index next = 0;
  std::size_t row = 0;
  for (const Block& k : blocks_)
    if (k.differential && k.present) {
      out.middleRows(k.first, k.count) = rates.middleRows(next, k.count);
      next += k.count;
    }
  for (const Block& k : blocks_)  // as they come; see ordered()
    for (int i = 0; !k.differential && i < k.count; ++i) {
      if (row >= algebraic.size()) throw Error("there are fewer algebraic equations than algebraic unknowns");
      out.row(k.first + i) = y.row(algebraic[row++]);
    }
  return out;
}

Eigen::MatrixXd CandidateLayout::ordered(const Eigen::MatrixXd& flow) const {
  Eigen::MatrixXd out = flow;
  int from = -1;
  for (const Block& k : blocks_)
    if (!k.differential && from < 0) from = k.first;
  for (const int k : order_) {
    const Block& to = blocks_[static_cast<std::size_t>(k)];
    out.middleRows(to.first, to.count) = flow.middleRows(from, to.count);
    from += to.count;
  }
  return out;
}

void CandidateLayout::choose_order(const std::vector<Eigen::MatrixXd>& flow,
                                   const std::vector<Eigen::MatrixXd>& exact) {
  if (order_.size() < 2) return;
  std::vector<int> best = order_, trial = order_;
  std::sort(trial.begin(), trial.end());
  double least = HUGE_VAL;
  do {
    order_ = trial;
    double misfit = 0;
    for (const int k : trial) {
      const Block& at = blocks_[static_cast<std::size_t>(k)];
      double minus = 0, plus = 0, size = 0;
      for (std::size_t i = 0; i < flow.size(); ++i) {
        const Eigen::MatrixXd y = ordered(flow[i]).middleRows(at.first, at.count),
                              x = exact[i].middleRows(at.first, at.count);
        minus += (y - x).squaredNorm();
        plus += (y + x).squaredNorm();
        size += x.squaredNorm() + y.squaredNorm();
      }
      if (size > 0) misfit += std::min(minus, plus) / size;
    }
    if (misfit < least - 1e-12) {
      least = misfit;
      best = trial;
    }
  } while (std::next_permutation(trial.begin(), trial.end()));
  order_ = best;
}

}  // namespace costate
