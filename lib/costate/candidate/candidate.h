// Bring your own adjoint: the interface that a researcher's own adjoint equations are written against, header only.
//
// A candidate is one C++ file: a class derived from CandidateAdjoint and one line COSTATE_CANDIDATE(MyAdjoint). CMake:
//   find_package(costate REQUIRED)
//   costate_add_candidate(my_adjoint my_adjoint.cpp)
// and then
//   costate check SCENE --candidate ./my_adjoint.so
// An example is apps/tutorial/my_adjoint/. Notation as in lib/README.md:
//   R1 = M a + Phi_q^T lambda - Q = 0,  psi = w|_T + int g dt,  K = R1_q,  C = R1_v,  F_rho = R1_rho.
//
// The unknowns mu are groups stacked in the order of unknowns(). The names that the checker can compare term by term:
//   mu_q   multipliers of q' = v (n)                      mu_v   those of v' = a at acceleration level (n)
//   P      momenta: M mu - g_a, at acceleration level the same as mu_v (n)
//   mu_z   multipliers of z' = f (nz)
//   s1, s2 multipliers of R1 (n) and R2 (m) at acceleration level, where they are kept as unknowns
//   mu, nu, kappa   multipliers of R1 (n), of Phi and of Phidot (m) of index 3 and index 2
// and of Maggi's formulations (lib/README.md (5)), whose independent coordinates are called y = B q here, because z are
// the force states (f: degrees of freedom):
//   mu_y, mu_yd     multipliers of y' and yd' (f), where lib/README.md (5.5) has mu_z, mu_zd
//   P               My mu - g_ydd (f), the same as mu_yd;  mu  multiplier of R^T R1 = 0 (f), where it is kept as an
//   unknown
// "penalty-second-order" and "maggi-second-order" integrate mu, the multiplier of R1 (n) or of R^T R1 = 0 (f), mu_dot =
// mu' and mu_z; running costs on accelerations or reactions are refused there. mu_q, mu_v, mu_y, mu_yd, P, mu_z, mu_dot
// (and mu beside it) are differential unknowns, all others algebraic (see Group).
#pragma once

#include <Eigen/Dense>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace costate {

/// Everything that adjoint equations are made of, at one point of the trajectory. Dense; rows are equations, columns
/// what is differentiated for. `rho` stands for the parameters.
struct AdjointBlocks {
  using Matrix = Eigen::MatrixXd;
  using Vector = Eigen::VectorXd;

  int n = 0, m = 0, nz = 0, np = 0;  // coordinates, constraint rows, force states, parameters
  double t = 0;
  Vector q, v, a, lambda, z, rho;

  Matrix M, Phi_q;
  Matrix K, C;                // R1_q = (M a)_q + (Phi_q^T lambda)_q - Q_q and R1_v = -Q_v
  Matrix Ma_q, Phi_lambda_q;  // (M a)_q and (Phi_q^T lambda)_q
  Matrix Q_q, Q_v, Q_z;       // Q holds applied and velocity-dependent inertia forces
  Matrix Phid_q, Phidd_q;     // of Phidot and Phiddot; Phidd_v = 2 Phid_q, Phidd_a = Phi_q
  Matrix R2_q, R2_v;          // R2 = Phidd + 2 xi omega Phidot + omega^2 Phi - lambda / alpha
  Matrix f_q, f_v, f_z;       // of z' = f(t, q, v, z, rho)

