#include "costate/candidate/candidate_search.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/candidate/candidate_hypotheses.h"
#include "costate/candidate/candidate_messages.h"

namespace costate {

namespace {

using Kind = Alteration::Kind;
using Eigen::VectorXd;

constexpr int kUnexplained = 50;

bool finite(const std::vector<VectorXd>& x) {
  for (const auto& y : x)
    if (!y.allFinite()) return false;
  return true;
}

struct Explanation {
  int cost = 0;
  double unlikely = 0;
  std::vector<int> hypotheses;           // of the best one
  std::vector<std::vector<int>> others;  // further ones that explain equally well
};

class Search {
 public:
  Search(const AdjointModel& model, const CandidateComparison& c) : c_(c) {
    base_ = c_.model({});
    for (const auto section : c_.sections) {
      const auto& terms = model.terms(section);
      for (std::size_t i = 0; i < terms.size(); ++i)
        add_hypotheses(terms[i], static_cast<int>(i), c_.where, hypotheses_);
    }
    values_.resize(hypotheses_.size());
    for (std::size_t h = 0; h < hypotheses_.size(); ++h) values_[h] = c_.model({hypotheses_[h].a});
    weigh();
  }

  CandidateDiagnosis run() {
    CandidateDiagnosis d;
    find_blind_spots(d);
    choose_signs();
    Option best = option({}, kUnexplained * 100, 3);
    std::vector<Option> equal;
    if (best.cost > 0) {
      std::vector<int> shared;
      for (std::size_t h = 0; h < hypotheses_.size(); ++h)
        if (hypotheses_[h].block < 0 && finite(values_[h])) shared.push_back(static_cast<int>(h));
      const auto consider = [&](const std::vector<int>& inner, int depth) {
        Option o = option(inner, best.cost, depth);
        if (o.cost < best.cost || (o.cost == best.cost && o.unlikely < best.unlikely)) std::swap(o, best);
        if (o.cost <= best.cost) equal.push_back(o);
      };
      for (const int i : shared) consider({i}, 2);
      if (best.cost > 2)
        for (std::size_t i = 0; i < shared.size(); ++i)
          for (std::size_t j = i + 1; j < shared.size(); ++j)
            if (!conflict(at(shared[i]).a, at(shared[j]).a)) consider({shared[i], shared[j]}, 1);
    }
    report(best, equal, d);
    return d;
  }

 private:
  struct Option {
    std::vector<int> inner;
    std::vector<Explanation> blocks;
    int cost = 0;
    double unlikely = 0;
  };

  const CandidateHypothesis& at(int h) const { return hypotheses_[static_cast<std::size_t>(h)]; }

  /// Rows count by the largest of the terms that stand in them, over all samples.
  void weigh() {
    for (std::size_t k = 0; k < c_.where.size(); ++k) {
      const auto rows = static_cast<Eigen::Index>(c_.components[k].size());
      VectorXd size = VectorXd::Zero(rows);
      const auto take = [&](const VectorXd& x) {
        for (Eigen::Index i = 0; i < x.size(); ++i)
          if (std::isfinite(x[i])) size[i % rows] = std::max(size[i % rows], std::abs(x[i]));
      };
      take(base_[k]);
      take(c_.candidate[k]);
      for (std::size_t h = 0; h < hypotheses_.size(); ++h)
        if (hypotheses_[h].block == static_cast<int>(k) && hypotheses_[h].a.kind == Kind::dropped)
          take(values_[h][k] - base_[k]);
      VectorXd w(base_[k].size());
      // Rows much smaller than the others of their equation are rounding of it.
      const double floor = rows > 0 ? 1e-8 * size.maxCoeff() : 0;
      for (Eigen::Index i = 0; i < w.size(); ++i) w[i] = size[i % rows] > 0 ? 1 / std::max(size[i % rows], floor) : 0;
      weight_.push_back(w);
    }
    sign_.assign(c_.where.size(), 1.0);
  }

  VectorXd delta(int h, std::size_t k) const {
    return (values_[static_cast<std::size_t>(h)][k] - base_[k]).cwiseProduct(weight_[k]);
  }

