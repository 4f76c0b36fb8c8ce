#include "costate/optimize/pareto.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <optional>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/optimize/bound_size.h"
#include "costate/record/interrupt.h"

namespace costate {

namespace {

/// Targets whose ideal and nadir differ by less than this many tolerances do not conflict.
constexpr double kConflict = 1e3;
/// What the others count for, in ranges of targets, where one is at its least, and what another has to gain: where the
/// least is at one design alone, that costs half of the product of both, by the second derivatives.
constexpr double kOfOthers[] = {1e-3, 1e-5}, kGained = 1e-3, kCosts = 0.05;

class Tracer {
 public:
  Tracer(const Design& design, const ParetoOptions& options, const ParetoReplay& replay, const ParetoSink& record,
         const std::function<void(const ParetoFront&)>& found)
      : design_(design), options_(options), replay_(replay), record_(record), found_(found) {
    options_.search.stop_value.reset();
    options_.search.gradient_tolerance = 0;
    // Points that differ by less than the errors of their psi are one.
    options_.search.relative_tolerance = std::max(options_.search.relative_tolerance, 10 * design.rtol());
  }

  ParetoFront run() {
    const std::size_t count = design_.targets.size();
    if (count < 2)
      throw CapabilityError(
          "A Pareto front is one between two targets or more: give the scene cases of different "
          "'objective', [[case]].");
    for (std::size_t g = 0; g < count; ++g) find_end(g);
    find_ranges();
    if (conflict_) {
      const std::vector<double> ideal = front_.ideal, nadir = front_.nadir;
      for (std::size_t g = 0; g < count; ++g) choose_end(g);
      measure_ranges();
      // What is at its least where all the others are keeps the range that it had, as a scale.
      for (std::size_t g = 0; g < count; ++g) {
        front_.ideal[g] = ideal[g];
        if (!(front_.nadir[g] - ideal[g] > kGained * (nadir[g] - ideal[g]))) front_.nadir[g] = nadir[g];
      }
      place_ends();
    }
    if (conflict_)
      for (const auto& b : simplex_points(count, std::max(2, options_.points) - 1)) find_point(b);
    mark_dominated(front_, kConflict * design_.rtol());
    const auto exceeding =
        std::count_if(front_.points.begin(), front_.points.end(), [](const ParetoPoint& q) { return !q.feasible(); });
    if (exceeding > 0)
      notice(fmt::format("{} of the {} points exceed a constraint: there the search found none that meets it.",
                         exceeding, front_.points.size()));
    return std::move(front_);
  }

 private:
  /// The least of one target alone.
  void find_end(std::size_t g) {
    Design d = design_;
    d.goal = Design::Goal::sum;
    d.targets = {design_.targets[g]};
    keep(search(d, std::vector<double>(design_.targets.size(), 0.0), static_cast<int>(g)));
  }

  /// Where many designs have one target at its least: the one of them that is best for the others. Where that gains
  /// little, what the others weigh is to be little, too.
  void choose_end(std::size_t g) {
    for (const double weight : kOfOthers)
      if (choose_end(g, weight)) return;
  }

  /// False where the target lost by what the others weigh: with less of that it may not.
  bool choose_end(std::size_t g, double weight) {
    Design d = design_;
    d.goal = Design::Goal::sum;
    for (std::size_t i = 0; i < d.targets.size(); ++i)
      d.targets[i].range = (front_.nadir[i] - front_.ideal[i]) / (i == g ? 1 : weight);
    ParetoPoint& end = front_.points[g];
    for (std::size_t j = 0; j < end.rho.size(); ++j) d.parameters.parameters[j].value = end.rho[j];
    std::optional<ParetoPoint> p = search(d, end.simplex, -1);
    if (error_) std::rethrow_exception(error_);
    if (!p) return true;
    end.evaluations += p->evaluations;
    const auto lost = [&](std::size_t i) {
      return (p->targets[i] - end.targets[i]) / (front_.nadir[i] - front_.ideal[i]);
    };
    double gained = 0;
    for (std::size_t i = 0; i < d.targets.size(); ++i)
      if (i != g) gained = std::max(gained, -lost(i));
    if (!(gained > kGained) || p->excess > std::max(end.excess, ParetoPoint::kExceeded)) return true;
    if (!(lost(g) <= kCosts * weight * gained)) return false;
    p->least_of = static_cast<int>(g);
    p->evaluations = end.evaluations;
    end = std::move(*p);
    front_.notes.push_back(
        fmt::format("'{}' is at its least at many designs: its end is the one that is best for the "
                    "others.",
                    design_.targets[g].name));
    return true;
  }

