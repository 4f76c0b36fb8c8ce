# Installation of the CMake package: find_package(costate) gives costate::lib and costate::solvers.
include(CMakePackageConfigHelpers)

set(COSTATE_INSTALL_CMAKEDIR "${CMAKE_INSTALL_LIBDIR}/cmake/costate")
set(COSTATE_INSTALL_MODELSDIR "${CMAKE_INSTALL_DATADIR}/costate/models")

configure_package_config_file(
  cmake/costateConfig.cmake.in "${PROJECT_BINARY_DIR}/costateConfig.cmake"
  INSTALL_DESTINATION "${COSTATE_INSTALL_CMAKEDIR}"
  PATH_VARS COSTATE_INSTALL_MODELSDIR)

# Until 1.0 the interface may change with the minor version.
write_basic_package_version_file("${PROJECT_BINARY_DIR}/costateConfigVersion.cmake"
                                 COMPATIBILITY SameMinorVersion)

install(FILES "${PROJECT_BINARY_DIR}/costateConfig.cmake"
              "${PROJECT_BINARY_DIR}/costateConfigVersion.cmake"
              cmake/FindHDF5Serial.cmake cmake/FindKLU.cmake cmake/FindSUNDIALS.cmake
              cmake/costateCandidate.cmake
        DESTINATION "${COSTATE_INSTALL_CMAKEDIR}")
install(EXPORT costateTargets NAMESPACE costate:: DESTINATION "${COSTATE_INSTALL_CMAKEDIR}")
install(FILES LICENSE README.md DESTINATION "${CMAKE_INSTALL_DOCDIR}" OPTIONAL)
