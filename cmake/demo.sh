#!/usr/bin/env bash
# Installs what is missing, builds the release preset (again: only what changed), runs the example optimization and
# draws it.
# Usage: demo.sh [results directory]
set -euo pipefail

results=$(realpath -m "${1:-$(dirname "${BASH_SOURCE[0]}")/../results/five_bar}")
cd "$(dirname "${BASH_SOURCE[0]}")/.."

bash cmake/install-dependencies.sh

cmake --preset release
cmake --build --preset release --parallel "$(nproc)" --target costate_app

mkdir -p "$results"
build/release/bin/costate optimize models/five_bar/five_bar.toml --output "$results"

echo
echo "The results of the demo are in $results"
draw() {  # FIGURE WHAT
  if gnuplot -c "models/five_bar/figures/$1.gp" "$results" "$results/$1.svg"; then
    printf '  %-18s %s\n' "$1.svg" "$2"
  fi
}
if command -v gnuplot >/dev/null; then
  draw motion "the mechanism's motion before and after"
  draw time "velocity of point 2 and energies against time, before"
  draw evaluations "cost, gradient and parameters against the evaluations"
else
  echo "  (no figures, for want of gnuplot)"
fi
echo "  report.html        the run on one page, with plots"
echo "  optimize.json      the result and every evaluation"
echo "  optimized.toml     the scene with the best parameters"
echo "  before.h5, after.h5, before.csv, after.csv: the motions"
echo "What the scene is and what the numbers should be: models/five_bar/README.md"
