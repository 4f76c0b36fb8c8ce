#include "check_findings.h"

#include <fmt/format.h>

#include "guide.h"

namespace costate::app {

void CheckFindings::add(Verdict verdict, const std::string& sentence) {
  if (verdict == Verdict::disagreement) wrong.push_back(sentence);
  if (verdict == Verdict::failed) failed.push_back(sentence);
  if (verdict == Verdict::inaccurate) inaccurate.push_back(sentence);
  if (verdict == Verdict::cut) cut.push_back(sentence);
}

void CheckFindings::write(Json& j) const {
  j["disagreements"] = wrong;
  j["failures"] = failed;
  j["inaccurate"] = inaccurate;
  j["cut"] = cut;
}

std::string CheckFindings::text() const {
  std::string text;
  for (const auto& w : wrong) text += "DISAGREEMENT: " + w + "\n";
  for (const auto& w : failed) text += "FAILED: " + w + "\n";
  for (const auto& w : inaccurate) text += "INACCURATE: " + w + "\n";
  return text;
}

void CheckFindings::print() const {
  for (const auto& w : wrong) print_message(with_guide("disagreement: " + w));
  for (const auto& w : failed) print_message("failed: " + w);
  for (const auto& w : inaccurate) print_message(fmt::format("warning: inaccurate: {}", w));
}

std::string CheckFindings::agreement(double patience) const {
  std::string s =
      !failed.empty() ? fmt::format("no disagreement, but {} failed", failed.size())
      : !inaccurate.empty()
          ? fmt::format("no disagreement, but {} less accurate than the tolerance lets one expect", inaccurate.size())
      : !cut.empty() ? "all that ended agree within what the tolerances allow"
                     : "all agree within what the tolerances allow";
  if (!cut.empty())
    s += fmt::format("; {} took more than {:g} times what the reference took and {} cut (--patience)", cut.size(),
                     patience, cut.size() == 1 ? "was" : "were");
  return s + "\n";
}

}  // namespace costate::app
