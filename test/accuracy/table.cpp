#include "table.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace costate::accuracy {

namespace {

using nlohmann::json;

struct Tally {
  long asked = 0, judged = 0, within = 0, unmet = 0, failed = 0;
  double worst = 0;
  std::vector<double> total, result;  // times against the best fixed setting

  std::string row(const std::string& name) const {
    const auto share = [](const std::vector<double>& v, double part) {
      if (v.empty()) return std::string("");
      std::vector<double> s = v;
      std::sort(s.begin(), s.end());
      return fmt::format("{:.1f}", s[static_cast<std::size_t>(part * static_cast<double>(s.size() - 1))]);
    };
    return fmt::format("| {} | {} | {} | {} | {} | {:.1f} % | {:.2g} | {} | {} | {} |\n", name, asked, failed, unmet,
                       judged, judged > 0 ? 100.0 * static_cast<double>(within) / static_cast<double>(judged) : 0.0,
                       worst, share(total, 0.5), share(total, 0.9), share(result, 0.5));
  }
};

const char* kHead =
    " | asked | failed | said not met | judged | within | worst error / request | time / best, median | 90 % | result "
    "alone, median |\n|---|---|---|---|---|---|---|---|---|---|\n";

}  // namespace

Verdict tabulate(const std::vector<json>& records) {
  std::map<double, Tally, std::greater<>> by_request;
  std::map<std::string, Tally> by_family;
  Tally all;
  long unjudged = 0;
  for (const json& variant : records) {
    if (!variant.contains("requests")) {
      ++unjudged;
      continue;
    }
    for (const json& r : variant["requests"])
      for (Tally* t : {&by_request[r["accuracy"]], &by_family[variant["family"]], &all}) {
        ++t->asked;
        if (r.contains("failed")) {
          ++t->failed;
          continue;
        }
        if (r.contains("best_s") && r["met"]) {
          const double best = r["best_s"];
          t->total.push_back(r["time_s"].get<double>() / best);
          t->result.push_back(r["result_s"].get<double>() / best);
        }
        if (!r["met"]) {
          ++t->unmet;
          continue;
        }
        if (r["error"].is_null()) continue;
        const double ratio = r["error"].get<double>() / r["accuracy"].get<double>();
        ++t->judged;
        t->within += ratio <= 1 ? 1 : 0;
        t->worst = std::max(t->worst, ratio);
      }
  }
  Verdict v;
  v.text = fmt::format("{} variants, {} of them without a proven reference\n\n| accuracy{}", records.size(), unjudged,
                       kHead);
  for (const auto& [accuracy, t] : by_request) v.text += t.row(fmt::format("{:.0e}", accuracy));
  v.text += fmt::format("{}\n| family{}", all.row("all"), kHead);
  for (const auto& [family, t] : by_family) v.text += t.row(family);
  v.judged = all.judged;
  v.within = all.within;
  v.worst = all.worst;
  return v;
}

}  // namespace costate::accuracy
