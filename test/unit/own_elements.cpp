// Elements and problems of one's own, which no reader of scenes has looked at: what is wrong in them is told, at the
// element, and not carried into a motion.
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <memory>

#include "costate/base/error.h"
#include "costate/element/element.h"
#include "costate/element/law/scalar_law.h"
#include "costate/integrator/simulate.h"
#include "costate/kind/body/mass.h"
#include "costate/kind/body/point.h"
#include "costate/mechanism/builder.h"
#include "costate/objective/objective.h"
#include "costate/sensitivity/method.h"

using namespace costate;
using Catch::Contains;

namespace {

/// x^2/2 - k + (t/10)^2: a rod whose length changes with time, which it says or not.
class TimedRow final : public ConstraintOf<TimedRow> {
 public:
  TimedRow(int coordinate, int number, bool says) : ConstraintOf("rod", "timed"), says_(says) {
    append_coordinates({coordinate});
    append_numbers({number});
  }
  int rows() const override { return 1; }
  std::string row_name(int) const override { return "length"; }
  bool rheonomic() const override { return says_; }
  template <class S>
  void physics(const S& t, const S* q, const S* p, S* phi) const {
    phi[0] = q[0] * q[0] * S(0.5) - p[0] + t * t * S(0.01);
  }

 private:
  bool says_;
};

class Pull final : public ForceOf<Pull> {
 public:
  Pull(std::vector<int> coordinates, std::vector<int> numbers, int initial = -1)
      : ForceOf("pull", "own"), initial_(initial) {
    append_coordinates(coordinates);
    append_numbers(numbers);
  }
  int states() const override { return initial_ < 0 ? 0 : 1; }
  int initial_state_number(int) const override { return initial_; }
  template <class S>
  void physics(const S&, const S* q, const S*, const S*, const S* p, S* Q, S* zdot) const {
    Q[0] = -p[0] * q[0];
    if (states() > 0) zdot[0] = S(0.0);
  }

 private:
  int initial_;
};

/// Springs along x and y with everything by hand, of which `wrong` is as the name says.
class Springs final : public ForceOf<Springs> {
 public:
  Springs(std::vector<int> coordinates, std::vector<int> numbers, const char* wrong)
      : ForceOf("springs", "own"), wrong_(wrong) {
    append_coordinates(coordinates);
    append_numbers(numbers);
  }
  int states() const override { return 1; }
  int initial_state_number(int) const override { return 0; }
  template <class S>
  void physics(const S&, const S* q, const S* v, const S* z, const S* p, S* Q, S* zdot) const {
    Q[0] = -p[0] * q[0] * q[0] * q[0] - v[1] + z[0];
    Q[1] = -p[0] * q[1];
    zdot[0] = p[0] * q[0] - z[0];
  }
  void calc_force(const LocalState& s, double* Q, double* zdot) const override {
    physics<double>(s.t, s.q, s.v, s.z, s.p, Q, zdot);
    Q[1] *= factor("force");
  }
  void calc_partials(const LocalState& s, ForcePartials out) const override {
    out.Q_q(0, 0) = -3 * s.p[0] * s.q[0] * s.q[0] * factor("Q_q");
    out.Q_q(1, 1) = -s.p[0];
    out.Q_v(0, 1) = -factor("Q_v");
    out.Q_z(0, 0) = factor("Q_z");
    out.f_q(0, 0) = s.p[0] * factor("f_q");
    out.f_z(0, 0) = -factor("f_z");
  }
  void calc_number_partial(const LocalState& s, int, double* Q_p, double* f_p) const override {
    Q_p[0] = -s.q[0] * s.q[0] * s.q[0];
    Q_p[1] = -s.q[1] * factor("number");
    f_p[0] = s.q[0];
  }
  void add_number_gradient(const LocalState& s, const double* w_Q, const double* w_f, const int*, int count,
                           double* out) const override {
    if (count && w_Q) out[0] -= w_Q[0] * s.q[0] * s.q[0] * s.q[0] + w_Q[1] * s.q[1];
    if (count && w_f) out[0] += factor("sum") * w_f[0] * s.q[0];
  }
  bool may_rest() const override { return wrong_ == "rest"; }
  double calc_rest(const LocalState&, double* slopes) const override {
    slopes[0] = 1;
    return 0.1;
  }

