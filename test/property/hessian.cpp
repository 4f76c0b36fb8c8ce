// Hessian-vector products against differences of whole gradients along the direction, and their symmetry: for
// every formulation that offers them, with costs on positions, velocities, accelerations, reactions and force
// states, running and terminal, and parameters of every kind (lengths move the start, so its second
// derivatives count).
//
// Tolerances, relative to the largest entry in scaled parameters. A product is as accurate as a gradient:
// kSteps rtol (see gradients.cpp). Differences of gradients are extrapolated over steps h, h/2, h/4, ...
// (Ridders): long ones suffer from truncation, short ones from the gradients' own errors over the step, and
// the entry of the tableau with the least estimate is taken. The estimate of a direction is that of its worst
// entry, and counts ten times.
#include "costate/sensitivity/hessian.h"

#include <support/compare.h>
#include <support/costs.h>
#include <support/models.h>
#include <support/random.h>
#include <support/sketch.h>
#include <support/sweep.h>
#include <support/variants.h>

#include <catch2/catch.hpp>

#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "support/paths.h"

using namespace costate;
using namespace costate::test;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kRtol = 1e-11;
constexpr double kOracle = 1e-6;  // what differences must reach: a lost block shows as 1e-3 and more
constexpr double kSteps = 1e3;

VectorXd scales(const ParameterSelection& p) {
  VectorXd s(p.size());
  for (int j = 0; j < p.size(); ++j) s[j] = p.parameters[static_cast<std::size_t>(j)].scale;
  return s;
}

struct Oracle {
  VectorXd product, error;
};

/// H d by differences of gradients over steps x d, x = h and less; d in parameters.
Oracle difference_product(const Problem& problem, const std::string& method, const VectorXd& d, double h) {
  const std::vector<double> rho = problem.parameters.values();
  const auto gradient_at = [&](double x) {
    std::vector<double> at = rho;
    for (std::size_t j = 0; j < at.size(); ++j) at[j] += x * d[static_cast<Eigen::Index>(j)];
    const std::vector<double> g = gradient(problem, method, at).gradient;
    return VectorXd(Eigen::Map<const VectorXd>(g.data(), static_cast<Eigen::Index>(g.size())));
  };
  Oracle best;
  std::vector<VectorXd> row, before;
  for (int k = 0; k < 5; ++k, h /= 2) {
    before = std::move(row);
    row = {(gradient_at(h) - gradient_at(-h)) / (2 * h)};
    double factor = 1;
    for (std::size_t i = 1; i <= before.size(); ++i) {
      factor *= 4;
      row.push_back((factor * row[i - 1] - before[i - 1]) / (factor - 1));
      const VectorXd error = (row[i] - row[i - 1]).cwiseAbs().cwiseMax((row[i] - before[i - 1]).cwiseAbs());
      const auto worst = [&](const VectorXd& e) { return scales(problem.parameters).cwiseProduct(e).maxCoeff(); };
      if (best.error.size() == 0 || worst(error) < worst(best.error)) best = {row[i], error};
    }
  }
  return best;
}

/// The largest difference of two lists of columns in scaled parameters, against the largest entry of the
/// second.
Mismatch mismatch(const MatrixXd& a, const MatrixXd& b, const ParameterSelection& parameters) {
  const MatrixXd x = scales(parameters).asDiagonal() * a, y = scales(parameters).asDiagonal() * b;
  const double size = y.cwiseAbs().maxCoeff();
  Mismatch m;
  for (Eigen::Index j = 0; j < x.cols(); ++j)
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      const double e = std::abs(x(i, j) - y(i, j)) / size;
      if (e <= m.error) continue;
      m.error = std::isfinite(e) ? e : HUGE_VAL;
      m.text = fmt::format("{}, direction {}: {:.12g} and {:.12g}, {:.2g} of the largest",
                           parameters.parameters[static_cast<std::size_t>(i)].name, j, a(i, j), b(i, j), m.error);
    }
  return m;
}

