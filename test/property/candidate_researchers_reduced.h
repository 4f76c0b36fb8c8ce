// The same for the formulations in independent coordinates and in second-order form.
#pragma once

#include "candidate_researchers.h"

namespace costate::test {

/// Maggi, explicit or, with mu kept, implicit; written out to the blocks of all coordinates.
class MaggiResearcher final : public Researcher {
 public:
  MaggiResearcher(std::string formulation, bool kept) : Researcher(std::move(formulation)), kept_(kept) {}

  std::vector<Group> unknowns() const override {
    if (!kept_) return CandidateAdjoint::unknowns();
    return {{"mu_y", 'f', true}, {"P", 'f', true}, {"mu_z", 'z', true}, {"mu", 'f', false}};
  }

  Vector rhs(const AdjointBlocks& b, const Vector& x) const override {
    const int f = b.f, nz = b.nz;
    const Vector mu_y = x.head(f), mu_z = x.segment(2 * f, nz);
    const Reduced g = running(b);
    const Vector mu = multiplier(b, x, g);
    const std::string Y = "the equation of mu_y'", V = kept_ ? kP : "the equation of mu_yd'", P = "the definition of P";
    Vector r(x.size());
    r.head(f) = times(Y, "-R^T g^_q", -b.R, g.q) + times(Y, "-D^T g^_v", -b.D, g.v) + times(Y, "-A^T g^_a", -b.A, g.a) +
                stiffness(b, Y, 1, mu) + times(Y, "-f_y^T mu_z", -b.f_q * b.R - b.f_v * b.D, mu_z);
    r.segment(f, f) = times(V, "-R^T g^_v", -b.R, g.v) + times(V, "-E^T g^_a", -b.E, g.a) + term(V, "-mu_y", -mu_y) +
                      times(V, "R^T C R", b.R.transpose() * b.C * b.R, mu) +
                      times(V, "R^T M E", b.R.transpose() * b.M * b.E, mu) +
                      times(V, "-f_yd^T mu_z", -b.f_v * b.R, mu_z);
    r.segment(2 * f, nz) = term(kMuZ, "-g_z", -b.g_z) + times(kMuZ, "-Q_z^T s", -b.Q_z, g.s) +
                           times(kMuZ, "-Qy_z^T mu", -b.R.transpose() * b.Q_z, mu) +
                           times(kMuZ, "-f_z^T mu_z", -b.f_z, mu_z);
    if (kept_)
      r.tail(f) =
          times(P, "My mu", b.My.transpose(), mu) + times(P, "-R^T g^_a", -b.R, g.a) + term(P, "-P", -x.segment(f, f));
    return r;
  }

  void terminal(const AdjointBlocks& b, Vector& mu, Vector& gradient) const override {
    const std::string Y = "the terminal value mu_y(T)",
                      V = kept_ ? "the terminal value P(T)" : "the terminal value mu_yd(T)",
                      Z = "the terminal value mu_z(T)";
    const Reduced w = reduced(b, "the elimination of reactions from w", "w", b.w_q, b.w_v, b.w_a, b.w_lambda);
    const Vector tau = b.My.ldlt().solve(times("the elimination of accelerations from w", "R^T w^_a", b.R, w.a));
    mu.head(b.f) = times(Y, "R^T w^_q", b.R, w.q) + times(Y, "D^T w^_v", b.D, w.v) + times(Y, "A^T w^_a", b.A, w.a) +
                   stiffness(b, Y, -1, tau);
    mu.segment(b.f, b.f) = times(V, "R^T w^_v", b.R, w.v) + times(V, "E^T w^_a", b.E, w.a) +
                           times(V, "R^T C R", -b.R.transpose() * b.C * b.R, tau) +
                           times(V, "R^T M E", -b.R.transpose() * b.M * b.E, tau);
    mu.segment(2 * b.f, b.nz) =
        term(Z, "w_z", b.w_z) + times(Z, "Q_z^T s", b.Q_z, w.s) + times(Z, "Qy_z^T tau", b.Qy_z, tau);
    gradient += parameters(b, kEnd, "w", b.w_rho, w, tau);
  }

  Vector integrand(const AdjointBlocks& b, const Vector& x) const override {
    const Reduced g = running(b);
    const Vector mu_z = x.segment(2 * b.f, b.nz);
    return parameters(b, kIntegrand, "g", b.g_rho, g, multiplier(b, x, g)) + times(kIntegrand, "f_rho", b.f_rho, mu_z) +
           times(kIntegrand, "f_q N_rho", b.f_q * b.N_rho, mu_z) +
           times(kIntegrand, "f_v V_rho", b.f_v * b.V_rho, mu_z);
  }