 private:
  double factor(const char* what) const { return wrong_ == what ? 0.9 : 1; }
  std::string wrong_;
};

/// -(sum of 20 numbers) x on x, and a soft -3 y on y.
class Many final : public ForceOf<Many> {
 public:
  Many(std::vector<int> coordinates, std::vector<int> numbers, const char* wrong)
      : ForceOf("many", "own"), wrong_(wrong) {
    append_coordinates(coordinates);
    append_numbers(numbers);
  }
  template <class S>
  void physics(const S&, const S* q, const S*, const S*, const S* p, S* Q, S*) const {
    for (std::size_t k = 0; k < numbers().size(); ++k) Q[0] -= p[k] * q[0];
    Q[1] = -3.0 * q[1];
  }
  void calc_partials(const LocalState& s, ForcePartials out) const override {
    for (std::size_t k = 0; k < numbers().size(); ++k) out.Q_q(0, 0) -= s.p[k];
    out.Q_q(1, 1) = wrong_ == "soft" ? -6 : wrong_ == "nan" ? std::nan("") : -3;
  }
  void calc_number_partial(const LocalState& s, int k, double* Q_p, double*) const override {
    Q_p[0] = wrong_ == "late" && k == 18 ? s.q[0] : -s.q[0];
  }
  void add_number_gradient(const LocalState& s, const double* w_Q, const double*, const int*, int count,
                           double* out) const override {
    for (int i = 0; i < count; ++i)
      if (w_Q) out[wrong_ == "first" ? 0 : i] -= w_Q[0] * s.q[0];
  }

 private:
  std::string wrong_;
};

/// k (1 - cos x), of which the force is written without the cancellation that the template has.
class Cancelled final : public ForceOf<Cancelled> {
 public:
  Cancelled(int coordinate, int number) : ForceOf("cancelled", "own") {
    append_coordinates({coordinate});
    append_numbers({number});
  }
  template <class S>
  void physics(const S&, const S* q, const S*, const S*, const S* p, S* Q, S*) const {
    using std::cos;
    Q[0] = p[0] * (1.0 - cos(q[0]));
  }
  void calc_force(const LocalState& s, double* Q, double*) const override {
    Q[0] = 2 * s.p[0] * std::pow(std::sin(s.q[0] / 2), 2);
  }
};

/// x^2 y = k with everything by hand.
class Curve final : public ConstraintOf<Curve> {
 public:
  Curve(std::vector<int> coordinates, std::vector<int> numbers, const char* wrong)
      : ConstraintOf("curve", "own"), wrong_(wrong) {
    append_coordinates(coordinates);
    append_numbers(numbers);
  }
  int rows() const override { return 1; }
  std::string row_name(int) const override { return "curve"; }
  template <class S>
  void physics(const S&, const S* q, const S* p, S* phi) const {
    phi[0] = q[0] * q[0] * q[1] - p[0];
  }
  void calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const override {
    phi_q(0, 0) = 2 * s.q[0] * s.q[1];
    phi_q(0, 1) = s.q[0] * s.q[0] * factor("phi_q");
  }
  void calc_bias(const LocalState& s, double* bias) const override {
    bias[0] = (2 * s.v[0] * s.v[0] * s.q[1] + 4 * s.q[0] * s.v[0] * s.v[1]) * factor("bias");
  }
  void calc_hessian(const LocalState& s, LocalMatrix& hessian) const override {
    hessian(0, 0) = 2 * s.lambda[0] * s.q[1];
    hessian(0, 1) = hessian(1, 0) = 2 * s.lambda[0] * s.q[0] * factor("hessian");
  }
  void calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                     LocalMatrix& phidd_q) const override {
    Constraint::calc_partials(s, hessian, phid_q, phidd_q);
    phidd_q(0, 1) *= factor("phidd_q");
  }
  void calc_number_partial(const LocalState&, int, double* phi_p, double*, double*, double*) const override {
    phi_p[0] = -factor("number");
  }
  double calc_number_gradient(const LocalState&, int, const ConstraintWeights& w) const override {
    return -w.phi[0] * factor("sum");
  }

