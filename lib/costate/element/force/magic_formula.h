// The Magic Formula tyre in steady state and with lagging slips: MF-Tyre 6.1 (FITTYP 61, 62) and, with its
// own few terms, 5.2 and PAC2002 (FITTYP 5, 6, 21, 52). Equations: H. B. Pacejka, Tire and Vehicle Dynamics,
// 3rd edition, chapter 4.3.2 (4.E1 to 4.E78), without turn slip, in the axes of .tir files (ISO-W: x forward,
// y left, z up), and with the conventions of the public magic-formula-tyre-library (teasit, commit 642592f),
// which the test compares with:
//   - the pure side force takes the angle alpha, all else tan alpha; camber enters by its sine
//   - the trail's side force, and the residual moment but for its camber terms, are those without camber
//   - the residual moment has cos(alpha) in D_r and once more outside
//   - but S_Vy is scaled as the book has it, by 10 LMUY / (1 + 9 LMUY), like S_Vx
//   - and sgn is that of alpha_y = alpha + S_Hy, as in (4.E24), not of alpha, which would let the force jump at alpha =
//   0
// The generation 5.2 (the same author's 1st edition, chapter 4.3; the equations (40) to (54) of MF-Tyre's manual) has
//   - camber in the trail's side force, which is F_y - S_Vyk, and in S_Hf and B_r
//   - the angle alpha throughout, arctan(sqrt(tan^2 alpha + (K_x kappa/K_y)^2)) in the moment, and one cos(alpha) in
//     its residual part
//   - S_V scaled by LMUX and LMUY themselves, and QSX1 by LVMX alone
// And these are ours, for smoothness: sgn(alpha_y) in E_y, alpha_y = alpha + S_Hy, is tanh(alpha_y / 1e-3 rad), which
// changes the side force by less than 1e-6 F_z in |alpha_y| < 2e-3 and not at all beyond 0.02; shape factors E are not
// above 1.
//
// Relaxation lengths are numbers of the scene or follow load and camber by the coefficients of 5.2 and PAC2002.
//
// Numbers: slip speed, [relaxation length if it is a number, and initial slip] of the lateral and then of the
// longitudinal slip where they lag, then the coefficients by their names in the file.
#pragma once

#include <string>
#include <vector>

#include "costate/element/force/tyre_models.h"

namespace costate {

// clang-format off
#define COSTATE_MAGIC_FORMULA \
  FNOMIN, UNLOADED_RADIUS, LONGVL, NOMPRES, INFLPRES, BREFF, DREFF, FREFF, LFZO, LCX, LMUX, LEX, LKX, LHX, \
  LVX, LCY, LMUY, LEY, LKY, LHY, LVY, LTR, LRES, LXAL, LYKA, LVYKA, LS, LKYC, LKZC, LVMX, LMX, LMY, PCX1, \
  PDX1, PDX2, PDX3, PEX1, PEX2, PEX3, PEX4, PKX1, PKX2, PKX3, PHX1, PHX2, PVX1, PVX2, PPX1, PPX2, PPX3, \
  PPX4, RBX1, RBX2, RBX3, RCX1, REX1, REX2, RHX1, PCY1, PDY1, PDY2, PDY3, PEY1, PEY2, PEY3, PEY4, PEY5, \
  PKY1, PKY2, PKY3, PKY4, PKY5, PKY6, PKY7, PHY1, PHY2, PHY3, PVY1, PVY2, PVY3, PVY4, PPY1, PPY2, PPY3, \
  PPY4, PPY5, RBY1, RBY2, RBY3, RBY4, RCY1, REY1, REY2, RHY1, RHY2, RVY1, RVY2, RVY3, RVY4, RVY5, RVY6, \
  QBZ1, QBZ2, QBZ3, QBZ4, QBZ5, QBZ9, QBZ10, QCZ1, QDZ1, QDZ2, QDZ3, QDZ4, QDZ6, QDZ7, QDZ8, QDZ9, QDZ10, \
  QDZ11, QEZ1, QEZ2, QEZ3, QEZ4, QEZ5, QHZ1, QHZ2, QHZ3, QHZ4, PPZ1, PPZ2, SSZ1, SSZ2, SSZ3, SSZ4, QSX1, \
  QSX2, QSX3, QSX4, QSX5, QSX6, QSX7, QSX8, QSX9, QSX10, QSX11, PPMX1, QSY1, QSY2, QSY3, QSY4, QSY5, QSY6, \
  QSY7, QSY8, PTX1, PTX2, PTX3, PTY1, PTY2, LSGKP, LSGAL
// clang-format on
#define COSTATE_TEXT_OF(...) #__VA_ARGS__
#define COSTATE_TEXT(...) COSTATE_TEXT_OF(__VA_ARGS__)

struct MagicFormula {
  enum Coefficient { COSTATE_MAGIC_FORMULA, count };
  /// The same names, separated by commas.
  static constexpr const char* names = COSTATE_TEXT(COSTATE_MAGIC_FORMULA);
  struct Entry {
    std::string name;
    double usual;  // where a file does not give it: 1 for scaling factors, 0 for most others
  };
  /// In the order of the numbers.
  static const std::vector<Entry>& coefficients();

