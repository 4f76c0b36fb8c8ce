#!/usr/bin/env bash
# Installs what is missing, builds Costate with its tests and runs all of them.
#
#   test.sh              optimized build
#   test.sh --sanitize   a debug build with address and undefined-behaviour sanitizers first, then the
#                        optimized one
#   CI=true test.sh      the unit tests under sanitizers, then the optimized build, with warnings as errors
#
# The output ends with the summary of ctest, of the optimized build.
set -euo pipefail

sanitize=false
preset=release
if [[ ${CI:-} == true || ${CI:-} == 1 ]]; then
  sanitize=units
  preset=ci
fi
for argument in "$@"; do
  case $argument in
    --sanitize) sanitize=true ;;
    *)
      echo "usage: test.sh [--sanitize]" >&2
      exit 2
      ;;
  esac
done

cd "$(dirname "${BASH_SOURCE[0]}")/.."
bash cmake/install-dependencies.sh

build() {
  echo "== Building the preset '$1'"
  cmake --preset "$1" -D COSTATE_BUILD_TESTS=ON
  cmake --build --preset "$1" --parallel "$(nproc)" "${@:2}"
}

if [[ $sanitize != false ]]; then
  selection=()
  if [[ $sanitize == units ]]; then
    build debug --target test_unit
    selection=(--label-regex '^unit$')
  else
    build debug
  fi
  echo "== Testing the preset 'debug' (sanitizers)"
  ctest --preset debug --output-on-failure -j "$(nproc)" "${selection[@]}"
  echo "== The tests pass under the sanitizers"
fi

build "$preset"
echo "== Testing the preset '$preset'"
ctest --preset "$preset" --output-on-failure -j "$(nproc)"
