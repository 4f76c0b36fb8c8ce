"""A scene from Python: simulate, differentiate, change and optimize it.

    python3 first_run.py damped_pendulum.toml
"""
import sys

import numpy as np

import costate

scene = costate.load(sys.argv[1])
problem = costate.Problem(scene, rtol=1e-9)

run = problem.simulate(times=np.linspace(0, 5, 11), outputs=["P.x", "energy.total"])
print("t [s]    ", run.t)
print("P.x [m]  ", run["P.x"])

g = problem.gradient()
print(f"psi = {g.psi:.8g}, dpsi/d{problem.parameters[0]} = {g.gradient[0]:.7g}")
print(f"d2psi    = {problem.hessian()[0, 0]:.6g}")

# Scenes do not change; `set` gives another one.
heavier = scene.set({"bar.rod.mass_kg": 4})
print(f"with {heavier['bar.rod.mass_kg']:g} kg psi = {costate.Problem(heavier).gradient().psi:.6g}")

best = problem.optimize(callback=lambda e: print(f"  {e['index']:2d}  psi = {e['psi']:.8g}"))
print(f"c = {best.parameters[0]:.6g}: {best.stop_reason}")
problem.scene_at(best.parameters).save("optimized.toml")
