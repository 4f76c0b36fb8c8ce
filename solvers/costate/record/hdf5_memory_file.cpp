#include "costate/record/hdf5_memory_file.h"

#include <cstdlib>
#include <cstring>

#include "costate/base/error.h"

namespace costate::record_detail {
namespace {

// The memory functions of HDF5's in-memory files. H5Fget_file_image is of no use here: it changes a byte of
// the first block after its checksum is made, so that files of the 1.8 format come out unreadable. Instead,
// the buffer is kept when HDF5 frees it on closing; then all checksums and flags are final.
void* image_malloc(std::size_t size, H5FD_file_image_op_t, void*) { return std::malloc(size); }

void* image_memcpy(void* to, const void* from, std::size_t size, H5FD_file_image_op_t, void*) {
  return std::memcpy(to, from, size);
}

void* image_realloc(void* memory, std::size_t size, H5FD_file_image_op_t, void*) { return std::realloc(memory, size); }

herr_t image_free(void* memory, H5FD_file_image_op_t operation, void* kept) {
  if (operation == H5FD_FILE_IMAGE_OP_FILE_CLOSE) {
    *static_cast<void**>(kept) = memory;
  } else {
    std::free(memory);
  }
  return 0;
}

void* same_data(void* kept) { return kept; }

herr_t keep_data(void*) { return 0; }

}  // namespace

Hdf5MemoryFile::Hdf5MemoryFile(std::size_t increment_bytes) : memory_(std::make_unique<void*>(nullptr)) {
  const char* action = "creating a file in memory";
  const Hdf5Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, action);
  H5FD_file_image_callbacks_t callbacks = {image_malloc, image_memcpy, image_realloc, image_free,
                                           same_data,    keep_data,    memory_.get()};
  check_hdf5(H5Pset_fapl_core(access.get(), increment_bytes, false), action);
  check_hdf5(H5Pset_file_image_callbacks(access.get(), &callbacks), action);
  // The format of HDF5 1.8 (readable everywhere): its metadata carries checksums, so damage is noticed.
  check_hdf5(H5Pset_libver_bounds(access.get(), H5F_LIBVER_V18, H5F_LIBVER_V18), action);
  // The root group keeps no time stamps, so that the same content gives the same bytes.
  const Hdf5Handle creation(H5Pcreate(H5P_FILE_CREATE), H5Pclose, action);
  check_hdf5(H5Pset_obj_track_times(creation.get(), false), action);
  file_ = Hdf5Handle(H5Fcreate("costate-in-memory", H5F_ACC_TRUNC, creation.get(), access.get()), H5Fclose, action);
}

Hdf5MemoryFile::~Hdf5MemoryFile() {
  file_ = Hdf5Handle();  // moves by swapping: the file closes with the temporary, before its memory goes
  std::free(*memory_);
}

std::string_view Hdf5MemoryFile::finish() {
  check_hdf5(H5Fflush(file_.get(), H5F_SCOPE_GLOBAL), "completing the file");
  const ssize_t size = check_hdf5(H5Fget_file_image(file_.get(), nullptr, 0), "measuring the file");
  file_ = Hdf5Handle();
  if (*memory_ == nullptr) throw Error("completing the file: HDF5 did not close it");
  return {static_cast<const char*>(*memory_), static_cast<std::size_t>(size)};
}

}  // namespace costate::record_detail
