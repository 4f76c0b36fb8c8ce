// What researchers would hand in: adjoints of each formulation written against costate/candidate/candidate.h, with
// every term open to a deliberate slip.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "costate/candidate/candidate.h"

namespace costate::test {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

/// A deliberate error: "the equation of mu_q'|(M a)_q", and what is done to the term.
struct Slip {
  std::string id;
  char kind = 'd';  // dropped, negated, transposed, 2: doubled, h: halved, 7: times 0.7
};

/// What all researchers share: terms that a test can spoil. Their own formulas stand in the derived classes.
class Researcher : public CandidateAdjoint {
 public:
  explicit Researcher(std::string formulation) : formulation_(std::move(formulation)) {}
  std::string formulation() const override { return formulation_; }
  std::vector<Slip> slips;
  mutable std::map<std::string, bool> terms;  // id, square

 protected:
  double factor(const std::string& id) const {
    double f = 1;
    for (const Slip& s : slips)
      if (s.id == id)
        f *= s.kind == 'd' ? 0 : s.kind == 'n' ? -1 : s.kind == '2' ? 2 : s.kind == 'h' ? 0.5 : s.kind == '7' ? 0.7 : 1;
    return f;
  }
  Vector term(const std::string& where, const std::string& name, const Vector& x) const {
    terms.emplace(where + "|" + name, false);
    return factor(where + "|" + name) * x;
  }
  /// A^T x, or A x for a slip.
  Vector times(const std::string& where, const std::string& name, const Matrix& A, const Vector& x) const {
    const std::string id = where + "|" + name;
    terms.emplace(id, A.rows() == A.cols());
    for (const Slip& s : slips)
      if (s.id == id && s.kind == 't') return A * x;
    return factor(id) * (A.transpose() * x);
  }
  std::string formulation_;
};

const std::string kMuQ = "the equation of mu_q'", kMuV = "the equation of mu_v'", kMuZ = "the equation of mu_z'",
                  kP = "the equation of P'", kIntegrand = "the gradient's integrand",
                  kSolve = "the solve for s1 and s2", kEnd = "the gradient at T",
                  kStart = "the gradient's terms at the start",
                  kTau = "the elimination of accelerations and multipliers from w";

/// Index 1, Baumgarte, penalty, augmented Lagrangian: explicit or, with s1 and s2 kept, implicit.
class AccelerationResearcher : public Researcher {
 public:
  AccelerationResearcher(std::string formulation, bool kept) : Researcher(std::move(formulation)), kept_(kept) {}

  std::vector<Group> unknowns() const override {
    if (!kept_) return CandidateAdjoint::unknowns();
    return {{"mu_q", 'n', true}, {"P", 'n', true}, {"mu_z", 'z', true}, {"s1", 'n', false}, {"s2", 'm', false}};
  }

  Vector rhs(const AdjointBlocks& b, const Vector& mu) const override {
    Vector s1, s2, r(mu.size());
    multipliers(b, mu, s1, s2);
    const Vector mu_q = mu.head(b.n), mu_v = mu.segment(b.n, b.n), mu_z = mu.segment(2 * b.n, b.nz);
    r.head(b.n) =
        term(kMuQ, "-g_q", -b.g_q) + times(kMuQ, "(M a)_q", b.Ma_q, s1) +
        times(kMuQ, "(Phi_q^T lambda)_q", b.Phi_lambda_q, s1) + times(kMuQ, "-Q_q", -b.Q_q, s1) +
        times(kMuQ, "Phidd_q", b.Phidd_q, s2) + times(kMuQ, "2 xi omega Phid_q", 2 * b.xi * b.omega * b.Phid_q, s2) +
        times(kMuQ, "omega^2 Phi_q", b.omega * b.omega * b.Phi_q, s2) + times(kMuQ, "-f_q^T mu_z", -b.f_q, mu_z);
    r.segment(b.n, b.n) = term(kMuV, "-g_v", -b.g_v) + term(kMuV, "-mu_q", -mu_q) + times(kMuV, "-Q_v", -b.Q_v, s1) +
                          times(kMuV, "2 Phid_q", 2 * b.Phid_q, s2) +
                          times(kMuV, "2 xi omega Phi_q", 2 * b.xi * b.omega * b.Phi_q, s2) +
                          times(kMuV, "-f_v^T mu_z", -b.f_v, mu_z);
    r.segment(2 * b.n, b.nz) =
        term(kMuZ, "-g_z", -b.g_z) + times(kMuZ, "-Q_z^T s1", -b.Q_z, s1) + times(kMuZ, "-f_z^T mu_z", -b.f_z, mu_z);
    if (kept_) {
      const std::string one = "the algebraic equation of s1", two = "the algebraic equation of s2";
      r.segment(2 * b.n + b.nz, b.n) = times(one, "M s1", b.M.transpose(), s1) + times(one, "Phi_q^T s2", b.Phi_q, s2) +
                                       term(one, "-mu_v", -mu_v) + term(one, "-g_a", -b.g_a);
      r.tail(b.m) = -term(two, "Phi_q s1", b.Phi_q * s1) - term(two, "-g_lambda", -b.g_lambda) -
                    term(two, "-s2 / alpha", -b.inverse_alpha * s2);
    }
    return r;
  }