  // Maggi only, else f = 0 and all empty: [Phi_q; B]^-1 = [S R], and what small changes of the motion are,
  //   dq = R dy + N_rho drho,  dv = R dyd + D dy + V_rho drho,  da = R dydd + E dyd + A dy + A_rho drho,
  //   R^T dR1 = My dydd + Cy dyd + Ky dy - Qy_z dz + Fy drho,   dz' = f_yd dyd + f_y dy + f_z dz + fy_rho drho,
  //   dlambda = -S^T (M da + C dv + K dq - Q_z dz + F_rho drho).
  // The choice B may change on the way. Between the pieces the unknowns are transformed as (5.12) says, by the checker:
  // a candidate sees one choice only. With redundant rows [S R] is a pseudo-inverse; what the reactions' least norm
  // adds to a cost on them is in g_q, g_rho, w_q, w_rho already.
  int f = 0;
  Matrix B, R, S;                      // f x n, n x f, n x m
  Matrix D, E, A;                      // n x f: D = R', E = 2 D, A = R''
  Matrix My, Cy, Ky, Qy_z, f_yd, f_y;  // f x f, Qy_z = R^T Q_z: f x nz, f_yd = f_v R and f_y = f_q R + f_v D: nz x f
  Matrix N_rho, V_rho, A_rho, Fy, fy_rho;

  Matrix F_rho;  // R1_rho = (M a)_rho + (Phi_q^T lambda)_rho - Q_rho
  Matrix Ma_rho, Phi_lambda_rho, Q_rho;
  Matrix Phi_rho, Phid_rho, Phidd_rho, R2_rho, f_rho;

  // "penalty-second-order" and "maggi-second-order" only: time derivatives along the motion, exact, and with
  //   Mb = M + alpha Phi_q^T Phi_q,  Cb = C + alpha Phi_q^T R2_v,  Kb = K + alpha Phi_q^T R2_q,
  //   Rb = F_rho + alpha Phi_q^T R2_rho
  // what the equations of second order (lib/README.md (4.3), (5.8)) are written in. Maggi's are My, Cy, Ky, Fy above
  // and their rates. In Mb_ddot and Cb_dot terms with alpha cancel: the compact form of the penalty costs log10(alpha
  // M^-1) digits of the trajectory's accuracy. The candidate is judged by what the exact compact equations reach on it.
  Matrix Mb, Mb_dot, Mb_ddot, Cb, Cb_dot, Kb, Rb;     // penalty
  Matrix My_dot, My_ddot, Cy_dot, f_yd_dot, f_v_dot;  // Maggi; f_v_dot of both
  Vector g_v_dot;                                     // (g_v)'
  Vector g_y, g_yd, g_yd_dot;                         // Maggi: R^T g_q + D^T g_v, R^T g_v, (R^T g_v)'

  Vector g_q, g_v, g_a, g_lambda, g_z, g_rho;  // running cost
  Vector w_q, w_v, w_a, w_lambda, w_z, w_rho;  // terminal cost, evaluated at this point
  /// Along the motion, exact; only set where terminal() is called, and g_a_dot, g_lambda_dot not for Maggi's
  /// formulations.
  Matrix M_dot;
  Vector g_a_dot, g_lambda_dot;

  double xi = 0, omega = 0;  // stabilisation; zero for index 1, 2, 3
  double inverse_alpha = 0;  // penalty: 1 / alpha; zero for exact constraints
  double alpha() const { return 1 / inverse_alpha; }

  /// [s1; s2] of [[M, Phi_q^T], [Phi_q, -1/alpha]] [s1; s2] = [top; bottom].
  Vector solve_kkt(const Vector& top, const Vector& bottom) const {
    if (!kkt_) {
      Matrix kkt = Matrix::Zero(n + m, n + m);
      kkt.topLeftCorner(n, n) = M;
      kkt.topRightCorner(n, m) = Phi_q.transpose();
      kkt.bottomLeftCorner(m, n) = Phi_q;
      kkt.bottomRightCorner(m, m).diagonal().setConstant(-inverse_alpha);
      kkt_ = std::make_shared<Eigen::PartialPivLU<Matrix>>(kkt);
    }
    Vector b(n + m);
    b << top, bottom;
    return kkt_->solve(b);
  }
  mutable std::shared_ptr<const Eigen::PartialPivLU<Matrix>> kkt_;  // factored at the first solve
};

class CandidateAdjoint {
 public:
  using Matrix = Eigen::MatrixXd;
  using Vector = Eigen::VectorXd;
  /// Consecutive unknowns: `size` is 'n', 'm', 'z' or 'f' (coordinates, constraint rows, force states, degrees of
  /// freedom).
  struct Group {
    std::string name;
    char size = 'n';
    bool differential = true;
    int count(const AdjointBlocks& b) const { return size == 'n' ? b.n : size == 'm' ? b.m : size == 'z' ? b.nz : b.f; }
  };

