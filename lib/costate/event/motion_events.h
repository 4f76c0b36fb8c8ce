// The events of a mechanism (element/guarded_force.h): where they are along a step, what jumps there, and how tangents
// and adjoints cross. Positions go on, velocities but for impacts (event/impact.h: v+ = v + u); states of forces jump,
// z+ = D(t, x), and with them the right-hand side, f = (v, a, z'). The time t* of an event depends on everything
// (lib/README.md (17), (19)):
//   dt* = -(h_x dx + h_rho drho)/hdot,           hdot = h_t + h_x f-
//   dx+ = G_x dx + G_rho drho + (G_t + G_x f- - f+) dt*,   dpsi += (g- - g+) dt*,   G = (q, v + u, D)
//   sigma = mu+^T (G_t + G_x f- - f+) + g- - g+,  mu-^T = mu+^T G_x - sigma/hdot h_x
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/assembly/gathered_state.h"
#include "costate/assembly/variation.h"
#include "costate/element/guarded_force.h"
#include "costate/event/contact_gap.h"
#include "costate/event/contact_shares.h"
#include "costate/event/impact.h"
#include "costate/event/reaction_slope.h"
#include "costate/event/watched_guard.h"
#include "costate/objective/output.h"

namespace costate {

class MotionEvents {
 public:
  /// Of the mechanism's forces, with the numbers that the assembly has.
  explicit MotionEvents(Assembly& assembly);
  MotionEvents(const MotionEvents&) = delete;  // shares_ holds the contacts

  static bool has_any(const Mechanism& mechanism);
  /// Throws CapabilityError where there are any: for runs that are not carried across ("fixed steps").
  static void refuse(const Mechanism& mechanism, const std::string& what);

  /// By which impacts are solved for; to be called before the first one.
  void use(ImpulseBalance& balance) {
    impact_ = std::make_unique<Impact>(assembly_, balance);
    expansion_ = std::make_unique<Impact>(assembly_, balance);
  }

  bool empty() const { return guards_.empty(); }
  /// What was before decides at some events: whether bounces have died out. Of a run whose events are met again, one by
  /// one.
  struct History {
    struct OfContact {
      double largest_approach;
      std::vector<double> died_at;
      double decided;
    };
    double fastest = 0;
    std::vector<OfContact> contacts;
  };
  History history() const;
  void recall(const History& history);
  /// "contact.foot: touch".
  const std::string& name(int event) const { return of(event).name; }
  /// "closed": behind the event, and of rigid contacts behind the last cross().
  std::string mode(int event) const {
    return contact_of(event) ? last_mode_ : of(event).guarded->mode_behind(of(event).k);
  }
  /// Whether guards depend on multipliers, which states must then have.
  bool needs_multipliers() const { return needs_multipliers_; }
  /// By how much the last cross() made a state jump, the one that jumped most, or at an impact the rate of the gap; in
  /// its own unit.
  double last_jump() const { return last_jump_; }
  /// What it took from the kinetic energy, in J; 0 but at impacts.
  double last_loss() const { return last_loss_; }
  /// For how long contacts that closed at t, as their bounces had died out, would still bounce [s].
  double unseen_bounces(double t) const;
  /// Behind that: the states z, accelerations and multipliers x with these open, as they would be for nearly all of it.
  void solve_unseen(const StateView& behind, std::vector<double>& z, std::vector<double>& x);
  /// After begin() or cross(): how long what leaves a gap stays open at the least, if it comes back as it was sent off;
  /// infinite where nothing does. Steps have to be shorter, whatever errors of positions allow.
  double last_hop() const { return last_hop_; }

  /// A run begins at this state: a guard counts once it has been seen on the side from which it crosses, or where it is
  /// at zero and about to cross. Throws ModelError where it is past zero.
  void begin(const StateView& s);