  static constexpr int inputs = 5, most_states = 2;
  static constexpr bool slips = true, pulls_along = true, overturns = true, resists = true;
  static constexpr int most_numbers = 5 + count;
  bool lags = false, lags_along = false;  // lateral and longitudinal slip
  bool lags_by_load = false;              // over lengths from PTX1 to LSGAL, not over numbers of their own
  bool free_rolling = false;              // no longitudinal slip nor force, whatever the spin
  bool mirrored = false;                  // a left tyre on the right side or the other way round
  bool has_pressure = false;              // NOMPRES and INFLPRES are there
  bool camber_as_angle = false;           // 5.2: camber itself, not its sine, and its own terms

  int first() const { return 1 + numbers_a_lag() * states(); }
  int number_count() const { return first() + count; }
  int states() const { return (lags ? 1 : 0) + (lags_along ? 1 : 0); }
  int initial_state(int i) const { return numbers_a_lag() * (1 + i); }
  int trail() const { return -1; }

  template <class S, class P>
  S slip_tangent(const TyreInput<S>& in, const S* z, const P* p) const {
    return lags ? z[0] : TyreSlip::ratio(in.forward(), in.lateral(), p[0]);
  }
  template <class S, class P>
  S slip_angle(const TyreInput<S>& in, const S* z, const P* p) const {
    using std::atan;
    return atan(slip_tangent(in, z, p));
  }
  template <class S, class P>
  S longitudinal_slip(const TyreInput<S>& in, const S* z, const P* p) const {
    if (free_rolling) return S(0.0);
    return lags_along ? z[lags ? 1 : 0] : TyreSlip::ratio(in.forward(), in.rolling() - in.forward(), p[0]);
  }

  /// R_e = R - d_N DREFF atan(BREFF d / d_N) - FREFF d for a deflection d, d_N that of the nominal load,
  /// FNOMIN / stiffness, where the file has these, else R - d / 3.
  template <class S, class P>
  S effective_radius(const S& deflection, const P& radius, const P& stiffness, const P* p) const {
    using std::atan;
    const P* c = p + first();
    if (!(value_of(deflection) > 0)) return S(radius);
    if (!has_effective_radius) return S(radius) - deflection / S(3.0);
    const S d_N = S(c[FNOMIN]) / S(stiffness);
    return S(radius) - d_N * S(c[DREFF]) * atan(S(c[BREFF]) * deflection / d_N) - S(c[FREFF]) * deflection;
  }
  bool has_effective_radius = false;