  void measure_ranges() {
    const std::size_t count = design_.targets.size();
    front_.ideal.assign(count, std::numeric_limits<double>::infinity());
    front_.nadir.assign(count, -std::numeric_limits<double>::infinity());
    for (const ParetoPoint& p : front_.points)
      for (std::size_t g = 0; g < count; ++g) {
        front_.ideal[g] = std::min(front_.ideal[g], p.targets[g]);
        front_.nadir[g] = std::max(front_.nadir[g], p.targets[g]);
      }
  }

  void find_ranges() {
    measure_ranges();
    const std::size_t count = design_.targets.size();
    for (std::size_t g = 0; g < count; ++g) {
      const double size =
          std::max({std::abs(front_.ideal[g]), std::abs(front_.nadir[g]), std::abs(front_.start.targets[g])});
      if (front_.nadir[g] - front_.ideal[g] > kConflict * design_.rtol() * size) continue;
      front_.notes.push_back(
          fmt::format("'{}' is at its least where the others are, too: there is nothing to trade against it.",
                      design_.targets[g].name));
      conflict_ = false;
    }
    if (conflict_) place_ends();
  }

  /// Where they lie among the points of the simplex: the sum of f_g is not 0, as targets conflict.
  void place_ends() {
    for (ParetoPoint& p : front_.points) {
      double sum = 0;
      for (std::size_t g = 0; g < design_.targets.size(); ++g)
        sum += p.simplex[g] = (p.targets[g] - front_.ideal[g]) / (front_.nadir[g] - front_.ideal[g]);
      for (double& b : p.simplex) b /= sum > 0 ? sum : 1;
    }
  }

  /// (21.1), with 1 added to all f_g, so that t is of the size of 1.
  void find_point(const std::vector<double>& b) {
    Design d = design_;
    d.goal = Design::Goal::worst;
    for (std::size_t g = 0; g < b.size(); ++g) {
      const double range = front_.nadir[g] - front_.ideal[g];
      d.targets[g].offset = front_.ideal[g] + (b[g] - 1) * range;
      d.targets[g].range = range;
    }
    // From the nearest point that is there.
    const ParetoPoint* nearest = nullptr;
    double least = std::numeric_limits<double>::infinity();
    for (const ParetoPoint& p : front_.points) {
      double distance = 0;
      for (std::size_t g = 0; g < b.size(); ++g) distance += (p.simplex[g] - b[g]) * (p.simplex[g] - b[g]);
      if (distance < least) {
        least = distance;
        nearest = &p;
      }
    }
    for (std::size_t j = 0; j < nearest->rho.size(); ++j) d.parameters.parameters[j].value = nearest->rho[j];
    keep(search(d, b, -1));
  }

  void keep(std::optional<ParetoPoint> p) {
    if (!p) return;
    front_.points.push_back(std::move(*p));
    if (found_) found_(front_);
    if (error_) std::rethrow_exception(error_);
  }

