// The stages of a Radau step of hand-derived equations: against the system of all stages in full, solved with more
// digits, and how often its parts are factored.
#include "costate/integrator/linear_stages.h"

#include <fmt/format.h>
#include <support/paths.h>

#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"

using namespace costate;

namespace {

constexpr double kTolerance = 1e-11;
// What is left of a solution that is right to kTolerance in each group, by an estimate from its last correction.
constexpr double kWithin = 4 * kTolerance;

/// Hand-derived adjoint equations of the five-bar, and its motion.
class Stages {
 public:
  Stages(const std::string& formulation, const std::string& scheme)
      : problem_(make_problem(Scene::load(COSTATE_MODELS_DIR "/five_bar/five_bar.toml"))) {
    problem_.formulation = formulation;
    equations_ = find_formulation(formulation)
                     .make_hand_adjoint(problem_.mechanism, problem_.parameters, problem_.objective,
                                        problem_.formulation_options);
    equations_->set_parameters(problem_.parameters.values().data());
    solver_ = std::make_unique<LinearStages>(*equations_, *find_radau_scheme(scheme));
    stages_ = solver_->scheme().stages;
    A_.resize(static_cast<std::size_t>(stages_));
    D_.resize(A_.size());
  }

  /// Takes the stages of the step of length h, backward, from t on.
  void take(double t, double h) {
    std::vector<double> times;
    for (int i = stages_ - 1; i >= 0; --i) times.push_back(t - solver_->scheme().c[i] * h);
    std::vector<std::vector<double>> points;
    Problem motion = problem_;
    motion.formulation = "index1";
    motion.solver.t_end = t;
    simulate(motion, problem_.parameters.values(), times, [&](const MechanismState& s, System& system) {
      const int n = system.assembly().n();
      points.emplace_back(s.q, s.q + n);
      points.back().insert(points.back().end(), s.v, s.v + n);
    });
    REQUIRE(points.size() == A_.size());
    for (int i = 0; i < stages_; ++i) {
      const auto at = static_cast<std::size_t>(stages_ - 1 - i);
      equations_->evaluate(times[at], points[at].data());
      solver_->take(i);
      A_[static_cast<std::size_t>(i)].assign(equations_->A().begin(), equations_->A().end());
      D_[static_cast<std::size_t>(i)].assign(equations_->D().begin(), equations_->D().end());
    }
  }

  /// The largest error of a group of unknowns of a solution, over their size.
  double error(double h) {
    const int N = equations_->size();
    Eigen::MatrixXd right(stages_ * N, 1);
    for (Eigen::Index k = 0; k < right.rows(); ++k) right(k, 0) = std::sin(1.0 + 2.3 * static_cast<double>(k));
    const Eigen::MatrixXd given = right;
    REQUIRE(solver_->prepare(h) < 0);
    REQUIRE(solver_->solve(right, kTolerance) < 0);
    const Eigen::VectorXd exact = full_solution(h, given.col(0));
    Eigen::ArrayXd size = Eigen::ArrayXd::Zero(equations_->groups()), wrong = size;
    for (Eigen::Index k = 0; k < right.rows(); ++k) {
      const int group = equations_->group(static_cast<int>(k) % N);
      size[group] = std::max(size[group], std::abs(exact[k]));
      wrong[group] = std::max(wrong[group], std::abs(right(k, 0) - exact[k]));
    }
    return (wrong / size).maxCoeff();
  }

  LinearStages& solver() { return *solver_; }

 private:
  Eigen::VectorXd full_solution(double h, const Eigen::VectorXd& right) const {
    using Matrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
    const SparsePattern& p = equations_->pattern();
    const int N = equations_->size();
    Matrix all = Matrix::Zero(stages_ * N, stages_ * N);
    for (int j = 0; j < N; ++j)
      for (auto e = p.column_start[j]; e < p.column_start[j + 1]; ++e) {
        const int row = static_cast<int>(p.row[e]);
        const auto at = static_cast<std::size_t>(e);
        for (int i = 0; i < stages_; ++i) {
          if (!equations_->differential(row)) {
            all(i * N + row, i * N + j) += A_[static_cast<std::size_t>(i)][at];
            continue;
          }
          all(i * N + row, i * N + j) += D_[static_cast<std::size_t>(i)][at];
          for (int l = 0; l < stages_; ++l)
            all(i * N + row, l * N + j) -=
                static_cast<long double>(h) * solver_->scheme().a(i, l) * A_[static_cast<std::size_t>(l)][at];
        }
      }
    const Matrix x = all.fullPivLu().solve(right.cast<long double>());
    return x.col(0).cast<double>();
  }

  Problem problem_;
  std::unique_ptr<HandEquations> equations_;
  std::unique_ptr<LinearStages> solver_;
  std::vector<std::vector<double>> A_, D_;
  int stages_ = 0;
};

}  // namespace

TEST_CASE("stages of linear equations: solutions are those of the whole system, whatever was factored when") {
  for (const auto& [formulation, scheme] : {std::pair{"index1", "radau5"},
                                            {"baumgarte", "radau5"},
                                            {"index2", "radau5"},
                                            {"index3", "radau5"},
                                            {"penalty", "radau5"},
                                            {"penalty-second-order", "radau5"},
                                            {"index1", "radau9"},
                                            {"baumgarte", "radau9"},
                                            {"index2", "radau9"},
                                            {"index3", "radau9"},
                                            {"penalty", "radau9"},
                                            {"penalty-second-order", "radau9"}}) {
    INFO(formulation << " " << scheme);
    Stages s(formulation, scheme);
    const double h = 1e-3;
    for (const double t : {2.0, 1.999, 1.998, 1.997, 0.5}) {  // steps of one motion, and one from elsewhere in it
      INFO("t = " << t);
      s.take(t, h);
      CHECK(s.error(h) <= kWithin);
    }
    for (const double longer : {2e-3, 5e-2, 1e-5}) {
      INFO("h = " << longer);
      s.take(1.5, longer);
      CHECK(s.error(longer) <= kWithin);
    }
  }
}

TEST_CASE("stages of linear equations: factors serve the next steps of the same length") {
  for (const auto& [formulation, scheme, matrices] : {std::tuple{"index1", "radau5", 2},
                                                      {"baumgarte", "radau5", 2},
                                                      {"penalty", "radau5", 2},
                                                      {"baumgarte", "radau9", 3}}) {  // a real one, and complex ones
    INFO(formulation << " " << scheme);
    Stages s(formulation, scheme);
    const double h = 1e-3;
    s.take(2, h);
    CHECK(s.error(h) <= kWithin);
    CHECK(s.solver().factorizations() == matrices);
    for (const double t : {1.999, 1.998}) {
      s.take(t, h);
      CHECK(s.error(h) <= kWithin);
    }
    CHECK(s.solver().factorizations() == matrices);
    s.take(1.997, 2 * h);
    CHECK(s.error(2 * h) <= kWithin);
    CHECK(s.solver().factorizations() == 2 * matrices);
  }
}
