// Where Costate's own libraries are: what is loaded at run time stands beside them.
#pragma once

#include <dlfcn.h>

#include <filesystem>

#include "costate/base/error.h"

namespace costate::app {

/// The file of the library that a function is in.
template <class Function>
std::filesystem::path library_of(Function* f) {
  Dl_info info{};
  if (dladdr(reinterpret_cast<void*>(f), &info) == 0 || !info.dli_fname)
    throw Error("The files of Costate's own libraries cannot be found.");
  return info.dli_fname;
}

}  // namespace costate::app
