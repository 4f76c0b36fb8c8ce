// The analysis of accuracy against cost, on tables made up so that the answer is known.
#include "costate/tradeoff/trade_analysis.h"

#include <catch2/catch.hpp>
#include <cmath>

using namespace costate;
using Catch::Matchers::Contains;

namespace {

/// Rows of simulations with errors of psi.
struct MadeUp {
  TradeTable table;

  std::size_t combination(const std::string& formulation, const std::string& integrator) {
    table.combinations.push_back({formulation, integrator});
    return table.combinations.size() - 1;
  }
  TradeRow& row(std::size_t c, double rtol, double error, double time_s, long steps = 100) {
    TradeRow r;
    r.combination = c;
    r.rtol = rtol;
    r.status = TradeStatus::ok;
    r.error[0] = error;
    r.time_s = time_s;
    r.counters.steps = steps;
    table.rows.push_back(r);
    return table.rows.back();
  }
  /// Errors of 1e-3, 1e-4, ... at rtol 1e-3, 1e-4, ..., each `errors` of it, with ever more steps.
  std::size_t curve(const std::string& formulation, const std::vector<double>& errors, double first_s = 1e-3) {
    const std::size_t c = combination(formulation, "cvodes");
    for (std::size_t k = 0; k < errors.size(); ++k)
      row(c, std::pow(10, -3 - static_cast<int>(k)), errors[k], first_s * std::pow(1.5, k),
          100 * static_cast<long>(k + 1));
    return c;
  }
};

}  // namespace

TEST_CASE("tradeoff: an error that is small by chance is not depended on") {
  MadeUp m;
  // The second passes through zero: it counts as its tighter neighbours do.
  m.curve("a", {1e-3, 1e-9, 1e-5, 1e-6, 1e-7});
  m.table.floor[0] = 2e-7;
  const auto e = dependable_errors(m.table, TradeMeasure::psi);
  REQUIRE(e.size() == 5);
  CHECK(e[0] == 1e-3);
  CHECK(e[1] == 1e-5);
  CHECK(e[2] == 1e-5);
  CHECK(e[3] == 1e-6);
  CHECK(e[4] == 2e-7);  // the reference certifies no less
  for (const double x : dependable_errors(m.table, TradeMeasure::gradient)) CHECK(std::isnan(x));
}

TEST_CASE("tradeoff: the Pareto front") {
  MadeUp m;
  const auto a = m.combination("a", "cvodes"), b = m.combination("b", "idas");
  m.row(a, 1e-3, 1e-3, 1.0);  // 0: on the front
  m.row(a, 1e-4, 1e-4, 4.0);  // 1: beaten by 3
  m.row(b, 1e-3, 5e-3, 2.0);  // 2: beaten by 0
  m.row(b, 1e-4, 1e-5, 3.0);  // 3: on the front
  m.row(b, 1e-5, 1e-5, 3.5);  // 4: as exact as 3, but slower
  m.row(b, 1e-6, 1e-8, 9.0);  // 5: on the front
  m.row(a, 1e-5, 1e-9, 1.0).status = TradeStatus::failed;
  CHECK(pareto_front(m.table, TradeMeasure::psi) == std::vector<std::size_t>{0, 3, 5});
}

TEST_CASE("tradeoff: what each digit costs, in words") {
  MadeUp m;
  const auto a = m.combination("penalty", "cvodes"), b = m.combination("index1", "idas");
  m.row(a, 1e-5, 3e-4, 2.0e-3);
  m.row(a, 1e-6, 5e-5, 4.1e-3);
  m.row(a, 1e-7, 6e-6, 6.56e-3);
  m.row(b, 1e-3, 8e-3, 1.0e-3);
  m.row(b, 1e-4, 9e-4, 8.0e-3);
  m.table.floor[0] = 1e-12;
  const auto c = trade_choices(m.table, TradeMeasure::psi);
  REQUIRE(c.size() == 5);
  CHECK(c[0].target == Approx(0.1));
  CHECK(c[0].row == 3);
  CHECK(c[1].row == 3);
  CHECK(*c[0].next_digit == 1);
  CHECK(c[2].row == 0);
  CHECK(*c[1].next_digit == Approx(2));
  CHECK(c[3].row == 1);
  CHECK(*c[3].next_digit == Approx(1.6));
  CHECK(c[4].row == 2);
  CHECK_FALSE(c[4].next_digit);
  CHECK(sentence(m.table, TradeMeasure::psi, c[3]) ==
        "for 1e-04 in psi: penalty on cvodes at rtol 1e-06, 4.1 ms; the next digit costs 1.6 times as much");
  CHECK_THAT(sentence(m.table, TradeMeasure::psi, c[0]), Contains("the next digit costs nothing"));
  CHECK_THAT(sentence(m.table, TradeMeasure::psi, c[4]), Contains("no setting that was run gives the next digit"));
}

