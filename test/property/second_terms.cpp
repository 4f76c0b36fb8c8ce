// Second derivatives along a direction, of every registered kind of element and of every output, against
// differences of the first-derivative blocks. The blocks are written by hand and the second derivatives come
// from the elements' templates, so that the two share no derivative; and a block that a template lost would
// show in both directions.
//
// Tolerance: kDifferenceTolerance, as for first derivatives: extrapolated differences of blocks over steps of
// 1e-3 have rounding errors of 10 eps / 1e-3 = 2e-12 of the largest entry and truncation errors of order
// 1e-18 times seventh derivatives, which is below as long as these stay under 1e9.
#include "costate/assembly/second_terms.h"

#include "costate/objective/output.h"
#include "examples.h"

using namespace costate;
using namespace costate::test;

namespace {

/// A state, the parameters at it, and a direction of both.
struct Line {
  State at, along;
  Vector rho, drho;

  State state(double x) const {
    State s = at;
    s.q += x * along.q;
    s.v += x * along.v;
    s.a += x * along.a;
    s.lambda += x * along.lambda;
    s.z += x * along.z;
    return s;
  }
};

Line random_line(const Scene& scene, const Assembly& assembly, const State& s, Random& random) {
  const Mechanism& m = *scene.mechanism();
  Line line;
  line.at = s;
  line.along.q = random.vector(m.coordinate_count());
  line.along.v = 2 * random.vector(m.coordinate_count());
  line.along.a = 3 * random.vector(m.coordinate_count());
  line.along.lambda = 5 * random.vector(m.row_count());
  line.along.z = random.vector(m.state_count());
  line.rho.resize(assembly.np());
  line.drho = random.vector(assembly.np());
  for (int j = 0; j < assembly.np(); ++j) {
    line.rho[j] = assembly.parameters().parameters[static_cast<std::size_t>(j)].value;
    line.drho[j] *= std::max(0.1, std::abs(line.rho[j]));
  }
  return line;
}

struct Weights {
  Vector force, phi, phid, phidd, state;
  TermWeights view() const { return {force.data(), phi.data(), phid.data(), phidd.data(), state.data()}; }
};

Vector joined(const std::vector<Vector>& parts) {
  Eigen::Index size = 0;
  for (const auto& p : parts) size += p.size();
  Vector all(size);
  size = 0;
  for (const auto& p : parts) {
    all.segment(size, p.size()) = p;
    size += p.size();
  }
  return all;
}

/// The gradient of the weighted sum of all terms from the first-derivative blocks: q, v, a, lambda, z, rho.
Vector first_derivative(Assembly& x, const Line& line, const Weights& w, double at) {
  const State s = line.state(at);
  const Vector rho = line.rho + at * line.drho;
  x.set_parameters(rho.data());
  x.calc_dynamics(s.view());
  x.calc_partials(s.view());
  Assembly::ParameterColumns c;
  x.calc_parameter_columns(s.view(), c);
  const auto transposed = [](const SparsePattern& pattern, const std::vector<double>& values, const Vector& weights) {
    return Vector(dense(pattern, values.data()).transpose() * weights);
  };
  const Vector q = transposed(x.square(), x.K, w.force) + transposed(x.jacobian(), x.phi_q, w.phi) +
                   transposed(x.jacobian(), x.phid_q, w.phid) + transposed(x.jacobian(), x.phidd_q, w.phidd) +
                   transposed(x.state_force(), x.f_q, w.state);
  const Vector v = transposed(x.square(), x.C, w.force) + transposed(x.jacobian(), x.phi_q, w.phid) +
                   2 * transposed(x.jacobian(), x.phid_q, w.phidd) + transposed(x.state_force(), x.f_v, w.state);
  const Vector a = transposed(x.square(), x.M, w.force) + transposed(x.jacobian(), x.phi_q, w.phidd);
  const Vector lambda = dense(x.jacobian(), x.phi_q.data()) * w.force;
  const Vector z = transposed(x.state_state(), x.f_z, w.state) - transposed(x.force_state(), x.Q_z, w.force);
  const Vector of_rho = c.F.transpose() * w.force + c.phi.transpose() * w.phi + c.phid.transpose() * w.phid +
                        c.phidd.transpose() * w.phidd + c.f.transpose() * w.state;
  return joined({q, v, a, lambda, z, of_rho});
}

struct Changes {
  ScalarGradient g;
  std::vector<double> numbers;
  Variation d;