  void terminal(const AdjointBlocks& b, Vector& mu, Vector& gradient) const override {
    const Vector tau = b.solve_kkt(term(kTau, "w_a", b.w_a), term(kTau, "w_lambda", b.w_lambda));
    const Vector t1 = term(kTau, "tau1", tau.head(b.n)), t2 = term(kTau, "tau2", tau.tail(b.m));
    const std::string q = "the terminal value mu_q(T)", v = "the terminal value mu_v(T)",
                      z = "the terminal value mu_z(T)";
    mu.head(b.n) = term(q, "w_q", b.w_q) + times(q, "(M a)_q", -b.Ma_q, t1) +
                   times(q, "(Phi_q^T lambda)_q", -b.Phi_lambda_q, t1) + times(q, "-Q_q", b.Q_q, t1) +
                   times(q, "Phidd_q", -b.Phidd_q, t2) +
                   times(q, "2 xi omega Phid_q", -2 * b.xi * b.omega * b.Phid_q, t2) +
                   times(q, "omega^2 Phi_q", -b.omega * b.omega * b.Phi_q, t2);
    mu.segment(b.n, b.n) = term(v, "w_v", b.w_v) + times(v, "-Q_v", b.Q_v, t1) +
                           times(v, "2 Phid_q", -2 * b.Phid_q, t2) +
                           times(v, "2 xi omega Phi_q", -2 * b.xi * b.omega * b.Phi_q, t2);
    mu.segment(2 * b.n, b.nz) = term(z, "w_z", b.w_z) + times(z, "Q_z^T tau1", b.Q_z, t1);
    gradient += term(kEnd, "w_rho", b.w_rho) + times(kEnd, "(M a)_rho", -b.Ma_rho, t1) +
                times(kEnd, "(Phi_q^T lambda)_rho", -b.Phi_lambda_rho, t1) + times(kEnd, "-Q_rho", b.Q_rho, t1) +
                times(kEnd, "Phidd_rho", -b.Phidd_rho, t2) +
                times(kEnd, "2 xi omega Phid_rho", -2 * b.xi * b.omega * b.Phid_rho, t2) +
                times(kEnd, "omega^2 Phi_rho", -b.omega * b.omega * b.Phi_rho, t2);
  }

  Vector integrand(const AdjointBlocks& b, const Vector& mu) const override {
    Vector s1, s2;
    multipliers(b, mu, s1, s2);
    const std::string& i = kIntegrand;
    return term(i, "g_rho", b.g_rho) + times(i, "(M a)_rho", -b.Ma_rho, s1) +
           times(i, "(Phi_q^T lambda)_rho", -b.Phi_lambda_rho, s1) + times(i, "-Q_rho", b.Q_rho, s1) +
           times(i, "Phidd_rho", -b.Phidd_rho, s2) +
           times(i, "2 xi omega Phid_rho", -2 * b.xi * b.omega * b.Phid_rho, s2) +
           times(i, "omega^2 Phi_rho", -b.omega * b.omega * b.Phi_rho, s2) +
           times(i, "f_rho^T mu_z", b.f_rho, mu.segment(2 * b.n, b.nz));
  }

