// An optimization's journal: what identifies the run, and its evaluations as records.
#pragma once

#include "costate/optimize/optimizer.h"
#include "costate/record/journal.h"
#include "costate/scene/scene_file.h"
#include "design_setup.h"

namespace costate::app {

/// Everything that decides the sequence of evaluations.
nlohmann::json journal_header(const DesignSetup& setup, const std::vector<SceneFile>& files, const OptimizerOptions& o);

/// The options that choose what the journal's run was made with, "--formulation index1 ..."; their names alone where
/// there is no journal.
std::string settings_in_words(const std::filesystem::path& journal);

nlohmann::json evaluation_record(const OptimizerEvaluation& e);

/// Throws: the journal goes another way than this run. `evaluation`: where they part.
[[noreturn]] void refuse_journal(const Journal& journal, const std::string& evaluation);

/// The evaluations of an interrupted run. From the first record on that this run cannot have written (its lengths, its
/// bounds, numbers that are not finite) the journal is cut off.
std::vector<OptimizerEvaluation> read_evaluations(Journal& journal, const ParameterSelection& parameters,
                                                  std::size_t constraints, std::size_t cases);

/// The same of costate pareto: records name their search, from 0 on and in order.
std::vector<std::vector<OptimizerEvaluation>> read_searches(Journal& journal, const ParameterSelection& parameters,
                                                            std::size_t constraints, std::size_t cases);

}  // namespace costate::app
