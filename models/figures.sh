#!/usr/bin/env bash
# Draws the figures of all models from their scenes and from runs of the tool.
# Usage: figures.sh [costate]    (default: the tool of the release build)
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")"
tool=$(realpath "${1:-../build/release/bin/costate}")
runs=$(mktemp -d)
trap 'rm -rf "$runs"' EXIT

draw() {  # MODEL SCENE [awk options]
  local model=$1 scene=$2
  shift 2
  mkdir -p "$model/figures"
  awk -v side=110 "$@" -f draw.awk "$model/$scene.toml" > "$model/figures/$model.svg"
}
draw five_bar five_bar
draw slider_crank slider_crank -v side=125
draw pendulum pendulum -v width=440
draw damped_pendulum damped_pendulum -v width=440
draw n_four_bar n_four_bar_2
draw andrews andrews -v side=70
draw car_axis car_axis

"$tool" optimize five_bar/five_bar.toml --output "$runs/five_bar" --quiet
for figure in motion time evaluations; do
  gnuplot -c "five_bar/figures/$figure.gp" "$runs/five_bar" "five_bar/figures/$figure.svg"
done

"$tool" simulate slider_crank/slider_crank.toml --output "$runs/slider_crank" --csv --quiet
gnuplot -c slider_crank/figures/angles.gp "$runs/slider_crank" slider_crank/figures/angles.svg
