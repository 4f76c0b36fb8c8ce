// Evaluates the dense blocks that candidate adjoints are written in (candidate.h) along a stored trajectory.
#pragma once

#include <functional>
#include <memory>

#include "costate/adjoint/maggi_blocks.h"
#include "costate/analysis/start.h"
#include "costate/candidate/candidate.h"
#include "costate/level/acceleration_level.h"
#include "costate/level/formulation_options.h"
#include "costate/objective/objective.h"

namespace costate {

/// How a formulation that candidates can be written for treats its constraints; throws CapabilityError for
/// the others.
Stabilization candidate_stabilization(const std::string& formulation, const std::shared_ptr<const Mechanism>& mechanism,
                                      const FormulationOptions& options);

class CandidateBlocks {
 public:
  /// Gives q, v, z at t.
  using Motion = std::function<void(double t, double* qvz)>;

  /// For a formulation that candidates can be written for; throws CapabilityError for the others.
  CandidateBlocks(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters, Objective objective,
                  const std::string& formulation, const FormulationOptions& options);
  void set_parameters(const double* rho);

  /// Of Maggi's formulations: chooses the independent coordinates along the motion, given times in their
  /// order, and returns the times where they change. Without a plan those that are best at the first
  /// evaluated point are in force.
  std::vector<double> plan(const std::vector<double>& times, const Motion& motion);
  /// The choice in force at t (at a change: that of the later piece), and of the piece between two times.
  int chart(double t) const;

  Assembly& assembly() { return assembly_; }
  /// All blocks at t of the motion, in the choice of independent coordinates in force or in another one.
  AdjointBlocks at(double t, const Motion& motion) { return at(t, motion, chart(t)); }
  AdjointBlocks at(double t, const Motion& motion, int chart);
  /// The same with M_dot and, but for Maggi's formulations, g_a_dot and g_lambda_dot.
  AdjointBlocks with_rates(double t, const Motion& motion);
  Start start(double t) { return find_start(assembly_, t, true); }

 private:
  void add_second_order(AdjointBlocks& b, const StateView& s);
  void add_reduced(AdjointBlocks& b, const Assembly::ParameterColumns& columns);

  Assembly assembly_;
  Objective objective_;
  AccelerationLevel level_;
  bool reduced_, second_order_;
  MaggiBlocks maggi_;
  struct Piece {
    double end;
    int chart;
  };
  std::vector<Piece> plan_;  // in order of time; the last one has no end
};

}  // namespace costate
