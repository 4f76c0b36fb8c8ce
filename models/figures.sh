#!/usr/bin/env bash
# Draws the figures of all models from their scenes and from runs of the tool.
# Usage: figures.sh [costate]    (default: the tool of the release build)
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")"
tool=$(realpath "${1:-../build/release/bin/costate}")
runs=$(mktemp -d)
trap 'rm -rf "$runs"' EXIT

draw() {  # MODEL SCENE [options of costate draw]
  local model=$1 scene=$2
  shift 2
  mkdir -p "$model/figures"
  "$tool" draw "$model/$scene.toml" "$@" -o "$model/figures/$model.svg"
}
for model in five_bar slider_crank andrews car_axis bricard flyball_governor heavy_top; do draw $model $model; done
for model in pendulum damped_pendulum bouncing_ball shortest_swing; do draw $model $model --width 440; done
draw n_four_bar n_four_bar_2
"$tool" draw five_bar/five_bar_ground.toml -o five_bar/figures/five_bar_ground.svg
for scene in drop thrown; do "$tool" draw bouncing_ball/$scene.toml --width 440 -o bouncing_ball/figures/$scene.svg; done
for scene in arc_feet sole_feet space point_feet rigid_arcs knees; do
  mkdir -p walker/figures
  "$tool" draw walker/$scene.toml --no-names --width 440 -o walker/figures/$scene.svg
done
for goal in speed energy stability; do
  "$tool" optimize walker/gait_$goal.toml --no-certificate --output "$runs/gait_$goal" --quiet
  for gait in before:walker/gait_$goal.toml "after:$runs/gait_$goal/optimized.toml"; do
    "$tool" animate "${gait#*:}" --output-step 0.1 --width 440 --t-end 7.2 -o "walker/figures/gait_${goal}_${gait%%:*}.svg"
  done
done
for model in cradle engine rimless_wheel rocking_block sliding_box painleve_rod; do draw $model $model --no-names --width 440; done
draw rigid_body euler_top --width 440

"$tool" optimize five_bar/five_bar.toml --output "$runs/five_bar" --quiet
for figure in motion time evaluations; do
  gnuplot -c "five_bar/figures/$figure.gp" "$runs/five_bar" "five_bar/figures/$figure.svg"
done

"$tool" simulate slider_crank/slider_crank.toml --output "$runs/slider_crank" --csv --quiet
gnuplot -c slider_crank/figures/angles.gp "$runs/slider_crank" slider_crank/figures/angles.svg
