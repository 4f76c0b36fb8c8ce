#include "costate/candidate/candidate_model.h"

#include <algorithm>
#include <cmath>

#include "costate/candidate/candidate_coordinates.h"
#include "costate/candidate/candidate_maggi.h"
#include "costate/candidate/candidate_second_order.h"
#include "costate/formulation/formulation.h"

namespace costate {

using Kind = Alteration::Kind;

std::vector<CandidateAdjoint::Group> usual_unknowns(const std::string& formulation) {
  const Formulation& f = find_formulation(formulation);
  const bool independent = f.constraints == ConstraintForm::independent;
  const char size = independent ? 'f' : 'n';
  if (f.adjoint_order == 2) return {{"mu", size, true}, {"mu_dot", size, true}, {"mu_z", 'z', true}};
  return {
      {independent ? "mu_y" : "mu_q", size, true}, {independent ? "mu_yd" : "mu_v", size, true}, {"mu_z", 'z', true}};
}

AdjointModel::AdjointModel(std::string formulation) : formulation_(std::move(formulation)) {
  tell_usual_unknowns(usual_unknowns(formulation_));
}

std::unique_ptr<AdjointModel> make_adjoint_model(const std::string& formulation,
                                                 const std::vector<std::string>& groups) {
  const auto has = [&](const char* name) { return std::find(groups.begin(), groups.end(), name) != groups.end(); };
  const Formulation& f = find_formulation(formulation);
  const bool independent = f.constraints == ConstraintForm::independent;
  if (f.adjoint_order == 2 && independent) return std::make_unique<SecondOrderModel<MaggiModel>>(formulation);
  if (f.adjoint_order == 2) return std::make_unique<SecondOrderModel<CoordinateModel>>(formulation);
  if (independent) return std::make_unique<MaggiModel>(formulation, has("mu"));
  return std::make_unique<CoordinateModel>(formulation, has("s1") || has("s2"));
}

void AdjointModel::begin(Section s) const {
  section_ = s;
  position_ = 0;
  shared_ = s == Section::solve;
}

int AdjointModel::next(const char* where, const char* name, bool& fresh) const {
  auto& list = terms_[static_cast<int>(section_)];
  const int i = position_++;
  fresh = i == static_cast<int>(list.size());
  if (fresh) {
    AdjointTerm t;
    t.section = section_;
    t.where = where;
    t.name = name;
    t.parts = {name};
    t.shared = shared_ || all_shared_;
    t.matrix_of_solve = in_matrix_;
    list.push_back(std::move(t));
  }
  return i;
}

double AdjointModel::factor(int term, int part) const {
  double f = 1;
  for (const Alteration& a : alterations_) {
    if (a.section != section_ || a.term != term || a.part != part) continue;
    if (a.kind == Kind::dropped) f = 0;
    if (a.kind == Kind::negated) f = -f;
    if (a.kind == Kind::doubled) f *= 2;
    if (a.kind == Kind::halved) f *= 0.5;
    if (a.kind == Kind::scaled) f *= a.factor;
  }
  return f;
}

AdjointModel::Vector AdjointModel::product(const char* where, const char* name, const char* block,
                                           std::vector<Part> parts, const char* unknown, const Vector& u,
                                           const Blocks& others, const Named& unknowns, bool transposed) const {
  bool fresh = false;
  // Without stabilisation its constituents do not exist.
  std::erase_if(parts, [](const Part& p) { return p.c == 0; });
  const int id = next(where, name, fresh);
  if (fresh) {
    AdjointTerm& t = terms_[static_cast<int>(section_)].back();
    t.block = block;
    t.unknown = unknown;
    t.square = parts[0].B->rows() == parts[0].B->cols() && parts[0].B->rows() > 0;
    t.parts.clear();
    for (const Part& p : parts) {
      t.parts.push_back(p.name);
      t.part_blocks.push_back(p.block);
    }
    for (const auto& o : others) t.other_blocks.push_back(o.first);
    for (const auto& o : unknowns) t.other_unknowns.push_back(o.first);
  }
  const Vector* x = &u;
  bool altered = false;
  for (const Alteration& a : alterations_)
    if (a.section == section_ && a.term == id) {
      altered = true;
      if (a.kind == Kind::other_unknown && a.part < 0) x = unknowns[static_cast<std::size_t>(a.option)].second;
    }
  const auto times = [&](const Matrix& B, const Vector& y, bool t) -> Vector {
    if (t) return B.transpose() * y;
    return B * y;
  };
  Vector sum = Vector::Zero(transposed ? parts[0].B->cols() : parts[0].B->rows());
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const Part& p = parts[k];
    const Matrix* B = p.B;
    double c = p.c;
    bool t = transposed;
    const Vector* y = x;
    if (altered) {
      c *= factor(id, static_cast<int>(k));
      for (const Alteration& a : alterations_) {
        if (a.section != section_ || a.term != id || (a.part >= 0 && a.part != static_cast<int>(k))) continue;
        if (a.kind == Kind::transposed) t = !t;
        if (a.kind == Kind::other_block && a.part >= 0) B = others[static_cast<std::size_t>(a.option)].second;
        if (a.kind == Kind::other_unknown && a.part >= 0) y = unknowns[static_cast<std::size_t>(a.option)].second;
      }
    }
    if (c != 0 && B->size() > 0) sum += c * times(*B, *y, t);
  }
  if (!altered) return sum;
  for (const Alteration& a : alterations_)
    if (a.section == section_ && a.term == id && a.part < 0 && a.kind == Kind::other_block) {
      // The sign with which the whole block stands in the equation.
      const double c = name[0] == '-' ? -1 : 1;
      sum = c * times(*others[static_cast<std::size_t>(a.option)].second, *x, transposed);
    }
  return factor(id, -1) * sum;
}

AdjointModel::Vector AdjointModel::vector(const char* where, const char* name, const Vector& x, double c,
                                          const Named& others) const {
  bool fresh = false;
  const int id = next(where, name, fresh);
  if (fresh)
    for (const auto& o : others) terms_[static_cast<int>(section_)].back().other_unknowns.push_back(o.first);
  const Vector* y = &x;
  for (const Alteration& a : alterations_)
    if (a.section == section_ && a.term == id && a.kind == Kind::other_unknown)
      y = others[static_cast<std::size_t>(a.option)].second;
  return c * factor(id, -1) * *y;
}

AdjointModel::Vector AdjointModel::result(const char* where, const char* name, const Vector& x,
                                          const char* message) const {
  bool fresh = false;
  const bool before = std::exchange(shared_, true);
  const int id = next(where, name, fresh);
  shared_ = before;
  if (fresh) terms_[static_cast<int>(section_)].back().message = message;
  return factor(id, -1) * x;
}

double AdjointModel::coefficient(const char* where, const char* name) const {
  bool fresh = false;
  in_matrix_ = true;
  const int id = next(where, name, fresh);
  in_matrix_ = false;
  return factor(id, -1);
}

}  // namespace costate