  Vector start_contribution(const AdjointBlocks& b, const Vector& mu, const Matrix& Sq0, const Matrix& Sv0,
                            const Matrix& Sz0) const override {
    return times(kStart, "mu_q^T Sq0", Sq0, mu.head(b.n)) + times(kStart, "mu_v^T Sv0", Sv0, mu.segment(b.n, b.n)) +
           times(kStart, "mu_z^T Sz0", Sz0, mu.segment(2 * b.n, b.nz));
  }

 private:
  void multipliers(const AdjointBlocks& b, const Vector& mu, Vector& s1, Vector& s2) const {
    if (kept_) {
      s1 = mu.segment(2 * b.n + b.nz, b.n);
      s2 = mu.tail(b.m);
      return;
    }
    const Vector s = b.solve_kkt(term(kSolve, "mu_v", mu.segment(b.n, b.n)) + term(kSolve, "g_a", b.g_a),
                                 term(kSolve, "g_lambda", b.g_lambda));
    s1 = s.head(b.n);
    s2 = s.tail(b.m);
  }
  bool kept_;
};

/// Penalty as in the books: Mb mu = mu_v + g^_a with Mb = M + Phi_q^T alpha Phi_q.
class PenaltyResearcher final : public CandidateAdjoint {
 public:
  std::string formulation() const override { return "penalty"; }
  Vector rhs(const AdjointBlocks& b, const Vector& x) const override {
    const double al = b.alpha();
    const Matrix Kb = b.K + al * b.Phi_q.transpose() * b.R2_q, Cb = b.C + al * b.Phi_q.transpose() * b.R2_v;
    const Vector mu = solve(b, x), mu_z = x.tail(b.nz);
    Vector r(x.size());
    r << -(b.g_q + al * b.R2_q.transpose() * b.g_lambda) + Kb.transpose() * mu - b.f_q.transpose() * mu_z,
        -(b.g_v + al * b.R2_v.transpose() * b.g_lambda) - x.head(b.n) + Cb.transpose() * mu - b.f_v.transpose() * mu_z,
        -b.g_z - b.Q_z.transpose() * mu - b.f_z.transpose() * mu_z;
    return r;
  }
  void terminal(const AdjointBlocks& b, Vector& mu, Vector& gradient) const override {
    const double al = b.alpha();
    const Vector tau = Mb(b).ldlt().solve(b.w_a + al * b.Phi_q.transpose() * b.w_lambda);
    const Vector l = al * (b.Phi_q * tau - b.w_lambda);
    mu << b.w_q - b.K.transpose() * tau - b.R2_q.transpose() * l,
        b.w_v - b.C.transpose() * tau - b.R2_v.transpose() * l, b.w_z + b.Q_z.transpose() * tau;
    gradient += b.w_rho - b.F_rho.transpose() * tau - b.R2_rho.transpose() * l;
  }
  Vector integrand(const AdjointBlocks& b, const Vector& x) const override {
    const Vector mu = solve(b, x);
    return b.g_rho + b.alpha() * b.R2_rho.transpose() * b.g_lambda -
           (b.F_rho + b.alpha() * b.Phi_q.transpose() * b.R2_rho).transpose() * mu + b.f_rho.transpose() * x.tail(b.nz);
  }

 private:
  static Matrix Mb(const AdjointBlocks& b) { return b.M + b.alpha() * b.Phi_q.transpose() * b.Phi_q; }
  static Vector solve(const AdjointBlocks& b, const Vector& x) {
    return Mb(b).ldlt().solve(x.segment(b.n, b.n) + b.g_a + b.alpha() * b.Phi_q.transpose() * b.g_lambda);
  }
};

/// Index 3 and its stabilised index-2 form, unknowns (mu_q, P, mu_z, mu, nu, kappa), as a residual with its equations
/// in an order of its own.
class MomentumResearcher : public Researcher {
 public:
  explicit MomentumResearcher(std::string formulation)
      : Researcher(std::move(formulation)), second_(formulation_ == "index2") {}