  virtual ~CandidateAdjoint() = default;

  /// Its name, one of those of `costate list formulations`.
  virtual std::string formulation() const = 0;
  /// Default: mu_q, mu_v, mu_z; of Maggi's formulations mu_y, mu_yd, mu_z; of those of second order mu, mu_dot, mu_z.
  virtual std::vector<Group> unknowns() const { return usual_; }
  /// That default. The checker, which knows the formulation, tells it before it asks for anything else.
  void tell_usual_unknowns(std::vector<Group> groups) const { usual_ = std::move(groups); }

  // The backward system: one of the two. Both are linear (affine) in mu; time runs forward, mu' = d mu / dt.
  /// mu' on differential unknowns; on algebraic ones an expression that has to vanish.
  virtual Vector rhs(const AdjointBlocks&, const Vector& /*mu*/) const {
    throw std::logic_error("the candidate has neither rhs() nor residual()");
  }
  /// Vanishes on the solution. Equations stand in any order.
  virtual Vector residual(const AdjointBlocks& b, const Vector& mu, const Vector& mu_dot) const {
    Vector r = rhs(b, mu);
    int row = 0;
    for (const Group& g : unknowns()) {
      const int count = g.count(b);
      if (g.differential && row + count <= r.size())
        r.segment(row, count) = mu_dot.segment(row, count) - r.segment(row, count);
      row += count;
    }
    return r;
  }

  /// mu(T) from the blocks at T (entries of algebraic unknowns are not used), and the terms that the gradient gains
  /// there: gradient += w_rho and those of elimination and of boundary multipliers.
  virtual void terminal(const AdjointBlocks& b, Vector& mu, Vector& gradient) const = 0;
  /// The gradient's integrand, np entries.
  virtual Vector integrand(const AdjointBlocks& b, const Vector& mu) const = 0;
  /// What the gradient gains at the start, np entries, by default mu_q^T Sq0 + mu_v^T Sv0 + mu_z^T Sz0 of unknowns
  /// that begin with three such groups, or mu_y^T B Sq0 + mu_yd^T B Sv0 + mu_z^T Sz0; of second order there is no
  /// default. Sq0 = dq/drho at the start (n x np), and so on.
  virtual Vector start_contribution(const AdjointBlocks& b, const Vector& mu, const Matrix& Sq0, const Matrix& Sv0,
                                    const Matrix& Sz0) const {
    if (unknowns().front().name == "mu") throw std::logic_error("the candidate has no start_contribution()");
    if (unknowns().front().size == 'f')
      return (b.B * Sq0).transpose() * mu.head(b.f) + (b.B * Sv0).transpose() * mu.segment(b.f, b.f) +
             Sz0.transpose() * mu.segment(2 * b.f, b.nz);
    return Sq0.transpose() * mu.head(b.n) + Sv0.transpose() * mu.segment(b.n, b.n) +
           Sz0.transpose() * mu.segment(2 * b.n, b.nz);
  }

 private:
  mutable std::vector<Group> usual_;
};

/// Changes with every change of this header that a built candidate would notice.
inline constexpr int kCandidateAbi = 3;
/// What a candidate library tells about how it was built.
struct CandidateBuild {
  int abi = kCandidateAbi;
  int blocks_size = static_cast<int>(sizeof(AdjointBlocks));
  int alignment = static_cast<int>(EIGEN_MAX_ALIGN_BYTES);
};

}  // namespace costate

#define COSTATE_CANDIDATE(Class)                                                                               \
  extern "C" __attribute__((visibility("default"))) void costate_candidate_build(costate::CandidateBuild* b) { \
    *b = costate::CandidateBuild{};                                                                            \
  }                                                                                                            \
  extern "C" __attribute__((visibility("default"))) costate::CandidateAdjoint* costate_candidate_make() {      \
    return new Class;                                                                                          \
  }
