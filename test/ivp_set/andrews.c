/* Andrews' squeezing mechanism in the seven angles of the IVP test set, with accelerations as unknowns (27 in all).
   Lengths and masses: models/andrews/README.md. */
#define COORDINATES 7
#define CONSTRAINTS 6
#define ACCELERATIONS 1
#include "forms.h"

enum { kBeta, kTheta, kGamma, kPhi, kDelta, kOmega, kEpsilon };

static const double m1 = 0.04325, m2 = 0.00365, m3 = 0.02373, m4 = 0.00706, m5 = 0.0705, m6 = 0.00706, m7 = 0.05498;
static const double I1 = 2.194e-6, I2 = 4.41e-7, I3 = 5.255e-6, I4 = 5.667e-7, I5 = 1.169e-5, I6 = 5.667e-7,
                    I7 = 1.912e-5;
static const double xA = -0.06934, yA = -0.00227, xB = -0.03635, yB = 0.03273, xC = 0.014, yC = 0.072;
static const double stiffness = 4530, natural_length = 0.07785, torque = 0.033;
/* Crank: O-F, O-centre. Rod: F-E, F-centre. */
static const double crank = 0.007, crank_c = 0.00092, rod = 0.028, rod_c = 0.0115;
/* Triangle from B: E at (0, -edge), D at (xD, -yD), centre at (sx, -sy). */
static const double edge = 0.035, xD = 0.02, yD = 0.018, sx = 0.01043, sy = 0.01874;
/* Links E-G and E-H, each from its arm's end to its centre and to E; arms A-G and A-H and their centres. */
static const double link4 = 0.02, link4_c = 0.00579, link6 = 0.02, link6_c = 0.00579;
static const double arm5 = 0.04, arm5_x = 0.02308, arm5_y = 0.00916, arm7 = 0.04, arm7_x = 0.00449, arm7_y = 0.01228;

/* Kinetic energy: the centres' velocities squared, angles relative to the body before. */
static void masses(const double* q, double M[7][7]) {
  const double c2 = cos(q[kTheta]), s4 = sin(q[kPhi]), s6 = sin(q[kOmega]);
  memset(M, 0, 49 * sizeof(double));
  M[0][0] = m1 * crank_c * crank_c + m2 * (crank * crank - 2 * rod_c * crank * c2 + rod_c * rod_c) + I1 + I2;
  M[0][1] = M[1][0] = m2 * (rod_c * rod_c - rod_c * crank * c2) + I2;
  M[1][1] = m2 * rod_c * rod_c + I2;
  M[2][2] = m3 * (sx * sx + sy * sy) + I3;
  M[3][3] = m4 * link4_c * link4_c + I4;
  M[3][4] = M[4][3] = m4 * (link4_c * link4_c + arm5 * link4_c * s4) + I4;
  M[4][4] = m4 * (arm5 * arm5 + 2 * arm5 * link4_c * s4 + link4_c * link4_c) +
            m5 * (arm5_x * arm5_x + arm5_y * arm5_y) + I4 + I5;
  M[5][5] = m6 * link6_c * link6_c + I6;
  M[5][6] = M[6][5] = m6 * (link6_c * link6_c - arm7 * link6_c * s6) + I6;
  M[6][6] = m6 * (link6_c * link6_c - 2 * arm7 * link6_c * s6 + arm7 * arm7) +
            m7 * (arm7_x * arm7_x + arm7_y * arm7_y) + I6 + I7;
}

static void forces(double t, const double* q, const double* v, double* f) {
  const double s2 = sin(q[kTheta]), s3 = sin(q[kGamma]), c3 = cos(q[kGamma]);
  const double dx = xB + xD * c3 + yD * s3 - xC, dy = yB + xD * s3 - yD * c3 - yC;
  const double length = sqrt(dx * dx + dy * dy);
  const double pull = -stiffness * (length - natural_length) / length;
  f[0] = torque - m2 * rod_c * crank * v[kTheta] * (v[kTheta] + 2 * v[kBeta]) * s2;
  f[1] = m2 * rod_c * crank * v[kBeta] * v[kBeta] * s2;
  f[2] = pull * (dx * (yD * c3 - xD * s3) + dy * (xD * c3 + yD * s3));
  f[3] = m4 * arm5 * link4_c * v[kDelta] * v[kDelta] * cos(q[kPhi]);
  f[4] = -m4 * arm5 * link4_c * v[kPhi] * (v[kPhi] + 2 * v[kDelta]) * cos(q[kPhi]);
  f[5] = -m6 * arm7 * link6_c * v[kEpsilon] * v[kEpsilon] * cos(q[kOmega]);
  f[6] = m6 * arm7 * link6_c * v[kOmega] * (v[kOmega] + 2 * v[kEpsilon]) * cos(q[kOmega]);
}

/* E by the rod less E by the triangle, by the link on G and by the link on H. */
static void constraint(double t, const double* q, double* g) {
  const double b = q[kBeta], bt = b + q[kTheta], pd = q[kPhi] + q[kDelta], oe = q[kOmega] + q[kEpsilon];
  const double x = crank * cos(b) - rod * cos(bt), y = crank * sin(b) - rod * sin(bt);
  g[0] = x - edge * sin(q[kGamma]) - xB;
  g[1] = y + edge * cos(q[kGamma]) - yB;
  g[2] = x - link4 * sin(pd) - arm5 * cos(q[kDelta]) - xA;
  g[3] = y + link4 * cos(pd) - arm5 * sin(q[kDelta]) - yA;
  g[4] = x - link6 * cos(oe) - arm7 * sin(q[kEpsilon]) - xA;
  g[5] = y - link6 * sin(oe) + arm7 * cos(q[kEpsilon]) - yA;
}

