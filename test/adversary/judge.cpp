#include "judge.h"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/sensitivity/hessian.h"
#include "costate/sensitivity/method.h"

namespace costate::adversary {

namespace {

std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  std::replace(text.begin(), text.end(), '\t', ' ');
  return text.substr(0, 300);
}

/// What the run had to say, in one line.
std::string warnings() {
  std::string text;
  for (const auto& sentence : take_notices()) text += sentence + " ";
  return text;
}

/// Whether psi and each derivative are no farther off than the error that the result gives with it.
bool is_within_its_error(const GradientResult& r, const Truth& truth) {
  if (!r.known_error || !(std::abs(r.psi - truth.psi) <= r.known_error->psi + truth.psi_uncertainty)) return false;
  for (std::size_t j = 0; j < truth.gradient.size(); ++j) {
    double error = j < r.known_error->gradient.size() ? r.known_error->gradient[j] : 0;
    if (j < r.gradient_error.size()) error = std::max(error, r.gradient_error[j]);
    if (!(std::abs(r.gradient[j] - truth.gradient[j]) <= error + 10 * truth.uncertainty[j])) return false;
  }
  return true;
}

}  // namespace

const char* name_of(Outcome outcome) {
  switch (outcome) {
    case Outcome::agreed:
      return "agreed";
    case Outcome::warned:
      return "warned";
    case Outcome::refused:
      return "refused";
    case Outcome::failed:
      return "failed";
    case Outcome::unjudged:
      return "unjudged";
    case Outcome::wrong:
      return "WRONG";
    case Outcome::crashed:
      return "CRASHED";
    case Outcome::hung:
      return "HUNG";
  }
  return "";
}

std::vector<std::pair<std::string, std::string>> combinations() {
  std::vector<std::pair<std::string, std::string>> list;
  for (const Formulation& f : formulations())
    for (const SensitivityMethod& m : sensitivity_methods())
      if (m.name != "differences" && refusal(m, f).empty()) list.emplace_back(f.name, m.name);
  return list;
}

Finding found(const std::string& run, const std::function<void(Finding&)>& find) {
  Finding f;
  f.run = run;
  try {
    find(f);
  } catch (const CapabilityError& e) {
    f.outcome = Outcome::refused;
    f.message = one_line(e.what());
  } catch (const SolverError& e) {
    f.outcome = Outcome::failed;
    f.message = one_line(e.what());
  } catch (const Error& e) {
    f.outcome = Outcome::refused;
    f.message = one_line(e.what());
  } catch (const std::exception& e) {
    f.outcome = Outcome::crashed;
    f.message = one_line(std::string("raw exception: ") + e.what());
  }
  f.message = one_line(f.message);
  return f;
}

Finding run_gradient(const std::string& text, const std::string& formulation, const std::string& method,
                     const Truth& truth, double allowed) {
  return found(formulation + " x " + method, [&](Finding& f) {
    const Scene scene = Scene::parse(text, "adversary.toml");
    Problem problem = make_problem(scene);
    problem.formulation = formulation;
    problem.solver.integrator.clear();
    take_notices();
    const GradientResult r = gradient(problem, method, problem.parameters.values());
    bool finite = std::isfinite(r.psi);
    for (const double g : r.gradient) finite = finite && std::isfinite(g);
    const std::string warned = warnings();
    if (!truth.known) {
      f.outcome = finite ? Outcome::unjudged : Outcome::wrong;
      f.message = finite ? one_line(warned) : "a result that is not finite";
      return;
    }
    const bool discrete = has_fixed_steps(r.integrator);
    double size = 0, largest = 0;
    for (std::size_t j = 0; j < truth.gradient.size(); ++j)
      size = std::max(size, std::abs(truth.gradient[j]) * truth.scales[j]);
    // A gradient that vanishes (the start of another body, a shift of the whole mechanism) has no size of its own:
    // terms of the cost's size cancel in it, each known to the tolerance times what the motion makes of it. It is
    // measured by the cost; not to be told from zero is what the differences find within their own uncertainty.
    bool vanishes = true;
    for (std::size_t j = 0; j < truth.gradient.size(); ++j)
      vanishes = vanishes && std::abs(truth.gradient[j]) * truth.scales[j] <=
                                 10 * truth.uncertainty[j] * truth.scales[j] + 1e-8 * truth.psi_scale;
    size = vanishes ? 0.1 * truth.psi_scale : std::max(size, 1e-3 * truth.psi_scale);
    std::string worst;
    for (std::size_t j = 0; j < truth.gradient.size(); ++j) {
      const double e =
          (std::abs(r.gradient[j] - truth.gradient[j]) - 10 * truth.uncertainty[j]) * truth.scales[j] / size;
      if (!(e <= largest)) {
        largest = std::isfinite(e) ? e : HUGE_VAL;
        worst = fmt::format("parameter {}: {:.9g}, right {:.9g}", j, r.gradient[j], truth.gradient[j]);
      }
    }
    const double psi_error = std::max(0.0, std::abs(r.psi - truth.psi) - truth.psi_uncertainty) /
                             std::max(std::abs(truth.psi), 1e-3 * truth.psi_scale);
    if (!(psi_error <= largest)) {
      largest = std::isfinite(psi_error) ? psi_error : HUGE_VAL;
      worst = fmt::format("psi {:.9g}, right {:.9g}", r.psi, truth.psi);
    }
    f.error = largest;
    // A gradient by fixed steps is that of its own psi, of second order in its step.
    const bool right = largest <= (discrete ? 100 * allowed : allowed);
    const bool told = !right && is_within_its_error(r, truth);
    f.outcome = right ? Outcome::agreed : !warned.empty() || told ? Outcome::warned : Outcome::wrong;
    f.message = one_line((right ? "" : worst) + (warned.empty() ? "" : "; warned: " + warned) +
                         (told ? "; within the error that stands beside it" : ""));
  });
}

