// Directions in which contacts slide in space (element/switched_rows.h), and how they turn: with the rates v_t of the
// rows along the ground, the offset o, w = v_t + o and sigma = w/|w|
//   R2_k = -(lambda_k + mu lambda_0 sigma_k),   sigma_x = (1 - sigma sigma^T)/|w| w_x,   k = 1, 2.
// Of contacts in the plane, whose direction does not change, nothing is done.
#pragma once

#include "costate/assembly/assembly.h"

namespace costate {

/// Whether contacts may slide in space.
bool may_slide_in_space(const Assembly& assembly);
/// Of a constraint whose rows may slide: where the states of all forces say whether and how it does, z[state] with the
/// offset behind it in space; of others -1.
int sliding_state(const Mechanism& mechanism, const Constraint& constraint);
/// Whether a contact begins to slide in space from rest, from one state of all forces to the other.
bool begins_slip_from_rest(const Mechanism& mechanism, const double* z_before, const double* z_after);
/// Whether a contact slides in space; and whether the i-th of the assembly's sliding rows is of one that does.
bool slips_in_space(const Assembly& assembly);
bool slips_in_space(const Assembly& assembly, std::size_t i);
/// The directions of those of `rows`, of the assembly's sliding rows, that slide in space, at (q, v, z) of the Jacobian
/// that is there. Where v or z are missing they stay as they are, and where w = 0 there is none.
void turn_slips(const Assembly& assembly, const StateView& s, std::vector<Assembly::SlidingRow>& rows);
/// Of rows along which contacts slide: phid_q := 0, phidd_q := 0, in space (R2_k)_q, by their rates' phid_q.
void part_sliding_partials(const Assembly& assembly, const StateView& s, std::vector<double>& phid_q,
                           std::vector<double>& phidd_q);
/// The largest sum |J| |v| of all rows along which contacts slide: w is the sum of such parts, and known to their
/// rounding.
double parts_of_slips(const Assembly& assembly, const double* v);
/// r2_v += (R2_k)_v of contacts that slide in space.
void add_slip_rates(const Assembly& assembly, const StateView& s, std::vector<double>& r2_v);
/// For rows of rates in whose place those of friction stand: (R2_k)_q and (R2_k)_v of contacts that slide in space, on
/// the Jacobian's pattern and zero elsewhere, at the partials that are there; both empty where nothing slides in space.
void slip_partials(const Assembly& assembly, const StateView& s, std::vector<double>& by_q, std::vector<double>& by_v);
/// slip_partials(), and K += J_t^T (R2)_q, C += J_t^T (R2)_v: the equations' derivatives at constant normal forces,
/// with lambda_k = -mu lambda_0 sigma_k, in the place of those at constant multipliers.
void add_slip_forces(Assembly& assembly, const StateView& s, std::vector<double>& by_q, std::vector<double>& by_v);
/// (R2_k)_rho, as far as sigma turns, of the rates' columns phid; empty where nothing slides in space.
Eigen::MatrixXd slip_columns(const Assembly& assembly, const StateView& s, const Eigen::MatrixXd& phid);
/// Of the contact whose first row is `row`: the weights of the rates of its rows in factor sum_k weight_k R2_k.
void slip_weights(const Assembly& assembly, const StateView& s, int row, double factor, const double* weight,
                  double* of_rates);

}  // namespace costate