void check_products(const Problem& problem, const MatrixXd& directions, double h) {
  const std::string method = "cvodes-adjoint";
  const std::vector<double> rho = problem.parameters.values();
  const HessianProducts found = hessian_products(problem, rho, directions);
  MatrixXd expected(directions.rows(), directions.cols());
  double error = 0;
  for (Eigen::Index k = 0; k < directions.cols(); ++k) {
    const Oracle o = difference_product(problem, method, directions.col(k), h);
    expected.col(k) = o.product;
    error = std::max(error, scales(problem.parameters).cwiseProduct(o.error).maxCoeff());
  }
  error /= MatrixXd(scales(problem.parameters).asDiagonal() * expected).cwiseAbs().maxCoeff();
  CAPTURE(error);
  REQUIRE(error < kOracle);
  CHECK_BELOW(mismatch(found.products, expected, problem.parameters), kSteps * problem.solver.rtol + 10 * error);
  const GradientResult g = gradient(problem, method, rho);
  const auto column = [](const std::vector<double>& x) {
    return MatrixXd(Eigen::Map<const VectorXd>(x.data(), static_cast<Eigen::Index>(x.size())));
  };
  CHECK_BELOW(mismatch(column(found.gradient), column(g.gradient), problem.parameters), kSteps * problem.solver.rtol);
}

std::vector<Variant> offered() {
  std::vector<Variant> r;
  for (const Variant& v : variants())
    if (hessian_refusal(find_formulation(v.formulation)).empty()) r.push_back(v);
  return r;
}

MatrixXd random_directions(const ParameterSelection& p, int count, std::uint32_t seed) {
  Random random(seed);
  MatrixXd d(p.size(), count);
  for (int k = 0; k < count; ++k) d.col(k) = scales(p).cwiseProduct(random.vector(p.size()));
  return d;
}

}  // namespace

TEST_CASE("Hessian: who offers it, and what the others say", "[hessian]") {
  CHECK(offered().size() >= 5);  // index1, baumgarte, penalty (twice), augmented-lagrangian
  const std::string refused = hessian_refusal(find_formulation("maggi"));
  CHECK_THAT(refused, Catch::Contains("'maggi'") && Catch::Contains("'index1'"));
  Problem p = five_bar().problem("index2", 1e-6);
  CHECK_THROWS_WITH(hessian(p, p.parameters.values()), Catch::Contains("'index2' has no Hessian"));
}

TEST_CASE("Hessian: five-bar against differences of gradients", "[hessian]") {
  const TestModel model = five_bar();
  for (const Variant& v : offered()) {
    INFO(v.label);
    Problem p = model.problem(v.formulation, kRtol, {"L01", "L02", "k1", "k2", "m1", "m2", "m3", "m4"});
    p.formulation_options = v.options;
    p.solver.t_end = 2;
    check_products(p, random_directions(p.parameters, 2, 5), 0.1);
  }
}

TEST_CASE("Hessian: kitchen sink against differences of gradients", "[hessian]") {
  Eigen::Index turn = 0;
  for (const bool accelerations : {true, false}) {
    const TestModel model = accelerations ? kitchen_sink() : kitchen_sink_without_accelerations();
    for (const Variant& v : offered()) {
      INFO(model.name << ", " << v.label);
      Problem p = model.problem(v.formulation, kRtol);
      p.formulation_options = v.options;
      p.parameters = model.all_parameters();
      const MatrixXd d = random_directions(p.parameters, 2, 6);
      check_products(p, sweeps_are_whole() ? d : d.col(turn++ % 2), 0.03);
    }
  }
}

TEST_CASE("Hessian: free flight, a mechanism without constraints", "[hessian]") {
  const TestModel model = free_flight();
  const Problem p = model.problem("index1", kRtol);
  check_products(p, MatrixXd(scales(p.parameters).asDiagonal()), 0.2);
}

TEST_CASE("Hessian: redundant constraints, which penalties carry", "[hessian]") {
  // A board on three parallel ropes, of one length together.
  Sketch s;
  s.builder.set_gravity(0, -9.81);
  s.body("board", {0.6, -0.8, 0.0}, {0, 0, 0}, 2.0, 0.4, 0.1, -0.05);
  const double x[3] = {-0.3, 0.0, 0.5};
  std::vector<std::pair<std::string, double>> lengths;
  for (int i = 0; i < 3; ++i) {
    const std::string k = std::to_string(i);
    s.ground("G" + k, x[i], 0);
    s.attach("E" + k, "board", x[i], 0);
    s.distance("rope" + k, "G" + k, "E" + k);
    lengths.emplace_back("distance.rope" + k + ".length_m", 1.0);
  }
  s.give({"board.x"});
  s.numbers("cost", {{"weight", 1}});
  s.parameter("start", "body.board.x_m");
  s.parameter("length", lengths);
  s.parameter("g", {{"gravity.y_m_per_s2", -1.0}});
  TestModel model{"ropes", s.builder.build(), {}, 1};
  model.objective.running = {output_term(*model.mechanism, "board.x", 2, "cost.weight")};
  model.objective.terminal = {output_term(*model.mechanism, "board.y_dot", 2, "cost.weight")};
  for (const Variant& v : offered()) {
    if (!find_formulation(v.formulation).carries_redundancy) continue;
    INFO(v.label);
    Problem p = model.problem(v.formulation, kRtol, {"start", "length", "g"});
    p.formulation_options = v.options;
    check_products(p, MatrixXd(scales(p.parameters).asDiagonal()), 0.05);
  }
}

