// costate tradeoff --levels: scenes of less detail against the full one, in the place of settings of one scene.
#pragma once

#include <string>
#include <vector>

#include "command.h"
#include "costate/tradeoff/level_study.h"

namespace costate::app {

struct LevelOptions {
  std::vector<std::string> scenes, changes;  // of the scene itself: PATH=VALUE, several joined by ';'

  bool asked() const { return !scenes.empty() || !changes.empty(); }
};

/// The scenes' setups and what both have in common with the full one.
struct DetailLevels {
  std::vector<Setup> setups;  // behind the full one
  std::vector<DetailLevel> levels;
  std::vector<std::string> notes;  // what only one of two has, as sentences
};
/// `outputs`: asked for by name, which all levels must have; empty: those of interest in the full scene.
DetailLevels read_levels(const CommonOptions& common, const Setup& full, const LevelOptions& options,
                         const std::vector<std::string>& outputs, bool gradient);

Json levels_json(const Setup& setup, const LevelStudy& study, const std::vector<std::string>& notes);
std::string levels_csv(const LevelStudy& study);
std::string levels_text(const Setup& setup, const LevelStudy& study, const std::vector<std::string>& notes);
/// `note`: what interrupted it, or empty.
std::string levels_page(const Setup& setup, const LevelStudy& study, const std::vector<std::string>& notes,
                        const std::string& note);

}  // namespace costate::app