  struct Hit {
    double t;
    int event;
  };
  using States = std::function<StateView(double)>;
  /// The first event of a step; `at` gives the state at times between its ends, valid until it is called again, and
  /// `places` the same without accelerations and multipliers, which may cost less. To be called for each step once, in
  /// order of time.
  std::optional<Hit> find(double from, double to, const States& at, const States& places);

  /// Where a guard came to be looked at, or ceased to be, and was nearly zero: what errors decide. The nearest one of
  /// the run so far, by parts of `size`, the largest coordinate.
  struct Pass {
    double t = 0;
    std::string event;
    double gap = 0, size = 0;
  };
  const std::optional<Pass>& nearest_pass() const { return nearest_pass_; }

  /// The kink of a driver has changed the velocities to those of this state: throws SolverError where the impulses take
  /// a closed contact's ground to pull, or its friction beyond its limit, or a slide to its other way.
  void require_pushing(const StateView& behind, const std::vector<double>& v_before);

  /// v (n entries) and z (nz entries), those before, := those behind the event.
  void cross(int event, const StateView& before, double* v, double* z);

  /// Accelerations, rates of force states and running cost on one side.
  struct Side {
    std::vector<double> a, zdot;
    double cost = 0;
  };
  /// Columns (q, v, z), one a parameter or one a direction of them (np x count), become those behind the event;
  /// dcost[j]
  /// := what the running part of psi gains.
  void tangent(int event, const StateView& before, const Side& minus, const Side& plus, double* const* columns,
               int count, double* dcost, const Eigen::MatrixXd* directions = nullptr);
  /// mu of (q, v, z) behind the event becomes that before it; the gradient gains the event's own share.
  void adjoint(int event, const StateView& before, const Side& minus, const Side& plus, double* mu, double* gradient);
  /// tangent() is from here on of columns that are not integrated with the motion: it refuses what adjoint() refuses,
  /// a slip in space that begins from rest, behind which the direction turns the faster the slower it is.
  void differentiate_between_steps() { between_steps_ = true; }
  /// Tangents and adjoints cross from here on where a slip in space begins from rest; who says so sees to where it is
  /// slow (slowest_in_space()).
  void carry_slips_from_rest() { carries_slips_from_rest_ = true; }
  /// The normal row of the contact that begins to slide in space from rest at this event, as its friction reaches the
  /// limit, or -1. Throws CapabilityError where another one does behind it, or what has landed: directions are not
  /// differentiated there.
  int begins_from_rest(int event, const StateView& before, const double* z_after) const;
  /// Of slips in space, but for feet that were given velocities beside others: the smallest |w|, and its smallest part
  /// of the largest that its slip has had at the looks so far; infinite without any.
  struct Slowest {
    double speed = std::numeric_limits<double>::infinity(), part = speed;
  };
  Slowest slowest_in_space(const StateView& s);
  /// Whether contacts may slide in space at all.
  bool may_slip_in_space() const;
  /// Whether it is the stop of one, with the states z before it.
  bool stops_slip(int event, const double* z) const;
  /// Whether all contacts do the same: open, stick or slide.
  bool same_modes(const double* z, const double* other) const;
  /// A slip in space ends from here on where it falls below this part of the largest speed that it has had: tangents,
  /// known to a tolerance, still tell its direction there. What is left of its way is the square of the part, and of
  /// its time, which costs on what jumps at the stop see, the part itself.
  void end_slow_slips(double part) { slow_slips_ = part; }
  /// Velocities are known to rtol |v| + atol: a slip in space that an integrator's step has left slower than a few
  /// times that has no direction any more, turns about at random and is never seen to pass through zero. It stops where
  /// it fell below. What is left is taken by an impulse, which friction would have done in the time |w|/|w'|: positions
  /// and velocities are off by the square of the part, costs on what jumps at the stop, and its time, by the part
  /// itself.
  void end_unresolved_slips(double rtol, double atol) { slip_error_ = {rtol, atol}; }
  /// At an impact of a given time: mu of (q, v) behind it becomes that before it, that of what it sets is zero, and the
  /// gradient gains the impact's own share; returns the weight of the time.
  double adjoint_of_impact(int event, const StateView& before, double* mu, double* gradient);