TEST_CASE("tradeoff: no digit is recommended that the reference does not certify") {
  MadeUp m;
  m.curve("a", {1e-3, 1e-5, 1e-7, 1e-9, 1e-9, 1e-9});
  m.table.floor[0] = 3e-6;
  const auto c = trade_choices(m.table, TradeMeasure::psi);
  REQUIRE(!c.empty());
  CHECK(c.back().target == Approx(1e-5));
  CHECK(c.back().error == 1e-5);
}

TEST_CASE("tradeoff: what is in line is not reported") {
  MadeUp m;
  m.curve("proportional", {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7});
  m.curve("slower than proportional", {1e-2, 2e-3, 4e-4, 8e-5, 1.6e-5, 3.2e-6});
  m.curve("small by chance once", {1e-2, 1e-3, 1e-8, 1e-5, 1e-6, 1e-7});
  m.curve("exact", {1e-3, 1e-14, 1e-14, 1e-14, 1e-14, 1e-14});
  m.curve("ends at what is certified", {1e-2, 1e-4, 1e-12, 2e-12, 1e-12, 3e-12});
  m.table.floor[0] = 1e-11;
  for (const auto& o : out_of_line(m.table)) {
    INFO(o.sentence);
    CHECK(false);
  }
}

TEST_CASE("tradeoff: an error that does not fall") {
  MadeUp m;
  m.curve("fine", {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7});
  const auto c = m.curve("stuck", {1e-2, 1e-3, 2e-4, 1.1e-4, 1.3e-4, 1.2e-4});
  const auto found = out_of_line(m.table);
  REQUIRE(found.size() == 1);
  CHECK(found[0].kind == OutOfLine::Kind::does_not_fall);
  CHECK(found[0].combination == c);
  CHECK(found[0].rows == std::vector<std::size_t>{8, 9, 10, 11});
  CHECK_THAT(found[0].sentence, Contains("stuck on cvodes") && Contains("1.2e-04") && Contains("rtol 1e-05") &&
                                    Contains("rtol 1e-08") && !Contains("soft"));
  m.table.combinations[c].soft = true;
  CHECK_THAT(out_of_line(m.table).at(0).sentence, Contains("O(1/alpha)"));
}

TEST_CASE("tradeoff: fixed steps whose error does not fall") {
  MadeUp m;
  const auto c = m.combination("index3", "fixed");
  for (int k = 0; k < 6; ++k) {
    TradeRow& r = m.row(c, 0, k < 2 ? 1e-3 : 2e-4, 1e-3, 100 << k);
    r.step_s = 0.01 / (1 << k);
  }
  const auto found = out_of_line(m.table);
  REQUIRE(found.size() == 1);
  CHECK(found[0].rows == std::vector<std::size_t>{2, 3, 4, 5});
  CHECK_THAT(found[0].sentence, Contains("steps of 0.0025 s"));
}

TEST_CASE("tradeoff: more steps, less accuracy") {
  MadeUp m;
  const auto c = m.curve("worse", {1e-2, 1e-4, 1e-5, 4e-4, 1e-6, 1e-7});
  const auto found = out_of_line(m.table);
  REQUIRE(found.size() == 1);
  CHECK(found[0].kind == OutOfLine::Kind::rises);
  CHECK(found[0].combination == c);
  CHECK(found[0].rows == std::vector<std::size_t>{2, 3});
  CHECK_THAT(found[0].sentence, Contains("rtol 1e-06 400 steps") && Contains("4.0e-04") &&
                                    Contains("rtol 1e-05 only 300 steps") && Contains("1.0e-05"));
  // With fewer steps it is no contradiction.
  m.table.rows[3].counters.steps = 200;
  CHECK(out_of_line(m.table).empty());
}

TEST_CASE("tradeoff: far off the others at the same tolerance") {
  MadeUp m;
  for (const char* name : {"a", "b", "c", "d"}) m.curve(name, {1e-3, 1e-4, 1e-5, 1e-6});
  const auto c = m.curve("off", {0.8, 0.2, 2e-2, 2e-3});
  const auto found = out_of_line(m.table);
  REQUIRE(found.size() == 1);
  CHECK(found[0].kind == OutOfLine::Kind::far_off);
  CHECK(found[0].combination == c);
  CHECK_THAT(found[0].sentence, Contains("off on cvodes") && Contains("half of the others"));
}

TEST_CASE("tradeoff: gradients are judged by gradient runs, psi by simulations") {
  MadeUp m;
  const auto a = m.combination("a", "cvodes");
  m.table.combinations.push_back({"a", "cvodes", "cvodes-adjoint"});
  m.row(a, 1e-3, 1e-3, 1.0);
  TradeRow& g = m.row(1, 1e-3, 1e-5, 3.0);
  g.error[2] = 1e-2;
  CHECK(pareto_front(m.table, TradeMeasure::psi) == std::vector<std::size_t>{0});
  CHECK(pareto_front(m.table, TradeMeasure::gradient) == std::vector<std::size_t>{1});
  CHECK_THAT(sentence(m.table, TradeMeasure::gradient, trade_choices(m.table, TradeMeasure::gradient).at(1)),
             Contains("for 1e-02 in the gradient: a by cvodes-adjoint at rtol 0.001, 3e+03 ms"));
}
