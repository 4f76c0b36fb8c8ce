// What 'costate stress' found, scene by scene: as text, JSON and a page.
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "command.h"
#include "costate/tradeoff/stress.h"

namespace costate::app {

/// Values of the axis "long time".
inline constexpr const char* kOneTime = "the end time";
inline constexpr const char* kTenTimes = "10 times the end time";

struct StressedScene {
  std::string file, title;
  TradeReference reference;
  std::string unjudged;            // why nothing can be judged
  std::string failed;              // why the scene itself could not be run
  std::vector<std::string> notes;  // axes that do not apply
  std::vector<StressEntry> entries;
  double wall_s = 0;
  std::size_t count(StressVerdict verdict) const;
  /// "120 held, 3 refused, 1 WRONG in silence"
  std::string counts() const;
};

struct StressSummary {
  std::deque<StressedScene> scenes;
  std::string note;  // an interruption
  std::vector<std::string> warnings;
  double wall_s = 0;
  std::size_t count(StressVerdict verdict) const;
};

/// How the drift of each combination grows with the time of the run, from entries of the axis "long time" over one and
/// ten times the end time: a sentence each where it does, "baumgarte on idas 0.0".
std::string drift_exponents(const std::vector<StressEntry>& entries);

/// Of gradients over longer and longer times: a sentence a method, the last one that held and what came then.
std::vector<std::string> gradient_horizons(const std::vector<StressEntry>& entries);

/// Writes stress.html and stress.json, and prints.
void finish_stress(const StressSummary& summary, const CommonOptions& common, const std::filesystem::path& directory,
                   bool interrupted);

}  // namespace costate::app