 private:
  double factor(const char* what) const { return wrong_ == what ? 0.9 : 1; }
  std::string wrong_;
};

/// A mass that grows with x, with everything by hand.
class Growing final : public BodyOf<Growing> {
 public:
  Growing(int coordinate, int number, const char* wrong) : BodyOf("growing", "own"), wrong_(wrong) {
    append_coordinates({coordinate});
    append_numbers({number});
  }
  template <class S>
  void physics(const S* q, const S* v, const S* a, const S* p, S* r) const {
    r[0] = (p[0] + q[0] * q[0]) * a[0] + q[0] * v[0] * v[0];
  }
  void calc_mass(const LocalState& s, LocalMatrix& M) const override {
    M(0, 0) = (s.p[0] + s.q[0] * s.q[0]) * factor("mass");
  }
  void calc_force(const LocalState& s, double* Q) const override { Q[0] = -s.q[0] * s.v[0] * s.v[0] * factor("force"); }
  void calc_partials(const LocalState& s, LocalMatrix& r_q, LocalMatrix& r_v) const override {
    r_q(0, 0) = 2 * s.q[0] * s.a[0] + s.v[0] * s.v[0];
    r_v(0, 0) = 2 * s.q[0] * s.v[0] * factor("r_v");
  }
  void calc_number_partial(const LocalState& s, int, double* r_p) const override { r_p[0] = s.a[0] * factor("number"); }
  bool constant_mass() const override { return wrong_ == "constant_mass"; }

 private:
  double factor(const char* what) const { return wrong_ == what ? 0.9 : 1; }
  std::string wrong_;
};

struct OwnScene {
  MechanismBuilder builder;
  int x, k;
  OwnScene() {
    add_free_point(builder, "P", {1, 0, 0, 0});
    add_mass(builder, "m", "P", 2);
    x = builder.coordinate("P.x");
    k = builder.add_number("k", 10);
  }
};

}  // namespace

TEST_CASE("own elements: a constraint that changes with time and does not say so") {
  OwnScene s;
  CHECK_THROWS_WITH(s.builder.add(std::make_unique<TimedRow>(s.x, s.k, false)),
                    Contains("rod.timed") && Contains("'length'") && Contains("rheonomic"));
  CHECK_NOTHROW(s.builder.add(std::make_unique<TimedRow>(s.x, s.k, true)));
}

TEST_CASE("own elements: what the mechanism does not have") {
  OwnScene s;
  using Ints = std::vector<int>;
  CHECK_THROWS_WITH(s.builder.add(std::make_unique<Pull>(Ints{99}, Ints{s.k})),
                    Contains("pull.own") && Contains("coordinate of index 99"));
  CHECK_THROWS_WITH(s.builder.add(std::make_unique<Pull>(Ints{-1}, Ints{s.k})), Contains("coordinate of index -1"));
  CHECK_THROWS_WITH(s.builder.add(std::make_unique<Pull>(Ints{s.x}, Ints{999})), Contains("number of index 999"));
  CHECK_THROWS_WITH(s.builder.add(std::make_unique<Pull>(Ints{s.x}, Ints{s.k}, 7)), Contains("its number 7"));
  CHECK_THROWS_WITH(s.builder.add(std::unique_ptr<Force>()), Contains("null"));
  CHECK_THROWS_WITH(s.builder.add_coordinate("y", "m", 0, 999), Contains("'y' starts with the number 999"));
  CHECK_THROWS_WITH(s.builder.add_coordinate("y", "m", -1, 0), Contains("'y' starts with the number -1"));
  CHECK_THROWS_WITH(s.builder.add_parameter({"p", {{999, 1.0}}}), Contains("no number of index 999"));
  CHECK_THROWS_WITH(s.builder.add_parameter({"p", {{s.k, 1.0}, {s.k, 1.0}}}), Contains("'k' is listed twice"));
  CHECK_THROWS_WITH(s.builder.add_parameter({"p", {{s.k, 1.0}}, 20}), Contains("found 20"));
  CHECK_NOTHROW(s.builder.add_parameter({"p", {{s.k, 1.0}}, 10}));
  s.builder.build();
  CHECK_THROWS_WITH(s.builder.build(), Contains("builder is done"));
  CHECK_THROWS_WITH(s.builder.add_number("j", 1), Contains("builder is done"));
}

