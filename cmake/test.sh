#!/usr/bin/env bash
# Installs what is missing, builds Costate with its tests and runs all of them.
#
#   test.sh              optimized build
#   test.sh --sanitize   a debug build with address and undefined-behaviour sanitizers first, then the
#                        optimized one
#   CI=true test.sh      warnings are errors
#
# The output ends with the summary of ctest, of the optimized build.
set -euo pipefail

sanitize=false
preset=release
if [[ ${CI:-} == true || ${CI:-} == 1 ]]; then
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
  cmake --build --preset "$1" --parallel "$(nproc)"
}

if $sanitize; then
  build debug
  echo "== Testing the preset 'debug' (sanitizers)"
  ctest --preset debug --output-on-failure -j "$(nproc)"
  echo "== The tests pass under the sanitizers"
fi

build "$preset"
echo "== Testing the preset '$preset'"
ctest --preset "$preset" --output-on-failure -j "$(nproc)"
