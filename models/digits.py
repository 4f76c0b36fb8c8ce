#!/usr/bin/env python3
"""Digits that each formulation reaches on a model, against its reference.json: the tables in the models' READMEs.

  digits.py andrews                           states and gradients of andrews/reference.json, as Markdown
  digits.py n_four_bar --scene n_four_bar_1_parallel.toml --t 5 --states
  --costate PATH    the tool (default: that of the release build)
  --formulations LIST, --methods LIST   only these
  --rtol LIST       relative tolerances that are tried (default: 1e-11,1e-12,1e-13,1e-14)
  --atol LIST       absolute ones, as multiples of rtol (default: 1)
  --limit SECONDS   longest time of one run (default: 20); what takes longer counts as stopped

A digit count is -log10 of the largest relative error: of the state over all quantities of the entry; of a gradient
over all parameters, each derivative times its parameter and relative to the largest of these. The best over the
tolerances stands in the table, with the tolerances behind it; "stops" where no run came to its end.
Needs Python 3 and nothing else.
"""
import argparse
import json
import math
import pathlib
import subprocess

here = pathlib.Path(__file__).resolve().parent
options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
options.add_argument("model")
options.add_argument("--scene")
options.add_argument("--t", type=float)
options.add_argument("--states", action="store_true", help="states only")
options.add_argument("--gradients", action="store_true", help="gradients only")
options.add_argument("--formulations", default="")
options.add_argument("--methods", default="")
options.add_argument("--rtol", default="1e-11,1e-12,1e-13,1e-14")
options.add_argument("--atol", default="1")
options.add_argument("--limit", type=float, default=20)
options.add_argument("--costate", default=str(here.parent / "build/release/bin/costate"))
options = options.parse_args()
both = options.states == options.gradients
tolerances = [(r, "%g" % (float(r) * float(a))) for r in options.rtol.split(",") for a in options.atol.split(",")]


def run(*words):
    """The tool's summary, or None where the run stops."""
    try:
        done = subprocess.run([options.costate, *words, "--json"], capture_output=True, text=True,
                              timeout=options.limit)
    except subprocess.TimeoutExpired:
        return None
    summary = json.loads(done.stdout)
    return summary if done.returncode == 0 else None


def digits(error):
    return math.inf if error == 0 else -math.log10(error) if math.isfinite(error) else -math.inf


def best(measure, *words):
    """(digits, steps, rtol, atol) of the best tolerance, or None."""
    found = []
    for rtol, atol in tolerances:
        summary = run(*words, "--no-files", "--rtol", rtol, "--atol", atol)
        if summary:
            found.append((digits(measure(summary)), summary["counters"]["steps"], rtol, atol))
    return max(found, key=lambda f: f[0], default=None)


def settings(b):
    return b[2] if float(b[2]) == float(b[3]) else f"{b[2]}, atol {b[3]}"


table = json.loads(subprocess.run([options.costate, "list", "--json"], capture_output=True, text=True).stdout)
chosen = [f for f in options.formulations.split(",") if f]
formulations = [f for f in table["formulations"] if not chosen or f["name"] in chosen]
reference = json.loads((here / options.model / "reference.json").read_text())


def wanted(entry, key):
    return (not options.scene or entry["scene"] == options.scene) and (not options.t or entry[key] == options.t)


for entry in reference["states"]:
    if not (both or options.states) or not wanted(entry, "t_s") or entry["t_s"] == 0:
        continue
    def error(summary):
        return max(abs(summary["terminal"][name] - x) / (abs(x) or 1) for name, x in entry["values"].items())
    print(f"\nState of {entry['scene']} at {entry['t_s']} s ({len(entry['values'])} quantities)\n")
    print("| formulation | integrator | digits | steps | rtol |\n|---|---|---|---|---|", flush=True)
    for f in formulations:
        for integrator in f["integrators"]:
            if integrator == "fixed":  # of second order: no match for these tolerances
                continue
            b = best(error, "simulate", str(here / options.model / entry["scene"]), "--formulation", f["name"],
                     "--integrator", integrator, "--t-end", repr(entry["t_s"]))
            print(f"| {f['name']} | {integrator} | " +
                  (f"{b[0]:.1f} | {b[1]} | {settings(b)} |" if b else "stops | | |"), flush=True)

possible = {(c["formulation"], c["method"]) for c in table["combinations"] if c["possible"]}
chosen = [m for m in options.methods.split(",") if m]
methods = [m["name"] for m in table["methods"] if (m["name"] in chosen if chosen else
           m["name"] != "differences" and not m["name"].startswith("discrete"))]
for entry in reference["functionals"]:
    if not (both or options.gradients) or not wanted(entry, "t_end_s") or not entry["gradient"]:
        continue
    scene = [str(here / options.model / entry["scene"]), "--t-end", repr(entry["t_end_s"]),
             "--parameters", ",".join(entry["gradient"])]
    for override in entry["set"]:
        scene += ["--set", override]
    def error(summary):
        size = max(abs(g * summary["parameters"][p]) for p, g in entry["gradient"].items())
        return max(abs((summary["gradient"][p] - g) * summary["parameters"][p])
                   for p, g in entry["gradient"].items()) / size
    print(f"\nGradient of {entry['scene']} to {entry['t_end_s']} s {' '.join(entry['set'])}\n")
    print(f"| formulation | {' | '.join(methods)} |\n|---|{'---|' * len(methods)}", flush=True)
    for f in formulations:
        cells = []
        for m in methods:
            if (f["name"], m) not in possible:
                cells.append("")
                continue
            b = best(error, "gradient", *scene, "--formulation", f["name"], "--method", m)
            cells.append(f"{b[0]:.1f} ({settings(b)})" if b else "stops")
        print(f"| {f['name']} | {' | '.join(cells)} |", flush=True)
