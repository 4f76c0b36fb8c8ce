# Installs the build tree into a staging prefix and builds and runs the project in test/package against it; then the same
# with the Debian package, unpacked into an empty root. Called by ctest; see test/CMakeLists.txt for the variables.
file(REMOVE_RECURSE "${WORK_DIR}")

function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE result)
  if(NOT result EQUAL 0)
    list(JOIN ARGV " " command)
    message(FATAL_ERROR "failed (${result}): ${command}")
  endif()
endfunction()

function(require_text file text)
  if(NOT EXISTS "${file}")
    message(FATAL_ERROR "not installed: ${file}")
  endif()
  file(READ "${file}" content)
  string(FIND "${content}" "${text}" at)
  if(at EQUAL -1)
    message(FATAL_ERROR "${file} has no '${text}'")
  endif()
endfunction()

# A launcher with settings of its own ("cmake -E env ... ccache") is a list; the last of it is the cache.
set(launcher "")
if(CXX_COMPILER_LAUNCHER)
  list(GET CXX_COMPILER_LAUNCHER -1 launcher)
endif()

# What a user does with an installation below `prefix`: find_package, the tool, its manual page and completions, a model.
function(try prefix name)
  file(GLOB pc "${prefix}/lib*/pkgconfig/costate.pc" "${prefix}/lib/*/pkgconfig/costate.pc")
  get_filename_component(pc_directory "${pc}" DIRECTORY)
  set(ENV{PKG_CONFIG_PATH} "${pc_directory}")
  run("${CMAKE_COMMAND}" -S "${SOURCE_DIR}" -B "${WORK_DIR}/build_${name}" -G "${GENERATOR}"
      "-DCMAKE_BUILD_TYPE=${CONFIG}" "-DCMAKE_PREFIX_PATH=${prefix}" "-DCMAKE_CXX_COMPILER=${CXX_COMPILER}"
      "-DCMAKE_CXX_COMPILER_LAUNCHER=${launcher}")
  run("${CMAKE_COMMAND}" --build "${WORK_DIR}/build_${name}" --config "${CONFIG}")
  run("${CMAKE_CTEST_COMMAND}" --test-dir "${WORK_DIR}/build_${name}" -C "${CONFIG}" --output-on-failure)
  if(TOOL)
    run("${prefix}/${TOOL}" --help)
    run("${prefix}/${TOOL}" gradient "${prefix}/share/costate/models/damped_pendulum/damped_pendulum.toml" --no-files)
    require_text("${prefix}/share/man/man1/costate.1" "costate optimize")
    require_text("${prefix}/share/doc/costate/apps/tutorial/own_force_and_cost.cpp" "MagnetLaw")
    if(PYTHON)
      run("${CMAKE_COMMAND}" -E env "PYTHONPATH=${prefix}/lib/python3/dist-packages" "${PYTHON}" -c
          "import costate; costate.Problem('${prefix}/share/costate/models/damped_pendulum/damped_pendulum.toml').gradient()")
    endif()
    require_text("${prefix}/share/bash-completion/completions/costate" "complete -o default -F _costate costate")
    require_text("${prefix}/share/zsh/vendor-completions/_costate" "#compdef costate")
  endif()
endfunction()

# The installed tree must work from wherever it is, hence from a place it was not installed to.
run("${CMAKE_COMMAND}" --install "${BINARY_DIR}" --config "${CONFIG}" --prefix "${WORK_DIR}/prefix")
file(RENAME "${WORK_DIR}/prefix" "${WORK_DIR}/moved")
try("${WORK_DIR}/moved" moved)

find_program(DPKG_DEB dpkg-deb)
if(DPKG_DEB)
  run("${CMAKE_CPACK_COMMAND}" --config "${BINARY_DIR}/CPackConfig.cmake" -C "${CONFIG}" -B "${WORK_DIR}/deb")
  file(GLOB package "${WORK_DIR}/deb/*.deb")
  run("${DPKG_DEB}" --info "${package}")
  run("${DPKG_DEB}" --extract "${package}" "${WORK_DIR}/root")
  try("${WORK_DIR}/root/usr" deb)
endif()
