// Global terms of the equations of motion, assembled from the elements' local kernels:
//   M a + Phi_q^T lambda = Q,  Phi(q, t) = 0,  zdot = f(q, v, z, t)
// with all first derivatives (lib/README.md (0)). Patterns and slots are fixed at construction; an evaluation
// gathers, calls kernels and scatters, and allocates nothing. One Assembly serves one thread.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "costate/assembly/rest_region.h"
#include "costate/linear/sparse_pattern.h"
#include "costate/mechanism/mechanism.h"

namespace costate {

/// Read-only view of a state in global numbering; a, lambda, z may be null where a call does not need them.
struct StateView {
  double t = 0;
  const double* q = nullptr;
  const double* v = nullptr;
  const double* a = nullptr;
  const double* lambda = nullptr;
  const double* z = nullptr;
};

struct AssemblyCounters {
  long dynamics = 0;    // evaluations of M, Q, Phi_q, ...
  long partials = 0;    // evaluations of the derivative blocks
  long parameters = 0;  // evaluations of the derivatives with respect to parameters
};

class Assembly {
 public:
  Assembly(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters);

  const Mechanism& mechanism() const { return *mechanism_; }
  std::shared_ptr<const Mechanism> mechanism_ptr() const { return mechanism_; }
  const ParameterSelection& parameters() const { return parameters_; }
  int n() const { return n_; }
  int m() const { return m_; }
  int nz() const { return nz_; }
  int np() const { return parameters_.size(); }

  /// rho has np() entries. Everything that depends on numbers only is recomputed here.
  void set_parameters(const double* rho);
  const std::vector<double>& numbers() const { return numbers_; }
  const std::vector<double>& rho() const { return rho_; }

  // Rows that come and go with the states of forces (element/switched_rows.h): of the last evaluation that was given z,
  // and before one not there. Evaluations without z leave them as they are.
  bool has_switched_rows() const { return !switches_.empty(); }
  void switch_rows(const double* z);
  bool is_there(int row) const { return row_there_.empty() || row_there_[static_cast<std::size_t>(row)]; }
  /// Whether a row keeps positions, or only velocities.
  bool holds_position(int row) const { return row_holds_.empty() || row_holds_[static_cast<std::size_t>(row)]; }
  /// Constraints with rows that have no place (assembly/rolling_rows.h), there or not.
  const std::vector<std::size_t>& constraints_without_place() const { return without_place_; }
  /// Of contacts that slide at these states: R2 of the row `along`, which is not there, is
  /// -(lambda_along + direction mu lambda_normal), mu a number.
  struct SlidingRow {
    int normal, along, number;
    double direction;
  };
  const std::vector<SlidingRow>& sliding_rows() const { return sliding_; }
  double friction(const SlidingRow& r) const { return r.direction * numbers_[static_cast<std::size_t>(r.number)]; }
  /// Those that may slide, as (along, normal).
  const std::vector<std::pair<int, int>>& slidable_rows() const { return slidable_; }
  /// Phi_q with the rows along which contacts slide: its transpose carries the multipliers' forces.
  const std::vector<double>& reaction_jacobian() const { return sliding_.empty() ? phi_q : reaction_q_; }

  // Patterns: mass-like n x n, constraint m x n, force-state blocks n x nz, nz x n, nz x nz.
  const SparsePattern& square() const { return square_; }
  const SparsePattern& jacobian() const { return jacobian_; }
  const SparsePattern& force_state() const { return force_state_; }
  const SparsePattern& state_force() const { return state_force_; }
  const SparsePattern& state_state() const { return state_state_; }

  // Results of calc_dynamics (values on the patterns above, or dense vectors).
  std::vector<double> M, phi_q, Q, phi, phi_t, bias, zdot;
  // Results of calc_partials: K = (M a + Phi_q^T lambda - Q)_q, C = -Q_v, and those of constraints and states.
  std::vector<double> K, C, phid_q, phidd_q, Q_z, f_q, f_v, f_z;