  void find_blind_spots(CandidateDiagnosis& d) {
    std::vector<const AdjointTerm*> gone;
    for (int h = 0; h < static_cast<int>(hypotheses_.size()); ++h) {
      const CandidateHypothesis& x = at(h);
      if (x.a.kind != Kind::dropped && x.a.kind != Kind::transposed) continue;
      if (!finite(values_[static_cast<std::size_t>(h)])) continue;
      double largest = 0;
      for (std::size_t k = 0; k < c_.where.size(); ++k)
        if (base_[k].size() > 0) largest = std::max(largest, delta(h, k).cwiseAbs().maxCoeff());
      if (largest > 10 * c_.tolerance) continue;
      if (std::find(gone.begin(), gone.end(), x.term) != gone.end()) continue;  // said of the whole term already
      const std::string name = x.a.part >= 0 ? x.term->parts[static_cast<std::size_t>(x.a.part)] : x.term->name;
      if (x.a.kind == Kind::dropped) {
        if (x.a.part < 0) gone.push_back(x.term);
        d.blind.push_back({x.term->where, name, "vanishes on this scene"});
      } else if (x.a.part < 0) {
        d.blind.push_back({x.term->where, name, "is symmetric on this scene: its transpose cannot be told from it"});
      }
    }
  }

  VectorXd difference(std::size_t k, const std::vector<VectorXd>& model) const {
    return (sign_[k] * c_.candidate[k] - model[k]).cwiseProduct(weight_[k]);
  }
  bool small(const VectorXd& d) const { return d.size() == 0 || d.cwiseAbs().maxCoeff() <= c_.tolerance; }

  /// Algebraic equations may be written with either sign, and multiplied by a number.
  void choose_signs() {
    mirrored_.resize(c_.where.size());
    for (std::size_t k = 0; k < c_.where.size(); ++k) {
      const double size = c_.candidate[k].squaredNorm();
      if (!c_.sign_free[k] || !(size > 0)) continue;
      sign_[k] = c_.candidate[k].dot(base_[k]) / size;
      if (sign_[k] != 0 && small(difference(k, base_))) continue;
      sign_[k] = 1;
      const Explanation plus = explain(k, {}, base_, 2);
      sign_[k] = -1;
      const Explanation minus = explain(k, {}, base_, 2);
      const bool keep = plus.cost < minus.cost || (plus.cost == minus.cost && plus.unlikely <= minus.unlikely);
      if (keep) sign_[k] = 1;
      if (plus.cost == minus.cost) mirrored_[k] = keep ? minus.hypotheses : plus.hypotheses;
    }
  }

  /// Fewest alterations of single terms of block k that explain what is left.
  Explanation explain(std::size_t k, const std::vector<int>& inner, const std::vector<VectorXd>& model,
                      int depth) const {
    Explanation e;
    const VectorXd d = difference(k, model);
    if (small(d)) return e;
    std::vector<int> which;
    std::vector<VectorXd> change;
    for (int h = 0; h < static_cast<int>(hypotheses_.size()); ++h) {
      if (at(h).block != static_cast<int>(k)) continue;
      VectorXd x;
      if (inner.empty()) {
        x = delta(h, k);
      } else {
        std::vector<Alteration> all;
        for (const int i : inner) all.push_back(at(i).a);
        all.push_back(at(h).a);
        x = (c_.model(all)[k] - model[k]).cwiseProduct(weight_[k]);
      }
      if (!x.allFinite() || small(x / 10)) continue;
      which.push_back(h);
      change.push_back(std::move(x));
    }
    const int count = static_cast<int>(which.size());
    const double tolerance = 4 * c_.tolerance;
    const auto fits = [&](const VectorXd& rest, const VectorXd& x) {
      for (Eigen::Index i = 0; i < rest.size(); ++i)
        if (!(std::abs(rest[i] - x[i]) <= tolerance)) return false;
      return true;
    };
    std::vector<std::vector<int>> found;
    const auto name = [&](std::initializer_list<int> list) {
      std::vector<int> h;
      for (const int i : list) h.push_back(which[static_cast<std::size_t>(i)]);
      found.push_back(h);
    };
    const auto clash = [&](int i, int j) {
      return conflict(at(which[static_cast<std::size_t>(i)]).a, at(which[static_cast<std::size_t>(j)]).a);
    };
    const auto of = [&](int i) -> const VectorXd& { return change[static_cast<std::size_t>(i)]; };
    for (int i = 0; i < count; ++i)
      if (fits(d, of(i))) name({i});
    for (int i = 0; i < count && depth >= 2 && found.empty(); ++i) {
      const VectorXd rest = d - of(i);
      for (int j = i + 1; j < count; ++j)
        if (!clash(i, j) && fits(rest, of(j))) name({i, j});
      if (i + 1 < count && !found.empty()) {  // all pairs, for the report
        for (int i2 = i + 1; i2 < count; ++i2) {
          const VectorXd rest2 = d - of(i2);
          for (int j = i2 + 1; j < count; ++j)
            if (!clash(i2, j) && fits(rest2, of(j))) name({i2, j});
        }
      }
    }
    for (int i = 0; i < count && depth >= 3 && found.empty(); ++i)
      for (int j = i + 1; j < count && found.empty(); ++j) {
        if (clash(i, j)) continue;
        const VectorXd rest = d - of(i) - of(j);
        for (int l = j + 1; l < count; ++l)
          if (!clash(i, l) && !clash(j, l) && fits(rest, of(l))) name({i, j, l});
      }
    if (found.empty()) {
      e.cost = kUnexplained;
      return e;
    }
    const auto unlikely = [&](const std::vector<int>& s) {
      double u = 0;
      for (const int h : s) u += at(h).unlikely;
      return u;
    };
    std::stable_sort(found.begin(), found.end(),
                     [&](const auto& a, const auto& b) { return unlikely(a) < unlikely(b); });
    e.cost = static_cast<int>(found[0].size());
    e.unlikely = unlikely(found[0]);
    e.hypotheses = found[0];
    e.others.assign(found.begin() + 1, found.end());
    return e;
  }