Finding run_hessian(const std::string& text, const std::string& formulation, const std::string& other, double step,
                    double allowed) {
  return found(formulation + " x hessian", [&](Finding& f) {
    Problem problem = make_problem(Scene::parse(text, "adversary.toml"));
    problem.formulation = formulation;
    problem.solver.integrator.clear();
    const auto rho = problem.parameters.values();
    const auto np = static_cast<Eigen::Index>(rho.size());
    Eigen::VectorXd scale(np), d(np);
    for (Eigen::Index j = 0; j < np; ++j) {
      scale[j] = problem.parameters.parameters[static_cast<std::size_t>(j)].scale;
      d[j] = scale[j] * std::cos(1.7 * static_cast<double>(j) + 0.4);
    }
    take_notices();
    const Hessian h = confirmed_hessian(problem, rho);
    Problem oracle = problem;
    oracle.formulation = formulation == other ? "index1" : other;
    oracle.solver.rtol = 1e-11;
    oracle.solver.confirm = false;
    const auto gradient_at = [&](double e) {
      auto x = rho;
      for (Eigen::Index j = 0; j < np; ++j) x[static_cast<std::size_t>(j)] += e * d[j];
      const GradientResult r = gradient(oracle, "cvodes-forward", x);
      return Eigen::VectorXd(scale.cwiseProduct(Eigen::Map<const Eigen::VectorXd>(r.gradient.data(), np)));
    };
    Eigen::VectorXd along[3];
    for (int k = 0; k < 3; ++k) {
      const double e = step / (1 << k);
      along[k] = (gradient_at(e) - gradient_at(-e)) / (2 * e);
    }
    const Eigen::VectorXd right = (4 * along[2] - along[1]) / 3, before = (4 * along[1] - along[0]) / 3;
    // A gradient that vanishes is measured by the cost, as above; a psi of squares of rounding by nothing.
    constexpr double kZero = 1e-18;
    const double size = std::max(
                     {right.cwiseAbs().maxCoeff(), gradient_at(0).cwiseAbs().maxCoeff(), 1e-3 * std::abs(h.psi)}),
                 unsure = (right - before).cwiseAbs().maxCoeff();
    const std::string warned = warnings();
    if (!std::isfinite(unsure) || !(size > kZero) || unsure > 0.1 * allowed * size) {
      f.message = fmt::format("differences do not settle: {:.1e} of {:.3g}", unsure, size);
      return;
    }
    const Eigen::VectorXd product = scale.cwiseProduct(h.matrix * d);
    const double largest = (scale.asDiagonal() * h.matrix * scale.asDiagonal()).cwiseAbs().maxCoeff(),
                 off = (product - right).cwiseAbs().maxCoeff();
    f.error = size > 0 ? off / size : 0;
    const bool as_said = off <= allowed * size + 10 * unsure,
               told = off <= 10 * h.error * largest * d.cwiseQuotient(scale).cwiseAbs().sum() || !warned.empty();
    f.outcome = as_said ? Outcome::agreed : told ? Outcome::warned : Outcome::wrong;
    if (!as_said) f.message = fmt::format("H d off by {:.3g} of {:.3g}, said {:.1e}", off, size, h.error);
  });
}

