#include "costate/level/penalty_weight.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "costate/assembly/assembly.h"

namespace costate {

namespace {

/// Phi_q and the diagonal of M at the first positions.
struct FirstRows {
  struct Entry {
    int coordinate;
    double slope;
  };
  std::vector<std::vector<Entry>> rows;
  std::vector<double> mass;
};

FirstRows first_rows(const std::shared_ptr<const Mechanism>& mechanism) {
  Assembly assembly(mechanism, ParameterSelection{});
  const std::vector<double> q = mechanism->first_positions();
  StateView s;
  s.q = s.v = q.data();
  assembly.calc_mass(s);
  assembly.calc_jacobian(s);
  FirstRows r;
  r.rows.resize(static_cast<std::size_t>(assembly.m()));
  r.mass.assign(static_cast<std::size_t>(assembly.n()), 0.0);
  const SparsePattern &J = assembly.jacobian(), &M = assembly.square();
  for (int j = 0; j < assembly.n(); ++j) {
    const auto column = static_cast<std::size_t>(j);
    for (auto e = J.column_start[column]; e < J.column_start[column + 1]; ++e) {
      const double slope = assembly.phi_q[static_cast<std::size_t>(e)];
      if (slope != 0) r.rows[static_cast<std::size_t>(J.row[e])].push_back({j, slope});
    }
    for (auto e = M.column_start[column]; e < M.column_start[column + 1]; ++e)
      if (M.row[e] == j) r.mass[column] = std::abs(assembly.M[static_cast<std::size_t>(e)]);
  }
  return r;
}

using Inertias = std::map<std::string, double>;  // the largest of the coordinates in m, in rad, in 1

/// The mass that a row moves, min over its coordinates of inertia / slope^2; 0 where there is none.
double mass_of_row(const std::vector<FirstRows::Entry>& row, const std::vector<Coordinate>& coordinates,
                   const Inertias& inertias) {
  double inverse = 0;
  for (const auto& [j, slope] : row) {
    const double inertia = inertias.at(coordinates[static_cast<std::size_t>(j)].unit);
    if (inertia > 0) inverse = std::max(inverse, slope * slope / inertia);
  }
  return inverse > 0 ? 1 / inverse : 0;
}

/// Where no coordinate of a unit has inertia, as the angles of bars, the rows lend it to them.
Inertias largest_inertias(const FirstRows& first, const std::vector<Coordinate>& coordinates) {
  Inertias own;
  for (std::size_t j = 0; j < coordinates.size(); ++j) {
    double& largest = own[coordinates[j].unit];
    largest = std::max(largest, first.mass[j]);
  }
  for (std::size_t pass = 0; pass < own.size(); ++pass) {
    Inertias lent = own;
    for (const auto& row : first.rows) {
      const double mass = mass_of_row(row, coordinates, own);
      for (const auto& [j, slope] : row) {
        const std::string& unit = coordinates[static_cast<std::size_t>(j)].unit;
        if (own[unit] == 0) lent[unit] = std::max(lent[unit], mass * slope * slope);
      }
    }
    own = lent;
  }
  return own;
}

}  // namespace

// lib/README.md (4.5).
double default_penalty_weight(const std::shared_ptr<const Mechanism>& mechanism) {
  const FirstRows first = first_rows(mechanism);
  const auto& coordinates = mechanism->coordinates();
  const Inertias inertias = largest_inertias(first, coordinates);
  double largest = 0;
  for (const auto& row : first.rows) largest = std::max(largest, mass_of_row(row, coordinates, inertias));
  // No row, or none that moves a mass; those of contacts that are open are none yet, and move masses, not inertias of
  // another unit, which a body of 600 m has 3e4 times as much of.
  if (const auto masses = inertias.find("m"); largest == 0 && masses != inertias.end()) largest = masses->second;
  if (largest == 0)
    for (const auto& [unit, inertia] : inertias) largest = std::max(largest, inertia);
  return kPenaltyStiffness * (largest > 0 ? largest : 1.0);
}

// Made at the first call: formulations register before or after this file's own objects.
const std::vector<FormulationOption>& penalty_options() {
  static const std::vector<FormulationOption> options = {
      {.key = "penalty_xi",
       .help = "damping ratio of the constraints' error in penalty formulations",
       .number = 1,
       .rule = NumberRule::non_negative},
      {.key = "penalty_omega_rad_per_s",
       .help = "frequency of the constraints' error in penalty formulations",
       .number = 10,
       .rule = NumberRule::positive},
      {.key = "penalty_alpha",
       .help = "weight of the constraints against the masses; 0: chosen from the masses that rows move",
       .number = 0,
       .rule = NumberRule::non_negative,
       .flag = "--penalty-alpha"}};
  return options;
}

double penalty_weight(const std::shared_ptr<const Mechanism>& mechanism, const FormulationOptions& o) {
  const double chosen = o.number("penalty_alpha");
  return chosen > 0 ? chosen : default_penalty_weight(mechanism);
}

Stabilization penalty_stabilization(const std::shared_ptr<const Mechanism>& mechanism, const FormulationOptions& o) {
  return {o.number("penalty_xi"), o.number("penalty_omega_rad_per_s"), 1 / penalty_weight(mechanism, o)};
}

Stabilization augmented_stabilization(const std::shared_ptr<const Mechanism>& mechanism) {
  return {.inverse_alpha = 1 / default_penalty_weight(mechanism), .augmented = true};
}

FormulationOptions firmer_penalty(const std::shared_ptr<const Mechanism>& mechanism, const FormulationOptions& o) {
  FormulationOptions firmer = o;
  firmer.set("penalty_alpha", 10 * penalty_weight(mechanism, o));
  return firmer;
}

bool penalty_weight_chosen(const FormulationOptions& o) { return o.number("penalty_alpha") > 0; }

}  // namespace costate
