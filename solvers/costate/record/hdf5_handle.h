// Owning handles and error translation for the HDF5 C library. Internal: only .cpp files include it, so that the
// public headers do not need HDF5.
#pragma once

#include <hdf5.h>

#include <mutex>
#include <string>
#include <utility>

namespace costate::record_detail {

/// One use of the HDF5 library: holds a process-wide lock (the library is usually not built thread-safe)
/// and silences its automatic error printing; both end with the object.
class Hdf5Session {
 public:
  Hdf5Session();
  Hdf5Session(const Hdf5Session&) = delete;
  Hdf5Session& operator=(const Hdf5Session&) = delete;
  ~Hdf5Session();

 private:
  std::unique_lock<std::mutex> lock_;
  H5E_auto2_t old_function_ = nullptr;
  void* old_data_ = nullptr;
};

/// The innermost message of HDF5's error stack, e.g. "unable to open file ...".
[[nodiscard]] std::string hdf5_reason();

/// Throws Error("<action>: <reason of HDF5>") if `status` is negative; returns it otherwise.
template <class Status>
Status check_hdf5(Status status, const char* action);

/// Owns an HDF5 identifier of any kind (file, group, dataset, dataspace, type, attribute, property list).
class Hdf5Handle {
 public:
  Hdf5Handle() = default;
  /// Takes over `id`; throws Error naming `action` if it is negative (the HDF5 call failed).
  Hdf5Handle(hid_t id, herr_t (*closer)(hid_t), const char* action) : id_(check_hdf5(id, action)), closer_(closer) {}
  Hdf5Handle(Hdf5Handle&& other) noexcept
      : id_(std::exchange(other.id_, -1)), closer_(std::exchange(other.closer_, nullptr)) {}
  Hdf5Handle& operator=(Hdf5Handle&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(closer_, other.closer_);
    return *this;
  }
  Hdf5Handle(const Hdf5Handle&) = delete;
  Hdf5Handle& operator=(const Hdf5Handle&) = delete;
  ~Hdf5Handle() {
    if (id_ >= 0) closer_(id_);
  }

  [[nodiscard]] hid_t get() const { return id_; }

 private:
  hid_t id_ = -1;
  herr_t (*closer_)(hid_t) = nullptr;
};

[[noreturn]] void throw_hdf5_error(const char* action);

template <class Status>
Status check_hdf5(Status status, const char* action) {
  if (status < 0) throw_hdf5_error(action);
  return status;
}

}  // namespace costate::record_detail
