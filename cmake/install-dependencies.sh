#!/usr/bin/env bash
# Installs what Costate needs from the distribution (Debian 12): finds the packages that are missing and
# installs those, as root or with sudo. Without either it names them, and fails where one is needed. With nothing missing it
# does nothing, and what is optional and cannot be had it goes on without.
set -euo pipefail

# <package>, or <package>=<command> where any package that provides the command will do.
packages=(
  "g++=g++"
  cmake=cmake
  ninja-build=ninja
  pkg-config=pkg-config
  libeigen3-dev
  libsundials-dev
  libsuitesparse-dev
  libnlopt-dev
  libnlopt-cxx-dev
  libceres-dev
  libtomlplusplus-dev
  libcli11-dev
  libhdf5-dev
  nlohmann-json3-dev
  libfmt-dev
  catch2
)
# What the tool is built without where it cannot be had, a part of it or a test less.
optional=(
  gnuplot-nox=gnuplot
  clang-format=clang-format
  python3-dev
  python3-numpy
  python3-scipy
  pybind11-dev
  liburdfdom-dev
  liborocos-kdl-dev
  libopenmpi-dev
  openmpi-bin=mpirun
  libjs-three
  libjs-chart.js
)
# A browser, in which the tests open the pages that the tool writes; they pass it over where there is none.
if [[ ${CI:-} == true || ${CI:-} == 1 ]]; then
  optional+=(chromium=chromium)
fi

if ! command -v dpkg-query >/dev/null; then
  echo "install-dependencies.sh: no Debian package database here; please install the equivalents of:"
  echo "  ${packages[*]%%=*}"
  echo "and, for all of it, of:"
  echo "  ${optional[*]%%=*}"
  exit 0
fi

is_there() {
  local package=${1%%=*} program=${1#"${1%%=*}"}
  program=${program#=}
  [[ -n $program ]] && command -v "$program" >/dev/null && return
  [[ $(dpkg-query -W -f='${Status}\n' "$package" 2>/dev/null | head -n 1) == "install ok installed" ]]
}
missing=()
for entry in "${packages[@]}"; do is_there "$entry" || missing+=("${entry%%=*}"); done
wanted=()
for entry in "${optional[@]}"; do is_there "$entry" || wanted+=("${entry%%=*}"); done

if ((${#missing[@]} + ${#wanted[@]} == 0)); then
  exit 0
fi

if ((EUID == 0)); then
  as_root=(env)
elif command -v sudo >/dev/null && { [[ -t 0 ]] || sudo -n true 2>/dev/null; }; then
  as_root=(sudo env)
else
  echo "install-dependencies.sh: packages are missing and cannot be installed without root; please run" >&2
  echo "  apt-get install --no-install-recommends ${missing[*]} ${wanted[*]}" >&2
  exit $((${#missing[@]} > 0))
fi

install() { "${as_root[@]}" DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends "$@"; }
echo "Installing: ${missing[*]} ${wanted[*]}"
if ! "${as_root[@]}" DEBIAN_FRONTEND=noninteractive apt-get update -q && ((${#missing[@]} > 0)); then exit 1; fi
if ((${#missing[@]} > 0)); then install "${missing[@]}"; fi
if ((${#wanted[@]} > 0)) && ! install "${wanted[@]}"; then
  for package in "${wanted[@]}"; do install "$package" || echo "install-dependencies.sh: goes on without $package" >&2; done
fi
