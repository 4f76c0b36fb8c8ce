"""psi as a function that JAX (or, alike, torch.autograd.Function) differentiates, with our adjoint as its reverse mode.

    python3 with_jax.py damped_pendulum.toml
"""
import sys

try:
    import jax
except ImportError:
    print("jax is not installed")
    sys.exit(77)

import jax.numpy as jnp
import numpy as np

import costate

jax.config.update("jax_enable_x64", True)
problem = costate.Problem(costate.load(sys.argv[1]))


def run(rho):
    g = problem.gradient(np.asarray(rho))
    return np.float64(g.psi), g.gradient


@jax.custom_vjp
def psi(rho):
    return forward(rho)[0]


def forward(rho):
    shapes = jax.ShapeDtypeStruct((), jnp.float64), jax.ShapeDtypeStruct(rho.shape, jnp.float64)
    return jax.pure_callback(run, shapes, rho)


psi.defvjp(forward, lambda gradient, cotangent: (cotangent * gradient,))

# A design of two numbers, of which the damper is the product.
design = jnp.array([0.5, 2.0])
value, gradient = jax.value_and_grad(lambda x: psi(jnp.array([x[0] * x[1]])))(design)
print(f"psi = {value:.8g}, d psi/d design = {gradient}")
assert np.allclose(gradient, problem.gradient([1.0]).gradient[0] * np.array([2.0, 0.5]))