TEST_CASE("own elements: two of one name") {
  OwnScene s;
  const auto pull = [&] { return std::make_unique<Pull>(std::vector<int>{s.x}, std::vector<int>{s.k}); };
  CHECK_NOTHROW(s.builder.add(pull()));
  CHECK_THROWS_WITH(s.builder.add(pull()), Contains("pull.own") && Contains("a force of this name already"));
}

TEST_CASE("own elements: derivatives by hand are those of the element's own physics, or told with their entry") {
  const auto build = [](const char* kind, const std::string& wrong) {
    OwnScene s;
    const std::vector<int> xy{s.x, s.builder.coordinate("P.y")}, k{s.k};
    if (std::string(kind) == "springs") s.builder.add(std::make_unique<Springs>(xy, k, wrong.c_str()));
    if (std::string(kind) == "curve") s.builder.add(std::make_unique<Curve>(xy, k, wrong.c_str()));
    if (std::string(kind) == "growing") s.builder.add(std::make_unique<Growing>(s.x, s.k, wrong.c_str()));
    s.builder.build();
  };
  const auto refused = [&](const char* kind, const char* wrong, const char* by, const char* entry) {
    INFO(kind << ": " << wrong);
    CHECK_THROWS_WITH(build(kind, wrong), Contains(std::string(kind) + ".own") && Contains(by) && Contains(entry));
  };
  for (const char* kind : {"springs", "curve", "growing"}) CHECK_NOTHROW(build(kind, "nothing"));
  refused("springs", "force", "calc_force", "(1, 0)");
  refused("springs", "Q_q", "calc_partials", "Q_q (0, 0)");
  refused("springs", "Q_v", "calc_partials", "Q_v (0, 1)");
  refused("springs", "Q_z", "calc_partials", "Q_z (0, 0)");
  refused("springs", "f_q", "calc_partials", "f_q (0, 0)");
  refused("springs", "f_z", "calc_partials", "f_z (0, 0)");
  refused("springs", "number", "calc_number_partial", "by 'k', entry (1, 0)");
  refused("springs", "sum", "add_number_gradient", "by 'k'");
  refused("springs", "rest", "calc_rest", "border");
  refused("curve", "phi_q", "calc_phi_q", "(0, 1)");
  refused("curve", "bias", "calc_bias", "(0, 0)");
  refused("curve", "hessian", "calc_hessian", "(1, 0)");
  refused("curve", "phidd_q", "calc_partials", "phidd_q (0, 1)");
  refused("curve", "number", "calc_number_partial", "by 'k'");
  refused("curve", "sum", "calc_number_gradient", "by 'k'");
  refused("growing", "mass", "calc_mass", "(0, 0)");
  refused("growing", "force", "calc_force", "(0, 0)");
  refused("growing", "r_v", "calc_partials", "r_v (0, 0)");
  refused("growing", "number", "calc_number_partial", "by 'k'");
  refused("growing", "constant_mass", "constant_mass", "changes by");
}

TEST_CASE("own elements: one number of many, a soft entry beside a stiff one, and no number at all") {
  const auto build = [](const char* wrong) {
    OwnScene s;
    std::vector<int> numbers;
    for (int k = 0; k < 20; ++k) numbers.push_back(s.builder.add_number("n" + std::to_string(k), 1e6));
    s.builder.add(std::make_unique<Many>(std::vector<int>{s.x, s.builder.coordinate("P.y")}, numbers, wrong));
    s.builder.build();
  };
  CHECK_NOTHROW(build("nothing"));
  CHECK_THROWS_WITH(build("soft"), Contains("many.own") && Contains("Q_q (1, 1) is -6"));
  CHECK_THROWS_WITH(build("nan"), Contains("many.own") && Contains("Q_q (1, 1) is nan"));
  CHECK_THROWS_WITH(build("late"), Contains("many.own") && Contains("by 'n18'"));
  CHECK_THROWS_WITH(build("first"), Contains("many.own") && Contains("add_number_gradient"));
}