static void rows(double t, const double* q, double G[6][7]) {
  const double b = q[kBeta], bt = b + q[kTheta], pd = q[kPhi] + q[kDelta], oe = q[kOmega] + q[kEpsilon];
  const double xt = rod * sin(bt), yt = -rod * cos(bt), xb = xt - crank * sin(b), yb = yt + crank * cos(b);
  memset(G, 0, 42 * sizeof(double));
  for (int i = 0; i < 6; i += 2) {
    G[i][kBeta] = xb;
    G[i][kTheta] = xt;
    G[i + 1][kBeta] = yb;
    G[i + 1][kTheta] = yt;
  }
  G[0][kGamma] = -edge * cos(q[kGamma]);
  G[1][kGamma] = -edge * sin(q[kGamma]);
  G[2][kPhi] = -link4 * cos(pd);
  G[2][kDelta] = G[2][kPhi] + arm5 * sin(q[kDelta]);
  G[3][kPhi] = -link4 * sin(pd);
  G[3][kDelta] = G[3][kPhi] - arm5 * cos(q[kDelta]);
  G[4][kOmega] = link6 * sin(oe);
  G[4][kEpsilon] = G[4][kOmega] - arm7 * cos(q[kEpsilon]);
  G[5][kOmega] = -link6 * cos(oe);
  G[5][kEpsilon] = G[5][kOmega] - arm7 * sin(q[kEpsilon]);
}

static void drift(double t, const double* q, double* g_t) { memset(g_t, 0, 6 * sizeof *g_t); }

static void curvature(double t, const double* q, const double* v, double* c) {
  const double b = q[kBeta], bt = b + q[kTheta], pd = q[kPhi] + q[kDelta], oe = q[kOmega] + q[kEpsilon];
  const double b2 = v[kBeta] * v[kBeta], bt2 = (v[kBeta] + v[kTheta]) * (v[kBeta] + v[kTheta]);
  const double pd2 = (v[kPhi] + v[kDelta]) * (v[kPhi] + v[kDelta]), d2 = v[kDelta] * v[kDelta];
  const double oe2 = (v[kOmega] + v[kEpsilon]) * (v[kOmega] + v[kEpsilon]), e2 = v[kEpsilon] * v[kEpsilon];
  const double x = -crank * cos(b) * b2 + rod * cos(bt) * bt2, y = -crank * sin(b) * b2 + rod * sin(bt) * bt2;
  const double g2 = v[kGamma] * v[kGamma];
  c[0] = x + edge * sin(q[kGamma]) * g2;
  c[1] = y - edge * cos(q[kGamma]) * g2;
  c[2] = x + link4 * sin(pd) * pd2 + arm5 * cos(q[kDelta]) * d2;
  c[3] = y - link4 * cos(pd) * pd2 + arm5 * sin(q[kDelta]) * d2;
  c[4] = x + link6 * cos(oe) * oe2 + arm7 * sin(q[kEpsilon]) * e2;
  c[5] = y + link6 * sin(oe) * oe2 - arm7 * cos(q[kEpsilon]) * e2;
}

static void first_guess(double* q, double* v) {
  const double guess[7] = {-0.06171389001427645, 0, 0.455279819, 0.222668390, 0.487364980, -0.222668390, 1.230547445};
  memcpy(q, guess, sizeof guess);
  memset(v, 0, 7 * sizeof *v);
}

void start(double* y, double* off) { consistent_start(y, kTheta, off); }

/* The Jacobian without the derivatives of M, f, G and the curvature, by columns: Hairer and Wanner's way with this
   problem. It serves at index 2 and 3; at index 1 RADAU5's steps become short with it at tight tolerances. */
static void simplified(int index, const double* y, double* J, int stride) {
  double M[7][7], G[6][7];
  masses(y, M);
  rows(0, y, G);
  for (int i = 0; i < 27; ++i) memset(J + i * stride, 0, 27 * sizeof *J);
  for (int i = 0; i < 14; ++i) J[i + (i + 7) * stride] = 1;
  const int constrained = index == 3 ? 0 : index == 2 ? 7 : 14;
  for (int j = 0; j < 7; ++j) {
    for (int i = 0; i < 7; ++i) J[14 + i + (14 + j) * stride] = -M[i][j];
    for (int i = 0; i < 6; ++i) {
      J[14 + j + (21 + i) * stride] = -G[i][j];
      J[21 + i + (constrained + j) * stride] = G[i][j];
    }
  }
}

#define SIMPLIFIED(name, index)                                                                                     \
  void name(int* n, double* t, double* y, int* below, int* above, double* J, int* stride, double* extra, int* ip) { \
    simplified(index, y, J, *stride);                                                                               \
  }
SIMPLIFIED(jacobian1, 1)
SIMPLIFIED(jacobian2, 2)
SIMPLIFIED(jacobian3, 3)
