// Foreign code in a process of its own: it may crash, hang or end the process, and the caller says so.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "costate/candidate/candidate.h"
#include "costate/candidate/candidate_check.h"

namespace costate {

struct IsolatedResult {
  std::string text;     // what `work` returned
  std::string failure;  // or how the process ended: "crashed (signal 11, Segmentation fault) in rhs() at t = ..."
};

/// Runs `work` in a forked child, which may tell where it is; ends it and every process that it started after `limit_s`
/// seconds, on an interruption (which is then thrown), and when this process dies. What it prints goes to standard
/// error; what it sends back is bounded. Exceptions become failures.
IsolatedResult run_isolated(const std::function<std::string(const CandidateStage&)>& work, double limit_s);

/// Loads a candidate library; throws Error for a missing file, a missing symbol or another ABI. The library stays
/// loaded.
std::unique_ptr<CandidateAdjoint> load_candidate(const std::string& path);

/// The formulation that the candidate in a library names, asked for in a process of its own. Throws Error.
std::string candidate_formulation(const std::string& path, double limit_s);

/// check_candidate of the candidate in a library, in a process of its own; crashes and the like are in `failure`.
CandidateReport check_candidate_library(const std::string& path, const CandidateReference& reference, double limit_s);

}  // namespace costate