  /// sigma_kappa = F (PTX1 + PTX2 df) exp(-PTX3 df) (R0 / FNOMIN) LSGKP, df = (F - F0) / F0,
  /// F0 = FNOMIN LFZO, in m. What lags is the slip itself, sigma kappa' = .., not the deflection
  /// u = sigma kappa of the manuals: the same under a constant load, and regular at lift-off, where u / sigma
  /// is not.
  template <class S, class P>
  S longitudinal_relaxation_length(const S& F, const P* p) const {
    using std::exp;
    const P* c = p + first();
    const S F0 = S(c[FNOMIN]) * S(c[LFZO]), df = (F - F0) / F0, R0(c[UNLOADED_RADIUS]);
    return at_least(S(kLeastLag) * R0,
                    F * (S(c[PTX1]) + S(c[PTX2]) * df) * exp(-S(c[PTX3]) * df) * R0 / S(c[FNOMIN]) * S(c[LSGKP]));
  }
  /// sigma_alpha = PTY1 sin(2 atan(F / (PTY2 F0))) (1 - PKY3 |camber|) R0 LFZO LSGAL, in m.
  template <class S, class P>
  S lateral_relaxation_length(const S& F, const S& camber, const P* p) const {
    using std::atan;
    using std::sin;
    const P* c = p + first();
    const S F0 = S(c[FNOMIN]) * S(c[LFZO]), R0(c[UNLOADED_RADIUS]);
    const S size = value_of(camber) < 0 ? -camber : camber;
    return at_least(S(kLeastLag) * R0, S(c[PTY1]) * sin(S(2.0) * atan(F / (S(c[PTY2]) * F0))) *
                                           (S(1.0) - S(c[PKY3]) * size) * R0 * S(c[LFZO]) * S(c[LSGAL]));
  }
  /// Both lengths fall to zero with the load; they are kept above this share of R0, and are exactly the above
  /// from twice this on.
  static constexpr double kLeastLag = 0.05;

  template <class S, class P>
  void operator()(const TyreInput<S>& in, const S* z, const P* p, TyreOutput<S>& out, S* zdot) const {
    using std::tanh;
    const S tangent = slip_tangent(in, z, p), kappa = longitudinal_slip(in, z, p);
    if (lags)
      zdot[0] = (in.lateral() - TyreSlip::speed(in.forward(), p[0]) * tangent) /
                (lags_by_load ? lateral_relaxation_length(in.normal(), in.camber(), p) : S(p[1]));
    if (lags_along && !free_rolling)
      zdot[lags ? 1 : 0] = (in.rolling() - in.forward() - TyreSlip::speed(in.forward(), p[0]) * kappa) /
                           (lags_by_load ? longitudinal_relaxation_length(in.normal(), p) : S(p[lags ? 3 : 1]));
    if (!(value_of(in.normal()) > 0)) return;
    const double w = value_of(p[0]);
    S direction(value_of(in.forward()) < 0 ? -1.0 : 1.0);
    if (w > 0) direction = tanh(in.forward() / S(p[0]));
    if (!mirrored) return steady(in.normal(), kappa, tangent, in.camber(), in.forward(), direction, p + first(), out);
    steady(in.normal(), kappa, -tangent, -in.camber(), in.forward(), direction, p + first(), out);
    for (S* y : {&out.lateral(), &out.overturning(), &out.aligning()}) *y = -*y;
  }