  std::vector<Group> unknowns() const override {
    std::vector<Group> g = {
        {"mu_q", 'n', true}, {"P", 'n', true}, {"mu_z", 'z', true}, {"mu", 'n', false}, {"nu", 'm', false}};
    if (second_) g.push_back({"kappa", 'm', false});
    return g;
  }

  Vector residual(const AdjointBlocks& b, const Vector& x, const Vector& xp) const override {
    const int n = b.n, m = b.m, nz = b.nz;
    const Vector mu_q = x.head(n), P = x.segment(n, n), mu_z = x.segment(2 * n, nz), mu = x.segment(2 * n + nz, n),
                 nu = x.segment(3 * n + nz, m), kappa = second_ ? Vector(x.tail(m)) : Vector::Zero(m);
    Vector q = term(kMuQ, "-g_q", -b.g_q) + times(kMuQ, "(M a)_q", b.Ma_q, mu) +
               times(kMuQ, "(Phi_q^T lambda)_q", b.Phi_lambda_q, mu) + times(kMuQ, "-Q_q", -b.Q_q, mu) +
               times(kMuQ, "Phi_q^T nu", b.Phi_q, nu) + times(kMuQ, "-f_q^T mu_z", -b.f_q, mu_z);
    Vector p = term(kP, "-g_v", -b.g_v) + term(kP, "-mu_q", -mu_q) + times(kP, "-Q_v", -b.Q_v, mu) +
               times(kP, "-f_v^T mu_z", -b.f_v, mu_z);
    if (second_) {
      q += times(kMuQ, "Phid_q^T kappa", b.Phid_q, kappa);
      p += times(kP, "Phi_q^T kappa", b.Phi_q, kappa);
    }
    const Vector z =
        term(kMuZ, "-g_z", -b.g_z) + times(kMuZ, "-Q_z^T mu", -b.Q_z, mu) + times(kMuZ, "-f_z^T mu_z", -b.f_z, mu_z);
    const std::string def = "the definition of P", on = "the constraint on mu";
    const Vector d = times(def, "M mu", b.M.transpose(), mu) + term(def, "-g_a", -b.g_a) + term(def, "-P", -P);
    const Vector c = term(on, "Phi_q mu", b.Phi_q * mu) + term(on, "-g_lambda", -b.g_lambda);
    Vector r(x.size());
    if (second_)
      r << term("the constraint on mu_q", "Phi_q mu_q", b.Phi_q * mu_q), -c, d, xp.head(n) - q, p - xp.segment(n, n),
          xp.segment(2 * n, nz) - z;
    else
      r << -c, d, xp.head(n) - q, p - xp.segment(n, n), xp.segment(2 * n, nz) - z;
    return r;
  }

