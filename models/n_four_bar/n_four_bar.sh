#!/usr/bin/env bash
# Writes a scene of the N-four-bar mechanism to standard output.
#   n_four_bar.sh N              bars and pins: singular whenever the uprights lie flat
#   n_four_bar.sh N parallel     the same motion with uprights that are kept parallel: never singular
# This directory's scenes, all of them:
#   for n in 1 2 5 10 40; do
#     bash n_four_bar.sh $n > n_four_bar_$n.toml; bash n_four_bar.sh $n parallel > n_four_bar_${n}_parallel.toml
#   done
set -euo pipefail

n=${1:-}
kind=${2:-bars}
if [[ ! $n =~ ^[1-9][0-9]*$ || ! $kind =~ ^(bars|parallel)$ ]]; then
  echo "usage: n_four_bar.sh N [parallel], with N >= 1 windows" >&2
  exit 2
fi

# A list of quoted strings "prefix0suffix", "prefix1suffix", ...: list FIRST LAST PREFIX SUFFIX.
list() {
  local text="" i
  for ((i = $1; i <= $2; i++)); do text+="\"$3$i$4\", "; done
  printf '[%s]' "${text%, }"
}

windows="$n windows"
((n == 1)) && windows="one window"
if [[ $kind == bars ]]; then
  title="N-four-bar mechanism with $windows"
  description="$((n + 1)) upright bars on the ground, joined at their tops by $n level ones: one degree of freedom, singular whenever the uprights lie flat. Written by n_four_bar.sh $n."
else
  title="N-four-bar mechanism with $windows, uprights kept parallel"
  description="The motion of n_four_bar_$n.toml without its singular positions: the uprights are parallel by constraint, and the level bars, which only translate, are masses at their ends. Written by n_four_bar.sh $n parallel."
fi

cat <<EOF
title = "$title"
description = "$description"

[gravity]
y_m_per_s2 = -9.81
EOF
for ((i = 0; i <= n; i++)); do
  printf '\n[point.A%d]\nground = true\nx_m = %d\ny_m = 0\n' "$i" "$i"
done
for ((i = 0; i <= n; i++)); do
  printf '\n[point.B%d]\nx_m = %d\ny_m = 1\nvx_m_per_s = 1\n' "$i" "$i"
done
for ((i = 0; i <= n; i++)); do
  printf '\n[bar.upright%d]\nfrom = "A%d"\nto = "B%d"\nmass_kg = 1\nlength_m = 1\n' "$i" "$i" "$i"
done
if [[ $kind == bars ]]; then
  for ((i = 1; i <= n; i++)); do
    printf '\n[bar.level%d]\nfrom = "B%d"\nto = "B%d"\nmass_kg = 1\nlength_m = 1\n' "$i" "$((i - 1))" "$i"
  done
  level_masses=$(list 1 "$n" bar.level .mass_kg)
  level_factors=""
else
  for ((i = 1; i <= n; i++)); do
    printf '\n[parallel.upright%d]\nfirst = ["A0", "B0"]\nsecond = ["A%d", "B%d"]\n' "$i" "$i" "$i"
  done
  level_factors="factors = ["
  for ((i = 0; i <= n; i++)); do
    share=1
    ((i == 0 || i == n)) && share=0.5
    printf '\n[mass.top%d]\npoint = "B%d"\nmass_kg = %s\n' "$i" "$i" "$share"
    level_factors+="$share, "
  done
  level_masses=$(list 0 "$n" mass.top .mass_kg)
  level_factors="${level_factors%, }]"$'\n'
fi
cat <<EOF

[start]
given = ["B0.x"]

# The integral of the squared horizontal excursion of the first corner.
[[cost.running]]
kind = "square"
output = "B0.x"

# The strength of gravity, downwards.
[parameter.g]
number = "gravity.y_m_per_s2"
factors = [-1]
lower = 1
upper = 20

# The speed of the corners at the start.
[parameter.v]
number = "point.B0.vx_m_per_s"
lower = 0.1
upper = 10

# The length of all uprights.
[parameter.H]
numbers = $(list 0 "$n" bar.upright .length_m)
lower = 0.1
upper = 10

# The mass of each upright, and of each level bar.
[parameter.mu]
numbers = $(list 0 "$n" bar.upright .mass_kg)
lower = 0.1
upper = 10

[parameter.ml]
numbers = $level_masses
${level_factors}lower = 0.1
upper = 10

[run]
t_end_s = 10
formulation = "index1"
method = "idas-adjoint"
parameters = ["g", "v", "H", "mu", "ml"]
rtol = 1e-8
outputs = ["B0.x", "B0.y", "energy.total"]
EOF