  // Without a slip speed moments turn with the sense of rolling, and slips that do not lag are cut at 0.1 m/s.
  bool may_jump(const double* p) const { return p[0] == 0; }
  void add_jump_places(const TyreInput<double>& in, const double* z, const double* p, bool pressed,
                       std::vector<JumpPlace>& places) const {
    const auto at = [&](double forward, double factor) {
      TyreInput<double> there = in;
      there.x[1] = forward;
      for (const int i : {1, 2, 4}) there.x[i] *= factor;
      TyreOutput<double> out;
      double zdot[most_states + 1];
      (*this)(there, z, p, out, zdot);
      return out;
    };
    const auto jump = [&](TyreOutput<double> a, TyreOutput<double> b) {
      double most = 0;
      for (int i = 0; i < TyreOutput<double>::count; ++i) most = std::max(most, std::abs(a.x[i] - b.x[i]));
      return pressed && most > 1e-9 * in.normal() ? most : 0.0;
    };
    constexpr double kHardly = 1e-6;  // m/s
    places.push_back({.beyond = in.forward(),
                      .jump = jump(at(kHardly, 1), at(-kHardly, 1)),
                      .what = "passes the forward speed 0, where with slip_speed_m_per_s = 0 its moments turn at once",
                      .advice = "Give a slip_speed_m_per_s (0.1)",
                      .unit = "N or N m"});
    const auto cut = [&](double sliding) {
      const double speed = std::hypot(in.forward(), sliding), to = TyreSlip::cut_speed / std::max(speed, 1e-4);
      places.push_back({.beyond = speed - TyreSlip::cut_speed,
                        .jump = jump(at(in.forward(), 1.001 * to), at(in.forward(), 0.999 * to)),
                        .what = "passes the speed of 0.1 m/s up to which slip_speed_m_per_s = 0 takes slip for none",
                        .advice = "Give a slip_speed_m_per_s (0.1), or relaxation lengths",
                        .unit = "N or N m"});
    };
    if (!lags) cut(in.lateral());
    if (!lags_along && !free_rolling) cut(in.rolling() - in.forward());
  }

