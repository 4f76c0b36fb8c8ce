// KKT matrices by groups of bodies: which groups mechanisms have, and that what they solve is what KLU does, at the
// start of every shipped scene.
#include "costate/level/kkt_groups.h"

#include <support/compare.h>
#include <support/paths.h>
#include <support/random.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <set>

#include "costate/analysis/start.h"
#include "costate/base/error.h"
#include "costate/linear/kkt_solver.h"
#include "costate/scene/scene.h"

using namespace costate;
using namespace costate::test;

namespace {

struct Kkt {
  BlockMatrix matrix;
  explicit Kkt(Assembly& assembly, double corner) : matrix(assembly.n() + assembly.m()) {
    const int n = assembly.n(), m = assembly.m();
    const SparsePattern identity = SparsePattern::identity(m);
    const int mass = matrix.place(assembly.square(), 0, 0), rows = matrix.place(assembly.jacobian(), n, 0),
              columns = matrix.place(assembly.jacobian(), 0, n, true), below = matrix.place(identity, n, n);
    matrix.finalize();
    matrix.set_zero();
    matrix.add(mass, assembly.M.data());
    matrix.add(rows, assembly.phi_q.data());
    matrix.add(columns, assembly.phi_q.data());
    matrix.add_constant(below, corner);
  }
};

int largest(const std::vector<int>& group) { return *std::max_element(group.begin(), group.end()); }

}  // namespace

TEST_CASE("kkt groups: what is solved by groups is what is solved by KLU, in every shipped scene", "[kkt]") {
  // Both are backward stable up to growths of pivots that they bound (1e4 and 1e3); the residuals of the equations of
  // motion and of the rows, each against the largest terms of all of them.
  constexpr double kWithin = 1e-11;
  int by_groups = 0, scenes = 0;
  for (const auto& file : std::filesystem::recursive_directory_iterator(COSTATE_MODELS_DIR)) {
    if (file.path().extension() != ".toml") continue;
    INFO(file.path().string());
    std::unique_ptr<Assembly> assembly;
    Start start;
    try {
      assembly = std::make_unique<Assembly>(Scene::load(file.path().string()).mechanism(), ParameterSelection{});
      start = find_start(*assembly, 0, false);
    } catch (const Error&) {
      continue;  // part of a scene, cases, or no start of its own
    }
    const StateView s{0, start.q.data(), start.v.data(), nullptr, nullptr, start.z.data()};
    assembly->switch_rows(s.z);
    assembly->calc_dynamics(s);
    Kkt kkt(*assembly, -1e-9);  // so that redundant rows, and those of contacts that are open, are regular
    const SparsePattern& p = kkt.matrix.pattern();
    const Eigen::MatrixXd A = dense(p, kkt.matrix.values().data());
    const std::vector<int> group = kkt_groups(*assembly, p);
    KktSolver solver(p, group);
    KktSolver klu(p, {});
    REQUIRE(klu.factor(kkt.matrix.values().data()) == -1);
    REQUIRE(solver.factor(kkt.matrix.values().data()) == -1);
    ++scenes;
    by_groups += solver.sparse_factorizations() == 0 ? 1 : 0;
    Random random(5);
    const Eigen::VectorXd b = random.vector(A.rows());
    for (const bool transposed : {false, true}) {
      const auto residual = [&](KktSolver& by) {
        Eigen::VectorXd x = b;
        transposed ? by.solve_transposed(x.data()) : by.solve(x.data());
        // The matrix is symmetric.
        const Eigen::VectorXd off = (A * x - b).cwiseAbs(), sizes = A.cwiseAbs() * x.cwiseAbs() + b.cwiseAbs();
        const Eigen::Index n = assembly->n(), m = assembly->m();
        const double of_motion = off.head(n).maxCoeff() / sizes.head(n).maxCoeff();
        return m > 0 ? std::max(of_motion, off.tail(m).maxCoeff() / sizes.tail(m).maxCoeff()) : of_motion;
      };
      // Redundant rows leave KLU, too, no better residuals than 1e-7 (bricard).
      CHECK(residual(solver) <= std::max(kWithin, residual(klu)));
    }
  }
  CHECK(scenes > 60);
  CHECK(by_groups > scenes * 3 / 4);
}

TEST_CASE("kkt groups: bodies are groups and joints their border, small mechanisms are one", "[kkt]") {
  const auto groups_of = [](const std::string& model) {
    Assembly assembly(Scene::load(COSTATE_MODELS_DIR "/" + model).mechanism(), ParameterSelection{});
    const Kkt kkt(assembly, 0);
    return kkt_groups(assembly, kkt.matrix.pattern());
  };
  const std::vector<int> five_bar = groups_of("five_bar/five_bar.toml");
  CHECK(five_bar == std::vector<int>(10, 0));
  // Four bars of 7 coordinates and a row of length, those at the ground with the rows that hold them there: two of 3.
  const std::vector<int> in_space = groups_of("five_bar/five_bar_in_space.toml");
  REQUIRE(in_space.size() == 28 + 26);
  CHECK(largest(in_space) == 3);
  CHECK(std::count(in_space.begin(), in_space.end(), -1) == 15);
  // Points that bars link are no small group, nor are its blocks full.
  CHECK(groups_of("n_four_bar/n_four_bar_40.toml").empty());
  // The rack of the steering has no mass.
  const std::vector<int> vehicle = groups_of("iltis/double_lane_change.toml");
  REQUIRE(vehicle.size() == 68 + 53);
  CHECK(largest(vehicle) == 8);
  CHECK(std::count(vehicle.begin(), vehicle.begin() + 68, -1) == 1);
}
