// The generation 5.2 of the Magic Formula (PAC2002) under camber and in combined slip, against its equations written
// out in another language (Python) by someone who had not seen these: F_x, F_y, M_x and M_z, at 20 m/s; M_z in combined
// slip has arctan(sqrt(tan^2 alpha + (K_x kappa/K_y)^2)), (84) of that manual. The
// coefficients are of the size of a 205/60 R15's.
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <vector>

#include "costate/element/force/magic_formula.h"

using namespace costate;

namespace {

const std::map<std::string, double> kTyre = {{"FNOMIN", 4000},     {"UNLOADED_RADIUS", .3135},
                                             {"LONGVL", 16.6},     {"PCX1", 1.6411},
                                             {"PDX1", 1.1739},     {"PDX2", -.16395},
                                             {"PDX3", 5.},         {"PEX1", .46403},
                                             {"PEX2", .25022},     {"PEX3", .067842},
                                             {"PEX4", -3.7604e-5}, {"PKX1", 22.303},
                                             {"PKX2", .48896},     {"PKX3", .21253},
                                             {"PHX1", .0012297},   {"PHX2", .0004318},
                                             {"PVX1", -8.8098e-6}, {"PVX2", 1.862e-5},
                                             {"RBX1", 13.276},     {"RBX2", -13.778},
                                             {"RCX1", 1.2568},     {"REX1", .65225},
                                             {"REX2", -.24948},    {"RHX1", .0050722},
                                             {"PCY1", 1.3507},     {"PDY1", 1.0489},
                                             {"PDY2", -.18033},    {"PDY3", -2.8821},
                                             {"PEY1", -.0074722},  {"PEY2", -.0063208},
                                             {"PEY3", -9.9935},    {"PEY4", -760.14},
                                             {"PKY1", -21.92},     {"PKY2", 2.0012},
                                             {"PKY3", -.024778},   {"PHY1", .0026747},
                                             {"PHY2", 8.9094e-5},  {"PHY3", .031415},
                                             {"PVY1", .037318},    {"PVY2", -.010049},
                                             {"PVY3", -.32931},    {"PVY4", -.69553},
                                             {"RBY1", 7.1433},     {"RBY2", 9.1916},
                                             {"RBY3", -.027856},   {"RCY1", 1.0719},
                                             {"REY1", -.27572},    {"REY2", .32802},
                                             {"RHY1", 5.7448e-6},  {"RHY2", -3.1368e-5},
                                             {"RVY1", -.027825},   {"RVY2", .053604},
                                             {"RVY3", -.27568},    {"RVY4", 12.12},
                                             {"RVY5", 1.9},        {"RVY6", -10.704},
                                             {"QBZ1", 10.904},     {"QBZ2", -1.8412},
                                             {"QBZ3", -.52041},    {"QBZ4", .039211},
                                             {"QBZ5", .41511},     {"QBZ9", 8.9846},
                                             {"QCZ1", 1.2136},     {"QDZ1", .093509},
                                             {"QDZ2", -.0092183},  {"QDZ3", -.057061},
                                             {"QDZ4", .73954},     {"QDZ6", -.0067783},
                                             {"QDZ7", .0052254},   {"QDZ8", -.18175},
                                             {"QDZ9", .029952},    {"QEZ1", -1.5697},
                                             {"QEZ2", .33394},     {"QEZ4", .26711},
                                             {"QEZ5", -3.594},     {"QHZ1", .0047326},
                                             {"QHZ2", .0026687},   {"QHZ3", .11998},
                                             {"QHZ4", .059083},    {"SSZ1", .033372},
                                             {"SSZ2", .0043624},   {"SSZ3", .56742},
                                             {"SSZ4", -.24116},    {"QSX1", .01},
                                             {"QSX2", .4},         {"QSX3", .05},
                                             {"QSY1", .01}};

struct Point {
  double kappa, alpha, load, camber;
  std::map<std::string, double> over;
  double Fx, Fy, Mx, Mz;
};

TyreOutput<double> evaluate(const Point& x) {
  std::map<std::string, double> coefficients = kTyre;
  for (const auto& [name, value] : x.over) coefficients[name] = value;
  std::vector<double> p = {0};  // slip speed
  for (const auto& entry : MagicFormula::coefficients()) {
    const auto at = coefficients.find(entry.name);
    p.push_back(at == coefficients.end() ? entry.usual : at->second);
  }
  MagicFormula model;
  model.camber_as_angle = true;
  TyreOutput<double> out;
  constexpr double kSpeed = 20;
  model(TyreInput<double>{{x.load, kSpeed, kSpeed * std::tan(x.alpha), x.camber, kSpeed * (1 + x.kappa)}},
        static_cast<const double*>(nullptr), p.data(), out, static_cast<double*>(nullptr));
  return out;
}

}  // namespace

TEST_CASE("magic formula: the generation 5.2 under camber and in combined slip") {
  const Point points[] = {
      // alpha and alpha_y = alpha + S_Hy of opposite signs: E_y has the latter's (335.29 N with the former's).
      {.02, -.02, 4000, .9, {}, 1836.61506414541, -338.045305081126, -444.198860157147, 157.939609542593},
      {0, .1, 4000, 0, {}, 54.834517843432, -3813.77028075652, -47.2408491508585, 29.1018762056614},
      {0, .02, 4000, .05, {}, 101.552879844028, -1543.77463076998, -36.7386673373194, 23.6623433266874},
      {0, .02, 4000, -.05, {}, 101.552879844028, -1200.52404160325, 18.801785647869, 37.1865217610549},
      {0, -.03, 3000, .1, {}, 65.5866982759453, 1375.97138304747, -12.0387364280482, -53.0099948852033},
      {.03, .02, 5000, .05, {}, 3017.67377551821, -1678.69553146527, -48.5669405696476, 80.7461043196959},
      {.03, .02, 4000, .05, {{"LMX", .5}}, 2326.15403722234, -1415.2578780264, -11.0920836190319, 60.00398923635},
      {.03,
       .02,
       4000,
       .03,
       {{"LMUX", .3}, {"LMUY", .3}, {"PVX1", .02}},
       1298.40141179358,
       -1029.8318256121,
       -18.6506138664697,
       19.2036400179722}};
  for (const Point& x : points) {
    CAPTURE(x.kappa, x.alpha, x.load, x.camber);
    TyreOutput<double> out = evaluate(x);
    // The sign of alpha in E_y is a steep one here, by less than 1e-12 from 0.02 rad on; sizes of F_z and F_z R_0.
    CHECK(out.longitudinal() == Approx(x.Fx).margin(1e-9 * x.load));
    CHECK(out.lateral() == Approx(x.Fy).margin(1e-9 * x.load));
    CHECK(out.overturning() == Approx(x.Mx).margin(1e-9 * x.load));
    CHECK(out.aligning() == Approx(x.Mz).margin(1e-9 * x.load));
  }
}
