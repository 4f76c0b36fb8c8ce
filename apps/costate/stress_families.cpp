#include "stress_families.h"

#include <fmt/format.h>

#include <cmath>

namespace costate::app {

namespace {

const char* kBodies = "bodies";
const char* kStiffness = "stiffness ratio";
const char* kRedundant = "redundant rows";

const char* kGravity = "[gravity]\ny_m_per_s2 = -9.81\n";

std::string point(const std::string& name, double x, double y, bool ground = false) {
  return fmt::format("[point.{}]\n{}x_m = {}\ny_m = {}\n", name, ground ? "ground = true\n" : "", x, y);
}
std::string bar(const std::string& name, const std::string& from, const std::string& to, double mass) {
  return fmt::format("[bar.{}]\nfrom = \"{}\"\nto = \"{}\"\nmass_kg = {}\n", name, from, to, mass);
}
std::string run(const std::string& output, double end) {
  return fmt::format("[[cost.running]]\nkind = \"square\"\noutput = \"{}\"\n[run]\nt_end_s = {}\noutputs = [\"{}\"]\n",
                     output, end, output);
}

/// Hanging askew, a metre long and a kilogram heavy.
std::string chain(int n) {
  std::string text = kGravity + point("P0", 0, 0, true), given;
  for (int i = 1; i <= n; ++i) {
    const double s = static_cast<double>(i) / n;
    text += point(fmt::format("P{}", i), 0.6 * s, -0.8 * s);
    text += bar(fmt::format("B{}", i), fmt::format("P{}", i - 1), fmt::format("P{}", i), 1.0 / n);
    given += fmt::format("{}\"P{}.x\"", i > 1 ? ", " : "", i);
  }
  return text + "[start]\ngiven = [" + given + "]\n" + run(fmt::format("P{}.x", n), 0.3);
}

std::string double_pendulum(double end) {
  return kGravity + point("O", 0, 0, true) + point("A", 0.6, 0.8) + point("B", 1.5, 1.2) + bar("upper", "O", "A", 1) +
         bar("lower", "A", "B", 1) + "[parameter.mass]\nnumber = \"bar.lower.mass_kg\"\n" +
         "[start]\ngiven = [\"A.x\", \"B.x\"]\n" + run("B.x", end) + "parameters = [\"mass\"]\n";
}

/// A kilogram on 10 N/m, one more on it by a spring so many times as stiff, damped as it needs to come to rest.
std::string row_of_springs(double ratio) {
  const double stiffness = 10 * ratio;
  std::string text = point("O", 0, 0, true);
  for (int i = 1; i <= 2; ++i) {
    text += point(fmt::format("P{}", i), 1.0 * i + 0.1, 0) +
            fmt::format("[mass.M{}]\npoint = \"P{}\"\nmass_kg = 1\n", i, i);
    text += fmt::format("[driver.y{}]\ncoordinate = \"P{}.y\"\nlaw = 0\n", i, i);
  }
  text += "[spring.soft]\nfrom = \"O\"\nto = \"P1\"\nstiffness_N_per_m = 10\nnatural_length_m = 1\n";
  text += fmt::format(
      "[spring.stiff]\nfrom = \"P1\"\nto = \"P2\"\nstiffness_N_per_m = {}\nnatural_length_m = 1\ndamping_N_s_per_m = "
      "{}\n",
      stiffness, std::sqrt(2 * stiffness));
  return text + "[start]\ngiven = [\"P1.x\", \"P2.x\"]\n" + run("P2.x", 2);
}

/// A parallelogram whose coupler is a triangle on a third crank, which is off the others' direction by so much: it
/// turns only where that is zero.
std::string third_crank(double off) {
  return kGravity + point("A", 0, 0, true) + point("B", 1, 0, true) + point("C", 0.5, -0.5, true) +
         point("P", 0.6, -0.8) + point("Q", 1.6, -0.8) + point("R", 1.1 + off, -1.3) + bar("left", "A", "P", 1) +
         bar("right", "B", "Q", 1) + bar("middle", "C", "R", 1) + bar("PQ", "P", "Q", 1) + bar("PR", "P", "R", 1) +
         bar("QR", "Q", "R", 1) + "[start]\ngiven = [\"P.x\"]\n" + run("P.x", 0.5);
}

}  // namespace

const std::vector<std::string>& family_axes() {
  static const std::vector<std::string> axes = {kBodies, kChaoticHorizon, kStiffness, kRedundant};
  return axes;
}

std::vector<StressFamily> family_of(const std::string& axis) {
  std::vector<StressFamily> r;
  if (axis == kBodies)
    for (const int n : {1, 10, 100, 300, 1000}) r.push_back({axis, fmt::format("a chain of {}", n), chain(n)});
  if (axis == kChaoticHorizon)
    for (const double t : {1.0, 3.0, 10.0, 30.0, 100.0})
      r.push_back({axis, fmt::format("a double pendulum over {} s", t), double_pendulum(t)});
  if (axis == kStiffness)
    for (const double ratio : {1.0, 1e3, 1e6, 1e9, 1e12})
      r.push_back({axis, fmt::format("springs of 1 to {:g}", ratio), row_of_springs(ratio)});
  if (axis == kRedundant)
    for (const double off : {0.0, 1e-12, 1e-9, 1e-6, 1e-3})
      r.push_back({axis, fmt::format("a third crank off by {:g} m", off), third_crank(off)});
  return r;
}

}  // namespace costate::app
