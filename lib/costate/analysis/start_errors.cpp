#include "costate/analysis/start_errors.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "costate/analysis/given_system.h"
#include "costate/analysis/start.h"
#include "costate/assembly/rolling_rows.h"
#include "costate/base/error.h"

namespace costate {

void require_given_count(Assembly& assembly, double t, const double* q, const std::vector<std::string>& given,
                         const char* what, bool fewer_allowed) {
  int rank = constraint_rank(assembly, t, q).rank;
  if (what == std::string("positions") && !rows_without_place(assembly).empty()) {
    const std::vector<GivenStart> none;
    GivenSystem system(assembly, none, GivenSystem::Of::positions);
    system.factor(q);
    rank = system.rank();
  }
  const int free = assembly.n() - rank;
  const int found = static_cast<int>(given.size());
  if (found == free || (fewer_allowed && found < free)) return;
  throw ModelError(
      "start",
      fmt::format("Too {} given {}: {} coordinates less {} independent constraint rows leave {} degree{} of "
                  "freedom, so {} must be given, found {} ({}). {}",
                  found < free ? "few" : "many", what, assembly.n(), rank, free, free == 1 ? "" : "s",
                  fewer_allowed ? fmt::format("at most {}", free) : fmt::format("{}", free), found,
                  fmt::join(given, ", "),
                  found < free ? "Add to the list that [start] gives, or constrain the mechanism further."
                  : what == std::string("velocities")
                      ? "Remove some from given_velocities, which are those of the given positions where it is "
                        "left out; the constraints determine the rest."
                      : "Remove some; the constraints determine the rest."));
}

void throw_unreachable(const Assembly& assembly, const Eigen::VectorXd& residual,
                       const std::vector<std::string>& given) {
  std::vector<std::pair<double, std::string>> worst;
  const auto rows = assembly.mechanism().row_names();
  for (int i = 0; i < assembly.m(); ++i) worst.emplace_back(std::abs(residual[i]), rows[static_cast<std::size_t>(i)]);
  for (std::size_t g = 0; g < given.size(); ++g)
    worst.emplace_back(std::abs(residual[assembly.m() + static_cast<int>(g)]), "given " + given[g]);
  std::sort(worst.rbegin(), worst.rend());
  std::vector<std::string> text;
  for (std::size_t i = 0; i < std::min<std::size_t>(3, worst.size()); ++i)
    text.push_back(fmt::format("{} by {:.3g}", worst[i].second, worst[i].first));
  throw ModelError("start", fmt::format("The start cannot be reached: Newton's iteration from the first guesses does "
                                        "not close the mechanism. Violated most: {}. Check lengths and given "
                                        "coordinates, or bring the first guesses nearer.",
                                        fmt::join(text, ", ")));
}

}  // namespace costate
