#include "costate/candidate/candidate_second_order.h"

#include <type_traits>

namespace costate {

namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

/// The blocks of one of the two formulations, and what they are called.
struct Blocks {
  const Matrix &M, &M1, &M2, &C, &C1, &K, &F, &Qz, &f_q, &f_v, &f_v1, &f_rho;
  const Vector &g_q, &g_v, &g_v1;
  const char *nM, *nM1, *nM2, *nC, *nC1, *nK, *nF, *nQz, *nf_q, *nf_v, *nf_v1;
};

Blocks of_penalty(const AdjointBlocks& b) {
  return {b.Mb,  b.Mb_dot,  b.Mb_ddot, b.Cb,  b.Cb_dot, b.Kb,      b.Rb,        b.Q_z,   b.f_q,
          b.f_v, b.f_v_dot, b.f_rho,   b.g_q, b.g_v,    b.g_v_dot, "Mb mu_dot", "Mb'",   "Mb''",
          "Cb",  "Cb'",     "Kb",      "Rb",  "Q_z",    "f_q",     "f_v",       "(f_v)'"};
}
Blocks of_maggi(const AdjointBlocks& b) {
  return {b.My,   b.My_dot,   b.My_ddot, b.Cy,  b.Cy_dot, b.Ky,       b.Fy,        b.Qy_z,   b.f_y,
          b.f_yd, b.f_yd_dot, b.fy_rho,  b.g_y, b.g_yd,   b.g_yd_dot, "My mu_dot", "My'",    "My''",
          "Cy",   "Cy'",      "Ky",      "Fy",  "Qy_z",   "f_y",      "f_yd",      "(f_yd)'"};
}
template <class First>
Blocks blocks_of(const AdjointBlocks& b) {
  if constexpr (std::is_same_v<First, MaggiModel>) return of_maggi(b);
  return of_penalty(b);
}

}  // namespace

#define SQUARE                                                                   \
  {                                                                              \
    {x.nM1, &x.M1}, {x.nM2, &x.M2}, {x.nC, &x.C}, {x.nC1, &x.C1}, { x.nK, &x.K } \
  }

template <class First>
auto SecondOrderModel<First>::rest(const AdjointBlocks& b, const char* eq, const Vector& mu, const Vector& mu_z) const
    -> Vector {
  const Blocks x = blocks_of<First>(b);
  Vector r = this->vector(eq, std::is_same_v<First, MaggiModel> ? "-g_yd" : "-g_v", x.g_v, -1);
  r += this->product(eq, "-M' mu", x.nM1, {{"-M' mu", x.nM1, &x.M1, -1}}, "mu", mu, {}, {}, false);
  r += this->product(eq, "C^T mu", x.nC, {{"C^T mu", x.nC, &x.C, 1}}, "mu", mu, {}, {});
  if (b.nz > 0)
    r += this->product(eq, "-f_v^T mu_z", x.nf_v, {{"-f_v^T mu_z", x.nf_v, &x.f_v, -1}}, "mu_z", mu_z, {}, {});
  return r;
}

template <class First>
auto SecondOrderModel<First>::rhs(const AdjointBlocks& b, const Vector& all) const -> Vector {
  const Blocks x = blocks_of<First>(b);
  const auto k = x.M.rows();
  const Vector mu = all.head(k), mu_dot = all.segment(k, k), mu_z = all.segment(2 * k, b.nz);
  this->begin(Section::solve);
  this->begin(Section::flow);
  Vector out(all.size());
  out.head(k) = this->vector("the equation of mu'", "mu_dot", mu_dot, 1, {{"mu", &mu}});
  const Vector mu_z_dot = -b.g_z - x.Qz.transpose() * mu - b.f_z.transpose() * mu_z;
  const char* eq = "the equation of mu_dot'";
  const typename First::Named us = {{"mu", &mu}, {"mu_dot", &mu_dot}};
  constexpr bool maggi = std::is_same_v<First, MaggiModel>;
  Vector r = this->vector(eq, maggi ? "g_y" : "g_q", x.g_q, 1);
  r += this->vector(eq, maggi ? "-(g_yd)'" : "-(g_v)'", x.g_v1, -1);
  r += this->product(eq, "-2 M' mu_dot", x.nM1, {{"-2 M' mu_dot", x.nM1, &x.M1, -2}}, "mu_dot", mu_dot, {}, us, false);
  r += this->product(eq, "C^T mu_dot", x.nC, {{"C^T mu_dot", x.nC, &x.C, 1}}, "mu_dot", mu_dot, SQUARE, us);
  r += this->product(eq, "-M'' mu", x.nM2, {{"-M'' mu", x.nM2, &x.M2, -1}}, "mu", mu, {}, us, false);
  r += this->product(eq, "C'^T mu", x.nC1, {{"C'^T mu", x.nC1, &x.C1, 1}}, "mu", mu, SQUARE, us);
  r += this->product(eq, "-K^T mu", x.nK, {{"-K^T mu", x.nK, &x.K, -1}}, "mu", mu, {}, us);
  if (b.nz > 0) {
    r += this->product(eq, "f_q^T mu_z", x.nf_q, {{"f_q^T mu_z", x.nf_q, &x.f_q, 1}}, "mu_z", mu_z, {}, {});
    r += this->product(eq, "-f_v'^T mu_z", x.nf_v1, {{"-f_v'^T mu_z", x.nf_v1, &x.f_v1, -1}}, "mu_z", mu_z, {}, {});
    r += this->product(eq, "-f_v^T mu_z'", x.nf_v, {{"-f_v^T mu_z'", x.nf_v, &x.f_v, -1}}, "mu_z'", mu_z_dot, {}, {});
  }
  out.segment(k, k) = x.M.ldlt().solve(r);
  if (b.nz > 0) {
    eq = "the equation of mu_z'";
    out.segment(2 * k, b.nz) =
        this->vector(eq, "-g_z", b.g_z, -1) +
        this->product(eq, "-Q_z^T mu", x.nQz, {{"-Q_z^T mu", x.nQz, &x.Qz, -1}}, "mu", mu, {}, us) +
        this->product(eq, "-f_z^T mu_z", "f_z", {{"-f_z^T mu_z", "f_z", &b.f_z, -1}}, "mu_z", mu_z, {}, {});
  }
  return out;
}