  /// What is found, or nothing where it fails: a note says so.
  std::optional<ParetoPoint> search(const Design& d, const std::vector<double>& b, int least_of) {
    const int number = searches_++;
    const std::vector<OptimizerEvaluation> replay = replay_ ? replay_(number) : std::vector<OptimizerEvaluation>();
    OptimizerResult r;
    try {
      r = optimize(d, options_.search, replay, [&](const OptimizerEvaluation& e) {
        if (record_) record_(number, e);
      });
    } catch (const SolverError& e) {
      if (least_of >= 0) throw;  // without it the front has no range
      front_.notes.push_back(fmt::format("The search towards ({:.3g}) failed: {}", fmt::join(b, ", "), e.what()));
      return {};
    }
    const OptimizerEvaluation& best = r.evaluations[r.best];
    if (number == 0) front_.start = point_of(r.evaluations.front(), b);
    ParetoPoint p = point_of(best, b);
    p.least_of = least_of;
    p.converged = r.converged;
    p.stop_reason = r.stop_reason;
    p.evaluations = static_cast<int>(r.evaluations.size());
    error_ = r.error;
    return p;
  }

  ParetoPoint point_of(const OptimizerEvaluation& e, const std::vector<double>& b) {
    ParetoPoint p;
    p.simplex = b;
    p.rho = e.rho;
    p.cases = e.cases;
    for (std::size_t g = 0; g < design_.targets.size(); ++g) p.targets.push_back(design_.target(g, e.cases));
    if (sizes_.empty()) sizes_ = bound_sizes(design_.parameters, e, design_.bounds());
    for (std::size_t c = 0; c < e.constraints.size(); ++c) {
      p.violation = std::max(p.violation, e.constraints[c]);
      p.excess = std::max(p.excess, e.constraints[c] / sizes_[c]);
    }
    return p;
  }

  const Design& design_;
  ParetoOptions options_;
  const ParetoReplay& replay_;
  const ParetoSink& record_;
  const std::function<void(const ParetoFront&)>& found_;
  ParetoFront front_;
  std::vector<double> sizes_;  // of the constraints
  bool conflict_ = true;
  int searches_ = 0;
  std::exception_ptr error_;  // what ended the last search
};

void add_points(std::vector<int>& digits, std::size_t at, int left, int along, bool up,
                std::vector<std::vector<double>>& out) {
  if (at + 1 == digits.size()) {
    digits[at] = left;
    std::vector<double> b;
    for (const int d : digits) b.push_back(static_cast<double>(d) / along);
    if (std::count(digits.begin(), digits.end(), 0) + 1 < static_cast<std::ptrdiff_t>(digits.size()))
      out.push_back(std::move(b));
    return;
  }
  // To and fro, so that one follows its neighbour.
  for (int k = 0; k <= left; ++k) {
    digits[at] = up ? k : left - k;
    add_points(digits, at + 1, left - digits[at], along, (k % 2 == 0) == up, out);
  }
}

}  // namespace

std::vector<std::vector<double>> simplex_points(std::size_t targets, int along) {
  std::vector<std::vector<double>> points;
  std::vector<int> digits(targets, 0);
  add_points(digits, 0, along, along, false, points);
  return points;
}

void mark_dominated(ParetoFront& front, double tolerance) {
  const auto slack = [&](std::size_t g) { return tolerance * (front.nadir[g] - front.ideal[g]); };
  for (ParetoPoint& p : front.points) {
    p.dominated = std::any_of(front.points.begin(), front.points.end(), [&](const ParetoPoint& q) {
      bool better = false;
      for (std::size_t g = 0; g < p.targets.size(); ++g) {
        if (q.targets[g] > p.targets[g] + slack(g)) return false;
        better = better || q.targets[g] < p.targets[g] - slack(g);
      }
      return better && q.excess <= std::max(p.excess, ParetoPoint::kExceeded);
    });
  }
  for (auto p = front.points.begin(); p != front.points.end(); ++p)
    p->repeated = std::any_of(front.points.begin(), p, [&](const ParetoPoint& q) {
      for (std::size_t g = 0; g < q.targets.size(); ++g)
        if (!(std::abs(q.targets[g] - p->targets[g]) <= slack(g))) return false;
      return true;
    });
}

ParetoFront trace_front(const Design& design, const ParetoOptions& options, const ParetoReplay& replay,
                        const ParetoSink& record, const std::function<void(const ParetoFront&)>& found) {
  return Tracer(design, options, replay, record, found).run();
}

}  // namespace costate
