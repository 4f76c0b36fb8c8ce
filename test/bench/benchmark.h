// The benchmarks of this program: each prints a table, or one JSON object.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "costate/problem/problem.h"
#include "costate/tradeoff/trade_table.h"

namespace costate::bench {

struct Settings {
  int rounds = 11;     // of interleaved timing
  bool quick = false;  // fewer and smaller cases, to see that it runs
};

struct Report {
  std::string text;
  nlohmann::json json;
};

/// Gradients of the five-bar: their time against a simulation and against the program by hand, their errors, counters.
Report gradients(const Settings& settings);
/// Gradients of a chain against the number of parameters, and the time of a step against the length of the chain.
Report parameters(const Settings& settings);

/// Every formulation by every method on the five-bar and Andrews' mechanism at three tolerances: counters, time,
/// errors.
Report matrix(const Settings& settings);
/// The discrete adjoint's time against its simulation's on three mechanisms.
Report discrete(const Settings& settings);

/// The same mechanisms in other programs, at equal error: gradients of the five-bar by programs by hand on CVODES, IDAS
/// and PETSc, forward runs of chains in Simbody. Those that are not found are left out, and named.
Report peers(const Settings& settings);

/// The full vehicle in the double lane change: against real time, gradients of 6 and 100 parameters against a
/// simulation, the time of a step against the number of vehicles; and each of these alone.
Report vehicle(const Settings& settings);
Report vehicle_speed(const Settings& settings);
Report vehicle_gradients(const Settings& settings);
Report vehicle_number(const Settings& settings);

/// What a scene requires against everything: parts that the cost needs, and the five-bar in the plane and in space.
Report requires_of_scenes(const Settings& settings);
/// Runs that store reactions at samples against the same that store nothing.
Report reactions(const Settings& settings);
/// The whole command against the number of bodies, in parts; and its memory.
Report bodies(const Settings& settings);

nlohmann::json counters_json(const Counters& c);

}  // namespace costate::bench
