/* The car axis of the IVP test set: positions (x_l, y_l, x_r, y_r), their rates and two multipliers, which here have
   the opposite sign (M a = f - G^T lambda). Numbers: models/car_axis/README.md. */
#define COORDINATES 4
#define CONSTRAINTS 2
#define ACCELERATIONS 0
#include "forms.h"

static const double mass = 10 * 0.01 * 0.01 / 2; /* M eps^2 / 2 */
static const double axle = 1, natural_length = 0.5, gravity = 1, bump = 0.1, frequency = 10;

/* The right wheel: position, rate and acceleration of x, then of y. y = bump sin(frequency t), x^2 + y^2 = axle^2. */
static void wheel(double t, double* x, double* y) {
  const double s = sin(frequency * t), c = cos(frequency * t);
  y[0] = bump * s;
  y[1] = bump * frequency * c;
  y[2] = -bump * frequency * frequency * s;
  x[0] = sqrt(axle * axle - y[0] * y[0]);
  x[1] = -y[0] * y[1] / x[0];
  x[2] = -(y[1] * y[1] + y[0] * y[2] + x[1] * x[1]) / x[0];
}

static void masses(const double* q, double M[4][4]) {
  memset(M, 0, 16 * sizeof(double));
  for (int i = 0; i < 4; ++i) M[i][i] = mass;
}

static void forces(double t, const double* q, const double* v, double* f) {
  double x[3], y[3];
  wheel(t, x, y);
  const double dx = q[2] - x[0], dy = q[3] - y[0];
  const double left = natural_length / sqrt(q[0] * q[0] + q[1] * q[1]) - 1;
  const double right = natural_length / sqrt(dx * dx + dy * dy) - 1;
  f[0] = left * q[0];
  f[1] = left * q[1] - mass * gravity;
  f[2] = right * dx;
  f[3] = right * dy - mass * gravity;
}

static void constraint(double t, const double* q, double* g) {
  double x[3], y[3];
  wheel(t, x, y);
  g[0] = q[0] * x[0] + q[1] * y[0];
  g[1] = (q[0] - q[2]) * (q[0] - q[2]) + (q[1] - q[3]) * (q[1] - q[3]) - axle * axle;
}

static void rows(double t, const double* q, double G[2][4]) {
  double x[3], y[3];
  wheel(t, x, y);
  G[0][0] = x[0];
  G[0][1] = y[0];
  G[0][2] = G[0][3] = 0;
  G[1][0] = 2 * (q[0] - q[2]);
  G[1][1] = 2 * (q[1] - q[3]);
  G[1][2] = -G[1][0];
  G[1][3] = -G[1][1];
}

static void drift(double t, const double* q, double* g_t) {
  double x[3], y[3];
  wheel(t, x, y);
  g_t[0] = q[0] * x[1] + q[1] * y[1];
  g_t[1] = 0;
}

static void curvature(double t, const double* q, const double* v, double* c) {
  double x[3], y[3];
  wheel(t, x, y);
  c[0] = 2 * (v[0] * x[1] + v[1] * y[1]) + q[0] * x[2] + q[1] * y[2];
  c[1] = 2 * ((v[0] - v[2]) * (v[0] - v[2]) + (v[1] - v[3]) * (v[1] - v[3]));
}

static void first_guess(double* q, double* v) {
  const double positions[4] = {0, 0.5, axle, 0.5}, rates[4] = {-0.5, 0, -0.5, 0};
  memcpy(q, positions, sizeof positions);
  memcpy(v, rates, sizeof rates);
}

/* It is consistent as it stands; no coordinate has to move. */
void start(double* y, double* off) { consistent_start(y, 4, off); }