TEST_CASE("Hessian: the scene of the slider-crank", "[hessian]") {
  Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/slider_crank/slider_crank.toml"));
  p.formulation = "baumgarte";
  p.solver.rtol = kRtol;
  p.solver.integrator.clear();
  check_products(p, MatrixXd(scales(p.parameters).asDiagonal()), 0.2);
}

TEST_CASE("Hessian: a top whose angular velocity is given, in a frame that varies", "[hessian]") {
  // The given rates are bilinear in positions and velocities: the start has second derivatives of its own.
  Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/heavy_top/heavy_top.toml",
                                       {"rigid_body.top.e1=0.3", "rigid_body.top.e0=0.95393920141694566",
                                        "rigid_body.top.e2=0", "rigid_body.top.e3=0", "run.t_end_s=0.1"}));
  p.formulation = "baumgarte";
  p.solver.rtol = kRtol;
  p.solver.integrator.clear();
  p.parameters = p.mechanism->select({"rigid_body.top.e1", "rigid_body.top.e3", "spin", "precession", "height"});
  check_products(p, MatrixXd(scales(p.parameters).asDiagonal()), 0.02);
}

TEST_CASE("Hessian: a run that starts at its static equilibrium", "[hessian]") {
  // The balance of forces has second derivatives of its own, and those of a force state that rests.
  const std::vector<std::string> moving = {"start.given_velocities=['P1.x', 'P3.x']", "point.P1.vx_m_per_s=1"};
  for (const auto& velocities : {std::vector<std::string>(), moving}) {
    INFO((velocities.empty() ? "at rest" : "moving"));
    std::vector<std::string> overrides = {
        "start.equilibrium=true", "start.given=[]", "run.t_end_s=0.5",
        "maxwell.M={from='A', to='P2', stiffness_N_per_m=30, natural_length_m=2, damping_N_s_per_m=20}"};
    overrides.insert(overrides.end(), velocities.begin(), velocities.end());
    Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/five_bar/five_bar.toml", overrides));
    p.formulation = "baumgarte";
    p.solver.rtol = kRtol;
    p.solver.integrator.clear();
    p.parameters = p.mechanism->select({"L01", "k2", "m2", "maxwell.M.natural_length_m", "bar.B12.length_m"});
    check_products(p, MatrixXd(scales(p.parameters).asDiagonal()), 0.02);
  }
}

TEST_CASE("Hessian: symmetric, linear in the direction, and the same in parts", "[hessian]") {
  const TestModel model = kitchen_sink();
  std::size_t turn = 0;
  for (const Variant& v : offered()) {
    INFO(v.label);
    Problem p = model.problem(v.formulation, 1e-9);
    p.formulation_options = v.options;
    p.parameters = some_of(model.all_parameters(), turn++);
    const std::vector<double> rho = p.parameters.values();
    const Hessian h = hessian(p, rho);
    CHECK(h.asymmetry > 0);  // nothing symmetrizes the products behind our back
    CHECK(h.asymmetry <= kSteps * p.solver.rtol);
    const MatrixXd d = random_directions(p.parameters, 1, 8);
    Problem small = p;
    small.solver.memory_budget_MB = 0.001;  // one direction at a time
    MatrixXd two(d.rows(), 2);
    two << d, -3 * d;
    const HessianProducts one = hessian_products(small, rho, two);
    CHECK_BELOW(mismatch(one.products.col(0), h.matrix * d, p.parameters), kSteps * p.solver.rtol);
    CHECK_BELOW(mismatch(one.products.col(1), -3 * h.matrix * d, p.parameters), kSteps * p.solver.rtol);
  }
}

TEST_CASE("Hessian: products at a looser tolerance keep that tolerance", "[hessian]") {
  const TestModel model = five_bar();
  Problem p = model.problem("baumgarte", 1e-12);
  p.solver.t_end = 2;
  const std::vector<double> rho = p.parameters.values();
  const Hessian exact = hessian(p, rho);
  for (const double rtol : {1e-5, 1e-7, 1e-9}) {
    p.solver.rtol = rtol;
    const Hessian h = hessian(p, rho);
    CAPTURE(rtol, h.asymmetry);
    CHECK_BELOW(mismatch(h.matrix, exact.matrix, p.parameters), kSteps * rtol);
  }
}
