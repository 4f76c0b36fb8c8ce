#include "tradeoff_levels.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <sstream>

#include "costate/objective/output.h"
#include "named_outputs.h"

namespace costate::app {

namespace {

bool among(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// What is read, and what it is called.
struct LevelSource {
  std::string name, scene;
  std::vector<std::string> changes;
};

std::vector<LevelSource> sources_of(const CommonOptions& common, const LevelOptions& options) {
  std::vector<LevelSource> sources;
  for (const auto& file : options.scenes) {
    const std::string stem = std::filesystem::path(file).stem().string();
    const bool once = std::count_if(options.scenes.begin(), options.scenes.end(), [&](const auto& other) {
                        return std::filesystem::path(other).stem() == stem;
                      }) == 1;
    sources.push_back({once && stem != std::filesystem::path(common.scene).stem() ? stem : file, file, {}});
  }
  for (const auto& changes : options.changes) {
    LevelSource s{changes, common.scene, {}};
    std::istringstream all(changes);
    for (std::string one; std::getline(all, one, ';');) s.changes.push_back(one);
    sources.push_back(s);
  }
  return sources;
}

Setup level_setup(const CommonOptions& common, const LevelSource& source) {
  CommonOptions options = common;
  options.scene = source.scene;
  options.parameters.clear();  // of those that all have, below
  options.overrides.insert(options.overrides.end(), source.changes.begin(), source.changes.end());
  try {
    return Setup(options, Purpose::compare);
  } catch (const SceneError&) {
    throw;
  } catch (const Error& e) {  // an option's: say of which level
    throw Error(fmt::format("{} (at level '{}')", e.what(), source.name));
  }
}

bool accepts(const Setup& setup, const std::string& parameter) {
  try {
    setup.problem.mechanism->select({parameter});
    return true;
  } catch (const Error&) {
    return false;
  }
}

class LevelReader {
 public:
  LevelReader(const CommonOptions& common, const Setup& full, const LevelOptions& options,
              const std::vector<std::string>& outputs)
      : full_(full), asked_(outputs), sources_(sources_of(common, options)) {
    names_.push_back(std::filesystem::path(common.scene).stem().string());
    for (const LevelSource& s : sources_) {
      read_.setups.push_back(level_setup(common, s));
      names_.push_back(s.name);
    }
  }

  DetailLevels read(bool gradient) {
    choose_outputs();
    for (std::size_t level = 0; level < names_.size(); ++level) {
      const Setup& s = setup(level);
      DetailLevel& l = read_.levels.emplace_back();
      l.name = names_[level];
      l.problem = s.problem;
      l.outputs = outputs_of(level);
    }
    choose_parameters(gradient);
    return std::move(read_);
  }

 private:
  const Setup& setup(std::size_t level) const { return level == 0 ? full_ : read_.setups[level - 1]; }

  void choose_outputs() {
    wanted_ = asked_;
    if (wanted_.empty()) wanted_ = outputs_of_interest(full_.scene);
    if (wanted_.empty()) wanted_ = full_.problem.mechanism->coordinate_names();
    std::erase(wanted_, "time");
  }

  std::vector<std::string> outputs_of(std::size_t level) {
    const Mechanism &m = *setup(level).problem.mechanism, &full = *full_.problem.mechanism;
    const std::vector<std::string> known = output_names(m);
    std::vector<std::string> has;
    for (const auto& name : wanted_) {
      if (!among(known, name)) {
        if (!asked_.empty())
          throw Error(fmt::format("--outputs: There is no output '{}' at level '{}'.{}", name, names_[level],
                                  suggestion(name, known)));
        read_.notes.push_back(fmt::format("{} has no output {}.", names_[level], name));
        continue;
      }
      const std::string a = make_output(m, name)->unit(), b = make_output(full, name)->unit();
      if (a != b)
        throw Error(
            fmt::format("Output '{}' is in {} at level '{}' but in {} in the full model; choose others with "
                        "--outputs.",
                        name, a, names_[level], b));
      has.push_back(name);
    }
    if (has.empty())
      throw Error(
          fmt::format("There is nothing to compare level '{}' by: it has none of {}. Name outputs that both "
                      "have with --outputs.",
                      names_[level], fmt::join(wanted_, ", ")));
    return has;
  }

  void choose_parameters(bool gradient) {
    std::vector<std::string> common;
    if (gradient)
      for (const auto& name : full_.problem.parameters.names()) {
        std::vector<std::string> without;
        for (std::size_t level = 1; level < names_.size(); ++level)
          if (!accepts(setup(level), name)) without.push_back(names_[level]);
        if (without.empty())
          common.push_back(name);
        else
          read_.notes.push_back(fmt::format("Parameter {} is not in {}.", name, fmt::join(without, ", ")));
      }
    if (gradient && common.empty())
      throw Error("--gradient: There is no parameter that all levels have; name some with --parameters.");
    for (std::size_t level = 0; level < names_.size(); ++level) {
      DetailLevel& l = read_.levels[level];
      if (gradient && !l.has_cost())
        throw Error(fmt::format("--gradient: Level '{}' has no cost that could be differentiated.", l.name));
      l.problem.parameters = l.problem.mechanism->select(common);
      l.rho = l.problem.parameters.values();
      for (std::size_t j = 0; j < common.size(); ++j)
        if (l.rho[j] != read_.levels[0].rho[j])
          read_.notes.push_back(fmt::format("Parameter {} is {:.9g} in {}, {:.9g} in the full model.", common[j],
                                            l.rho[j], l.name, read_.levels[0].rho[j]));
    }
  }

  const Setup& full_;
  const std::vector<std::string>& asked_;
  std::vector<LevelSource> sources_;
  std::vector<std::string> names_, wanted_;
  DetailLevels read_;
};

}  // namespace

DetailLevels read_levels(const CommonOptions& common, const Setup& full, const LevelOptions& options,
                         const std::vector<std::string>& outputs, bool gradient) {
  return LevelReader(common, full, options, outputs).read(gradient);
}

}  // namespace costate::app
