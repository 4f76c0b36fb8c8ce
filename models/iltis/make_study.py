#!/usr/bin/env python3
"""Writes study.toml, the thirteen optimizations of the vehicle and one with constraints: python3 make_study.py"""

import pathlib

sets = {"leaf": ["kL1", "kL2"], "damping": ["c1", "c2"], "strut": ["k1", "k2"],
        "all": ["kL1", "kL2", "c1", "c2", "k1", "k2"]}
scenes = {"four_post_white": "white", "four_post_red": "red", "speed_bumps": "bumps"}
text = 'title = "Bombardier Iltis: ride and handling"\n'
runs = [(f"ride_{short}_{name}", scene, p) for scene, short in scenes.items() for name, p in sets.items()]
runs.append(("handling", "double_lane_change", sets["all"]))
runs.append(("ride_white_limited", "four_post_white_limited", sets["all"]))
for name, scene, parameters in runs:
    quoted = ", ".join(f'"{p}"' for p in parameters)
    text += f'\n[[run]]\nname = "{name}"\nscene = "{scene}.toml"\nparameters = [{quoted}]\n'
    if scene in ("four_post_white", "four_post_red", "double_lane_change"):
        text += "options = { rtol = 1e-9 }\n"  # psi's own error ends the line search too early at the scenes' 1e-8
(pathlib.Path(__file__).resolve().parent / "study.toml").write_text(text)
