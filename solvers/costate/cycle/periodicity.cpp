// Whether what acts on a mechanism repeats itself with the period that a cycle is said to have.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/base/error.h"
#include "costate/cycle/return_map.h"

namespace costate {

void ReturnMap::require_periodic(const Eigen::VectorXd& x, const std::vector<double>& positions) const {
  std::vector<double> values;
  const Problem p = problem_at(x, positions, false, parameters(), values);
  Assembly assembly(p.mechanism, p.parameters);
  assembly.set_parameters(values.data());
  const State state = this->state(x, positions);
  const auto period = section_.settings().period_s;
  const double span = period ? *period : p.solver.t_end - p.solver.t_start;
  const std::vector<double> zero(static_cast<std::size_t>(assembly.n() + assembly.m()), 0.0);
  const int np = static_cast<int>(rho_.size());
  const auto terms = [&](double t) {
    StateView s;
    s.t = t;
    s.q = state.q.data();
    s.v = state.v.data();
    s.z = state.z.data();
    s.a = s.lambda = zero.data();
    assembly.calc_dynamics(s);
    assembly.calc_partials(s);
    Assembly::ParameterColumns c;
    assembly.resize(c);
    assembly.calc_parameter_columns(s, c);
    std::pair<std::vector<double>, Eigen::MatrixXd> r;
    for (const auto* part : {&assembly.Q, &assembly.phi, &assembly.phi_t, &assembly.bias, &assembly.zdot})
      r.first.insert(r.first.end(), part->begin(), part->end());
    r.second.resize(c.F.rows() + 3 * c.phi.rows() + c.f.rows(), np);
    if (np > 0)
      r.second << c.F.leftCols(np), c.phi.leftCols(np), c.phid.leftCols(np), c.phidd.leftCols(np), c.f.leftCols(np);
    return r;
  };
  constexpr double kSame = 1e-7;
  const std::vector<double> parts = {0.0, 0.1379, 0.3417, 0.5731, 0.8123};
  std::vector<decltype(terms(0.0))> now, then;
  double size = 0;
  Eigen::VectorXd column_size = Eigen::VectorXd::Zero(np);
  for (const double part : parts) {
    const double t = p.solver.t_start + part * span;
    now.push_back(terms(t));
    then.push_back(terms(t + (period ? span : 0.4391 * span)));
    for (const auto* side : {&now.back(), &then.back()}) {
      for (const double f : side->first) size = std::max(size, std::abs(f));
      for (int j = 0; j < np; ++j)
        if (side->second.rows() > 0)
          column_size[j] = std::max(column_size[j], side->second.col(j).cwiseAbs().maxCoeff());
    }
  }
  bool depends = false;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    double most = 0;
    for (std::size_t i = 0; i < now[k].first.size(); ++i) {
      most = std::max(most, std::abs(now[k].first[i] - then[k].first[i]));
      depends = depends || std::abs(now[k].first[i] - now[0].first[i]) > kSame * size;
    }
    if (most > kSame * size)
      throw ModelError(period ? "cycle.period_s" : "cycle.section",
                       period ? fmt::format("Forces or constraints at t = {:g} s and {:g} s later differ by {:.2g} of "
                                            "what they are: this is no period of theirs.",
                                            p.solver.t_start + parts[k] * span, span, most / size)
                              : "Forces or constraints depend on time, so that a state at the section does not say how "
                                "the motion goes on. Give 'period_s' in the place of 'section'.");
    for (int j = 0; period && j < np; ++j)
      if (column_size[j] > 0 &&
          (now[k].second.col(j) - then[k].second.col(j)).cwiseAbs().maxCoeff() > kSame * column_size[j])
        throw ModelError("cycle.period_s",
                         fmt::format("Parameter '{}' changes the period of the forces, while 'period_s' is a fixed "
                                     "number: the cycle has no derivative by it. Leave it out of the parameters.",
                                     problem_.parameters.parameters[static_cast<std::size_t>(j)].name));
  }
  if (period && !depends)
    throw ModelError("cycle.period_s",
                     "Nothing here depends on time: the period of a free motion is its own. Give 'section' in the "
                     "place of 'period_s'.");
}

}  // namespace costate
