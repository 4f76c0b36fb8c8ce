// Hessians against others: how far apart, and of closed forms of psi.
#pragma once

#include <Eigen/Core>
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "costate/problem/scaled_gradient.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/difference_hessian.h"

namespace costate::test {

/// Its runs are not confirmed by others, and on each formulation's own integrator.
inline Problem unconfirmed(Problem p) {
  p.solver.confirm = false;
  p.solver.integrator.clear();
  return p;
}
/// Of a scene as text.
inline Problem unconfirmed(const std::string& scene) {
  return unconfirmed(make_problem(Scene::parse(scene, "scene.toml")));
}

/// In scaled parameters, against the largest entry of `right`.
inline double apart(const Problem& p, const Eigen::MatrixXd& found, const Eigen::MatrixXd& right) {
  const Eigen::VectorXd s = scales(p.parameters);
  return largest_scaled(s, found - right) / largest_scaled(s, right);
}

/// Of psi(const long double* rho), by differences of fourth order at steps h_j in long double: off by some 1e-9 of its
/// largest entry in units of 1/(h_i h_j) and h = 1e-3 of what rho varies over.
template <class Psi>
Eigen::MatrixXd hessian_of(const Psi& psi, const std::vector<double>& rho, const std::vector<long double>& h) {
  const long double c[] = {1.0L / 12, -8.0L / 12, 8.0L / 12, -1.0L / 12};
  const int at[] = {-2, -1, 1, 2};
  const auto n = static_cast<Eigen::Index>(rho.size());
  Eigen::MatrixXd H(n, n);
  for (std::size_t i = 0; i < rho.size(); ++i)
    for (std::size_t j = 0; j < rho.size(); ++j) {
      long double sum = 0;
      for (int a = 0; a < 4; ++a)
        for (int b = 0; b < 4; ++b) {
          std::vector<long double> p(rho.begin(), rho.end());
          p[i] += at[a] * h[i];
          p[j] += at[b] * h[j];
          sum += c[a] * c[b] * psi(p.data());
        }
      H(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = static_cast<double>(sum / (h[i] * h[j]));
    }
  return H;
}

/// By every formulation that has products; penalties hold constraints by O(1/alpha).
inline void check_closed(Problem p, const Eigen::MatrixXd& expected, double exact) {
  const auto rho = p.parameters.values();
  for (const char* formulation : {"index1", "baumgarte", "penalty", "augmented-lagrangian"}) {
    p.formulation = formulation;
    const Hessian h = hessian(p, rho);
    const double off = apart(p, h.matrix, expected);
    CAPTURE(formulation, off, h.asymmetry);
    INFO(h.matrix << "\n\n" << expected);
    CHECK(off < exact);
    CHECK(h.asymmetry < exact);
  }
}
/// Against a closed form of psi, to 1e3 rtol as gradients are (gradients.cpp), and the 1e-7 to which closed forms are
/// known (hessian_of()).
template <class Psi>
void check_closed(const Problem& p, const Psi& psi, const std::vector<long double>& steps, double more = 0) {
  check_closed(p, hessian_of(psi, p.parameters.values(), steps), 1e3 * p.solver.rtol + 1e-7 + more);
}

/// By formulations that have products, of which penalties hold constraints by O(1/alpha), against differences of exact
/// gradients by another integrator, which are known to what their extrapolation changes, three times. A lost term is
/// 1e-3 and more.
inline void check_by_differences(Problem p, double exact,
                                 const std::vector<std::string>& formulations = {"index1", "baumgarte", "penalty"},
                                 const std::string& method = "idas-adjoint") {
  const auto rho = p.parameters.values();
  Problem tight = p;
  tight.solver.rtol = 1e-12;
  tight.formulation = "baumgarte";
  // Steps of 8e-4 of the scales: what is left of a contact's or a kink's fourth order is nothing then.
  for (Parameter& parameter : tight.parameters.parameters) parameter.scale *= 0.2;
  const Hessian expected = hessian_by_differences(tight, method, rho);
  REQUIRE(expected.asymmetry < 1e-3);
  for (const std::string& formulation : formulations) {
    p.formulation = formulation;
    const Hessian h = hessian(p, rho);
    const double off = apart(p, h.matrix, expected.matrix);
    CAPTURE(formulation, off, h.asymmetry, expected.asymmetry);
    INFO(h.matrix << "\n\n" << expected.matrix);
    const auto column = [&](const std::vector<double>& g) {
      return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(g.data(), static_cast<Eigen::Index>(g.size())));
    };
    const Eigen::VectorXd of_size = scales(p.parameters).cwiseProduct(column(expected.gradient)),
                          found = scales(p.parameters).cwiseProduct(column(h.gradient));
    CHECK((found - of_size).cwiseAbs().maxCoeff() < exact * of_size.cwiseAbs().maxCoeff());
    CHECK(off < 3 * expected.asymmetry + exact);
    CHECK(h.asymmetry < exact);
  }
}

}  // namespace costate::test
