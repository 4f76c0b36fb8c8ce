#include "costate/candidate/candidate_maggi.h"

namespace costate {

std::vector<CandidateAdjoint::Group> MaggiModel::unknowns() const {
  std::vector<Group> g = {{"mu_y", 'f', true}, {kept_ ? "P" : "mu_yd", 'f', true}, {"mu_z", 'z', true}};
  if (kept_) g.push_back({"mu", 'f', false});
  return g;
}

const MaggiModel::Constituents& MaggiModel::constituents(const AdjointBlocks& b) const {
  const auto found = known_.find(b.t);
  if (found != known_.end() && found->second.first == b.B) return found->second.second;
  Constituents c;
  const Matrix Rt = b.R.transpose();
  c.Ma_q = Rt * b.Ma_q * b.R;
  c.Phi_lambda_q = Rt * b.Phi_lambda_q * b.R;
  c.Q_q = Rt * b.Q_q * b.R;
  c.C_D = Rt * b.C * b.D;
  c.M_times_A = Rt * b.M * b.A;
  c.C_R = Rt * b.C * b.R;
  c.M_times_E = Rt * b.M * b.E;
  c.Ma_rho = Rt * b.Ma_rho;
  c.Phi_lambda_rho = Rt * b.Phi_lambda_rho;
  c.Q_rho = Rt * b.Q_rho;
  c.K_N = Rt * b.K * b.N_rho;
  c.C_V = Rt * b.C * b.V_rho;
  c.M_times_A_rho = Rt * b.M * b.A_rho;
  c.f_q = b.f_q * b.R;
  c.f_v = b.f_v * b.D;
  c.f_q_N = b.f_q * b.N_rho;
  c.f_v_V = b.f_v * b.V_rho;
  c.mass.compute(b.My);
  auto& place = known_[b.t];
  place = {b.B, std::move(c)};
  return place.second;
}

// The whole blocks with the sign c, by their constituents.
#define PARTS_K(c)                                                                                 \
  {                                                                                                \
    {"(M a)_q", "Ma_q", &b.Ma_q, c}, {"(Phi_q^T lambda)_q", "Phi_lambda_q", &b.Phi_lambda_q, c}, { \
      "-Q_q", "Q_q", &b.Q_q, -(c)                                                                  \
    }                                                                                              \
  }
#define PARTS_F(c)                                                                                             \
  {                                                                                                            \
    {"(M a)_rho", "Ma_rho", &b.Ma_rho, c}, {"(Phi_q^T lambda)_rho", "Phi_lambda_rho", &b.Phi_lambda_rho, c}, { \
      "-Q_rho", "Q_rho", &b.Q_rho, -(c)                                                                        \
    }                                                                                                          \
  }
#define PARTS_KY(c)                                                                                          \
  {                                                                                                          \
    {"R^T (M a)_q R", "Ma_q", &x.Ma_q, c}, {"R^T (Phi_q^T lambda)_q R", "Phi_lambda_q", &x.Phi_lambda_q, c}, \
        {"-R^T Q_q R", "Q_q", &x.Q_q, -(c)}, {"R^T C D", "C_D", &x.C_D, c}, {                                \
      "R^T M A", "M_times_A", &x.M_times_A, c                                                                \
    }                                                                                                        \
  }
#define PARTS_CY(c)                                                            \
  {                                                                            \
    {"R^T C R", "C_R", &x.C_R, c}, { "R^T M E", "M_times_E", &x.M_times_E, c } \
  }
#define PARTS_FY(c)                                                                                                    \
  {                                                                                                                    \
    {"R^T (M a)_rho", "Ma_rho", &x.Ma_rho, c}, {"R^T (Phi_q^T lambda)_rho", "Phi_lambda_rho", &x.Phi_lambda_rho, c},   \
        {"-R^T Q_rho", "Q_rho", &x.Q_rho, -(c)}, {"R^T K N_rho", "K_N", &x.K_N, c}, {"R^T C V_rho", "C_V", &x.C_V, c}, \
    {                                                                                                                  \
      "R^T M A_rho", "M_times_A_rho", &x.M_times_A_rho, c                                                              \
    }                                                                                                                  \
  }
#define BASES                               \
  {                                         \
    {"R", &b.R}, {"D", &b.D}, { "A", &b.A } \
  }
#define BASES_RHO                                                   \
  {                                                                 \
    {"N_rho", &b.N_rho}, {"V_rho", &b.V_rho}, { "A_rho", &b.A_rho } \
  }
#define SQUARE_Y                                  \
  {                                               \
    {"My", &b.My}, {"Ky", &b.Ky}, { "Cy", &b.Cy } \
  }

MaggiModel::Reduced MaggiModel::without_reactions(const AdjointBlocks& b, bool terminal) const {
  const char* eq = terminal ? "the elimination of reactions from w" : "the elimination of reactions from g";
  const bool before = std::exchange(shared_, true);
  Reduced r;
  r.s = product(eq, terminal ? "S w_lambda" : "S g_lambda", "S", {{"S", "S", &b.S, 1}},
                terminal ? "w_lambda" : "g_lambda", terminal ? b.w_lambda : b.g_lambda, {}, {}, false);
  r.q = vector(eq, terminal ? "w_q" : "g_q", terminal ? b.w_q : b.g_q, 1) +
        product(eq, "-K^T s", "K", PARTS_K(-1), "s", r.s, {}, {});
  r.v = vector(eq, terminal ? "w_v" : "g_v", terminal ? b.w_v : b.g_v, 1) +
        product(eq, "-C^T s", "C", {{"-C^T s", "C", &b.C, -1}}, "s", r.s, {}, {});
  r.a = vector(eq, terminal ? "w_a" : "g_a", terminal ? b.w_a : b.g_a, 1) +
        product(eq, "-M s", "M", {{"M", "M", &b.M, -1}}, "s", r.s, {}, {}, false);
  shared_ = before;
  return r;
}

MaggiModel::Reduced MaggiModel::inner(const AdjointBlocks& b, const Vector& x, Vector& mu) const {
  begin(Section::solve);
  Reduced g = without_reactions(b, false);
  if (kept_) {
    mu = x.segment(2 * b.f + b.nz, b.f);
  } else {
    const char* eq = "the solve for mu";
    const Vector right = vector(eq, "mu_yd", x.segment(b.f, b.f), 1) +
                         product(eq, "R^T g^_a", "R", {{"R", "R", &b.R, 1}}, "g^_a", g.a, BASES, {});
    mu = constituents(b).mass.solve(right);
  }
  return g;
}

MaggiModel::Vector MaggiModel::rhs(const AdjointBlocks& b, const Vector& all) const {
  const Constituents& x = constituents(b);
  const int f = b.f, nz = b.nz;
  const Vector mu_y = all.head(f), mu_yd = all.segment(f, f), mu_z = all.segment(2 * f, nz);
  Vector mu, out(all.size());
  const Reduced g = inner(b, all, mu);
  begin(Section::flow);
  const Named us = {{"mu_y", &mu_y}, {kept_ ? "P" : "mu_yd", &mu_yd}, {"mu", &mu}};
  const char* eq = "the equation of mu_y'";
  Vector r = product(eq, "-R^T g^_q", "R", {{"R", "R", &b.R, -1}}, "g^_q", g.q, BASES, {});
  r += product(eq, "-D^T g^_v", "D", {{"D", "D", &b.D, -1}}, "g^_v", g.v, BASES, {});
  r += product(eq, "-A^T g^_a", "A", {{"A", "A", &b.A, -1}}, "g^_a", g.a, BASES, {});
  r += product(eq, "Ky^T mu", "Ky", PARTS_KY(1), "mu", mu, SQUARE_Y, us);
  if (nz > 0)
    r += product(eq, "-f_y^T mu_z", "f_y", {{"f_q R", "f_q", &x.f_q, -1}, {"f_v D", "f_v", &x.f_v, -1}}, "mu_z", mu_z,
                 {}, {});
  out.head(f) = r;
  eq = kept_ ? "the equation of P'" : "the equation of mu_yd'";
  r = product(eq, "-R^T g^_v", "R", {{"R", "R", &b.R, -1}}, "g^_v", g.v, BASES, {});
  r += product(eq, "-E^T g^_a", "E", {{"E", "E", &b.E, -1}}, "g^_a", g.a, BASES, {});
  r += vector(eq, "-mu_y", mu_y, -1, us);
  r += product(eq, "Cy^T mu", "Cy", PARTS_CY(1), "mu", mu, SQUARE_Y, us);
  if (nz > 0)
    r += product(eq, "-f_yd^T mu_z", "f_yd", {{"-f_yd^T mu_z", "f_yd", &b.f_yd, -1}}, "mu_z", mu_z, {{"f_y", &b.f_y}},
                 {});
  out.segment(f, f) = r;
  if (nz > 0) {
    eq = "the equation of mu_z'";
    out.segment(2 * f, nz) = vector(eq, "-g_z", b.g_z, -1) +
                             product(eq, "-Q_z^T s", "Q_z", {{"Q_z", "Q_z", &b.Q_z, -1}}, "s", g.s, {}, {}) +
                             product(eq, "-Qy_z^T mu", "Qy_z", {{"Qy_z", "Qy_z", &b.Qy_z, -1}}, "mu", mu, {}, us) +
                             product(eq, "-f_z^T mu_z", "f_z", {{"f_z", "f_z", &b.f_z, -1}}, "mu_z", mu_z, {}, {});
  }
  if (kept_) {
    eq = "the definition of P";
    out.segment(2 * f + nz, f) = product(eq, "My mu", "My", {{"My", "My", &b.My, 1}}, "mu", mu, SQUARE_Y, us, false) +
                                 product(eq, "-R^T g^_a", "R", {{"R", "R", &b.R, -1}}, "g^_a", g.a, BASES, {}) +
                                 vector(eq, "-P", mu_yd, -1, us);
  }
  return out;
}

MaggiModel::Vector MaggiModel::integrand(const AdjointBlocks& b, const Vector& all) const {
  const Constituents& x = constituents(b);
  Vector mu;
  const Reduced g = inner(b, all, mu);
  const Vector mu_y = all.head(b.f), mu_yd = all.segment(b.f, b.f), mu_z = all.segment(2 * b.f, b.nz);
  begin(Section::integrand);
  const Named us = {{"mu_y", &mu_y}, {kept_ ? "P" : "mu_yd", &mu_yd}, {"mu", &mu}};
  const char* eq = "the gradient's integrand";
  Vector r = vector(eq, "g_rho", b.g_rho, 1);
  r += product(eq, "-F_rho^T s", "F_rho", PARTS_F(-1), "s", g.s, {}, {});
  r += product(eq, "N_rho^T g^_q", "N_rho", {{"N_rho", "N_rho", &b.N_rho, 1}}, "g^_q", g.q, BASES_RHO, {});
  r += product(eq, "V_rho^T g^_v", "V_rho", {{"V_rho", "V_rho", &b.V_rho, 1}}, "g^_v", g.v, BASES_RHO, {});
  r += product(eq, "A_rho^T g^_a", "A_rho", {{"A_rho", "A_rho", &b.A_rho, 1}}, "g^_a", g.a, BASES_RHO, {});
  r += product(eq, "-Fy^T mu", "Fy", PARTS_FY(-1), "mu", mu, {}, us);
  if (b.nz > 0)
    r += product(
        eq, "fy_rho^T mu_z", "fy_rho",
        {{"f_rho", "f_rho", &b.f_rho, 1}, {"f_q N_rho", "f_q_N", &x.f_q_N, 1}, {"f_v V_rho", "f_v_V", &x.f_v_V, 1}},
        "mu_z", mu_z, {}, {});
  return r;
}

void MaggiModel::terminal(const AdjointBlocks& b, Vector& out, Vector& gradient) const {
  const Constituents& x = constituents(b);
  begin(Section::terminal);
  const Reduced w = without_reactions(b, true);
  const char* eq = "the elimination of accelerations from w";
  shared_ = true;
  const Vector tau = x.mass.solve(product(eq, "R^T w^_a", "R", {{"R", "R", &b.R, 1}}, "w^_a", w.a, BASES, {}));
  shared_ = false;
  out = Vector::Zero((kept_ ? 3 : 2) * b.f + b.nz);
  eq = "the terminal value mu_y(T)";
  Vector r = product(eq, "R^T w^_q", "R", {{"R", "R", &b.R, 1}}, "w^_q", w.q, BASES, {});
  r += product(eq, "D^T w^_v", "D", {{"D", "D", &b.D, 1}}, "w^_v", w.v, BASES, {});
  r += product(eq, "A^T w^_a", "A", {{"A", "A", &b.A, 1}}, "w^_a", w.a, BASES, {});
  r += product(eq, "-Ky^T tau", "Ky", PARTS_KY(-1), "tau", tau, SQUARE_Y, {});
  out.head(b.f) = r;
  eq = kept_ ? "the terminal value P(T)" : "the terminal value mu_yd(T)";
  r = product(eq, "R^T w^_v", "R", {{"R", "R", &b.R, 1}}, "w^_v", w.v, BASES, {});
  r += product(eq, "E^T w^_a", "E", {{"E", "E", &b.E, 1}}, "w^_a", w.a, BASES, {});
  r += product(eq, "-Cy^T tau", "Cy", PARTS_CY(-1), "tau", tau, SQUARE_Y, {});
  out.segment(b.f, b.f) = r;
  if (b.nz > 0) {
    eq = "the terminal value mu_z(T)";
    out.segment(2 * b.f, b.nz) = vector(eq, "w_z", b.w_z, 1) +
                                 product(eq, "Q_z^T s", "Q_z", {{"Q_z", "Q_z", &b.Q_z, 1}}, "s", w.s, {}, {}) +
                                 product(eq, "Qy_z^T tau", "Qy_z", {{"Qy_z", "Qy_z", &b.Qy_z, 1}}, "tau", tau, {}, {});
  }
  eq = "the gradient at T";
  gradient += vector(eq, "w_rho", b.w_rho, 1);
  gradient += product(eq, "-F_rho^T s", "F_rho", PARTS_F(-1), "s", w.s, {}, {});
  gradient += product(eq, "N_rho^T w^_q", "N_rho", {{"N_rho", "N_rho", &b.N_rho, 1}}, "w^_q", w.q, BASES_RHO, {});
  gradient += product(eq, "V_rho^T w^_v", "V_rho", {{"V_rho", "V_rho", &b.V_rho, 1}}, "w^_v", w.v, BASES_RHO, {});
  gradient += product(eq, "A_rho^T w^_a", "A_rho", {{"A_rho", "A_rho", &b.A_rho, 1}}, "w^_a", w.a, BASES_RHO, {});
  gradient += product(eq, "-Fy^T tau", "Fy", PARTS_FY(-1), "tau", tau, {}, {});
}

MaggiModel::Vector MaggiModel::start_contribution(const AdjointBlocks& b, const Vector& all, const Matrix& Sq0,
                                                  const Matrix& Sv0, const Matrix& Sz0) const {
  begin(Section::start);
  const char* eq = "the gradient's terms at the start";
  const char* second = kept_ ? "P" : "mu_yd";
  const Vector mu_y = all.head(b.f), mu_yd = all.segment(b.f, b.f), mu_z = all.segment(2 * b.f, b.nz);
  const Matrix Sy0 = b.B * Sq0, Syd0 = b.B * Sv0;
  const Named us = {{"mu_y", &mu_y}, {second, &mu_yd}};
  Vector r = product(eq, "mu_y^T B Sq0", "B Sq0", {{"B Sq0", "B Sq0", &Sy0, 1}}, "mu_y", mu_y, {{"B Sv0", &Syd0}}, us);
  r += product(eq, kept_ ? "P^T B Sv0" : "mu_yd^T B Sv0", "B Sv0", {{"B Sv0", "B Sv0", &Syd0, 1}}, second, mu_yd,
               {{"B Sq0", &Sy0}}, us);
  if (b.nz > 0) r += product(eq, "mu_z^T Sz0", "Sz0", {{"Sz0", "Sz0", &Sz0, 1}}, "mu_z", mu_z, {}, {});
  return r;
}

#undef PARTS_K
#undef PARTS_F
#undef PARTS_KY
#undef PARTS_CY
#undef PARTS_FY
#undef BASES
#undef BASES_RHO
#undef SQUARE_Y

}  // namespace costate