  /// F_x, F_y, M_x, M_y, M_z for a load F > 0, slips kappa and tan alpha, and the camber. direction: 1
  /// forwards, -1 backwards. c: the coefficients.
  template <class S, class P>
  void steady(const S& F, const S& kappa, const S& tangent, const S& camber, const S& forward, const S& direction,
              const P* c, TyreOutput<S>& out) const {
    using std::atan;
    using std::cos;
    using std::exp;
    using std::sin;
    using std::sqrt;
    using std::tanh;
    const auto n = [&](Coefficient k) { return S(c[k]); };
    const S one(1.0), F0 = n(FNOMIN) * n(LFZO), R0 = n(UNLOADED_RADIUS), df = (F - F0) / F0;
    S dp(0.0), pressure(1.0);
    if (has_pressure) {
      pressure = n(INFLPRES) / n(NOMPRES);
      dp = pressure - one;
    }
    const S alpha = atan(tangent), g = camber_as_angle ? camber : S(sin(camber)), g2 = g * g;
    const S g_size = value_of(g) < 0 ? -g : g, cosine = one / sqrt(one + tangent * tangent);
    const auto linear = [&](Coefficient a, Coefficient b) { return n(a) + n(b) * df; };

    // Longitudinal, pure slip.
    const S mu_x =
        linear(PDX1, PDX2) * (one + dp * (n(PPX3) + n(PPX4) * dp)) * (one - n(PDX3) * camber * camber) * n(LMUX);
    const S C_x = n(PCX1) * n(LCX), D_x = mu_x * F, kx = kappa + linear(PHX1, PHX2) * n(LHX);
    const S K_x = F * linear(PKX1, PKX2) * exp(n(PKX3) * df) * (one + dp * (n(PPX1) + n(PPX2) * dp)) * n(LKX);
    const S E_x =
        limited((linear(PEX1, PEX2) + n(PEX3) * df * df) * (one - n(PEX4) * S(value_of(kx) > 0 ? 1.0 : -1.0)) * n(LEX));
    const auto of_offset = [&](const S& lambda) {
      return camber_as_angle ? lambda : S(10.0) * lambda / (one + S(9.0) * lambda);
    };
    const S along =
        D_x * sin(bent(K_x / (C_x * D_x), C_x, E_x, kx)) + F * linear(PVX1, PVX2) * n(LVX) * of_offset(n(LMUX));

    // Lateral, pure slip, with and without camber.
    const auto sign = [](const S& of) { return tanh(of / S(1e-3)); };
    const S mu_y0 = linear(PDY1, PDY2) * (one + dp * (n(PPY3) + n(PPY4) * dp)) * n(LMUY), C_y = n(PCY1) * n(LCY);
    const S H0 = linear(PHY1, PHY2) * n(LHY), V0 = F * linear(PVY1, PVY2) * n(LVY) * of_offset(n(LMUY)),
            E0 = linear(PEY1, PEY2) * n(LEY);
    const auto cornering = [&](const S& size, const S& square) {
      return n(PKY1) * F0 * (one + n(PPY1) * dp) * (one - n(PKY3) * size) * n(LKY) *
             sin(n(PKY4) * atan(F / F0 / ((n(PKY2) + n(PKY5) * square) * (one + n(PPY2) * dp))));
    };
    const auto side = [&](const S& K, const S& mu, const S& E, const S& H, const S& V) {
      const S D = mu * F;
      return D * sin(bent(K / (C_y * D), C_y, E, alpha + H)) + V;
    };
    const S K_y = cornering(g_size, g2), mu_y = mu_y0 * (one - n(PDY3) * g2);
    const S V_c = F * linear(PVY3, PVY4) * g * n(LKYC) * of_offset(n(LMUY));
    const S K_c = F * linear(PKY6, PKY7) * (one + n(PPY5) * dp) * n(LKYC);
    S H_c = n(PHY3) * g * n(LKYC);  // 5.2; 6.1 has the camber stiffness instead
    if (!camber_as_angle) H_c += (K_c * g - V_c) / K_y;
    const S E_y = limited(E0 * (one + n(PEY5) * g2 - (n(PEY3) + n(PEY4) * g) * sign(alpha + H0 + H_c)));
    const S across = side(K_y, mu_y, E_y, H0 + H_c, V0 + V_c);
    const S K_y0 = cornering(S(0.0), S(0.0)), E_y0 = limited(E0 * (one - n(PEY3) * sign(alpha + H0)));
    const S across0 = side(K_y0, mu_y0, E_y0, H0, V0);

    // Combined slip.
    const S slip = camber_as_angle ? alpha : tangent;
    const S E_xa = limited(linear(REX1, REX2)), B_xa = (n(RBX1) + n(RBX3) * g2) * cos(atan(n(RBX2) * kappa)) * n(LXAL);
    S& Fx = out.longitudinal();
    Fx = free_rolling ? S(0.0) : along * weight(B_xa, n(RCX1), E_xa, slip, n(RHX1));
    const S E_yk = limited(linear(REY1, REY2)), H_yk = linear(RHY1, RHY2);
    const S bend = cos(atan(n(RBY2) * (slip - n(RBY3)))) * n(LYKA);
    const S V_yk = mu_y * F * (linear(RVY1, RVY2) + n(RVY3) * g) * cos(atan(n(RVY4) * slip)) *
                   sin(n(RVY5) * atan(n(RVY6) * kappa)) * n(LVYKA);
    S& Fy = out.lateral();
    Fy = weight((n(RBY1) + n(RBY4) * g2) * bend, n(RCY1), E_yk, kappa, H_yk) * across + V_yk;
    const S of_trail = camber_as_angle ? Fy - V_yk : weight(n(RBY1) * bend, n(RCY1), E_yk, kappa, H_yk) * across0;

    // Aligning moment: the trail times the side force, the residual moment, and the longitudinal force's arm.
    const S share = K_x / K_y * kappa, share2 = share * share;
    // Only even functions take it.
    const auto with_share = [&](const S& a) {
      const S t = camber_as_angle ? S(sin(a) / cos(a)) : a, all = sqrt(t * t + share2 + S(1e-24));
      return camber_as_angle ? S(atan(all)) : all;
    };
    const S a_t = slip + linear(QHZ1, QHZ2) + linear(QHZ3, QHZ4) * g;
    const S a_r = slip + (camber_as_angle ? H0 + H_c + (V0 + V_c) / K_y : H0 + V0 / K_y0);
    const S B_t = (linear(QBZ1, QBZ2) + n(QBZ3) * df * df) * (one + n(QBZ4) * g + n(QBZ5) * g_size) * n(LKY) / n(LMUY);
    const S D_t = F * R0 / F0 * linear(QDZ1, QDZ2) * (one - n(PPZ1) * dp) * n(LTR) *
                  (one + n(QDZ3) * (camber_as_angle ? g : g_size) + n(QDZ4) * g2);
    const S E_t = limited((linear(QEZ1, QEZ2) + n(QEZ3) * df * df) *
                          (one + (n(QEZ4) + n(QEZ5) * g) * S(0.63661977236758134) * atan(B_t * n(QCZ1) * a_t)));
    const S trail = D_t * cos(bent(B_t, n(QCZ1), E_t, with_share(a_t))) * cosine;
    const S B_r = n(QBZ9) * n(LKY) / n(LMUY) + n(QBZ10) * (camber_as_angle ? K_y / (mu_y * F) : K_y0 / (mu_y0 * F));
    const S D_r = F * R0 * n(LMUY) * (camber_as_angle ? one : cosine) *
                  (linear(QDZ6, QDZ7) * n(LRES) +
                   (linear(QDZ8, QDZ9) * (one + n(PPZ2) * dp) + linear(QDZ10, QDZ11) * g_size) * g * n(LKZC));
    const S arm = R0 * (n(SSZ1) + n(SSZ2) * Fy / F0 + linear(SSZ3, SSZ4) * g) * n(LS);
    out.aligning() = direction * (D_r * cos(atan(B_r * with_share(a_r))) * cosine - trail * of_trail) + arm * Fx;

    // Overturning and rolling resistance, loads relative to FNOMIN itself.
    const S N = n(FNOMIN), load = F / N, angle = atan(n(QSX6) * load);
    const S always = n(QSX1) * n(LVMX) * (camber_as_angle ? one : n(LMX));
    out.overturning() = R0 * F *
                        (always + n(LMX) * (-n(QSX2) * camber * (one + n(PPMX1) * dp) + n(QSX3) * Fy / N +
                                            n(QSX4) * cos(n(QSX5) * angle * angle) *
                                                sin(n(QSX7) * camber + n(QSX8) * atan(n(QSX9) * Fy / N)) +
                                            n(QSX10) * atan(n(QSX11) * load) * camber));
    if (free_rolling) return;
    const S speed = forward / n(LONGVL), speed2 = speed * speed;
    const S resistance = n(QSY1) + n(QSY2) * Fx / N + n(QSY3) * (value_of(speed) < 0 ? -speed : speed) +
                         n(QSY4) * speed2 * speed2 + (n(QSY5) + n(QSY6) * load) * camber * camber;
    out.rolling() = -direction * F * R0 * resistance * n(LMY) * power(load, c[QSY7]) * power(pressure, c[QSY8]);
  }

