# Finds the serial parts of SUNDIALS that Costate uses and defines SUNDIALS::<component> for each of them.
#
# Used instead of the package configuration that SUNDIALS installs, which demands everything SUNDIALS was
# built with (in distribution packages MPI, PETSc, hypre and OpenMP) even of a project that only links the
# serial libraries. The target names are the same, and the two can be used side by side.
# The dense matrix and its solver are for a benchmark that is written on SUNDIALS alone.
set(SUNDIALS_components generic idas cvodes nvecserial sunmatrixdense sunlinsoldense)

find_path(SUNDIALS_INCLUDE_DIR sundials/sundials_config.h)
mark_as_advanced(SUNDIALS_INCLUDE_DIR)

set(SUNDIALS_VERSION "")
if(SUNDIALS_INCLUDE_DIR)
  file(STRINGS "${SUNDIALS_INCLUDE_DIR}/sundials/sundials_config.h" sundials_line
       REGEX "#define SUNDIALS_VERSION \"")
  if(sundials_line MATCHES "\"([0-9.]+)")
    set(SUNDIALS_VERSION "${CMAKE_MATCH_1}")
  endif()
endif()

set(SUNDIALS_required SUNDIALS_INCLUDE_DIR)
foreach(component IN LISTS SUNDIALS_components)
  find_library(SUNDIALS_${component}_LIBRARY sundials_${component})
  mark_as_advanced(SUNDIALS_${component}_LIBRARY)
  list(APPEND SUNDIALS_required SUNDIALS_${component}_LIBRARY)
endforeach()

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(
  SUNDIALS
  REQUIRED_VARS ${SUNDIALS_required}
  VERSION_VAR SUNDIALS_VERSION
  HANDLE_VERSION_RANGE)

if(SUNDIALS_FOUND)
  foreach(component IN LISTS SUNDIALS_components)
    if(NOT TARGET SUNDIALS::${component})
      add_library(SUNDIALS::${component} UNKNOWN IMPORTED)
      set_target_properties(
        SUNDIALS::${component} PROPERTIES IMPORTED_LOCATION "${SUNDIALS_${component}_LIBRARY}"
                                          INTERFACE_INCLUDE_DIRECTORIES "${SUNDIALS_INCLUDE_DIR}")
    endif()
  endforeach()
endif()
