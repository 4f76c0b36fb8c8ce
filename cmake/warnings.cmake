# costate_set_warnings(<target>): the warnings every target of the project is compiled with. Third-party
# headers come in through imported targets, hence as system headers, and are not subject to them.
function(costate_set_warnings target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic)
  # In a batch the unnamed namespace of a neighbour is not what a local name is mistaken for.
  target_compile_options(${target} PRIVATE "$<IF:$<BOOL:${COSTATE_BATCHES}>,-Wshadow=local,-Wshadow>")
  if(COSTATE_SANITIZE AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # The instrumentation makes GCC see uninitialized variables in the standard library.
    target_compile_options(${target} PRIVATE -Wno-maybe-uninitialized)
  endif()
  if(COSTATE_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
    if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
      # GCC 12 says these of a std::string that is joined with a literal (GCC bugs 105329 and 105651):
      # they are shown, and fail no build. The sanitizers' build tells true ones.
      target_compile_options(${target} PRIVATE -Wno-error=array-bounds -Wno-error=restrict)
    endif()
  endif()
endfunction()
