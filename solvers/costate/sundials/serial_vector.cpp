#include "costate/sundials/serial_vector.h"

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <new>

namespace costate {

namespace {

// Every vector of a session is made here, so that all data are aligned like the allocator's memory.
using Map = Eigen::Map<Eigen::ArrayXd, Eigen::Aligned16>;

/// Head, content and data in one piece of memory; the data follow.
struct alignas(16) Head {
  _generic_N_Vector vector;
  _N_VectorContent_Serial content;
};
static_assert(sizeof(Head) <= kVectorHeadBytes && alignof(std::max_align_t) >= alignof(Head));

Map map(N_Vector v) { return {NV_DATA_S(v), NV_LENGTH_S(v)}; }

N_Vector allocate(sunindextype size, N_Vector_Ops operations, SUNContext context, bool with_data) {
  const std::size_t data = with_data ? static_cast<std::size_t>(size) * sizeof(double) : 0;
  void* memory = std::malloc(sizeof(Head) + data);
  if (!memory) return nullptr;
  Head* head = new (memory) Head{};
  head->content.length = size;
  head->content.own_data = SUNFALSE;  // freed with the head
  head->content.data = with_data ? reinterpret_cast<double*>(head + 1) : nullptr;
  head->vector.content = &head->content;
  head->vector.ops = operations;
  head->vector.sunctx = context;
  return &head->vector;
}

N_Vector clone(N_Vector v) { return allocate(NV_LENGTH_S(v), v->ops, v->sunctx, true); }
N_Vector clone_empty(N_Vector v) { return allocate(NV_LENGTH_S(v), v->ops, v->sunctx, false); }
void destroy(N_Vector v) { std::free(v); }  // the head is the first member of the allocation

void linear_sum(double a, N_Vector x, double b, N_Vector y, N_Vector z) { map(z) = a * map(x) + b * map(y); }
void scale(double c, N_Vector x, N_Vector z) { map(z) = c * map(x); }
void set(double c, N_Vector z) { map(z) = c; }
void absolute(N_Vector x, N_Vector z) { map(z) = map(x).abs(); }
void inverse(N_Vector x, N_Vector z) { map(z) = map(x).inverse(); }
void add_constant(N_Vector x, double b, N_Vector z) { map(z) = map(x) + b; }

double norm(double square, N_Vector x) { return std::sqrt(square / static_cast<double>(NV_LENGTH_S(x))); }
double wrms_norm(N_Vector x, N_Vector w) { return norm((map(x) * map(w)).square().sum(), x); }
double wrms_norm_mask(N_Vector x, N_Vector w, N_Vector id) {
  // id is positive where an entry counts.
  const double *a = NV_DATA_S(x), *b = NV_DATA_S(w), *mask = NV_DATA_S(id);
  double sum = 0;
  for (sunindextype i = 0; i < NV_LENGTH_S(x); ++i) {
    const double p = mask[i] > 0 ? a[i] * b[i] : 0;
    sum += p * p;
  }
  return norm(sum, x);
}

/// z = sum of c_k X_k; of these only X_0 may be z.
int linear_combination(int count, double* c, N_Vector* X, N_Vector z) {
  Map out = map(z);
  int k = 0;
  if (count >= 3) {
    out = c[0] * map(X[0]) + c[1] * map(X[1]) + c[2] * map(X[2]);
    k = 3;
  } else if (count == 2) {
    out = c[0] * map(X[0]) + c[1] * map(X[1]);
    k = 2;
  } else {
    out = c[0] * map(X[0]);
    k = 1;
  }
  for (; k + 1 < count; k += 2) out += c[k] * map(X[k]) + c[k + 1] * map(X[k + 1]);
  if (k < count) out += c[k] * map(X[k]);
  return 0;
}
int scale_add_multi(int count, double* a, N_Vector x, N_Vector* Y, N_Vector* Z) {
  for (int k = 0; k < count; ++k) map(Z[k]) = a[k] * map(x) + map(Y[k]);
  return 0;
}
int linear_sum_array(int count, double a, N_Vector* X, double b, N_Vector* Y, N_Vector* Z) {
  for (int k = 0; k < count; ++k) linear_sum(a, X[k], b, Y[k], Z[k]);
  return 0;
}
int scale_array(int count, double* c, N_Vector* X, N_Vector* Z) {
  for (int k = 0; k < count; ++k) scale(c[k], X[k], Z[k]);
  return 0;
}
int set_array(int count, double c, N_Vector* Z) {
  for (int k = 0; k < count; ++k) set(c, Z[k]);
  return 0;
}
int wrms_norm_array(int count, N_Vector* X, N_Vector* W, double* norms) {
  for (int k = 0; k < count; ++k) norms[k] = wrms_norm(X[k], W[k]);
  return 0;
}
int wrms_norm_mask_array(int count, N_Vector* X, N_Vector* W, N_Vector id, double* norms) {
  for (int k = 0; k < count; ++k) norms[k] = wrms_norm_mask(X[k], W[k], id);
  return 0;
}
int scale_add_multi_array(int count, int sums, double* a, N_Vector* X, N_Vector** Y, N_Vector** Z) {
  for (int j = 0; j < sums; ++j)
    for (int k = 0; k < count; ++k) map(Z[j][k]) = a[j] * map(X[k]) + map(Y[j][k]);
  return 0;
}
int linear_combination_array(int count, int sums, double* c, N_Vector** X, N_Vector* Z) {
  for (int k = 0; k < count; ++k) {
    scale(c[0], X[0][k], Z[k]);
    for (int j = 1; j < sums; ++j) map(Z[k]) += c[j] * map(X[j][k]);
  }
  return 0;
}

/// Those of a serial vector with the ones above in their place.
_generic_N_Vector_Ops make_operations(SUNContext context) {
  N_Vector serial = N_VNewEmpty_Serial(0, context);
  if (!serial) throw std::bad_alloc();
  _generic_N_Vector_Ops o = *serial->ops;
  N_VDestroy(serial);
  o.nvclone = clone;
  o.nvcloneempty = clone_empty;
  o.nvdestroy = destroy;
  o.nvlinearsum = linear_sum;
  o.nvscale = scale;
  o.nvconst = set;
  o.nvabs = absolute;
  o.nvinv = inverse;
  o.nvaddconst = add_constant;
  o.nvwrmsnorm = wrms_norm;
  o.nvwrmsnormmask = wrms_norm_mask;
  o.nvlinearcombination = linear_combination;
  o.nvscaleaddmulti = scale_add_multi;
  o.nvlinearsumvectorarray = linear_sum_array;
  o.nvscalevectorarray = scale_array;
  o.nvconstvectorarray = set_array;
  o.nvwrmsnormvectorarray = wrms_norm_array;
  o.nvwrmsnormmaskvectorarray = wrms_norm_mask_array;
  o.nvscaleaddmultivectorarray = scale_add_multi_array;
  o.nvlinearcombinationvectorarray = linear_combination_array;
  return o;
}

}  // namespace

N_Vector new_serial_vector(sunindextype size, SUNContext context) {
  static _generic_N_Vector_Ops operations = make_operations(context);
  N_Vector v = allocate(size, &operations, context, true);
  if (v) set(0, v);
  return v;
}

}  // namespace costate
