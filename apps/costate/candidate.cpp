// costate check SCENE --candidate LIBRARY: a researcher's own adjoint beside the exact one.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "command.h"
#include "costate/candidate/candidate_process.h"
#include "costate/problem/scaled_gradient.h"
#include "costate/record/print.h"
#include "page_parts.h"

namespace costate::app {

namespace {

/// One line for each reason and equation.
std::string blind_text(const CandidateReport& r) {
  std::string text;
  std::map<std::string, std::map<std::string, std::string>> list;
  for (const auto& b : r.blind) {
    std::string& names = list[b.why][b.where];
    names += (names.empty() ? "" : ", ") + b.term;
  }
  for (const auto& [why, equations] : list) {
    text += fmt::format("cannot be judged: {}\n", why);
    for (const auto& [where, names] : equations) text += fmt::format("  {}: {}\n", where, names);
  }
  return text;
}

std::string text_of(const CandidateReport& r, const Setup& setup, const std::string& file) {
  std::string text = fmt::format("{}, candidate {} for formulation {}\n", title_of(setup), file, r.formulation);
  const auto& p = setup.problem.parameters.parameters;
  if (!r.gradient.empty()) {
    text += fmt::format("  {:<24} {:>20} {:>20} {:>10}\n", "parameter", "candidate", r.method, "error");
    const double size = largest_scaled(setup.problem.parameters, r.reference);
    for (std::size_t j = 0; j < p.size(); ++j) {
      const double e = std::abs(r.gradient[j] - r.reference[j]) * p[j].scale;
      text += fmt::format("  {:<24} {:>20.12g} {:>20.12g} {:>10.1e}\n", p[j].name, r.gradient[j], r.reference[j],
                          size > 0 ? e / size : e);
    }
  }
  if (!r.failure.empty()) text += fmt::format("FAILED: the candidate: {}\n", r.failure);
  if (r.first)
    text += fmt::format("first disagreement, backward from the end: t = {:.9g} s, {}: {:.9g} in place of {:.9g}\n",
                        r.first->t, r.first->component, r.first->found, r.first->expected);
  for (const auto& f : r.findings) {
    text += fmt::format("DIFFERENT: {}\n", f.message);
    for (const auto& a : f.alternatives) text += fmt::format("  or, equally well: {}\n", a);
  }
  for (const auto& n : r.notes) text += fmt::format("note: {}\n", n);
  text += blind_text(r);
  if (r.agrees)
    text += fmt::format("the candidate agrees: {:.1e} from {}\n", r.error, r.method);
  else if (r.failure.empty())
    text += fmt::format("the candidate disagrees: {:.1e} from {}\n", r.error, r.method);
  return text;
}

Json json_of(const CandidateReport& r, const Setup& setup, const std::string& file) {
  const auto names = setup.problem.parameters.names();
  Json j;
  j["candidate"] = Json::parse(json_text(file));
  j["formulation"] = r.formulation;
  j["method"] = r.method;
  j["parameters"] = named(names, setup.rho);
  j["gradient"] = r.gradient.empty() ? Json(nullptr) : named(names, r.gradient);
  j["reference_gradient"] = named(names, r.reference);
  j["error"] = std::isfinite(r.error) ? Json(r.error) : Json(nullptr);
  j["agrees"] = r.agrees;
  j["first_disagreement"] = nullptr;
  if (r.first)
    j["first_disagreement"] = {{"t", r.first->t},
                               {"component", r.first->component},
                               {"expected", r.first->expected},
                               {"found", r.first->found}};
  j["findings"] = Json::array();
  for (const auto& f : r.findings)
    j["findings"].push_back({{"where", f.where},
                             {"term", f.term},
                             {"what", f.what},
                             {"message", f.message},
                             {"alternatives", f.alternatives}});
  j["not_judged"] = Json::array();
  for (const auto& b : r.blind) j["not_judged"].push_back({{"where", b.where}, {"term", b.term}, {"why", b.why}});
  j["notes"] = r.notes;
  j["failure"] = r.failure.empty() ? Json(nullptr) : Json(r.failure);
  j["status"] = !r.failure.empty() ? "failed" : r.agrees ? "ok" : "disagreement";
  return j;
}

}  // namespace

int check_candidate_file(const CommonOptions& common, const CandidateOptions& options) {
  const Setup setup(common, Purpose::compare);
  if (setup.problem.parameters.size() == 0)
    throw Error("There is no parameter to differentiate: name some with --parameters or in [run].");
  if (!(options.limit_s > 0))
    throw Error(fmt::format("--candidate-limit must be positive, found {}.", options.limit_s));
  const std::string formulation = candidate_formulation(options.file, options.limit_s);
  const CandidateReference reference =
      setup.located([&] { return candidate_reference(setup.problem, formulation, setup.rho); });
  const CandidateReport r = check_candidate_library(options.file, reference, options.limit_s);
  Json j = json_of(r, setup, options.file);
  j["settings"] = settings_json(setup);
  j["counters"] = counters_json(reference.motion.counters);
  report(setup, common, j, text_of(r, setup, options.file), "candidate.json");
  if (!r.failure.empty()) print_message(fmt::format("the candidate: {}", r.failure));
  for (const auto& f : r.findings) print_message(fmt::format("disagreement: {}", f.message));
  if (!r.agrees && r.failure.empty() && r.findings.empty())
    print_message(fmt::format("disagreement: the gradient is {:.2e} from {}", r.error, r.method));
  return r.agrees ? 0 : kDisagreement;
}

}  // namespace costate::app
