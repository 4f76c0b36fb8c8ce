#!/usr/bin/env python3
"""The measured runs of this folder: the pendulum's own equation by Runge and Kutta's method, and noise from a seed.

m L^2 a = -m g L sin(deflection) - c v, with L = 0.53 m, c = 0.02 N m s/rad, m = 0.5 kg.
"""
import math
import random

L, C, M, G, NOISE_DEG = 0.53, 0.02, 0.5, 9.81, 0.5


def rate(x):
    return x[1], -G / L * math.sin(x[0]) - C / (M * L * L) * x[1]


def step(x, h):
    k1 = rate(x)
    k2 = rate([x[i] + h / 2 * k1[i] for i in (0, 1)])
    k3 = rate([x[i] + h / 2 * k2[i] for i in (0, 1)])
    k4 = rate([x[i] + h * k3[i] for i in (0, 1)])
    return [x[i] + h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]) for i in (0, 1)]


def record(file, deflection, seed, clock_ms):
    noise = random.Random(seed)
    x, h = [deflection, 0.0], 1e-4
    with open(file, "w") as out:
        out.write(f"# released at {deflection} rad\nt [ms],angle [deg]\n")
        for k in range(50001):
            if k % (clock_ms * 10) == 0:
                out.write(f"{k // 10},{math.degrees(x[0]) + noise.gauss(0, NOISE_DEG):.3f}\n")
            x = step(x, h)


record("swing_small.csv", 0.6, 1, 25)
record("swing_wide.csv", 1.9, 2, 20)
