# Installation of the CMake package: find_package(costate) gives costate::lib and costate::solvers.
include(CMakePackageConfigHelpers)

set(COSTATE_INSTALL_CMAKEDIR "${CMAKE_INSTALL_LIBDIR}/cmake/costate")
set(COSTATE_INSTALL_MODELSDIR "${CMAKE_INSTALL_DATADIR}/costate/models")

configure_package_config_file(
  cmake/costateConfig.cmake.in "${PROJECT_BINARY_DIR}/costateConfig.cmake"
  INSTALL_DESTINATION "${COSTATE_INSTALL_CMAKEDIR}"
  PATH_VARS COSTATE_INSTALL_MODELSDIR)

configure_file(cmake/costateConfigVersion.cmake.in "${PROJECT_BINARY_DIR}/costateConfigVersion.cmake" @ONLY)

# The same for what is built without CMake: pkg-config --cflags --libs costate.
file(RELATIVE_PATH costate_pc_prefix "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")
set(costate_pc_cflags "")
foreach(directory "${HDF5Serial_INCLUDE_DIR}" "${SUNDIALS_INCLUDE_DIR}")
  if(NOT directory IN_LIST CMAKE_CXX_IMPLICIT_INCLUDE_DIRECTORIES)
    string(APPEND costate_pc_cflags " -isystem ${directory}")
  endif()
endforeach()
if(COSTATE_NATIVE)
  string(APPEND costate_pc_cflags " -march=native")
endif()
string(JOIN " " costate_pc_libs "${SUNDIALS_idas_LIBRARY}" "${SUNDIALS_cvodes_LIBRARY}"
       "${SUNDIALS_nvecserial_LIBRARY}" "${SUNDIALS_generic_LIBRARY}" "${HDF5Serial_LIBRARY}")
configure_file(cmake/costate.pc.in "${PROJECT_BINARY_DIR}/costate.pc" @ONLY)
install(FILES "${PROJECT_BINARY_DIR}/costate.pc" DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig")

install(FILES "${PROJECT_BINARY_DIR}/costateConfig.cmake"
              "${PROJECT_BINARY_DIR}/costateConfigVersion.cmake"
              cmake/FindHDF5Serial.cmake cmake/FindKLU.cmake cmake/FindSUNDIALS.cmake
              cmake/costateCandidate.cmake
        DESTINATION "${COSTATE_INSTALL_CMAKEDIR}")
install(EXPORT costateTargets NAMESPACE costate:: DESTINATION "${COSTATE_INSTALL_CMAKEDIR}")

# A Debian package: cmake --build BUILD --target package.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME costate)
set(CPACK_PACKAGE_VENDOR "Costate")
set(CPACK_PACKAGE_CONTACT "the Costate developers <costate@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_RESOURCE_FILE_LICENSE "${PROJECT_SOURCE_DIR}/LICENSE")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS "${PROJECT_BINARY_DIR}/lib" "${PROJECT_BINARY_DIR}/solvers")
# What programs on the library are compiled with; the tool runs without.
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS
    "cmake, g++, libeigen3-dev, libfmt-dev, libhdf5-dev, libnlopt-cxx-dev, libsuitesparse-dev, libsundials-dev, python3-numpy")
if(PROJECT_IS_TOP_LEVEL)
  include(CPack)
endif()

install(FILES LICENSE README.md DESTINATION "${CMAKE_INSTALL_DOCDIR}" OPTIONAL)
foreach(page apps lib solvers test) # messages point at headings of these
  install(FILES ${page}/README.md DESTINATION "${CMAKE_INSTALL_DOCDIR}/${page}" OPTIONAL)
endforeach()
install(DIRECTORY apps/tutorial DESTINATION "${CMAKE_INSTALL_DOCDIR}/apps" OPTIONAL) # which apps/README.md names
