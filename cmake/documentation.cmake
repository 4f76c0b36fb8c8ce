# Target 'doc': reference of the C++ interface in <build>/doc/html.
find_package(Doxygen)
if(DOXYGEN_FOUND)
  configure_file(cmake/Doxyfile.in "${PROJECT_BINARY_DIR}/Doxyfile" @ONLY)
  add_custom_target(
    doc
    COMMAND ${CMAKE_COMMAND} -E make_directory "${PROJECT_BINARY_DIR}/doc"
    COMMAND Doxygen::doxygen "${PROJECT_BINARY_DIR}/Doxyfile"
    COMMENT "Generating the reference documentation"
    VERBATIM)
else()
  message(STATUS "doxygen not found: there is no target 'doc'")
endif()
