// Owning handles for SUNDIALS objects. The context must outlive every other handle, so each session holds its
// context as its first member.
#pragma once

#include <new>
#include <utility>
#include <vector>

#include "costate/base/error.h"
#include "costate/sundials/compatibility.h"
#include "costate/sundials/serial_vector.h"

namespace costate {

class Context {
 public:
  Context() {
    if (create_context(&context_) != 0) throw Error("SUNDIALS could not create a context.");
  }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;
  ~Context() { SUNContext_Free(&context_); }
  operator SUNContext() const { return context_; }  // NOLINT: a handle

 private:
  SUNContext context_ = nullptr;
};

/// A serial N_Vector, zero at first.
class Vector {
 public:
  Vector() = default;
  Vector(int size, SUNContext context) : v_(new_serial_vector(size, context)) {
    if (!v_) throw std::bad_alloc();
  }
  Vector(Vector&& o) noexcept : v_(std::exchange(o.v_, nullptr)) {}
  Vector& operator=(Vector&& o) noexcept {
    std::swap(v_, o.v_);
    return *this;
  }
  ~Vector() {
    if (v_) N_VDestroy(v_);
  }
  operator N_Vector() const { return v_; }  // NOLINT: a handle
  double* data() const { return NV_DATA_S(v_); }
  int size() const { return v_ ? static_cast<int>(N_VGetLength(v_)) : 0; }

 private:
  N_Vector v_ = nullptr;
};

/// An array of vectors as SUNDIALS' sensitivity calls want it.
class VectorArray {
 public:
  VectorArray() = default;
  VectorArray(int count, int size, SUNContext context) {
    for (int i = 0; i < count; ++i) {
      vectors_.emplace_back(size, context);
      handles_.push_back(vectors_.back());
    }
  }
  N_Vector* handles() { return handles_.data(); }
  double* data(int i) const { return vectors_[i].data(); }
  int count() const { return static_cast<int>(vectors_.size()); }

 private:
  std::vector<Vector> vectors_;
  std::vector<N_Vector> handles_;
};

inline double* data(N_Vector v) { return NV_DATA_S(v); }

}  // namespace costate