  // In event/event_second_terms.cpp: second derivatives of Lambda = mu^T G + kappa h, with mu behind the event.
  /// Derivatives by (q, v, z), by the parameters, the time itself, and of a guard by multipliers; or changes of them.
  struct Gradient {
    Eigen::VectorXd x, rho;
    double t = 0;
    Eigen::VectorXd lambda = {};
  };
  /// The guard's; what follows is about this event, and `before` stays valid. Throws CapabilityError where second
  /// derivatives are not carried across it, and what adjoint() throws.
  Gradient begin_second(int event, const StateView& before, const Side& minus);
  bool is_rigid(int event) const { return contact_of(event) != nullptr; }
  /// Whether it is a contact that lets go or begins to slide, and f goes on and its derivatives jump.
  bool bends(int event) const { return by_multipliers(of(event)) && !friction_falls(of(event)); }
  /// Whether no other rigid contact changes what it does.
  bool changes_alone(int event, const double* z_before, const double* z_after) const;
  /// Of mu^T G.
  Gradient transition_gradient(const double* mu);
  /// The change of Lambda's along d (its parameters': drho) at fixed mu, kappa; where friction falls by lambda, too.
  Gradient gradient_change(const double* mu, double kappa, const Variation& d, const Eigen::VectorXd& drho);

  // For steps that end at an event and are differentiated themselves (discrete/step_cut.h): the time of the event is
  // that at which the guard of the step's own end is zero. In event/step_crossing.cpp.
  /// The guard at (t, q, v, z; lambda where it depends on multipliers).
  double guard(int event, const StateView& s);
  /// The same, but that where a slip in space ends it is negative as long as w points back from where it points at
  /// `begin`: |w| is no less than zero.
  double guard_from(int event, const StateView& begin, const StateView& s);
  /// Derivatives of the guard at `before`, which has its multipliers; returns that by time. Throws what tangent()
  /// throws where there is no derivative.
  double guard_gradient(int event, const StateView& before, const Side& minus, const Side& plus, ScalarGradient& out);
  // Behind guard_gradient() of the same event:
  /// Columns (q, v, z) at the event, which comes by dt[j] later, become those behind it.
  void transition_tangent(int event, const StateView& before, double* const* columns, const double* dt, int count);
  /// mu of (q, v, z) behind the event becomes that before it; the gradient gains the transition's own share. Returns
  /// the weight of the time.
  double transition_adjoint(int event, const StateView& before, double* mu, double* gradient);

