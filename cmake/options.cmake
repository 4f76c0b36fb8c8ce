# Settings shared by all targets of the project.

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

if(PROJECT_IS_TOP_LEVEL)
  set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/bin")
  set(CMAKE_LIBRARY_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/lib")
endif()

# The installed tool and libraries find each other relative to their own place, so that the installation
# can be moved as a whole.
file(RELATIVE_PATH COSTATE_BIN_TO_LIB "${CMAKE_INSTALL_FULL_BINDIR}" "${CMAKE_INSTALL_FULL_LIBDIR}")
set(CMAKE_INSTALL_RPATH "$ORIGIN" "$ORIGIN/${COSTATE_BIN_TO_LIB}")

# ccache, if there is one and it works: it does not where its cache directory cannot be written.
find_program(COSTATE_CCACHE ccache)
mark_as_advanced(COSTATE_CCACHE)
if(COSTATE_CCACHE AND NOT DEFINED CMAKE_CXX_COMPILER_LAUNCHER)
  file(WRITE "${PROJECT_BINARY_DIR}/CMakeFiles/ccache_probe.cpp" "")
  execute_process(
    COMMAND "${COSTATE_CCACHE}" "${CMAKE_CXX_COMPILER}" -c ccache_probe.cpp -o ccache_probe.o
    WORKING_DIRECTORY "${PROJECT_BINARY_DIR}/CMakeFiles"
    RESULT_VARIABLE ccache_result
    OUTPUT_QUIET ERROR_QUIET)
  if(ccache_result EQUAL 0)
    # It passes over files with precompiled headers unless told that they are safe to compare.
    set(CMAKE_CXX_COMPILER_LAUNCHER "${CMAKE_COMMAND}" -E env
                                    CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime
                                    "${COSTATE_CCACHE}")
  endif()
endif()

if(COSTATE_SANITIZE)
  add_compile_options(-fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer)
  add_link_options(-fsanitize=address,undefined)
  # Under the address sanitizer Eigen aligns what malloc gives by hand. Libraries that are built without (KDL's, in the
  # tests) export the same functions for what malloc gives as it is, and either side would free the other's.
  add_compile_definitions(_GLIBCXX_ASSERTIONS EIGEN_MALLOC_ALREADY_ALIGNED=1)
endif()
