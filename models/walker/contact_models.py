#!/usr/bin/env python3
"""Eleven normal laws by nine models of friction on a walker: the table of README.md.

  contact_models.py arc_feet.toml
  contact_models.py sole_feet.toml --only flores,hertz
  --costate PATH    the tool (default: that of the release build)
  --t-end SECONDS   (default: 60, by which the gait is steady, or lost)
  --only LIST       only these normal laws
  --csv FILE        the whole as a table of numbers, too

Of the last two steps: their time, speed along x, the energy that contacts take in a step; of the whole run the largest
penetration, the integrator's steps a walker's step and the milliseconds a step. A step is a touch that comes more than
half a second after the other foot's. "falls at N" where the walker does not come to the end, with the steps it made.
Needs Python 3 and nothing else.
"""
import argparse
import csv
import io
import json
import pathlib
import subprocess
import tempfile

here = pathlib.Path(__file__).resolve().parent
options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
options.add_argument("scene")
options.add_argument("--costate", default=str(here.parent.parent / "build/release/bin/costate"))
options.add_argument("--t-end", type=float, default=60)
options.add_argument("--only", default="")
options.add_argument("--csv")
options = options.parse_args()

NORMAL = ["linear", "hertz", "hunt-crossley", "herbert-mcwhannell", "lee-wang", "lankarani-nikravesh", "gonthier",
          "zhiying-qishao", "flores", "hu-guo", "kelvin-voigt"]
# Beside mu = 0.8 and 0.01 m/s.
FRICTION = {"none": "", "coulomb": "", "threlfall": "", "ambrosio": "dead_velocity_m_per_s = 0.001",
            "bengisu-akay": "static_coefficient = 1", "stribeck": "static_coefficient = 1",
            "brown-mcphee": "static_coefficient = 1", "dahl": "bristle_stiffness_per_m = 1000",
            "lugre": "static_coefficient = 1\nbristle_stiffness_per_m = 1000\nbristle_damping_s_per_m = 10"}
RESTITUTION, DAMPING = "0.05", "1000"


def written(text, law, friction):
    """The scene with another law and friction."""
    out = []
    for line in text.splitlines():
        key = line.split(" = ")[0]
        if key == "law":
            line = 'law = "%s"' % law
        elif key == "stiffness_N_per_m_n" and law == "linear":
            line = "stiffness_N_per_m_n = 3e3"
        elif key == "restitution":
            line = {"linear": "", "hertz": "", "kelvin-voigt": "damping_N_s_per_m = " + DAMPING}.get(law, line)
        elif key == "friction":
            line = 'friction = "%s"\n%s' % (friction, FRICTION[friction])
        elif key == "friction_coefficient" and friction == "none":
            line = ""
        elif key == "transition_velocity_m_per_s" and friction in ("none", "dahl"):
            line = ""
        out.append(line)
    text = "\n".join(out)
    # Without parameters: what a law does not have cannot be one.
    text = text[:text.index("[parameter.")]
    return "\n".join(line for line in text.splitlines() if not line.startswith("parameters"))


def run(law, friction):
    with tempfile.TemporaryDirectory() as folder:
        scene = pathlib.Path(folder, "scene.toml")
        scene.write_text(written(pathlib.Path(here, options.scene).read_text(), law, friction))
        try:
            done = subprocess.run([options.costate, "simulate", str(scene), "--json", "--csv", "--output", folder,
                                   "--t-end", str(options.t_end), "--output-step", "0.01"],
                                  capture_output=True, text=True, timeout=120)
        except subprocess.TimeoutExpired:
            return {"why": "stopped after 120 s"}
        if done.returncode:
            return {"why": done.stderr.strip().splitlines()[-1]}
        summary = json.loads(done.stdout)
        # Its time without the table of samples.
        told = subprocess.run([options.costate, "simulate", str(scene), "--no-files", "--t-end", str(options.t_end)],
                              capture_output=True, text=True).stdout
        seconds = float(told.strip().splitlines()[-1].split(", ")[-1].split()[0])
        rows = list(csv.reader(io.StringIO(pathlib.Path(folder, "trajectory.csv").read_text())))
    names = [h.split(" ")[0] for h in rows[0]]
    rows = [[float(x) for x in row] for row in rows[1:]]

    def columns(ending):
        return [i for i, h in enumerate(names) if h.startswith("outputs/") and h.endswith(ending)]

    hip_x, hip_y = names.index("coordinates/hip.x"), names.index("coordinates/hip.y")
    first = rows[0][hip_y]
    fallen = next((row[0] for row in rows if row[hip_y] - first < -0.5 - 0.02 * row[hip_x]), None)
    steps, foot = [], None
    for event in touches(summary, rows, names):
        side = "left" if "left" in event[1] else "right"
        if side != foot and (not steps or event[0] - steps[-1] > 0.5):
            steps.append(event[0])
            foot = side
    if fallen is not None:
        return {"steps": sum(t < fallen for t in steps), "fallen": fallen}
    if len(steps) < 5:
        return {"steps": len(steps), "fallen": options.t_end}

    def at(t, i):
        k = next(k for k, row in enumerate(rows) if row[0] >= t)
        a, b = rows[max(k - 1, 0)], rows[k]
        w = (t - a[0]) / (b[0] - a[0]) if b[0] > a[0] else 0
        return a[i] + w * (b[i] - a[i])

    begin, end = steps[-4], steps[-2]
    lost = columns(".energy_lost")
    return {"steps": len(steps), "time": (end - begin) / 2, "speed": (at(end, hip_x) - at(begin, hip_x)) / (end - begin),
            "depth": max(row[i] for row in rows for i in columns(".penetration")),
            "lost": sum(at(end - 1, i) - at(begin - 1, i) for i in lost) / 2,  # between touches
            "work": summary["counters"]["steps"] / len(steps), "ms": 1000 * seconds / len(steps)}


def touches(summary, rows, names):
    """(time, name) of the touches; of laws without events, from the gaps."""
    found = [(e["t"], e["name"]) for e in summary.get("events", []) if ": touch" in e["name"]]
    if found:
        return found
    for i, h in enumerate(names):
        if h.startswith("outputs/") and h.endswith(".gap"):
            found += [(b[0], h) for a, b in zip(rows, rows[1:]) if a[i] > 0 >= b[i]]
    return sorted(found)


laws = [law for law in NORMAL if not options.only or law in options.only.split(",")]
table = []
print("| normal law | friction | step time [s] | speed [m/s] | depth [mm] | lost a step [mJ] | steps | ms |")
print("|---|---|---|---|---|---|---|---|")
for law in laws:
    for friction in FRICTION:
        r = run(law, friction)
        table.append({"law": law, "friction": friction, **r})
        if "time" in r:
            print("| %s | %s | %.4f | %.4f | %.2f | %.3f | %.0f | %.1f |" %
                  (law, friction, r["time"], r["speed"], 1000 * r["depth"], 1000 * r["lost"], r["work"], r["ms"]),
                  flush=True)
        else:
            print("| %s | %s | %s | | | | | |" %
                  (law, friction, "falls at %d" % r["steps"] if "steps" in r else r["why"]), flush=True)
if options.csv:
    keys = ["law", "friction", "steps", "time", "speed", "depth", "lost", "work", "ms", "fallen", "why"]
    with open(options.csv, "w", newline="") as file:
        out = csv.DictWriter(file, keys)
        out.writeheader()
        out.writerows(table)