  // A caller that knows its point by an identity (evaluation_point.h) says so, and can ask later whether the results
  // are still those of that point; 0 is none.
  /// M, Q, zdot, phi, phi_q, phi_t, bias at (t, q, v, z).
  void calc_dynamics(const StateView& s, long point = 0);
  /// By coordinates the sum of the elements' |Q|, the constant ones' as one: what is left where forces balance is known
  /// to the rounding of these.
  void calc_force_amounts(const StateView& s, std::vector<double>& amounts);
  /// Only phi, phi_q and phi_t at (t, q).
  void calc_constraints(const StateView& s);
  /// Only phi_q at (t, q).
  void calc_jacobian(const StateView& s, long point = 0);
  /// Only M at q.
  void calc_mass(const StateView& s, long point = 0);
  /// All derivative blocks at (t, q, v, a, lambda, z); also M and phi_q are those of the last calc_dynamics.
  void calc_partials(const StateView& s, long point = 0);
  /// Of these only K, C, Q_z, f_q, f_v, f_z.
  void calc_force_partials(const StateView& s);
  /// hessian = (Phi_q^T gamma)_q on the square pattern.
  void calc_hessian(const StateView& s, const double* gamma, std::vector<double>& hessian);

  /// Whether the results of calc_dynamics, M and phi_q of them, or those of calc_partials are those of the point.
  bool has_dynamics(long point) const { return point != 0 && dynamics_at_ == point; }
  bool has_matrices(long point) const { return point != 0 && mass_at_ == point && jacobian_at_ == point; }
  bool has_partials(long point) const { return point != 0 && partials_at_ == point; }
  /// An identity that no point had before; and whether one was given since the numbers are what they are.
  long new_point() { return ++last_point_; }
  bool knows(long point) const { return point > point_of_numbers_; }

  /// Dense derivative columns with respect to rho: F = (M a + Phi_q^T lambda - Q)_rho (n x np), phi, phidot,
  /// phiddot (m x np), f (nz x np). Zeroed first.
  struct ParameterColumns {
    Eigen::MatrixXd F, phi, phid, phidd, f;
  };
  void resize(ParameterColumns& columns) const;
  void calc_parameter_columns(const StateView& s, ParameterColumns& columns);
  /// gradient[j] += factor (s1^T F_j + s2^T (c0 phi_j + c1 phid_j + c2 phidd_j) + s0^T phid_j - sz^T f_j).
  struct ParameterWeights {
    const double* force = nullptr;  // s1, n
    const double* row = nullptr;    // s2, m
    double c0 = 0, c1 = 0, c2 = 0;
    const double* row_phi = nullptr;   // extra weight of phi alone, m (or null)
    const double* row_phid = nullptr;  // extra weight of phidot alone, m (or null)
    const double* state = nullptr;     // sz, nz
    bool constant_bodies = true;       // whether bodies of constant mass and force take part
  };
  void add_parameter_gradient(const StateView& s, const ParameterWeights& w, double factor, double* gradient);

  /// The share of bodies of constant mass and force in sums of such products, whatever their number of terms:
  /// gradient[j] += factor (sum over entries of M_rho_j outer - Q_rho_j.sum), where outer, on the square pattern, is
  /// the sum of s1 a^T, and sum that of s1.
  bool varies_constant_bodies() const { return varies_constant_bodies_; }
  void add_constant_body_gradient(const double* outer, const double* sum, double factor, double* gradient);
  /// out += Mdot x along the motion (q, v).
  void add_mass_rate_product(const StateView& s, const double* x, double* out);

  // What a projection onto the constraints in the metric of the masses differentiates: M u + Phi_q^T eta at (t, q),
  // with u (n) and eta (m) fixed. In assembly/projection_terms.cpp.
  /// out = (M u + Phi_q^T eta)_q on the square pattern.
  void calc_projection_hessian(const StateView& s, const double* u, const double* eta, std::vector<double>& out);
  /// F = (M u + Phi_q^T eta)_rho, n x np.
  void calc_projection_columns(const StateView& s, const double* u, const double* eta, Eigen::MatrixXd& F);
  /// gradient[j] += factor s1^T (M u + Phi_q^T eta)_rho_j.
  void add_projection_gradient(const StateView& s, const double* u, const double* eta, const double* s1, double factor,
                               double* gradient, bool constant_bodies = true);

