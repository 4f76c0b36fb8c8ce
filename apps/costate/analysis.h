// What the commands that analyse a single position share: the scene, its outputs at rest, tables, files.
#pragma once

#include <map>

#include "command.h"
#include "costate/analysis/equilibrium.h"
#include "costate/analysis/point_kink.h"
#include "costate/objective/output.h"

namespace costate::app {

struct AnalysisOptions {
  std::vector<std::string> hold;
  bool hold_given = false;      // --hold was there, possibly empty
  bool at_equilibrium = false;  // --equilibrium

  void add_hold(Command& command, const std::string& text);
};

/// The scene with its overrides; `released`: it starts at equilibrium, with only what it holds given.
Scene load_for_analysis(const CommonOptions& common, AnalysisOptions& options, bool released);

/// Runs f; a ModelError is reported at its place in the scene.
template <class F>
auto located_in(const Scene& scene, F&& f) {
  try {
    return f();
  } catch (const ModelError& e) {
    throw scene.located(e);
  }
}

/// Gives notice where contacts cannot be as a position at rest has them, whose balance knows equations alone: inside
/// the ground, held by it, or beyond what friction bears. lambda has m entries.
void tell_of_contacts(const Assembly& at, double t, const Eigen::VectorXd& q, const Eigen::VectorXd& z,
                      const Eigen::VectorXd& lambda);

/// "the stiffness of P.x by P.y", "the damping of ...".
std::string entry_name(const Mechanism& m, const PointKink& kink);

/// Whether stiffness brings a mechanism back to a balance: what damping makes grow is a matter of modes.
inline bool is_stable(const Equilibrium& e) { return e.degrees_of_freedom == 0 || e.lowest_stiffness > 0; }

/// Points on bodies and what elements measure, apart from rates.
std::vector<std::unique_ptr<Output>> measured_outputs(const Mechanism& m);
std::vector<std::unique_ptr<Output>> outputs_named(const Mechanism& m, const std::vector<std::string>& names);

/// "  NAME   value unit" lines, the names aligned.
class Listing {
 public:
  void add(const std::string& name, double value, const std::string& unit, const std::string& note = {});
  /// Numbers of another listing tell, too, how large those of a unit are.
  void beside(const Listing& other) { beside_.insert(beside_.end(), other.lines_.begin(), other.lines_.end()); }
  /// How large numbers of each unit are, at least as those that they may be made of.
  std::map<std::string, double> sizes() const;
  /// What rounding leaves of a zero, against the largest number of its unit, is printed as zero.
  std::string text() const;
  /// Name, number and what stands behind it, of each line.
  std::vector<std::vector<std::string>> rows() const;
  bool empty() const { return lines_.empty(); }

 private:
  struct Line {
    std::string name;
    double value;
    std::string unit, rest;
  };
  std::vector<Line> lines_, beside_;
};

/// Prints the JSON object or the text, and writes the object where --output says: to `file` in a folder, or to a file.
/// Beside `file` in a folder goes its page, with the extension html.
void report_analysis(const CommonOptions& common, const Json& json, const std::string& text, const std::string& file,
                     const std::function<std::string(const Json& whole)>& page);

}  // namespace costate::app