  Vector start_contribution(const AdjointBlocks& b, const Vector& x, const Matrix& Sq0, const Matrix& Sv0,
                            const Matrix& Sz0) const override {
    return times(kStart, "mu_y^T B Sq0", b.B * Sq0, x.head(b.f)) +
           times(kStart, kept_ ? "P^T B Sv0" : "mu_yd^T B Sv0", b.B * Sv0, x.segment(b.f, b.f)) +
           times(kStart, "mu_z^T Sz0", Sz0, x.segment(2 * b.f, b.nz));
  }

 private:
  struct Reduced {
    Vector s, q, v, a;
  };
  Reduced reduced(const AdjointBlocks& b, const std::string& where, const std::string& c, const Vector& q,
                  const Vector& v, const Vector& a, const Vector& lambda) const {
    Reduced r;
    r.s = term(where, "S " + c + "_lambda", b.S * lambda);
    r.q = term(where, c + "_q", q) + times(where, "(M a)_q", -b.Ma_q, r.s) +
          times(where, "(Phi_q^T lambda)_q", -b.Phi_lambda_q, r.s) + times(where, "-Q_q", b.Q_q, r.s);
    r.v = term(where, c + "_v", v) + times(where, "-C^T s", -b.C, r.s);
    r.a = term(where, c + "_a", a) + times(where, "-M s", -b.M.transpose(), r.s);
    return r;
  }
  Reduced running(const AdjointBlocks& b) const {
    return reduced(b, "the elimination of reactions from g", "g", b.g_q, b.g_v, b.g_a, b.g_lambda);
  }
  Vector multiplier(const AdjointBlocks& b, const Vector& x, const Reduced& g) const {
    if (kept_) return x.tail(b.f);
    return b.My.ldlt().solve(term("the solve for mu", "mu_yd", x.segment(b.f, b.f)) +
                             times("the solve for mu", "R^T g^_a", b.R, g.a));
  }
  Vector stiffness(const AdjointBlocks& b, const std::string& where, double c, const Vector& mu) const {
    const Matrix L = c * b.R.transpose();
    return times(where, "R^T (M a)_q R", L * b.Ma_q * b.R, mu) +
           times(where, "R^T (Phi_q^T lambda)_q R", L * b.Phi_lambda_q * b.R, mu) +
           times(where, "-R^T Q_q R", -L * b.Q_q * b.R, mu) + times(where, "R^T C D", L * b.C * b.D, mu) +
           times(where, "R^T M A", L * b.M * b.A, mu);
  }
  Vector parameters(const AdjointBlocks& b, const std::string& i, const std::string& c, const Vector& rho,
                    const Reduced& g, const Vector& mu) const {
    const Matrix L = -b.R.transpose();
    return term(i, c + "_rho", rho) + times(i, "(M a)_rho", -b.Ma_rho, g.s) +
           times(i, "(Phi_q^T lambda)_rho", -b.Phi_lambda_rho, g.s) + times(i, "-Q_rho", b.Q_rho, g.s) +
           times(i, "N_rho^T " + c + "^_q", b.N_rho, g.q) + times(i, "V_rho^T " + c + "^_v", b.V_rho, g.v) +
           times(i, "A_rho^T " + c + "^_a", b.A_rho, g.a) + times(i, "R^T (M a)_rho", L * b.Ma_rho, mu) +
           times(i, "R^T (Phi_q^T lambda)_rho", L * b.Phi_lambda_rho, mu) + times(i, "-R^T Q_rho", -L * b.Q_rho, mu) +
           times(i, "R^T K N_rho", L * b.K * b.N_rho, mu) + times(i, "R^T C V_rho", L * b.C * b.V_rho, mu) +
           times(i, "R^T M A_rho", L * b.M * b.A_rho, mu);
  }
  bool kept_;
};

/// Second order, of the penalty or of Maggi. What stands at the ends comes from a first-order candidate.
class SecondOrderResearcher final : public Researcher {
 public:
  explicit SecondOrderResearcher(std::string formulation)
      : Researcher(std::move(formulation)),
        maggi_(formulation_ == "maggi-second-order"),
        maggi_end_("maggi", false),
        penalty_end_("penalty", false) {}