Truth truth_by_rereading(const std::string& text, const std::vector<std::string>& paths, const char* formulation,
                         const char* integrator) {
  // Runs of one integrator may take the same steps and have the same errors, which differences make the most of.
  struct By {
    const char *formulation, *integrator;
  };
  const By by[] = {{"baumgarte", "cvodes"}, {formulation, integrator}};
  Truth truths[2];
  for (int k = 0; k < 2; ++k) {
    Truth& truth = truths[k];
    try {
      const auto psi = [&](const std::vector<std::string>& overrides) {
        const Scene scene = Scene::parse(text, "adversary.toml", overrides);
        Problem problem = make_problem(scene);
        problem.formulation = by[k].formulation;
        problem.solver.integrator = by[k].integrator;
        problem.solver.rtol = 1e-11;
        problem.solver.max_steps = 200000;
        return simulate(problem, problem.parameters.values()).psi;
      };
      const Scene scene = Scene::parse(text, "adversary.toml");
      const ParameterSelection selection = scene.mechanism()->select(paths);
      const std::vector<double> values = selection.values();
      truth.psi = psi({});
      for (std::size_t j = 0; j < paths.size(); ++j) {
        const double scale = std::max(selection.parameters[j].scale, std::abs(values[j])), h = 1e-3 * scale;
        double d[2];
        for (const int half : {1, 2})
          d[half - 1] = (psi({fmt::format("{}={:.17g}", paths[j], values[j] + h / half)}) -
                         psi({fmt::format("{}={:.17g}", paths[j], values[j] - h / half)})) /
                        (2 * h / half);
        truth.gradient.push_back((4 * d[1] - d[0]) / 3);
        truth.uncertainty.push_back(std::abs(d[1] - truth.gradient.back()));
        truth.scales.push_back(scale);
      }
      truth.known = true;
    } catch (const Error&) {
      return {};
    }
  }
  Truth& truth = truths[0];
  truth.psi_scale = std::abs(truth.psi);
  double size = 1e-3 * truth.psi_scale;
  for (std::size_t j = 0; j < truth.gradient.size(); ++j)
    size = std::max(size, std::abs(truth.gradient[j]) * truth.scales[j]);
  for (std::size_t j = 0; j < truth.gradient.size(); ++j) {
    truth.uncertainty[j] = std::max(truth.uncertainty[j], std::abs(truth.gradient[j] - truths[1].gradient[j]));
    if (!(truth.uncertainty[j] * truth.scales[j] < 2e-5 * size)) truth.known = false;
  }
  if (!(std::abs(truth.psi - truths[1].psi) <= 1e-6 * std::max(std::abs(truth.psi), 1e-300))) truth.known = false;
  return truth;
}

std::vector<Finding> in_child(const std::function<std::vector<Finding>()>& f, int seconds) {
  int ends[2];
  if (pipe(ends) != 0) throw Error("A pipe cannot be made.");
  const pid_t child = fork();
  if (child < 0) throw Error("A process cannot be started.");
  if (child == 0) {
    close(ends[0]);
    // Of the processor, not of the clock: a busy machine hangs nothing.
    const itimerval limit{{0, 0}, {seconds, 0}};
    setitimer(ITIMER_PROF, &limit, nullptr);
    std::string text;
    for (const Finding& x : f())
      text += fmt::format("{}\t{}\t{:.3g}\t{}\n", static_cast<int>(x.outcome), x.run, x.error, x.message);
    for (std::size_t at = 0; at < text.size();) {
      const ssize_t n = write(ends[1], text.data() + at, text.size() - at);
      if (n <= 0) break;
      at += static_cast<std::size_t>(n);
    }
    _exit(0);
  }
  close(ends[1]);
  std::string text;
  char buffer[4096];
  for (ssize_t n; (n = read(ends[0], buffer, sizeof buffer)) > 0;) text.append(buffer, static_cast<std::size_t>(n));
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  std::vector<Finding> list;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream fields(line);
    std::string outcome, error;
    Finding x;
    std::getline(fields, outcome, '\t');
    std::getline(fields, x.run, '\t');
    std::getline(fields, error, '\t');
    std::getline(fields, x.message);
    x.outcome = static_cast<Outcome>(std::stoi(outcome));
    x.error = std::strtod(error.c_str(), nullptr);
    list.push_back(x);
  }
  if (WIFSIGNALED(status))
    list.push_back({WTERMSIG(status) == SIGPROF ? Outcome::hung : Outcome::crashed, "the whole case", 0,
                    fmt::format("ended by signal {}", WTERMSIG(status))});
  else if (WEXITSTATUS(status) != 0)
    list.push_back({Outcome::crashed, "the whole case", 0, fmt::format("ended with status {}", WEXITSTATUS(status))});
  return list;
}

}  // namespace costate::adversary
