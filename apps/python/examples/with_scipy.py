"""scipy.optimize with exact gradients and Hessian products.

    python3 with_scipy.py damped_pendulum.toml
"""
import sys

try:
    from scipy.optimize import minimize
except ImportError:
    print("scipy is not installed (python3-scipy)")
    sys.exit(77)

import numpy as np

import costate

problem = costate.Problem(costate.load(sys.argv[1]), rtol=1e-10)
bounds = list(zip(problem.lower, problem.upper))

quasi_newton = minimize(problem.value_and_gradient, problem.values, jac=True, method="L-BFGS-B", bounds=bounds,
                        options={"gtol": 1e-8, "ftol": 0})
newton = minimize(problem.value_and_gradient, quasi_newton.x + 0.5, jac=True, method="trust-constr",
                  hessp=lambda x, p: problem.hessian_product(p, x), options={"gtol": 1e-9})
print(f"L-BFGS-B:     {quasi_newton.x}, psi = {quasi_newton.fun:.9g}, {quasi_newton.nfev} runs")
print(f"trust-constr: {newton.x}, psi = {newton.fun:.9g}, {newton.nfev} runs")
ours = problem.optimize(gradient_tolerance=1e-8)
print(f"costate:      {ours.parameters}, psi = {ours.psi:.9g}, {len(ours.evaluations)} runs")
assert np.allclose(quasi_newton.x, ours.parameters, rtol=1e-5)
assert np.allclose(newton.x, ours.parameters, rtol=1e-5)