  /// All blocks, given altered shared terms; gives up beyond `limit`.
  Option option(const std::vector<int>& inner, int limit, int depth) const {
    Option o;
    o.inner = inner;
    o.cost = static_cast<int>(inner.size());
    std::vector<VectorXd> model = base_;
    if (inner.size() == 1) model = values_[static_cast<std::size_t>(inner[0])];
    if (inner.size() > 1) {
      std::vector<Alteration> all;
      for (const int i : inner) all.push_back(at(i).a);
      model = c_.model(all);
      if (!finite(model)) {
        o.cost = std::numeric_limits<int>::max();
        return o;
      }
    }
    for (const int i : inner) o.unlikely += at(i).unlikely;
    std::vector<std::size_t> open;
    for (std::size_t k = 0; k < c_.where.size(); ++k)
      if (!small(difference(k, model))) open.push_back(k);
    o.blocks.resize(c_.where.size());
    if (!inner.empty() && o.cost + static_cast<int>(open.size()) > limit) {
      o.cost = std::numeric_limits<int>::max();
      return o;
    }
    for (const std::size_t k : open) {
      o.blocks[k] = explain(k, inner, model, depth);
      o.cost += o.blocks[k].cost;
      o.unlikely += o.blocks[k].unlikely;
      if (!inner.empty() && o.cost > limit) break;
    }
    return o;
  }

  void report(const Option& best, const std::vector<Option>& equal, CandidateDiagnosis& d) {
    const auto sentence = [&](int h) { return finding_of(*at(h).term, at(h).a).message; };
    const auto plain = [&](const std::vector<int>& s) {
      for (const int h : s)
        if (at(h).a.kind == Kind::other_block || at(h).a.kind == Kind::other_unknown) return false;
      return true;
    };
    const auto joined = [&](const std::vector<int>& s) {
      std::string text;
      for (const int h : s) text += (text.empty() ? "" : " and ") + sentence(h);
      return text;
    };
    const std::size_t first = d.findings.size();
    for (const int h : best.inner) d.findings.push_back(finding_of(*at(h).term, at(h).a));
    for (std::size_t k = 0; k < c_.where.size(); ++k) {
      const Explanation& e = best.blocks[k];
      if (e.cost == 0) continue;
      if (e.hypotheses.empty()) {
        explain_by_factors(k, best.inner, d);
        continue;
      }
      const std::size_t here = d.findings.size();
      const bool mirrored = c_.sign_free[k] && !mirrored_[k].empty() && mirrored_[k].size() == e.hypotheses.size();
      for (const int h : e.hypotheses) d.findings.push_back(finding_of(*at(h).term, at(h).a));
      for (const auto& o : e.others)
        if (d.findings[here].alternatives.size() < 6 && (plain(o) || !plain(e.hypotheses)))
          d.findings[here].alternatives.push_back(joined(o));
      if (mirrored) d.findings[here].alternatives.push_back(joined(mirrored_[k]) + ", the equation being negated");
    }
    for (const Option& o : equal) {
      if (o.cost != best.cost || o.inner == best.inner || d.findings.size() == first || o.cost >= kUnexplained)
        continue;
      std::vector<int> all = o.inner;
      for (const auto& e : o.blocks) all.insert(all.end(), e.hypotheses.begin(), e.hypotheses.end());
      if (plain(all) && d.findings[first].alternatives.size() < 6)
        d.findings[first].alternatives.push_back(joined(all));
    }
  }