 private:
  int numbers_a_lag() const { return lags_by_load ? 1 : 2; }
  /// x from 2 m on, m at x <= 0, between them m + x^2 / (4 m): with a continuous slope.
  template <class S>
  static S at_least(const S& m, const S& x) {
    if (!(value_of(x) > 0)) return m;
    return value_of(x) < 2 * value_of(m) ? m + x * x / (S(4.0) * m) : x;
  }
  template <class S>
  static S limited(const S& E) {
    return value_of(E) > 1 ? S(1.0) : E;
  }
  /// C atan(B x - E (B x - atan(B x))).
  template <class S>
  static S bent(const S& B, const S& C, const S& E, const S& x) {
    using std::atan;
    const S y = B * x;
    return C * atan(y - E * (y - atan(y)));
  }
  /// The weighting function of combined slip, cos(..(x + H)) / cos(..(H)).
  template <class S>
  static S weight(const S& B, const S& C, const S& E, const S& x, const S& H) {
    using std::cos;
    return cos(bent(B, C, E, x + H)) / cos(bent(B, C, E, H));
  }
  /// x^e for x > 0 and a number e.
  template <class S, class P>
  static S power(const S& x, const P& e) {
    using std::exp;
    using std::log;
    return exp(S(e) * log(x));
  }
};

#undef COSTATE_MAGIC_FORMULA
#undef COSTATE_TEXT
#undef COSTATE_TEXT_OF

}  // namespace costate