 private:
  using GuardOf = WatchedGuard;
  using ContactOf = WatchedContact;
  const GuardOf& of(int event) const { return guards_[static_cast<std::size_t>(event)]; }
  bool by_multipliers(const GuardOf& g) const {
    using Guard = UnilateralForce::Guard;
    if (g.contact < 0) return false;
    const Guard kind = contacts_[static_cast<std::size_t>(g.contact)].contact->guard_kind(g.k);
    return kind != Guard::touch && kind != Guard::stop;
  }
  /// At the start of a run: a guard that is zero, and stays so to first order.
  void look_from_rest(GuardOf& g, const StateView& s, int direction);
  /// A guard along the motion at this state with these accelerations: its value, rate and second derivative.
  Taylor2 course_of(const GuardOf& g, const StateView& s, const std::vector<double>& x);
  void find_hop(const StateView& s);
  /// Guard values; NaN where a guard is not looked at.
  void calc(const StateView& s, std::vector<double>& h);
  double value(const GuardOf& g, const StateView& s);
  /// The guard as the force has it, with those that share its friction (event/shared_friction.cpp).
  double guard(const GuardOf& g, const StateView& s);
  /// The speed at which a slip in space ends; 0 of other guards.
  double slowest_slip(const GuardOf& g) const;
  /// Of a step in which nothing else has happened: where a slip in space has fallen below what is resolved.
  std::optional<Hit> find_unresolved(double from, double to, const std::function<StateView(double)>& at);
  /// Where within a step guards are looked at, its ends among them; nowhere if none of them can cross in it.
  void choose_looks(double from, double to, const std::function<StateView(double)>& at);
  /// In event/let_pass.cpp: the guard comes to be looked at between a and b, or ceases to be; what of the look is left
  /// to find a crossing in, and the guard's value at its end.
  void meet_condition(GuardOf& g, bool comes, double& a, double& b, double& at_end,
                      const std::function<StateView(double)>& at);
  /// Of a guard with this value where its condition comes or ceases, or zero where it holds: whether the other point is
  /// in the place of its own, along the plane and above it, but for errors_of_meeting() [m]. There, too.
  bool meets_alike(const GuardOf& g, const StateView& s, double value);
  double errors_of_meeting() const;
  void load(const GuardOf& g, const StateView& s);
  void require_direction(const GuardOf& g, double along, const StateView& s);
  /// When in (begin, end] a contact that has left without having been seen to, as it does where what lifts it vanishes
  /// or another impact presses it down, falls into the ground for good; NaN: it does not.
  double falls_back(const GuardOf& g, double begin, double end, const std::function<StateView(double)>& at);
  void require_seen(const GuardOf& g, double last, double past, const StateView& s);
  MeasureArguments arguments() const;
  /// A contact in an impact: what it does, and the rows of Impact that are its own.
  struct InPlay {
    ContactOf* contact;
    bool bounces;
    double restitution;
    std::vector<int> rows;
    double given = 0;  // impulse that is given back, of Poisson's law
    int way = 0;       // of contact_ways.h
  };
  // In event/slow_slips.cpp.
  /// Whether a contact in space begins to slide from rest behind this event; a CapabilityError unless that is carried.
  bool slides_from_rest(int event, const StateView& before);
  void refuse_slip_from_rest(int event, const StateView& before);
  bool stops_in_space(const GuardOf& g) const;
  /// Of each contact whether it comes to rest along the ground in the instant of this event: the event's own, and where
  /// a slip in space ends those of its body that are about as slow, and what these leave no way to slide.
  std::vector<char> stopping(int event, const StateView& before);
  /// Of the contact of such a guard: from rest, or alone on its part.
  bool slides_now(const GuardOf& g, const double* z) const;
  /// The rigid contact of an event, or null; `strikes`: only where the event is an impact.
  const ContactOf* contact_of(int event, bool strikes = false) const {
    const int c = of(event).contact;
    if (c < 0) return nullptr;
    const ContactOf& contact = contacts_[static_cast<std::size_t>(c)];
    return strikes && contact.contact->guard_kind(of(event).k) != UnilateralForce::Guard::touch ? nullptr : &contact;
  }
  /// Whether velocities jump: where a gap closes, and where a slip in space ends, by what is left of it.
  bool has_impulse(int event) const;
  double number(const ContactOf& c, int k) const { return contact_number(c, k, assembly_); }
  UnilateralForce::Guard contact_guard(int event) const { return contact_of(event)->contact->guard_kind(of(event).k); }
  // In event/contact_modes.cpp.
  /// cross() of a rigid contact's event.
  void cross_contact(int event, const StateView& before, double* v, double* z);
  /// Of the contacts of this part that are closed at this state (q, v, z as they are behind an event) those stay so
  /// that the ground presses, and stick or slide; z with them. Some `begin` to slide, and some stop (of all, or none).
  void settle(const StateView& s, double* z, int part, const std::string& event,
              const std::vector<const ContactOf*>& begin, const std::vector<char>& stops);
  /// Whether a closed contact that slides has come to rest along the ground, but for rounding.
  bool has_stopped(const ContactOf& c, const StateView& s, double acceleration) const;
  /// Where a contact slides the largest acceleration at these states; else 0.
  double largest_acceleration(const StateView& s);
  /// Throws SolverError where a normal force vanishes through infinity.
  void require_bounded(const ContactOf& c, const StateView& s);
  /// A run begins at this state: that what slides there can.
  void require_sliding(const StateView& s);
  // In event/resting_together.cpp.
  /// What velocities are known to.
  double velocity_error() const { return slip_error_.relative * fastest_ + slip_error_.absolute; }
  /// With whom its contact shares what it holds (event/contact_shares.h), of a guard of multipliers in space, where
  /// the state's own shares are not within their limits, or `anyhow`; else null.
  const ContactShares::Held* held(const GuardOf& g, const StateView& s, bool anyhow = false);
  /// Of a contact that lets go or begins to slide at this state: what it does from there on, and what those do with
  /// which it shares what it holds, by their best shares; z with that. Returns those that begin to slide.
  std::vector<const ContactOf*> let_go(const GuardOf& g, const StateView& sticking, std::vector<double>& z);
  /// Of what lets go together the guard's derivatives by multipliers; h_rho_ := those by parameters.
  Eigen::VectorXd linearize_held(const ContactShares::Held& together);
  // In event/contact_impact.cpp.
  /// Solves for the impact at the event: jump_, and which contacts are closed behind it.
  void strike(int event, const StateView& before);
  std::vector<InPlay> find_in_play(int event, const StateView& before, double speed);
  /// Whether the bounces of a contact that strikes with this speed have died out.
  bool has_died_out(ContactOf& c, const StateView& before, double approach);
  /// What the contacts do in this impact: of all ways the one that fits; throws where there are none or several.
  void find_way(int event, const StateView& before, Impact& impact, std::vector<InPlay>& in_play, double speed);
  /// Accelerations and multipliers (n, m) at the rows that z has.
  void solve_motion(const StateView& s, double* x);
  /// The largest of rates or accelerations of the coordinates, those of angles at the mechanism's length.
  double largest_of(const double* x) const;
  /// What positions of the force are rounded by: likewise, or the mechanism's length, if they are all small.
  double size_of(const Force& force, const StateView& s) const;
  // In event/motion_derivatives.cpp.
  /// The largest sum of |Q_j|/M_jj by elements: what forces alone make, of which nothing is left where they balance.
  double acceleration_by_forces(const StateView& s);
  /// Whether `c` slides no other way than these do, as points of one body on one plane: where they stop it does.
  bool slides_as(const ContactOf& c, const std::vector<char>& others, const StateView& s);
  /// Whether derivatives cross this event as they are. Throws SolverError where there are none.
  bool goes_on_smoothly(int event, const StateView& before, const Side& minus, const Side& plus);
  // In event/falling_friction.cpp.
  /// Whether friction falls as sliding begins, from a larger coefficient: of a contact, and of what the guard is about.
  bool friction_falls(const ContactOf& c) const {
    return number(c, c.contact->sticking_number()) > number(c, c.contact->friction_number());
  }
  bool friction_falls(const GuardOf& g) const;
  // In event/shared_friction.cpp.
  /// The guards of others that stick and slide as this contact does, so that who bears how much of the friction is not
  /// determined, while what is left to the limits of all is; of a guard of falling friction, else none.
  const std::vector<int>& sharing(const GuardOf& g, const StateView& s);
  std::vector<int> find_sharing(const GuardOf& g, const StateView& s);
  /// Whether what sticks at this state, which has its multipliers, exceeds no limit of friction by more than `beyond`.
  bool sticks_within_limits(const ContactOf& c, const StateView& s, double beyond);
  /// Throws CapabilityError where such a contact, behind its slip, is held by others.
  void require_falling(int event, const StateView& before, const StateView& behind);
  /// The guard's derivatives by the multipliers of a contact (m), at what load() has loaded.
  Eigen::VectorXd by_multipliers_of(const GuardOf& g);
  /// To gradient_change().
  void add_multipliers_change(const GuardOf& g, double kappa, const Variation& d, Gradient& sum);
  /// linearize() of the guard and of those that share its friction; returns the derivatives by multipliers.
  Eigen::VectorXd linearize_all(const GuardOf& g, const StateView& before, const Side& minus, bool columns);
  /// linearize() where such a guard has the multipliers that belong to the state, and h_x_, h_rho_ and hdot_ what these
  /// depend on.
  void linearize_with_reactions(const GuardOf& g, const StateView& before, const Side& minus, bool columns);
  // In event/motion_derivatives.cpp.
  /// The derivatives of u at the impact; what follows from them, as Impact has it.
  void linearize_impact(int event, const StateView& before, bool columns);
  void impact_tangent(const double* dq, const double* dv, const Eigen::VectorXd& drho, double dt, double* du);
  double impact_adjoint(const double* w, double* w_q, double* w_v, double* gradient);
  /// The changes along d of what impact_adjoint() finds at fixed w (event/impact_second_terms.cpp).
  double impact_gradient_change(const double* w, const Variation& d, const Eigen::VectorXd& drho, double* w_q,
                                double* w_v, double* gradient);
  /// The impulses that Poisson's law gives back: active rows of the expansion and of the compression, the number of the
  /// restitution, the impulse of the compression.
  struct GivenBack {
    Eigen::Index of_expansion, of_compression;
    int number;
    double impulse;
  };
  std::vector<GivenBack> given_back() const;
  /// h_x, h_rho, hdot and those of the transition.
  void linearize(const GuardOf& g, const StateView& before, const Side& minus, bool columns);

