#!/usr/bin/env python3
"""Whether a touch whose force does not jump is cheaper as an event: the table of README.md.

  event_or_not.py
  --costate PATH    the tool (default: that of the release build)

A rod with a mass at either end tumbles over an elastic floor for a second: F = K d^n. By law = "hertz" its touches are no
events; by restitution = 1 the same force is one whose touches are, as they latch a speed. Evaluations (with those at touches)
at equal error of where an end comes to, by straight lines through runs at tolerances from 1e-3 to 1e-12, where an error
counts from where no tighter tolerance makes a larger one; geometric means over n = 1, 1.5, 2.2 and K = 1e3, 1e5.
The reference is dop853 with events at 1e-13. Needs Python 3 and nothing else.
"""
import argparse
import json
import math
import pathlib
import subprocess
import tempfile

here = pathlib.Path(__file__).resolve().parent
options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
options.add_argument("--costate", default=str(here.parent.parent / "build/release/bin/costate"))
options = options.parse_args()

END = '''
[contact.of_{0}]
point = "{0}"
{1}
stiffness_N_per_m_n = {2}
exponent = {3}
'''
ROD = '''
[gravity]
y_m_per_s2 = -9.81
[point.P]
x_m = 0
y_m = 0.3
vx_m_per_s = 0.4
vy_m_per_s = 0
[point.Q]
x_m = 0.3
y_m = 0.35
[mass.P]
point = "P"
mass_kg = 1
[mass.Q]
point = "Q"
mass_kg = 0.5
[distance.PQ]
from = "P"
to = "Q"
length_m = 0.304138126514911
[start]
given = ["P.x", "P.y", "Q.x"]
[run]
t_end_s = 1
[[cost.terminal]]
kind = "value"
output = "P.x"
'''
LAWS = {"passed": 'law = "hertz"', "event": "restitution = 1"}
TOLERANCES = [10.0 ** -k for k in range(3, 13)]
ERRORS = [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9]


def run(folder, law, stiffness, exponent, integrator, rtol):
    scene = pathlib.Path(folder) / "rod.toml"
    scene.write_text(ROD + "".join(END.format(end, LAWS[law], stiffness, exponent) for end in "PQ"))
    out = subprocess.run([options.costate, "simulate", str(scene), "--no-files", "--json", "--quiet", "--formulation",
                          "baumgarte", "--integrator", integrator, "--rtol", str(rtol)], capture_output=True, text=True)
    result = json.loads(out.stdout)
    if result.get("status") == "failed":
        raise SystemExit(result["error"])
    return result["psi"], result["counters"]["residuals"]


def work_at(curve, error):
    """Of (error, work) from loose to tight."""
    worst, honest = 0, []
    for e, w in reversed(curve):
        worst = max(worst, e, 1e-15)
        honest.append((worst, w))
    honest.reverse()
    for (e1, w1), (e2, w2) in zip(honest, honest[1:]):
        if e2 <= error <= e1:
            part = (math.log(e1 / error) / math.log(e1 / e2)) if e1 > e2 else 0
            return w1 * (w2 / w1) ** part
    return None


with tempfile.TemporaryDirectory() as folder:
    print("| evaluations of the one over the other at an error of | " + " | ".join(f"{e:.0e}" for e in ERRORS) + " |")
    print("|---" * (len(ERRORS) + 1) + "|")
    for integrator in ("cvodes", "idas", "dopri5", "dop853", "radau5"):
        logs = {e: [] for e in ERRORS}
        for exponent in (1.0, 1.5, 2.2):
            for stiffness in (1e3, 1e5):
                reference, _ = run(folder, "event", stiffness, exponent, "dop853", 1e-13)
                curves = {}
                for law in LAWS:
                    runs = [run(folder, law, stiffness, exponent, integrator, rtol) for rtol in TOLERANCES]
                    curves[law] = [(abs(psi - reference), work) for psi, work in runs]
                for e in ERRORS:
                    passed, event = work_at(curves["passed"], e), work_at(curves["event"], e)
                    if passed and event:
                        logs[e].append(math.log(event / passed))
        means = [f"{math.exp(sum(x) / len(x)):.2f}" if len(x) >= 4 else "" for x in logs.values()]
        print(f"| `{integrator}` | " + " | ".join(means) + " |", flush=True)
