#include "costate/candidate/candidate_coordinates.h"

#include "costate/formulation/formulation.h"

namespace costate {

CoordinateModel::CoordinateModel(std::string formulation, bool kept)
    : AdjointModel(std::move(formulation)),
      acceleration_(find_formulation(formulation_).constraints == ConstraintForm::acceleration),
      index3_(find_formulation(formulation_).constraints == ConstraintForm::index3),
      kept_(kept && acceleration_) {}

std::vector<CandidateAdjoint::Group> CoordinateModel::unknowns() const {
  std::vector<Group> g = {{"mu_q", 'n', true}, {acceleration_ ? "mu_v" : "P", 'n', true}, {"mu_z", 'z', true}};
  if (kept_) {
    g.push_back({"s1", 'n', false});
    g.push_back({"s2", 'm', false});
  } else if (!acceleration_) {
    g.push_back({"mu", 'n', false});
    g.push_back({"nu", 'm', false});
    if (!index3()) g.push_back({"kappa", 'm', false});
  }
  return g;
}

CoordinateModel::Solved CoordinateModel::solve_kkt(const AdjointBlocks& b, const char* where, const char* names[2],
                                                   const Vector& top, const Vector& bottom) const {
  const bool before = std::exchange(shared_, true);
  const double up = coefficient(where, names[0]), down = coefficient(where, names[1]),
               corner = b.inverse_alpha != 0 ? coefficient(where, "the penalty's -1/alpha") : 1;
  shared_ = before;
  Vector s;
  if (up == 1 && down == 1 && corner == 1) {
    s = b.solve_kkt(top, bottom);
  } else {
    Matrix A = Matrix::Zero(b.n + b.m, b.n + b.m);
    A.topLeftCorner(b.n, b.n) = b.M;
    A.topRightCorner(b.n, b.m) = up * b.Phi_q.transpose();
    A.bottomLeftCorner(b.m, b.n) = down * b.Phi_q;
    A.bottomRightCorner(b.m, b.m).diagonal().setConstant(-corner * b.inverse_alpha);
    Vector r(b.n + b.m);
    r << top, bottom;
    s = A.partialPivLu().solve(r);
  }
  return {s.head(b.n), s.tail(b.m)};
}

namespace {
const char* const kSolve = "the solve for s1 and s2";
}

CoordinateModel::Solved CoordinateModel::solve(const AdjointBlocks& b, const Vector& mu_v) const {
  begin(Section::solve);
  const Vector top = vector(kSolve, "mu_v", mu_v, 1) + vector(kSolve, "g_a", b.g_a, 1);
  const Vector bottom = vector(kSolve, "g_lambda", b.g_lambda, 1);
  const char* names[2] = {"Phi_q^T s2", "Phi_q s1"};
  return solve_kkt(b, kSolve, names, top, bottom);
}

// K^T s and the like occur in the flow (sign +1) and in terminal eliminations (sign -1).
#define PARTS_K(c)                                                                                 \
  {                                                                                                \
    {"(M a)_q", "Ma_q", &b.Ma_q, c}, {"(Phi_q^T lambda)_q", "Phi_lambda_q", &b.Phi_lambda_q, c}, { \
      "-Q_q", "Q_q", &b.Q_q, -(c)                                                                  \
    }                                                                                              \
  }
#define PARTS_C(c)                  \
  {                                 \
    { "-Q_v", "Q_v", &b.Q_v, -(c) } \
  }
#define PARTS_R2Q(c)                                                                                             \
  {                                                                                                              \
    {"Phidd_q", "Phidd_q", &b.Phidd_q, c}, {"2 xi omega Phid_q", "Phid_q", &b.Phid_q, (c)*2 * b.xi * b.omega}, { \
      "omega^2 Phi_q", "Phi_q", &b.Phi_q, (c)*b.omega* b.omega                                                   \
    }                                                                                                            \
  }
#define PARTS_R2V(c)                                                                                           \
  {                                                                                                            \
    {"2 Phid_q", "Phid_q", &b.Phid_q, (c)*2}, { "2 xi omega Phi_q", "Phi_q", &b.Phi_q, (c)*2 * b.xi* b.omega } \
  }
#define PARTS_F(c)                                                                                             \
  {                                                                                                            \
    {"(M a)_rho", "Ma_rho", &b.Ma_rho, c}, {"(Phi_q^T lambda)_rho", "Phi_lambda_rho", &b.Phi_lambda_rho, c}, { \
      "-Q_rho", "Q_rho", &b.Q_rho, -(c)                                                                        \
    }                                                                                                          \
  }
#define PARTS_R2RHO(c)                                                              \
  {                                                                                 \
    {"Phidd_rho", "Phidd_rho", &b.Phidd_rho, c},                                    \
        {"2 xi omega Phid_rho", "Phid_rho", &b.Phid_rho, (c)*2 * b.xi * b.omega}, { \
      "omega^2 Phi_rho", "Phi_rho", &b.Phi_rho, (c)*b.omega* b.omega                \
    }                                                                               \
  }
#define SQUARE                              \
  {                                         \
    {"M", &b.M}, {"K", &b.K}, { "C", &b.C } \
  }
#define ROWS                                                                                                    \
  {                                                                                                             \
    {"Phi_q", &b.Phi_q}, {"Phid_q", &b.Phid_q}, {"Phidd_q", &b.Phidd_q}, {"R2_q", &b.R2_q}, { "R2_v", &b.R2_v } \
  }
#define ROWS_RHO                                                                                             \
  {                                                                                                          \
    {"Phi_rho", &b.Phi_rho}, {"Phid_rho", &b.Phid_rho}, {"Phidd_rho", &b.Phidd_rho}, { "R2_rho", &b.R2_rho } \
  }
#define STATE_ROWS                     \
  {                                    \
    {"f_q", &b.f_q}, { "f_v", &b.f_v } \
  }

CoordinateModel::Multipliers CoordinateModel::multipliers(const AdjointBlocks& b, const Vector& x) const {
  if (acceleration_ && !kept_) {
    const Solved s = solve(b, x.segment(b.n, b.n));
    return {s.s1, s.s2, {}};
  }
  const int first = 2 * b.n + b.nz, rows = first + b.n;
  return {x.segment(first, b.n), x.segment(rows, b.m),
          acceleration_ || index3() ? Vector() : Vector(x.segment(rows + b.m, b.m))};
}

CoordinateModel::Vector CoordinateModel::rhs(const AdjointBlocks& b, const Vector& x) const {
  const int n = b.n, m = b.m, nz = b.nz;
  const Vector mu_q = x.head(n), mu_v = x.segment(n, n), mu_z = x.segment(2 * n, nz);
  const auto [s1, s2, kappa] = multipliers(b, x);
  begin(Section::flow);
  const bool second = kappa.size() > 0;
  const char *us = acceleration_ ? "s1" : "mu", *ul = acceleration_ ? "s2" : "nu", *uv = acceleration_ ? "mu_v" : "P";
  const Named ns = {{"mu_q", &mu_q}, {uv, &mu_v}, {us, &s1}};
  Named ms = {{ul, &s2}};
  if (second) ms.push_back({"kappa", &kappa});
  const Named gs = {{"g_q", &b.g_q}, {"g_v", &b.g_v}, {"g_a", &b.g_a}};
  Vector out(x.size());

  const char* eq = "the equation of mu_q'";
  Vector q = vector(eq, "-g_q", b.g_q, -1, gs);
  q += product(eq, acceleration_ ? "K^T s1" : "K^T mu", "K", PARTS_K(1), us, s1, SQUARE, ns);
  if (acceleration_)
    q += product(eq, "R2_q^T s2", "R2_q", PARTS_R2Q(1), "s2", s2, ROWS, {});
  else
    q += product(eq, "Phi_q^T nu", "Phi_q", {{"Phi_q", "Phi_q", &b.Phi_q, 1}}, "nu", s2, ROWS, ms);
  if (second)
    q += product(eq, "Phid_q^T kappa", "Phid_q", {{"Phid_q", "Phid_q", &b.Phid_q, 1}}, "kappa", kappa, ROWS, ms);
  if (nz > 0) q += product(eq, "-f_q^T mu_z", "f_q", {{"f_q", "f_q", &b.f_q, -1}}, "mu_z", mu_z, STATE_ROWS, {});
  out.head(n) = q;

  eq = acceleration_ ? "the equation of mu_v'" : "the equation of P'";
  Vector v = vector(eq, "-g_v", b.g_v, -1, gs);
  v += vector(eq, "-mu_q", mu_q, -1, ns);
  v += product(eq, acceleration_ ? "C^T s1" : "C^T mu", "C", PARTS_C(1), us, s1, SQUARE, ns);
  if (acceleration_)
    v += product(eq, "R2_v^T s2", "R2_v", PARTS_R2V(1), "s2", s2, ROWS, {});
  else if (second)
    v += product(eq, "Phi_q^T kappa", "Phi_q", {{"Phi_q", "Phi_q", &b.Phi_q, 1}}, "kappa", kappa, ROWS, ms);
  if (nz > 0) v += product(eq, "-f_v^T mu_z", "f_v", {{"f_v", "f_v", &b.f_v, -1}}, "mu_z", mu_z, STATE_ROWS, {});
  out.segment(n, n) = v;

  if (nz > 0) {
    eq = "the equation of mu_z'";
    out.segment(2 * n, nz) =
        vector(eq, "-g_z", b.g_z, -1) +
        product(eq, acceleration_ ? "-Q_z^T s1" : "-Q_z^T mu", "Q_z", {{"Q_z", "Q_z", &b.Q_z, -1}}, us, s1, {}, ns) +
        product(eq, "-f_z^T mu_z", "f_z", {{"f_z", "f_z", &b.f_z, -1}}, "mu_z", mu_z, {}, {});
  }
  const int row = 2 * n + nz;
  if (kept_) {
    eq = "the algebraic equation of s1";
    out.segment(row, n) = product(eq, "M s1", "M", {{"M", "M", &b.M, 1}}, us, s1, SQUARE, ns, false) +
                          product(eq, "Phi_q^T s2", "Phi_q", {{"Phi_q", "Phi_q", &b.Phi_q, 1}}, "s2", s2, ROWS, {}) +
                          vector(eq, "-mu_v", mu_v, -1, ns) + vector(eq, "-g_a", b.g_a, -1, gs);
    eq = "the algebraic equation of s2";
    Vector r = product(eq, "Phi_q s1", "Phi_q", {{"Phi_q", "Phi_q", &b.Phi_q, 1}}, us, s1, ROWS, ns, false);
    r += vector(eq, "-g_lambda", b.g_lambda, -1);
    if (b.inverse_alpha != 0) r += vector(eq, "-s2 / alpha", s2, -b.inverse_alpha);
    out.segment(row + n, m) = r;
  } else if (!acceleration_) {
    eq = "the definition of P";
    out.segment(row, n) = product(eq, "M mu", "M", {{"M", "M", &b.M, 1}}, us, s1, SQUARE, ns, false) +
                          vector(eq, "-g_a", b.g_a, -1, gs) + vector(eq, "-P", mu_v, -1, ns);
    eq = "the constraint on mu";
    out.segment(row + n, m) =
        product(eq, "Phi_q mu", "Phi_q", {{"Phi_q", "Phi_q", &b.Phi_q, 1}}, us, s1, ROWS, ns, false) +
        vector(eq, "-g_lambda", b.g_lambda, -1);
    if (second)
      out.segment(row + n + m, m) = product("the constraint on mu_q", "Phi_q mu_q", "Phi_q",
                                            {{"Phi_q", "Phi_q", &b.Phi_q, 1}}, "mu_q", mu_q, ROWS, ns, false);
  }
  return out;
}

CoordinateModel::Vector CoordinateModel::integrand(const AdjointBlocks& b, const Vector& x) const {
  const int n = b.n, nz = b.nz;
  const Vector mu_q = x.head(n), mu_v = x.segment(n, n), mu_z = x.segment(2 * n, nz);
  const auto [s1, s2, kappa] = multipliers(b, x);
  begin(Section::integrand);
  const char* eq = "the gradient's integrand";
  const Named ns = {{"mu_q", &mu_q}, {acceleration_ ? "mu_v" : "P", &mu_v}, {acceleration_ ? "s1" : "mu", &s1}};
  Named ms = {{acceleration_ ? "s2" : "nu", &s2}};
  if (kappa.size() > 0) ms.push_back({"kappa", &kappa});
  Vector r = vector(eq, "g_rho", b.g_rho, 1);
  r += product(eq, acceleration_ ? "-F_rho^T s1" : "-F_rho^T mu", "F_rho", PARTS_F(-1), acceleration_ ? "s1" : "mu", s1,
               {}, ns);
  if (acceleration_)
    r += product(eq, "-R2_rho^T s2", "R2_rho", PARTS_R2RHO(-1), "s2", s2, ROWS_RHO, {});
  else
    r += product(eq, "-Phi_rho^T nu", "Phi_rho", {{"Phi_rho", "Phi_rho", &b.Phi_rho, -1}}, "nu", s2, ROWS_RHO, ms);
  if (kappa.size() > 0)
    r += product(eq, "-Phid_rho^T kappa", "Phid_rho", {{"Phid_rho", "Phid_rho", &b.Phid_rho, -1}}, "kappa", kappa,
                 ROWS_RHO, ms);
  if (nz > 0) r += product(eq, "f_rho^T mu_z", "f_rho", {{"f_rho", "f_rho", &b.f_rho, 1}}, "mu_z", mu_z, {}, {});
  return r;
}

void CoordinateModel::terminal(const AdjointBlocks& b, Vector& mu, Vector& gradient) const {
  begin(Section::terminal);
  const char* eq = "the elimination of accelerations and multipliers from w";
  Vector tau1 = Vector::Zero(b.n), tau2 = Vector::Zero(b.m);
  {
    shared_ = true;
    const Vector top = vector(eq, "w_a", b.w_a, 1), bottom = vector(eq, "w_lambda", b.w_lambda, 1);
    const char* names[2] = {"Phi_q^T tau2", "Phi_q tau1"};
    const Solved tau = solve_kkt(b, eq, names, top, bottom);
    tau1 = result(eq, "tau1", tau.s1,
                  "the terms of tau1 (w_a and w_lambda eliminated by the equations of motion) are missing");
    tau2 = result(eq, "tau2", tau.s2, "the terms of tau2 (w_a and w_lambda eliminated by the constraints) are missing");
    shared_ = false;
  }
  const Named ws = {{"w_q", &b.w_q}, {"w_v", &b.w_v}, {"w_a", &b.w_a}};
  // At acceleration level these are the end values themselves, else they enter boundary multipliers, too.
  shared_ = !acceleration_;
  eq = acceleration_ ? "the terminal value mu_q(T)" : "w^_q (w without accelerations and multipliers)";
  Vector wq = vector(eq, "w_q", b.w_q, 1, ws);
  wq += product(eq, "-K^T tau1", "K", PARTS_K(-1), "tau1", tau1, SQUARE, {});
  wq += product(eq, "-R2_q^T tau2", "R2_q", PARTS_R2Q(-1), "tau2", tau2, ROWS, {});
  eq = acceleration_ ? "the terminal value mu_v(T)" : "w^_v (w without accelerations and multipliers)";
  Vector wv = vector(eq, "w_v", b.w_v, 1, ws);
  wv += product(eq, "-C^T tau1", "C", PARTS_C(-1), "tau1", tau1, SQUARE, {});
  wv += product(eq, "-R2_v^T tau2", "R2_v", PARTS_R2V(-1), "tau2", tau2, ROWS, {});
  Vector wz(b.nz);
  eq = "the terminal value mu_z(T)";
  if (b.nz > 0)
    wz = vector(eq, "w_z", b.w_z, 1) +
         product(eq, "Q_z^T tau1", "Q_z", {{"Q_z", "Q_z", &b.Q_z, 1}}, "tau1", tau1, {}, {});
  shared_ = false;
  eq = "the gradient at T";
  gradient += vector(eq, "w_rho", b.w_rho, 1);
  gradient += product(eq, "-F_rho^T tau1", "F_rho", PARTS_F(-1), "tau1", tau1, {}, {});
  gradient += product(eq, "-R2_rho^T tau2", "R2_rho", PARTS_R2RHO(-1), "tau2", tau2, ROWS_RHO, {});
  if (acceleration_) {
    mu = Vector::Zero(2 * b.n + b.nz + (kept_ ? b.n + b.m : 0));
    mu.head(2 * b.n + b.nz) << wq, wv, wz;
  } else {
    terminal_momentum(b, wq, wv, wz, mu, gradient);
  }
}

void CoordinateModel::terminal_momentum(const AdjointBlocks& b, const Vector& wq, const Vector& wv, const Vector& wz,
                                        Vector& mu_T, Vector& gradient) const {
  const int n = b.n, m = b.m;
  const char* eq = "the boundary multiplier eta_v";
  shared_ = true;
  const Vector top = vector(eq, "w^_v", wv, 1) + vector(eq, "g_a", b.g_a, 1),
               bottom = vector(eq, "g_lambda", b.g_lambda, 1);
  const char* names[2] = {"Phi_q^T eta_v", "Phi_q mu"};
  const Solved first = solve_kkt(b, eq, names, top, bottom);
  const Vector mu = first.s1;
  const Vector eta_v = result(eq, "eta_v", first.s2, "the boundary multiplier eta_v was left out");
  eq = "the boundary multiplier eta_q";
  Vector eta_q;
  if (index3()) {
    Vector r = vector(eq, "-g_v", b.g_v, -1) + vector(eq, "-w^_q", wq, -1);
    r += product(eq, "Phid_q^T eta_v", "Phid_q", {{"Phid_q", "Phid_q", &b.Phid_q, 1}}, "eta_v", eta_v, ROWS, {});
    r += product(eq, "C^T mu", "C", PARTS_C(1), "mu", mu, SQUARE, {});
    r += vector(eq, "(g_a)'", b.g_a_dot, 1);
    r += product(eq, "-M' mu", "M'", {{"M'", "M'", &b.M_dot, -1}}, "mu", mu, {}, {});
    if (b.nz > 0) r += product(eq, "-f_v^T mu_z", "f_v", {{"f_v", "f_v", &b.f_v, -1}}, "mu_z", wz, STATE_ROWS, {});
    Vector l = vector(eq, "(g_lambda)'", b.g_lambda_dot, 1);
    l += product(eq, "-Phid_q mu", "Phid_q", {{"Phid_q", "Phid_q", &b.Phid_q, -1}}, "mu", mu, ROWS, {}, false);
    const char* of[2] = {"-Phi_q^T eta_q", "Phi_q mu'"};
    eta_q = -solve_kkt(b, eq, of, r, l).s2;
  } else {
    Vector r = vector(eq, "w^_q", wq, 1);
    r += product(eq, "-Phid_q^T eta_v", "Phid_q", {{"Phid_q", "Phid_q", &b.Phid_q, -1}}, "eta_v", eta_v, ROWS, {});
    eta_q = m > 0 ? Vector(b.Phi_q.transpose().colPivHouseholderQr().solve(r)) : Vector(0);
  }
  eta_q = result(eq, "eta_q", eta_q, "the boundary multiplier eta_q was left out");
  shared_ = false;
  const Named etas = {{"eta_q", &eta_q}, {"eta_v", &eta_v}};
  eq = "the terminal value mu_q(T)";
  mu_T = Vector::Zero(3 * n + b.nz + (index3() ? m : 2 * m));
  mu_T.head(n) =
      vector(eq, "w^_q", wq, 1, {{"w^_v", &wv}}) +
      product(eq, "-Phi_q^T eta_q", "Phi_q", {{"Phi_q", "Phi_q", &b.Phi_q, -1}}, "eta_q", eta_q, ROWS, etas) +
      product(eq, "-Phid_q^T eta_v", "Phid_q", {{"Phid_q", "Phid_q", &b.Phid_q, -1}}, "eta_v", eta_v, ROWS, etas);
  eq = "the terminal value P(T)";
  mu_T.segment(n, n) =
      vector(eq, "w^_v", wv, 1, {{"w^_q", &wq}}) +
      product(eq, "-Phi_q^T eta_v", "Phi_q", {{"Phi_q", "Phi_q", &b.Phi_q, -1}}, "eta_v", eta_v, ROWS, etas);
  mu_T.segment(2 * n, b.nz) = wz;
  mu_T.segment(2 * n + b.nz, n) = mu;
  eq = "the gradient at T";
  gradient += product(eq, "-Phi_rho^T eta_q", "Phi_rho", {{"Phi_rho", "Phi_rho", &b.Phi_rho, -1}}, "eta_q", eta_q,
                      ROWS_RHO, etas);
  gradient += product(eq, "-Phid_rho^T eta_v", "Phid_rho", {{"Phid_rho", "Phid_rho", &b.Phid_rho, -1}}, "eta_v", eta_v,
                      ROWS_RHO, etas);
}

CoordinateModel::Vector CoordinateModel::start_contribution(const AdjointBlocks& b, const Vector& x, const Matrix& Sq0,
                                                            const Matrix& Sv0, const Matrix& Sz0) const {
  begin(Section::start);
  const char* eq = "the gradient's terms at the start";
  const Vector mu_q = x.head(b.n), mu_v = x.segment(b.n, b.n), mu_z = x.segment(2 * b.n, b.nz);
  const Named ns = {{"mu_q", &mu_q}, {acceleration_ ? "mu_v" : "P", &mu_v}};
  Vector r = product(eq, "mu_q^T Sq0", "Sq0", {{"Sq0", "Sq0", &Sq0, 1}}, "mu_q", mu_q, {{"Sv0", &Sv0}}, ns);
  r += product(eq, acceleration_ ? "mu_v^T Sv0" : "P^T Sv0", "Sv0", {{"Sv0", "Sv0", &Sv0, 1}},
               acceleration_ ? "mu_v" : "P", mu_v, {{"Sq0", &Sq0}}, ns);
  if (b.nz > 0) r += product(eq, "mu_z^T Sz0", "Sz0", {{"Sz0", "Sz0", &Sz0, 1}}, "mu_z", mu_z, {}, {});
  return r;
}

#undef PARTS_K
#undef PARTS_C
#undef PARTS_R2Q
#undef PARTS_R2V
#undef PARTS_F
#undef PARTS_R2RHO
#undef SQUARE
#undef ROWS
#undef ROWS_RHO
#undef STATE_ROWS

}  // namespace costate