TEST_CASE("own elements: what rounding takes from the template is no mistake") {
  MechanismBuilder b;
  add_free_point(b, "P", {1e-7, 0, 0, 0});
  add_mass(b, "m", "P", 2);
  b.add(std::make_unique<Cancelled>(b.coordinate("P.x"), b.add_number("k", 1e8)));
  CHECK_NOTHROW(b.build());
}

TEST_CASE("own problems: options that cannot be") {
  OwnScene s;
  s.builder.add(std::make_unique<Pull>(std::vector<int>{s.x}, std::vector<int>{s.k}));
  Problem good;
  good.mechanism = s.builder.build();
  good.parameters = good.mechanism->select({"k"});
  const auto wrong = [&](const std::function<void(Problem&)>& change, const char* what) {
    Problem p = good;
    change(p);
    CHECK_THROWS_WITH(gradient(p, "idas-adjoint", {10.0}), Contains(what));
    CHECK_THROWS_WITH(simulate(p, {10.0}), Contains(what));
  };
  CHECK_NOTHROW(simulate(good, {10.0}));
  const double none = std::nan("");
  wrong([&](Problem& p) { p.solver.t_end = none; }, "t_end");
  wrong([&](Problem& p) { p.solver.t_end = -1; }, "t_end");
  wrong([&](Problem& p) { p.solver.rtol = none; }, "rtol");
  wrong([&](Problem& p) { p.solver.rtol = 0; }, "rtol");
  wrong([&](Problem& p) { p.solver.atol = none; }, "atol");
  wrong([&](Problem& p) { p.solver.max_step_s = -1; }, "max_step_s");
  wrong([&](Problem& p) { p.solver.checkpoint_steps = -3; }, "checkpoint_steps");
  wrong([&](Problem& p) { p.objective.running.push_back(nullptr); }, "null");
  wrong([&](Problem& p) { p.mechanism.reset(); }, "no mechanism");
  wrong([&](Problem& p) { p.solver.cvodes_method = "foo"; }, "\"adams\" or \"bdf\"");
  using Target = OutputTerm::Target;
  const auto cost = [](const Mechanism& m, const char* name, int weight, Target target) {
    return std::make_shared<OutputTerm>(make_output(m, name), 1, weight, std::move(target));
  };
  wrong([&](Problem& p) { p.objective.running.push_back(cost(*p.mechanism, "P.x", 999, {})); }, "the number 999");
  wrong(
      [&](Problem& p) {
        Target law{std::make_shared<PolynomialLaw>(1), {-7}, nullptr};
        p.objective.running.push_back(cost(*p.mechanism, "P.x", -1, law));
      },
      "the number -7");
  // Of a mechanism with another point in front, whose x is the one's y: indices that are there, and mean another thing.
  MechanismBuilder other;
  add_free_point(other, "Q", {1, 0, 0, 0});
  add_free_point(other, "P", {1, 0, 0, 0});
  add_mass(other, "m", "P", 2);
  add_mass(other, "n", "Q", 2);
  const auto theirs = other.build();
  wrong([&](Problem& p) { p.objective.terminal.push_back(cost(*theirs, "Q.y", -1, {})); },
        "'Q.y' was made for another mechanism");
  wrong(
      [&](Problem& p) {
        Target output{nullptr, {}, make_output(*theirs, "Q.x")};
        p.objective.terminal.push_back(cost(*p.mechanism, "P.x", -1, output));
      },
      "'Q.x' was made for another mechanism");
  // Another one that is the same is as good.
  OwnScene again;
  again.builder.add(std::make_unique<Pull>(std::vector<int>{again.x}, std::vector<int>{again.k}));
  Problem same = good;
  same.objective.terminal.push_back(cost(*again.builder.build(), "P.x", -1, {}));
  CHECK_NOTHROW(simulate(same, {10.0}));
}