  Vector rhs(const AdjointBlocks& b, const Vector& x) const override {
    const Matrix &M1 = maggi_ ? b.My_dot : b.Mb_dot, &C = maggi_ ? b.Cy : b.Cb;
    const auto k = M1.rows();
    const Vector mu = x.head(k), mu_dot = x.segment(k, k), mu_z = x.tail(b.nz);
    const std::string e = "the equation of mu_dot'";
    Vector out(x.size());
    out.head(k) = term("the equation of mu'", "mu_dot", mu_dot);
    out.tail(b.nz) = term(kMuZ, "-g_z", -b.g_z) + times(kMuZ, "-Q_z^T mu", maggi_ ? -b.Qy_z : -b.Q_z, mu) +
                     times(kMuZ, "-f_z^T mu_z", -b.f_z, mu_z);
    const Matrix &fv = maggi_ ? b.f_yd : b.f_v, &fv1 = maggi_ ? b.f_yd_dot : b.f_v_dot;
    const Vector right = (maggi_ ? term(e, "g_y", b.g_y) + term(e, "-(g_yd)'", -b.g_yd_dot)
                                 : term(e, "g_q", b.g_q) + term(e, "-(g_v)'", -b.g_v_dot)) +
                         times(e, "-2 M' mu_dot", -2 * M1.transpose(), mu_dot) + times(e, "C^T mu_dot", C, mu_dot) +
                         times(e, "-M'' mu", maggi_ ? -b.My_ddot : -b.Mb_ddot, mu) +
                         times(e, "C'^T mu", maggi_ ? b.Cy_dot : b.Cb_dot, mu) +
                         times(e, "-K^T mu", maggi_ ? -b.Ky : -b.Kb, mu) +
                         times(e, "f_q^T mu_z", maggi_ ? b.f_y : b.f_q, mu_z) + times(e, "-f_v'^T mu_z", -fv1, mu_z) +
                         times(e, "-f_v^T mu_z'", -fv, out.tail(b.nz));
    out.segment(k, k) = (maggi_ ? b.My : b.Mb).ldlt().solve(right);
    return out;
  }
  void terminal(const AdjointBlocks& b, Vector& x, Vector& gradient) const override {
    Researcher& first = maggi_ ? static_cast<Researcher&>(maggi_end_) : penalty_end_;
    first.slips = slips;
    Vector end = x;
    first.terminal(b, end, gradient);
    terms.insert(first.terms.begin(), first.terms.end());
    const Matrix& M = maggi_ ? b.My : b.Mb;
    const auto k = M.rows();
    const std::string e = "the terminal value mu_dot(T)";
    const Vector mu = M.ldlt().solve(end.segment(k, k)), mu_z = end.tail(b.nz);
    x << mu, M.ldlt().solve(rest(b, e, mu, mu_z) + term(e, maggi_ ? "-mu_y(T)" : "-mu_q(T)", -end.head(k))), mu_z;
  }
  Vector integrand(const AdjointBlocks& b, const Vector& x) const override {
    const std::string& i = kIntegrand;
    const Vector r = term(i, "g_rho", b.g_rho) + times(i, "f_rho^T mu_z", maggi_ ? b.fy_rho : b.f_rho, x.tail(b.nz));
    if (!maggi_) return r + times(i, "-Rb^T mu", -b.Rb, x.head(b.n));
    return r + times(i, "N_rho^T g_q", b.N_rho, b.g_q) + times(i, "V_rho^T g_v", b.V_rho, b.g_v) +
           times(i, "-Fy^T mu", -b.Fy, x.head(b.f));
  }
  Vector start_contribution(const AdjointBlocks& b, const Vector& x, const Matrix& Sq0, const Matrix& Sv0,
                            const Matrix& Sz0) const override {
    const Matrix& M = maggi_ ? b.My : b.Mb;
    const auto k = M.rows();
    const Matrix B = maggi_ ? b.B : Matrix(Matrix::Identity(k, k));
    const Vector mu_q = rest(b, kStart, x.head(k), x.tail(b.nz)) + times(kStart, "-M mu_dot", -M, x.segment(k, k));
    return (B * Sq0).transpose() * mu_q + (B * Sv0).transpose() * times(kStart, "M mu", M, x.head(k)) +
           times(kStart, "mu_z^T Sz0", Sz0, x.tail(b.nz));
  }

 private:
  Vector rest(const AdjointBlocks& b, const std::string& e, const Vector& mu, const Vector& mu_z) const {
    return (maggi_ ? term(e, "-g_yd", -b.g_yd) : term(e, "-g_v", -b.g_v)) +
           times(e, "-M' mu", maggi_ ? -b.My_dot : -b.Mb_dot, mu) + times(e, "C^T mu", maggi_ ? b.Cy : b.Cb, mu) +
           times(e, "-f_v^T mu_z", maggi_ ? -b.f_yd : -b.f_v, mu_z);
  }
  bool maggi_;
  mutable MaggiResearcher maggi_end_;
  mutable AccelerationResearcher penalty_end_;
};

}  // namespace costate::test