  Changes(Assembly& assembly, const Line& line) {
    g.resize(assembly);
    assembly.set_parameters(line.rho.data());
    calc_number_changes(assembly, line.drho.data(), numbers);
    d = {0.0,
         line.along.q.data(),
         line.along.v.data(),
         line.along.a.data(),
         line.along.lambda.data(),
         line.along.z.data(),
         numbers.data()};
  }
  GradientTarget target() { return {g.q.data(), g.v.data(), g.a.data(), g.lambda.data(), g.z.data(), g.rho.data()}; }
  Vector all() const { return joined({g.q, g.v, g.a, g.lambda, g.z, g.rho}); }
};

}  // namespace

TEST_CASE("every element's second derivatives equal differences of its blocks", "[hessian]") {
  Random random(31);
  for_each_example([&](const Scene& scene, const Assembly& of_scene, const State& s) {
    const Mechanism& m = *scene.mechanism();
    Assembly assembly(scene.mechanism(), of_scene.parameters());
    const Line line = random_line(scene, assembly, s, random);
    Weights w;
    w.force = random.vector(m.coordinate_count());
    w.phi = random.vector(m.row_count());
    w.phid = random.vector(m.row_count());
    w.phidd = random.vector(m.row_count());
    w.state = random.vector(m.state_count());
    const Vector expected =
        directional_difference([&](double x) { return first_derivative(assembly, line, w, x); }, 1e-3);
    Changes found(assembly, line);
    add_gradient_change(assembly, line.at.view(), found.d, w.view(), found.target());
    require_equal("change of the gradient", found.all(), expected, kDifferenceTolerance);
    // Second derivatives are symmetric: (dL_x along d) e = (dL_x along e) d.
    Line other = random_line(scene, assembly, s, random);
    Changes across(assembly, other);
    add_gradient_change(assembly, line.at.view(), across.d, w.view(), across.target());
    const auto along = [&](const Line& l) {
      return joined({l.along.q, l.along.v, l.along.a, l.along.lambda, l.along.z, l.drho});
    };
    const double one = found.all().dot(along(other)), two = across.all().dot(along(line));
    const double size = found.all().cwiseAbs().dot(along(other).cwiseAbs());
    CHECK(std::abs(one - two) <= 1e-12 * std::max(1.0, size));
  });
}

TEST_CASE("every output's second derivatives equal differences of its gradient", "[hessian]") {
  Random random(32);
  for_each_example([&](const Scene& scene, const Assembly& of_scene, const State& s) {
    const Mechanism& m = *scene.mechanism();
    Assembly assembly(scene.mechanism(), of_scene.parameters());
    const Line line = random_line(scene, assembly, s, random);
    for (const std::string& name : output_names(m)) {
      if (name == "energy.potential" || name == "energy.total") continue;  // no part of a cost
      INFO("output " << name);
      const auto output = make_output(m, name);
      const auto place = [&](double x) {
        const Vector rho = line.rho + x * line.drho;
        assembly.set_parameters(rho.data());
        return line.state(x);
      };
      const Vector expected = directional_difference(
          [&](double x) {
            const State at = place(x);
            ScalarGradient g;
            g.resize(assembly);
            output->add_gradient(at.view(), assembly, 0.7, g);
            return joined({g.q, g.v, g.a, g.lambda, g.z, g.rho});
          },
          1e-3);
      const Vector slope = directional_difference(
          [&](double x) {
            const State at = place(x);
            return Vector(Vector::Constant(1, output->value(at.view(), assembly)));
          },
          1e-3);
      Changes found(assembly, line);
      require_equal("change", Vector::Constant(1, output->change(line.at.view(), assembly, found.d)), slope,
                    kDifferenceTolerance);
      output->add_gradient_change(line.at.view(), assembly, found.d, 0.7, found.g);
      require_equal("change of the gradient", found.all(), expected, kDifferenceTolerance);
    }
  });
}