  // Energies leave the results of the functions above as they are.
  double kinetic_energy(const StateView& s);
  /// g_q += factor v^T (M v)_q / 2, g_v += factor M v, g_rho += factor v^T M_rho v / 2.
  void add_kinetic_energy_gradient(const StateView& s, double factor, double* g_q, double* g_v, double* g_rho);
  double potential_energy(const StateView& s);

  /// Gathers the local arguments of an element (for outputs and tests). Pointers stay valid until the next gather.
  LocalState gather(const Element& e, std::size_t number_offset, const StateView& s);

  const AssemblyCounters& counters() const { return counters_; }

  // Column lists per number: who is a parameter.
  const std::vector<std::vector<std::pair<int, double>>>& number_columns() const { return columns_; }

 private:
  struct Slots {
    const Element* element = nullptr;
    int row_offset = 0;             // first row of a constraint, first state of a force
    std::size_t number_offset = 0;  // into local_numbers_
    std::vector<std::int64_t> square, jacobian, force_state, state_force, state_state;
    std::vector<int> active;              // local numbers that depend on parameters
    bool there = true;                    // of constraints: whether its rows are
    int slides = 0;                       // and the direction in which a contact slides
    std::optional<RestRegion> rest = {};  // of forces that may
  };
  struct Switch {
    std::size_t constraint;
    int state, sliding_state;  // among all; -1 where it does not slide
    int friction;              // number
  };
  void read_switches(const StateView& s) {
    if (!switches_.empty() && s.z) switch_rows(s.z);
  }
  /// What is evaluated of rows along which contacts slide becomes that of rows that are not there.
  void part_sliding_rows();
  LocalState gather(const Slots& s, const StateView& x);
  // In applied_forces.h.
  template <class Add>
  void for_each_varying_force(const StateView& s, double* zdot, const Add& add);
  /// Whether a force vanishes at a state: in the region found last, or in one found here.
  bool rests(Slots& force, const StateView& s) {
    return force.rest && (force.rest->holds(s.q, s.z) || (force.rest->is_due() && force.rest->find(gather(force, s))));
  }
  /// M at q into `out`.
  void calc_mass(const StateView& s, std::vector<double>& out);
  void add_body_and_force_partials(const StateView& s);
  void add_hessians(const StateView& s, std::vector<double>& out);
  static void scatter_square(const Slots& s, const double* local, double factor, std::vector<double>& global) {
    for (std::size_t k = 0; k < s.square.size(); ++k) global[s.square[k]] += factor * local[k];
  }
  template <class Visit>
  void for_each_momentum_partial(const StateView& s, const double* u, bool constant_bodies, const Visit& visit);

  std::shared_ptr<const Mechanism> mechanism_;
  ParameterSelection parameters_;
  int n_ = 0, m_ = 0, nz_ = 0;
  std::vector<double> rho_, numbers_, local_numbers_;
  std::vector<std::vector<std::pair<int, double>>> columns_;
  std::vector<Slots> bodies_, constraints_, forces_;
  // Bodies whose mass, whose force, and either of whose is not constant.
  std::vector<std::size_t> varying_mass_, varying_force_, varying_bodies_;
  std::vector<Switch> switches_;
  std::vector<char> row_there_, row_holds_;  // empty without switches
  std::vector<SlidingRow> sliding_;
  std::vector<std::size_t> without_place_;
  std::vector<std::pair<int, int>> slidable_;
  std::vector<double> reaction_q_;       // where there are sliding rows
  bool varies_constant_bodies_ = false;  // a parameter acts on one of the others
  SparsePattern square_, jacobian_, force_state_, state_force_, state_state_;
  std::vector<double> M_constant_, Q_constant_;
  std::vector<double> scratch_;
  std::vector<double> rest_;         // n zeros, sized when first needed
  std::vector<double> energy_mass_;  // M where an energy is taken, sized when first needed
  long last_point_ = 0, point_of_numbers_ = 0;
  long dynamics_at_ = 0, mass_at_ = 0, jacobian_at_ = 0, partials_at_ = 0;
  // Local gathered arrays.
  double lq_[kMaxLocal] = {}, lv_[kMaxLocal] = {}, la_[kMaxLocal] = {}, ll_[kMaxLocal] = {}, lz_[kMaxLocal] = {};
  AssemblyCounters counters_;
};

}  // namespace costate
