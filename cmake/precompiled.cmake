# costate_precompile(<target> [<header>...]): parses the headers that nearly every source includes once a target instead
# of once a file (about a second each); further headers are the target's own. Sources include what they use all the same.
option(COSTATE_PRECOMPILE "Precompile the headers that nearly every source includes" ON)

function(costate_precompile target)
  if(NOT COSTATE_PRECOMPILE)
    return()
  endif()
  target_precompile_headers(
    ${target}
    PRIVATE
    <Eigen/Core>
    <algorithm>
    <array>
    <cmath>
    <fmt/format.h>
    <functional>
    <map>
    <memory>
    <optional>
    <set>
    <string>
    <utility>
    <vector>
    ${ARGN})
endfunction()