  Assembly& assembly_;
  std::vector<GuardOf> guards_;
  std::vector<double> before_, after_;
  GatheredState gathered_;
  PathDual t_;  // local arguments on duals
  std::vector<PathDual> q_, v_, z_, p_, out_, lambda_;
  // Of the last linearization: rows over (q, v, z), columns of rho.
  std::vector<double> h_x_, h_rho_;
  std::vector<std::vector<double>> D_x_, D_rho_;
  std::vector<double> D_rate_, D_t_;  // D_t + D_x f-, D_t
  double h_t_ = 0, hdot_ = 0, last_jump_ = 0, last_loss_ = 0, last_hop_ = std::numeric_limits<double>::infinity();
  std::unique_ptr<Impact> impact_;
  std::unique_ptr<ReactionSlope> reactions_;  // made where it is asked
  std::vector<ContactOf> contacts_;
  std::optional<ContactShares> shares_;
  struct SharedFriction {
    std::vector<double> modes = {};  // of the contacts of the part, at which `guards` is known
    std::vector<int> guards = {};
  };
  std::vector<SharedFriction> shared_;  // by guards
  bool needs_multipliers_ = false, between_steps_ = false, carries_slips_from_rest_ = false;
  double slow_slips_ = 0;
  struct {
    double relative = 0, absolute = 0;
  } slip_error_;
  std::string last_mode_;
  std::vector<double> open_z_;         // states with all contacts open
  std::unique_ptr<Impact> expansion_;  // of Poisson's law what the compression, impact_, gives back
  bool expands_ = false;
  std::vector<double> amounts_;            // of forces, by coordinates
  std::vector<double> jump_, compressed_;  // u; and v behind the compression
  std::vector<double> levers_;             // of angles the mechanism's length, of lengths 1
  double fastest_ = 0;                     // largest speed of any coordinate so far
  double reach_ = 0;                       // largest position of what has gaps so far
  double length_ = 0;                      // of the mechanism
  std::optional<Pass> nearest_pass_;
  std::vector<double> looks_;
  std::vector<GapTrace::Look> trace_;
  double looked_until_ = std::numeric_limits<double>::quiet_NaN();
  int second_event_ = -1;  // of begin_second()
  StateView second_before_;
};

}  // namespace costate
