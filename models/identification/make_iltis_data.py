#!/usr/bin/env python3
"""The four-post record of this folder: the vehicle with worn dampers, run by another formulation and integrator than
the fit's and far tighter, and noise from a seed. Takes the program as its argument: make_iltis_data.py build/bin/costate
"""
import csv
import pathlib
import random
import subprocess
import sys
import tempfile

FRONT, REAR = 8200.0, 11400.0  # N s/m at rest; the data sheet has 9945.627 for both
SCENE = pathlib.Path(__file__).resolve().parent.parent / "iltis" / "four_post_white.toml"
CHANNELS = [(f"outputs/strut_{w}.length", f"strut_{w} [mm]", 1e3, 0.5) for w in ("FL", "FR", "RL", "RR")]
CHANNELS += [("accelerations/chassis.z", "heave [m/s^2]", 1, 0.1)]  # stored, written, factor to its unit, noise in that

with tempfile.TemporaryDirectory() as folder:
    values = [f"spring.strut_{w}.damper_law.slope={FRONT if w[0] == 'F' else REAR}" for w in ("FL", "FR", "RL", "RR")]
    subprocess.run([sys.argv[1], "simulate", SCENE, "--formulation", "baumgarte", "--integrator", "dop853", "--rtol",
                    "1e-11", "--t-end", "2", "--output-step", "0.01", "--csv", "--quiet", "--output", folder]
                   + [word for v in values for word in ("--set", v)], check=True)
    rows = list(csv.reader(open(next(pathlib.Path(folder).glob("*.csv")))))

names = rows[0]
noise = random.Random(11)
with open(pathlib.Path(__file__).resolve().parent / "iltis_four_post.csv", "w") as out:
    out.write("# four posts, white noise; damper slopes and noise: make_iltis_data.py\n")
    out.write(",".join(["t [s]"] + [c[1] for c in CHANNELS]) + "\n")
    for row in rows[1:]:
        values = [f"{float(row[0]):.2f}"]
        for output, _, factor, sigma in CHANNELS:
            at = next(i for i, n in enumerate(names) if n.startswith(f"{output} ["))
            values.append(f"{float(row[at]) * factor + noise.gauss(0, sigma):.3f}")
        out.write(",".join(values) + "\n")
