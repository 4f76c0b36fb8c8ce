# costate_batches(<target>): compiles the target's sources in batches of a folder, as one file each: headers and templates
# that neighbours share are then parsed and instantiated once, in about a third of the processor time. What stands at file
# scope in a source, its unnamed namespace included, is therefore named apart from that of its neighbours in the folder:
# `const RegisterSceneKind revolute_registered(...)`. A new file joins the batch of its folder by itself.
option(COSTATE_BATCHES "Compile the sources of a folder in batches" OFF)
set(costate_batch_size 10)

function(costate_batches target)
  if(NOT COSTATE_BATCHES)
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  get_target_property(sources ${target} SOURCES)
  list(FILTER sources INCLUDE REGEX "\\.cpp$")
  # Programs of the tests link all of the tool but its main().
  list(FILTER sources EXCLUDE REGEX "/main\\.cpp$")
  list(SORT sources)
  set(folder "")
  foreach(source IN LISTS sources)
    get_filename_component(here "${source}" DIRECTORY)
    if(NOT here STREQUAL folder)
      set(folder "${here}")
      set(n 0)
      file(RELATIVE_PATH name "${CMAKE_CURRENT_SOURCE_DIR}" "${here}")
      string(MAKE_C_IDENTIFIER "${name}" name)
    endif()
    math(EXPR batch "${n} / ${costate_batch_size}")
    math(EXPR n "${n} + 1")
    set_source_files_properties("${source}" PROPERTIES UNITY_GROUP "${name}_${batch}")
  endforeach()
endfunction()