template <class First>
auto SecondOrderModel<First>::integrand(const AdjointBlocks& b, const Vector& all) const -> Vector {
  const Blocks x = blocks_of<First>(b);
  const auto k = x.M.rows();
  const Vector mu = all.head(k), mu_dot = all.segment(k, k), mu_z = all.segment(2 * k, b.nz);
  this->begin(Section::integrand);
  const char* eq = "the gradient's integrand";
  constexpr bool maggi = std::is_same_v<First, MaggiModel>;
  Vector r = this->vector(eq, "g_rho", b.g_rho, 1);
  if constexpr (maggi) {
    r += this->product(eq, "N_rho^T g_q", "N_rho", {{"N_rho", "N_rho", &b.N_rho, 1}}, "g_q", b.g_q, {}, {});
    r += this->product(eq, "V_rho^T g_v", "V_rho", {{"V_rho", "V_rho", &b.V_rho, 1}}, "g_v", b.g_v, {}, {});
  }
  r += this->product(eq, maggi ? "-Fy^T mu" : "-Rb^T mu", x.nF, {{maggi ? "-Fy^T mu" : "-Rb^T mu", x.nF, &x.F, -1}},
                     "mu", mu, {}, {{"mu", &mu}, {"mu_dot", &mu_dot}});
  if (b.nz > 0)
    r += this->product(eq, "f_rho^T mu_z", "f_rho", {{"f_rho^T mu_z", "f_rho", &x.f_rho, 1}}, "mu_z", mu_z, {}, {});
  return r;
}

template <class First>
void SecondOrderModel<First>::terminal(const AdjointBlocks& b, Vector& out, Vector& gradient) const {
  const Blocks x = blocks_of<First>(b);
  const auto k = x.M.rows();
  // The end values of first order stand behind all of those of second order.
  this->all_shared_ = true;
  Vector first;
  First::terminal(b, first, gradient);
  const Vector mu_q = first.head(k), mu_v = first.segment(k, k), mu_z = first.segment(2 * k, b.nz);
  const char* eq = "the terminal value mu_dot(T)";
  const Eigen::LDLT<Matrix> mass(x.M);
  const Vector mu = mass.solve(mu_v);
  this->all_shared_ = false;
  out.resize(first.size());
  out << mu,
      mass.solve(rest(b, eq, mu, mu_z) +
                 this->vector(eq, std::is_same_v<First, MaggiModel> ? "-mu_y(T)" : "-mu_q(T)", mu_q, -1)),
      mu_z;
}

template <class First>
auto SecondOrderModel<First>::start_contribution(const AdjointBlocks& b, const Vector& all, const Matrix& Sq0,
                                                 const Matrix& Sv0, const Matrix& Sz0) const -> Vector {
  const Blocks x = blocks_of<First>(b);
  const auto k = x.M.rows();
  const Vector mu = all.head(k), mu_dot = all.segment(k, k), mu_z = all.segment(2 * k, b.nz);
  this->begin(Section::start);
  const char* eq = "the gradient's terms at the start";
  Vector mu_q = rest(b, eq, mu, mu_z);
  mu_q += this->product(eq, "-M mu_dot", x.nM, {{"-M mu_dot", x.nM, &x.M, -1}}, "mu_dot", mu_dot, {}, {}, false);
  const Vector mu_v = this->product(eq, "M mu", x.nM, {{"M mu", x.nM, &x.M, 1}}, "mu", mu, {}, {}, false);
  Vector r = Vector::Zero(Sq0.cols());
  if constexpr (std::is_same_v<First, MaggiModel>)
    r += (b.B * Sq0).transpose() * mu_q + (b.B * Sv0).transpose() * mu_v;
  else
    r += Sq0.transpose() * mu_q + Sv0.transpose() * mu_v;
  if (b.nz > 0) r += this->product(eq, "mu_z^T Sz0", "Sz0", {{"Sz0", "Sz0", &Sz0, 1}}, "mu_z", mu_z, {}, {});
  return r;
}

template class SecondOrderModel<MaggiModel>;
template class SecondOrderModel<CoordinateModel>;

#undef SQUARE

}  // namespace costate
