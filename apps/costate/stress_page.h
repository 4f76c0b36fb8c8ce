// What 'costate stress' found, scene by scene: as text, JSON and a page.
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "command.h"
#include "costate/tradeoff/stress.h"

namespace costate::app {

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
  double wall_s = 0;
  std::size_t count(StressVerdict verdict) const;
};

/// Writes stress.html and stress.json, and prints.
void finish_stress(const StressSummary& summary, const CommonOptions& common, const std::filesystem::path& directory,
                   bool interrupted);

}  // namespace costate::app
