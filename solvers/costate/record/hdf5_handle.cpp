#include "costate/record/hdf5_handle.h"

#include <fmt/format.h>

#include <algorithm>

#include "costate/base/error.h"

namespace costate::record_detail {
namespace {

std::mutex& library_mutex() {
  static std::mutex mutex;
  return mutex;
}

herr_t keep_innermost(unsigned depth, const H5E_error2_t* error, void* data) {
  // H5E_WALK_UPWARD visits the innermost (most specific) entry first.
  if (depth == 0 && error->desc != nullptr) *static_cast<std::string*>(data) = error->desc;
  return 0;
}

}  // namespace

Hdf5Session::Hdf5Session() : lock_(library_mutex()) {
  H5Eget_auto2(H5E_DEFAULT, &old_function_, &old_data_);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

Hdf5Session::~Hdf5Session() { H5Eset_auto2(H5E_DEFAULT, old_function_, old_data_); }

std::string hdf5_reason() {
  std::string reason;
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, keep_innermost, &reason);
  std::replace(reason.begin(), reason.end(), '\n', ' ');
  return reason.empty() ? "no reason given by HDF5" : reason;
}

void throw_hdf5_error(const char* action) { throw Error(fmt::format("{}: {}", action, hdf5_reason())); }

}  // namespace costate::record_detail
