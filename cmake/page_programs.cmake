# Programs of others that pages carry inside, so that they need no network: three.js, which motions in 3-D are drawn with
# (libjs-three), and Chart.js, which plots are read off and zoomed with (libjs-chart.js). Where they are found their text
# is put into the tool, and by the tool into such pages. Without them pages show what is there without scripts.

# costate_page_program(NAME FUNCTION HEADER DIRECTORY FILES...): the files of a directory, below the license in
# cmake/NAME.license, are what costate::app::FUNCTION() of a header gives. Without a directory that is empty.
# COSTATE_PAGE_PROGRAMS lists the sources, COSTATE_NAME_FOUND tells.
function(costate_page_program name function header directory)
  string(TOUPPER ${name} upper)
  set(PROGRAM_TEXT "")
  set(found OFF)
  list(GET ARGN 0 first)
  if(directory AND EXISTS "${directory}/${first}")
    set(found ON)
    file(READ "${PROJECT_SOURCE_DIR}/cmake/${name}.license" PROGRAM_TEXT)
    foreach(file IN LISTS ARGN)
      set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${directory}/${file}")
      file(READ "${directory}/${file}" text)
      foreach(end "</script" "<!--" "]]>" ")program\"") # of what it will stand in: HTML, XML, a string of C++
        string(FIND "${text}" "${end}" at)
        if(NOT at EQUAL -1)
          message(FATAL_ERROR "${directory}/${file} holds '${end}' and cannot be put into pages.")
        endif()
      endforeach()
      string(APPEND PROGRAM_TEXT "${text}\n")
    endforeach()
    message(STATUS "${name}.js: ${directory}")
  else()
    message(STATUS "${name}.js: not found, pages are built without it")
  endif()
  set(PROGRAM_FUNCTION ${function})
  set(PROGRAM_HEADER ${header})
  set(source "${PROJECT_BINARY_DIR}/page_programs/${name}.cpp")
  configure_file("${PROJECT_SOURCE_DIR}/cmake/page_program.cpp.in" "${source}" @ONLY)
  set(COSTATE_${upper}_FOUND ${found} PARENT_SCOPE)
  set(COSTATE_PAGE_PROGRAMS ${COSTATE_PAGE_PROGRAMS} "${source}" PARENT_SCOPE)
endfunction()

find_path(THREE_SCRIPT_DIR examples/js/controls/OrbitControls.js PATHS ${CMAKE_SYSTEM_PREFIX_PATH}
          PATH_SUFFIXES share/javascript/three)
find_path(CHART_SCRIPT_DIR chart.min.js PATHS ${CMAKE_SYSTEM_PREFIX_PATH} PATH_SUFFIXES share/javascript/chart.js)
mark_as_advanced(THREE_SCRIPT_DIR CHART_SCRIPT_DIR)
costate_page_program(three viewer_library costate/motion/viewer.h "${THREE_SCRIPT_DIR}" three.min.js
                     examples/js/controls/OrbitControls.js)
costate_page_program(chart plot_library costate/page/plot_script.h "${CHART_SCRIPT_DIR}" chart.min.js)