  void terminal(const AdjointBlocks& b, Vector& x, Vector& gradient) const override {
    const int n = b.n, m = b.m, nz = b.nz;
    const std::string hq = "w^_q (w without accelerations and multipliers)",
                      hv = "w^_v (w without accelerations and multipliers)", z = "the terminal value mu_z(T)",
                      ev = "the boundary multiplier eta_v", eq = "the boundary multiplier eta_q",
                      mq = "the terminal value mu_q(T)", mp = "the terminal value P(T)";
    const Vector tau = b.solve_kkt(term(kTau, "w_a", b.w_a), term(kTau, "w_lambda", b.w_lambda));
    const Vector t1 = term(kTau, "tau1", tau.head(n)), t2 = term(kTau, "tau2", tau.tail(m));
    const Vector wq = term(hq, "w_q", b.w_q) + times(hq, "(M a)_q", -b.Ma_q, t1) +
                      times(hq, "(Phi_q^T lambda)_q", -b.Phi_lambda_q, t1) + times(hq, "-Q_q", b.Q_q, t1) +
                      times(hq, "Phidd_q", -b.Phidd_q, t2);
    const Vector wv = term(hv, "w_v", b.w_v) + times(hv, "-Q_v", b.Q_v, t1) + times(hv, "2 Phid_q", -2 * b.Phid_q, t2);
    const Vector wz = term(z, "w_z", b.w_z) + times(z, "Q_z^T tau1", b.Q_z, t1);
    const Vector first = b.solve_kkt(term(ev, "w^_v", wv) + term(ev, "g_a", b.g_a), term(ev, "g_lambda", b.g_lambda));
    const Vector mu = first.head(n), eta_v = term(ev, "eta_v", first.tail(m));
    Vector eta_q;
    if (second_) {
      const Vector right = b.Phi_q * (term(eq, "w^_q", wq) + times(eq, "-Phid_q^T eta_v", -b.Phid_q, eta_v));
      eta_q = (b.Phi_q * b.Phi_q.transpose()).ldlt().solve(right);
    } else {
      const Vector top = term(eq, "-g_v", -b.g_v) + term(eq, "-w^_q", -wq) +
                         times(eq, "Phid_q^T eta_v", b.Phid_q, eta_v) + times(eq, "-Q_v", -b.Q_v, mu) +
                         term(eq, "(g_a)'", b.g_a_dot) + times(eq, "-M' mu", -b.M_dot, mu) +
                         times(eq, "-f_v^T mu_z", -b.f_v, wz);
      eta_q =
          -b.solve_kkt(top, term(eq, "(g_lambda)'", b.g_lambda_dot) + term(eq, "-Phid_q mu", -b.Phid_q * mu)).tail(m);
    }
    eta_q = term(eq, "eta_q", eta_q);
    x.head(n) = term(mq, "w^_q", wq) + times(mq, "-Phi_q^T eta_q", -b.Phi_q, eta_q) +
                times(mq, "-Phid_q^T eta_v", -b.Phid_q, eta_v);
    x.segment(n, n) = term(mp, "w^_v", wv) + times(mp, "-Phi_q^T eta_v", -b.Phi_q, eta_v);
    x.segment(2 * n, nz) = wz;
    gradient += term(kEnd, "w_rho", b.w_rho) + times(kEnd, "(M a)_rho", -b.Ma_rho, t1) +
                times(kEnd, "(Phi_q^T lambda)_rho", -b.Phi_lambda_rho, t1) + times(kEnd, "-Q_rho", b.Q_rho, t1) +
                times(kEnd, "Phidd_rho", -b.Phidd_rho, t2) + times(kEnd, "-Phi_rho^T eta_q", -b.Phi_rho, eta_q) +
                times(kEnd, "-Phid_rho^T eta_v", -b.Phid_rho, eta_v);
  }

  Vector integrand(const AdjointBlocks& b, const Vector& x) const override {
    const int n = b.n, m = b.m, nz = b.nz;
    const Vector mu = x.segment(2 * n + nz, n), nu = x.segment(3 * n + nz, m);
    const std::string& i = kIntegrand;
    Vector r = term(i, "g_rho", b.g_rho) + times(i, "(M a)_rho", -b.Ma_rho, mu) +
               times(i, "(Phi_q^T lambda)_rho", -b.Phi_lambda_rho, mu) + times(i, "-Q_rho", b.Q_rho, mu) +
               times(i, "-Phi_rho^T nu", -b.Phi_rho, nu) + times(i, "f_rho^T mu_z", b.f_rho, x.segment(2 * n, nz));
    if (second_) r += times(i, "-Phid_rho^T kappa", -b.Phid_rho, x.tail(m));
    return r;
  }

  Vector start_contribution(const AdjointBlocks& b, const Vector& x, const Matrix& Sq0, const Matrix& Sv0,
                            const Matrix& Sz0) const override {
    return times(kStart, "mu_q^T Sq0", Sq0, x.head(b.n)) + times(kStart, "P^T Sv0", Sv0, x.segment(b.n, b.n)) +
           times(kStart, "mu_z^T Sz0", Sz0, x.segment(2 * b.n, b.nz));
  }

 private:
  bool second_;
};

}  // namespace costate::test
