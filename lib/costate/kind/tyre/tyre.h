// [tyre.NAME]: a tyre between a wheel and a road, by one of several models. The wheel turns about an axis of
// a rigid body; see element/force/tyre_contact.h for the contact and tyre_models.h for the models.
#pragma once

#include <array>
#include <string>

#include "costate/element/force/tyre_contact.h"
#include "costate/kind/road/road.h"

namespace costate {

/// What all models share.
struct TyreOptions {
  std::string wheel;  // a point on a rigid body: the wheel's centre
  std::string road;
  std::array<double, 3> axis = {0, 1, 0};  // in the body's frame; the wheel points along axis x the ground's normal
  std::string spin;                        // a coordinate whose rate is the wheel's spin relative to the body, or none
  double radius_m = 0;                     // unloaded
  double stiffness_N_per_m = 0;
  double damping_N_s_per_m = 0;
  double damping_ramp_m = 1e-3;  // the damper grows with the deflection up to this one; 0: at once
  double road_factor = 1;        // of the road's height
  double road_shift = 0;         // the profile is seen this far [m], the post this much later [s]
  TyreContact contact = TyreContact::disc;
  bool bilateral = false;  // may pull: for linearisations; ride and linear only
};

/// How slip comes about, of the models with one.
struct TyreSlipOptions {
  double slip_speed_m_per_s = 0.1;  // regularises the slip at rest; 0: none, and no slip below 0.1 m/s
  double relaxation_length_m = 0;   // 0: without a lag
  double initial_slip = 0;          // tan alpha at the start, where it lags
};

void add_ride_tyre(MechanismBuilder& builder, const std::string& name, const TyreOptions& tyre);

struct LinearTyreOptions {
  double lateral_damping_N_s_per_m = 0;
  double cornering_stiffness_N_per_rad = 0;
  double camber_stiffness_N_per_rad = 0;
  double camber_moment_N_m_per_rad = 0;
  double aligning_moment_N_m_per_rad = 0;
  double trail_m = 0;
};
void add_linear_tyre(MechanismBuilder& builder, const std::string& name, const TyreOptions& tyre,
                     const TyreSlipOptions& slip, const LinearTyreOptions& options);

struct CalspanOptions {
  double A0 = 0, A1 = 0, A2 = 0, A3 = 0, A4 = 0, A_omega = 1, B1 = 0, B3 = 0, B4 = 0, SN = 1, AF1 = 0, AF2 = 0;
};
void add_calspan_tyre(MechanismBuilder& builder, const std::string& name, const TyreOptions& tyre,
                      const TyreSlipOptions& slip, const CalspanOptions& options);

}  // namespace costate