  /// Factors of up to three terms by least squares; else where the difference is largest.
  void explain_by_factors(std::size_t k, const std::vector<int>& inner, CandidateDiagnosis& d) {
    std::vector<Alteration> altered;
    for (const int i : inner) altered.push_back(at(i).a);
    const auto model = c_.model(altered);
    const VectorXd rest = difference(k, model);
    std::vector<int> which;
    std::vector<VectorXd> value;
    for (int h = 0; h < static_cast<int>(hypotheses_.size()); ++h)
      if (at(h).block == static_cast<int>(k) && at(h).a.kind == Kind::dropped) {
        auto all = altered;
        all.push_back(at(h).a);
        const VectorXd x = (model[k] - c_.model(all)[k]).cwiseProduct(weight_[k]);
        if (!x.allFinite() || small(x / 10)) continue;
        which.push_back(h);
        value.push_back(x);
      }
    const int count = static_cast<int>(which.size());
    std::vector<int> chosen;
    VectorXd factors;
    const auto attempt = [&](const std::vector<int>& s) {
      for (std::size_t i = 0; i < s.size(); ++i)
        for (std::size_t j = i + 1; j < s.size(); ++j)
          if (conflict(at(which[static_cast<std::size_t>(s[i])]).a, at(which[static_cast<std::size_t>(s[j])]).a))
            return false;
      Eigen::MatrixXd A(rest.size(), static_cast<Eigen::Index>(s.size()));
      for (std::size_t i = 0; i < s.size(); ++i)
        A.col(static_cast<Eigen::Index>(i)) = value[static_cast<std::size_t>(s[i])];
      const VectorXd x = A.colPivHouseholderQr().solve(rest);
      if ((A * x - rest).cwiseAbs().maxCoeff() > 10 * c_.tolerance) return false;
      chosen = s;
      factors = x;
      return true;
    };
    bool done = false;
    for (int i = 0; i < count && !done; ++i) done = attempt({i});
    for (int i = 0; i < count && !done; ++i)
      for (int j = i + 1; j < count && !done; ++j) done = attempt({i, j});
    for (int i = 0; i < count && !done; ++i)
      for (int j = i + 1; j < count && !done; ++j)
        for (int l = j + 1; l < count && !done; ++l) done = attempt({i, j, l});
    if (done) {
      for (std::size_t i = 0; i < chosen.size(); ++i) {
        Alteration a = at(which[static_cast<std::size_t>(chosen[i])]).a;
        a.kind = Kind::scaled;
        a.factor = 1 + factors[static_cast<Eigen::Index>(i)];
        if (std::abs(a.factor) < 1e-7) a.kind = Kind::dropped;
        if (std::abs(a.factor + 1) < 1e-7) a.kind = Kind::negated;
        if (std::abs(factors[static_cast<Eigen::Index>(i)]) > 1e-7)
          d.findings.push_back(finding_of(*at(which[static_cast<std::size_t>(chosen[i])]).term, a));
      }
      return;
    }
    d.explained = false;
    Eigen::Index worst = 0;
    rest.cwiseAbs().maxCoeff(&worst);
    const auto rows = static_cast<Eigen::Index>(c_.components[k].size());
    CandidateFinding f;
    f.where = c_.where[k];
    f.what = "unexplained";
    f.message = fmt::format(
        "{} differs in a way that no single term explains; most in {}: {:.9g} in place of {:.9g} at t = {:.6g} s",
        f.where, c_.components[k][static_cast<std::size_t>(worst % rows)], sign_[k] * c_.candidate[k][worst],
        model[k][worst], c_.sample_time[static_cast<std::size_t>(worst / rows)]);
    d.findings.push_back(f);
  }

  const CandidateComparison& c_;
  std::vector<CandidateHypothesis> hypotheses_;
  std::vector<VectorXd> base_;
  std::vector<std::vector<VectorXd>> values_;  // of each hypothesis alone
  std::vector<VectorXd> weight_;
  std::vector<double> sign_;
  std::vector<std::vector<int>> mirrored_;  // what explains an equation of the other sign as well
};

}  // namespace

CandidateDiagnosis diagnose(const AdjointModel& model, const CandidateComparison& comparison) {
  return Search(model, comparison).run();
}

}  // namespace costate
