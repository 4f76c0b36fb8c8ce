# Finds the sparse LU factorization KLU of SuiteSparse and defines the imported target KLU::KLU.
find_path(KLU_INCLUDE_DIR klu.h PATH_SUFFIXES suitesparse)
find_library(KLU_LIBRARY klu)
find_library(KLU_AMD_LIBRARY amd)
find_library(KLU_COLAMD_LIBRARY colamd)
find_library(KLU_BTF_LIBRARY btf)
find_library(KLU_CONFIG_LIBRARY suitesparseconfig)

set(KLU_VERSION "")
if(KLU_INCLUDE_DIR)
  file(STRINGS "${KLU_INCLUDE_DIR}/klu.h" klu_lines REGEX "#define KLU_(MAIN|SUB|SUBSUB)_VERSION +[0-9]+")
  foreach(part MAIN SUB SUBSUB)
    if(klu_lines MATCHES "KLU_${part}_VERSION +([0-9]+)")
      list(APPEND KLU_VERSION ${CMAKE_MATCH_1})
    endif()
  endforeach()
  list(JOIN KLU_VERSION "." KLU_VERSION)
endif()

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(
  KLU
  REQUIRED_VARS KLU_LIBRARY KLU_AMD_LIBRARY KLU_COLAMD_LIBRARY KLU_BTF_LIBRARY KLU_CONFIG_LIBRARY
                KLU_INCLUDE_DIR
  VERSION_VAR KLU_VERSION)
mark_as_advanced(KLU_INCLUDE_DIR KLU_LIBRARY KLU_AMD_LIBRARY KLU_COLAMD_LIBRARY KLU_BTF_LIBRARY
                 KLU_CONFIG_LIBRARY)

if(KLU_FOUND AND NOT TARGET KLU::KLU)
  add_library(KLU::KLU UNKNOWN IMPORTED)
  set_target_properties(KLU::KLU PROPERTIES IMPORTED_LOCATION "${KLU_LIBRARY}"
                                            INTERFACE_INCLUDE_DIRECTORIES "${KLU_INCLUDE_DIR}")
  target_link_libraries(KLU::KLU INTERFACE "${KLU_AMD_LIBRARY}" "${KLU_COLAMD_LIBRARY}"
                                           "${KLU_BTF_LIBRARY}" "${KLU_CONFIG_LIBRARY}")
endif()
