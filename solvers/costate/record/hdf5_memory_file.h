// An HDF5 file that is put together in memory and handed out as bytes. HDF5 1.10 can crash, or hang at exit,
// when a disk is full in the middle of a write; so HDF5 never writes to disk in record/: the finished bytes
// go out through write_file_atomically. Internal: only .cpp files include it.
#pragma once

#include <cstddef>
#include <memory>
#include <string_view>

#include "costate/record/hdf5_handle.h"

namespace costate::record_detail {

class Hdf5MemoryFile {
 public:
  /// An empty file that grows by `increment_bytes` at a time. Throws Error. Needs an Hdf5Session around it.
  explicit Hdf5MemoryFile(std::size_t increment_bytes);
  Hdf5MemoryFile(const Hdf5MemoryFile&) = delete;
  Hdf5MemoryFile& operator=(const Hdf5MemoryFile&) = delete;
  ~Hdf5MemoryFile();

  [[nodiscard]] hid_t get() const { return file_.get(); }

  /// Closes the HDF5 file and returns its bytes, valid as long as this object. All other handles into the
  /// file must be closed before. Throws Error.
  [[nodiscard]] std::string_view finish();

 private:
  std::unique_ptr<void*> memory_;  // where HDF5 leaves its buffer when the file is closed; malloc'ed
  Hdf5Handle file_;
};

}  // namespace costate::record_detail
