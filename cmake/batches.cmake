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
  foreach(source IN LISTS sources)
    get_filename_component(here "${source}" DIRECTORY)
    file(RELATIVE_PATH name "${CMAKE_CURRENT_SOURCE_DIR}" "${here}")
    string(MAKE_C_IDENTIFIER "${name}" name)
    if(NOT DEFINED n_${name}) # a folder's sources stand on both sides of those of the folders below it
      set(n_${name} 0)
    endif()
    math(EXPR batch "${n_${name}} / ${costate_batch_size}")
    math(EXPR n_${name} "${n_${name}} + 1")
    set_source_files_properties("${source}" PROPERTIES UNITY_GROUP "${name}_${batch}")
  endforeach()
endfunction()
