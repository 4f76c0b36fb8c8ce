// What contacts of all kinds share: the normal law and the friction, as scenes write them and as numbers of a
// mechanism.
#pragma once

#include <string>
#include <vector>

#include "costate/element/force/contact_laws.h"
#include "costate/mechanism/builder.h"
#include "costate/scene/scene_table.h"

namespace costate {

struct ContactLawOptions {
  std::string law = "hunt-crossley";                  // element/force/contact_laws.h
  double stiffness_N_per_m_n = 0;                     // K of F = K d^n; with a modulus that of Hertz, 4/3 E* sqrt(R)
  double youngs_modulus_Pa = 0, poisson_ratio = 0.3;  // of what has the radius; 0: the stiffness as given
  double other_youngs_modulus_Pa = 0, other_poisson_ratio = 0.3;  // of the ground, or of the other body; 0: rigid
  double exponent = 1.5;                                          // n; linear has 1
  double restitution = 0.5;                                       // of the laws that have one
  double damping_N_s_per_m = 0;                                   // of kelvin-voigt
  std::string friction = "none";
  double friction_coefficient = 0;  // of sliding
  double static_coefficient = -1;   // negative: that of sliding
  double transition_velocity_m_per_s = 0.01;
  double dead_velocity_m_per_s = 0;      // ambrosio
  double decay_s_per_m = 10;             // bengisu-akay
  double bristle_stiffness_per_m = 1e4;  // dahl, lugre: N sigma is a stiffness
  double bristle_damping_s_per_m = 0;    // lugre
  double approach_speed_m_per_s = 0;     // of a contact that is closed at the start
  bool energy_lost = false;              // whether that is integrated
};

/// By their names; throw ModelError at `subject`, with what was meant, where there is none.
NormalLaw normal_law(const std::string& subject, const std::string& name);
FrictionModel friction_model(const std::string& subject, const std::string& name);

/// The keys of a scene's table; those of the other side's material begin with `other` ("ground_").
void read_normal_law(SceneTable& table, const std::string& other, ContactLawOptions& o);
void read_friction(SceneTable& table, ContactLawOptions& o);
/// Throws ModelError at PATH.static_coefficient where sticking takes less than sliding.
void check_sticking(const std::string& path, double sliding, double sticking);

/// Adds the numbers of a contact to a mechanism, one by one, at PATH.KEY. A number that the chosen laws do not hold
/// keeps its place and is no parameter.
class ContactNumbers {
 public:
  ContactNumbers(MechanismBuilder& builder, std::string path) : builder_(builder), path_(std::move(path)) {}

  void add(const std::string& key, double value, NumberRule rule, bool used);
  /// The last one stands for the next one, too.
  void repeat() { numbers_.push_back(numbers_.back()); }
  /// K, n, e, C. Throws ModelError where they are out of range.
  void add_normal_law(const ContactLawOptions& o);
  /// Those of friction_force().
  void add_friction(const ContactLawOptions& o);
  /// Young's moduli and Poisson's ratios of both.
  void add_materials(const ContactLawOptions& o, const std::string& other);
  /// The approach speed at the start, and zero.
  void add_start(const ContactLawOptions& o, bool latches);
  const std::vector<int>& all() const { return numbers_; }

 private:
  MechanismBuilder& builder_;
  std::string path_;
  std::vector<int> numbers_;
};

/// Notice of a wall, whose height has no effect, where that may have been meant as its place.
void tell_of_wall(const std::string& path, double x, double height, double angle);
/// Throws ModelError where materials make no law: no radius, a linear law, a ratio out of range.
void check_materials(const std::string& path, const ContactLawOptions& o, const std::string& other, bool round);

}  // namespace costate
