# costate_add_candidate(<name> <source>...): builds <name>.so, an adjoint of one's own for
# 'costate check SCENE --candidate <name>.so'; see the header costate/candidate/candidate.h.
function(costate_add_candidate name)
  add_library(${name} MODULE ${ARGN})
  # Headers and flags of the library; the candidate uses none of its symbols.
  target_compile_features(${name} PRIVATE cxx_std_20)
  target_include_directories(${name} PRIVATE $<TARGET_PROPERTY:costate::lib,INTERFACE_INCLUDE_DIRECTORIES>)
  target_compile_options(${name} PRIVATE $<TARGET_PROPERTY:costate::lib,INTERFACE_COMPILE_OPTIONS>)
  target_link_libraries(${name} PRIVATE Eigen3::Eigen)
  set_target_properties(${name} PROPERTIES PREFIX "" CXX_VISIBILITY_PRESET hidden)
endfunction()
