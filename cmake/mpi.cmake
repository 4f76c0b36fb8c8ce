# MPI for 'mpirun -n N costate study', where it is found (libopenmpi-dev). COSTATE_MPI: AUTO, ON (an error where it is
# missing) or OFF.
set(COSTATE_MPI AUTO CACHE STRING "Build what ranks of MPI need: AUTO (where it is found), ON, OFF")
set_property(CACHE COSTATE_MPI PROPERTY STRINGS AUTO ON OFF)
set(COSTATE_MPI_FOUND OFF)
if(COSTATE_MPI AND NOT COSTATE_SANITIZE) # what MPI leaves allocated is not ours to report
  set(MPI_CXX_SKIP_MPICXX ON)
  find_package(MPI COMPONENTS CXX QUIET)
  set(COSTATE_MPI_FOUND ${MPI_CXX_FOUND})
endif()
if(COSTATE_MPI_FOUND)
  message(STATUS "MPI: ${MPI_CXX_LIBRARIES}")
elseif(COSTATE_MPI STREQUAL "ON")
  message(FATAL_ERROR "COSTATE_MPI is ON, and no MPI is found (libopenmpi-dev).")
else()
  message(STATUS "MPI: 'costate study' is built without it; libopenmpi-dev is missing or COSTATE_MPI is OFF")
endif()
