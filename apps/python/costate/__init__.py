"""Simulation, exact gradients and design optimization of multibody systems.

    import costate
    problem = costate.Problem(costate.load("five_bar.toml"), rtol=1e-9)
    run = problem.simulate()            # run.t, run["P2.x"], run.psi
    g = problem.gradient()              # g.psi, g.gradient
    H = problem.hessian()
    best = problem.optimize(callback=lambda e: print(e["index"], e["psi"]))

Parameters are numpy arrays in the order of problem.parameters. Mistakes and failed runs are exceptions with the tool's
text: Error, and SceneError (with file, line and column), ModelError, SolverError, CapabilityError, which derive from it.
What a run noticed without ending is in its `warnings` and told by Python's warnings (RunWarning). Ctrl-C ends a run
between two of its steps.
"""

import json as _json
import os as _os
import warnings as _warnings

from . import _costate
from ._costate import (CapabilityError, Error, ModelError, SceneError,
                       SolverError, __version__)

__all__ = [
    "CapabilityError", "Error", "Gradient", "ModelError", "Optimum",
    "Problem", "Run", "RunWarning", "Scene", "SceneError", "SolverError",
    "batch", "check", "command", "load", "parse",
]


class RunWarning(UserWarning):
    """What a run noticed that does not end it: constraints that drift, singular positions passed, ..."""


def _warn(sentences):
    for sentence in sentences:
        _warnings.warn(sentence, RunWarning, stacklevel=3)


def _value(x):
    """A Python value as a TOML value."""
    if isinstance(x, bool):
        return "true" if x else "false"
    if isinstance(x, str):
        return _json.dumps(x)
    if hasattr(x, "tolist"):  # of numpy
        return _value(x.tolist())
    if isinstance(x, dict):
        return "{" + ", ".join(f"{_json.dumps(str(k))} = {_value(y)}" for k, y in x.items()) + "}"
    if isinstance(x, (list, tuple)):
        return "[" + ", ".join(_value(y) for y in x) + "]"
    if isinstance(x, int):
        return repr(x)
    return repr(float(x))  # inf and nan are TOML as they are


class Scene:
    """A scene. It does not change: `set` gives another one."""

    def __init__(self, inner):
        self._inner = inner

    @property
    def title(self):
        return self._inner.title

    @property
    def file_name(self):
        return self._inner.file_name

    @property
    def coordinates(self):
        """The names of the coordinates."""
        return self._inner.coordinates

    @property
    def outputs(self):
        """The names of all outputs."""
        return self._inner.outputs

    @property
    def numbers(self):
        """The mechanism's numbers by path ("bar.rod.mass_kg"), in SI units."""
        return self._inner.numbers

    def __getitem__(self, path):
        return self._inner.numbers[path]

    def set(self, values=None, **tables):
        """The scene with values by path, all at once: scene.set({"bar.rod.mass_kg": 2, "run.rtol": 1e-9})."""
        values = {**(values or {}), **tables}
        return Scene(self._inner.with_overrides([(path, _value(value)) for path, value in values.items()]))

    def dump(self):
        """The scene as TOML, for a file anywhere: files that it names are so by absolute paths."""
        return self._inner.dump()

    def save(self, path):
        """Writes it to a file; those that it names are so by paths from there."""
        text = self._inner.dump(_os.path.dirname(_os.path.abspath(path)))
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)

    def __repr__(self):
        return f"<costate.Scene {self.title or self.file_name!r}>"


def load(path, set=None):
    """Reads a scene file; `set` replaces values by path before anything is checked. Its `file_name` is absolute."""
    overrides = [f"{key}={_value(value)}" for key, value in (set or {}).items()]
    return Scene(_costate.Scene.load(str(path), overrides))


def parse(text, name="scene.toml", set=None):
    """The scene that a text of TOML describes; files that it names count from the folder of `name`."""
    overrides = [f"{key}={_value(value)}" for key, value in (set or {}).items()]
    return Scene(_costate.Scene.parse(text, name, overrides))


class _Record:
    def __init__(self, fields):
        self.__dict__.update(fields)

    def __repr__(self):
        return f"<costate.{type(self).__name__} psi={self.psi:.9g}>"


class Run(_Record):
    """A simulation: t [s] (n), data (n x k) with a column for each of `names`, units, psi, psi_error (or
    None: what is known of it, where that is more than what rtol cannot hold), counters, events as (t, name), end (what ended it before its time, or None), warnings. run["P2.x"] is one column."""

    def __getitem__(self, name):
        try:
            return self.data[:, self.names.index(name)]
        except ValueError:
            raise KeyError(f"The run has no output '{name}'.") from None


class Gradient(_Record):
    """psi, psi_error (as of Run), gradient (p), error (p; estimated, or None), counters, events, warnings."""


class Optimum(_Record):
    """parameters (p), psi, gradient (p), stop_reason, converged, evaluations (a list of dicts), warnings."""


class Problem:
    """A scene with the choices of a run; what is None is as the scene says.

    parameters: names, or paths of numbers; formulation, method, integrator: by name, as in the tool; rtol, atol [-];
    t_end [s]; step [s] of fixed-step runs."""

    def __init__(self, scene, parameters=None, formulation=None, method=None, integrator=None, rtol=None, atol=None,
                 t_end=None, step=None):
        if not isinstance(scene, Scene):
            scene = load(scene)
        self._scene = scene
        self._choices = dict(parameters=None if parameters is None else list(parameters), formulation=formulation,
                             method=method, integrator=integrator, rtol=rtol, atol=atol, t_end=t_end, step=step)
        self._inner = _costate.Problem(scene._inner, self._choices)

    def __reduce__(self):  # for other processes
        return _remade, (self._scene, self._choices)

    @property
    def scene(self):
        return self._scene

    @property
    def parameters(self):
        """Names, in the order of all arrays of parameters."""
        return self._inner.parameters

    @property
    def values(self):
        """Values in the scene (p)."""
        return self._inner.values

    @property
    def lower(self):
        """Lower bounds (p), -inf where there is none."""
        return self._inner.lower

    @property
    def upper(self):
        """Upper bounds (p), inf where there is none."""
        return self._inner.upper

    @property
    def scale(self):
        """Typical sizes (p)."""
        return self._inner.scale

    @property
    def formulation(self):
        return self._inner.formulation

    @property
    def method(self):
        return self._inner.method

    @property
    def t_start(self):
        return self._inner.t_start

    @property
    def t_end(self):
        return self._inner.t_end

    def simulate(self, rho=None, times=None, outputs=None, confirm=True):
        """A run at the parameters rho (the scene's; a dict changes some): outputs (all) at increasing times (the scene's,
        or 500).

        Other runs, at other tolerances, confirm the motion, with a warning where it is not known as its tolerance claims;
        without `confirm` there is one run."""
        outputs = [outputs] if isinstance(outputs, str) else outputs
        run = Run(self._inner.simulate(self._rho(rho), _vector("times", times), outputs, confirm))
        _warn(run.warnings)
        return run

    def gradient(self, rho=None, method=None, estimate_error=False):
        """psi and its gradient at rho, by the problem's method or another one."""
        g = Gradient(self._inner.gradient(self._rho(rho), method or "", estimate_error))
        _warn(g.warnings)
        return g

    def value_and_gradient(self, rho):
        """(psi, gradient): what scipy.optimize.minimize(..., jac=True) asks for."""
        g = self.gradient(rho)
        return g.psi, g.gradient

    def hessian_product(self, direction, rho=None):
        """The Hessian of psi times a direction (p), or several (p x k), exactly."""
        import numpy
        if numpy.iscomplexobj(direction):
            raise TypeError("direction must be real numbers.")
        direction = numpy.asarray(direction, dtype=float)
        if not numpy.isfinite(direction).all():
            raise ValueError(f"direction must be finite numbers, found {direction!r:.100}.")
        columns = direction.reshape(len(direction), -1)
        return self._inner.hessian_product(columns, self._rho(rho)).reshape(direction.shape)

    def hessian(self, rho=None):
        """The Hessian of psi (p x p), exactly; where that is not offered by differences of gradients, with a warning
        that says so, why, and how far they are known. An exact one is taken at a tenth of rtol and held against a
        product at rtol itself, as in certificates: a warning says where it is known to no more than 1e-3 of its
        largest entry."""
        h = self._inner.hessian(self._rho(rho))
        _warn(h["warnings"])
        return h["matrix"]

    def optimize(self, callback=None, **settings):
        """The best parameters between their bounds, under the scene's constraints.

        callback sees each evaluation (a dict: index, parameters, psi, gradient, constraints, projected_gradient, failure);
        when it raises StopIteration the best so far is the result. settings: algorithm, max_evaluations, stop_value,
        relative_tolerance, gradient_tolerance."""
        optimum = Optimum(self._inner.optimize(callback, settings))
        _warn(optimum.warnings)
        return optimum

    def scene_at(self, rho):
        """The scene with the parameters rho written to its numbers."""
        return Scene(self._inner.scene_at(self._rho(rho)))

    def _rho(self, rho):
        if not isinstance(rho, dict):
            return _vector("rho", rho)
        unknown = [name for name in rho if name not in self.parameters]
        if unknown:
            raise KeyError(f"{unknown[0]!r} is no parameter of the problem: these are {', '.join(self.parameters)}.")
        return _vector("rho", [rho.get(name, value) for name, value in zip(self.parameters, self.values)])

    def __repr__(self):
        return f"<costate.Problem {self._scene.title or self._scene.file_name!r} in {', '.join(self.parameters)}>"


def _vector(name, x):
    """Numbers in a list; None stays."""
    import numpy
    if x is None:
        return None
    if numpy.iscomplexobj(x):
        raise TypeError(f"{name} must be real numbers: derivatives are exact, and no complex step is taken.")
    try:
        numbers = numpy.asarray(x, dtype=float)
    except (TypeError, ValueError):
        raise TypeError(f"{name} must be numbers in a list or an array of one dimension, found {x!r:.100}.") from None
    if numbers.ndim != 1:
        raise TypeError(f"{name} must have one dimension, found an array of shape {numbers.shape}.")
    return numbers.tolist()


def _remade(scene, choices):
    return Problem(scene, **choices)


def _words(name, scene, options):
    path = scene._inner.file_name if isinstance(scene, Scene) else str(scene)
    known = _costate.options_of(name)
    words = [name, path]
    for key, value in options.items():
        flag = "--" + key.replace("_", "-")
        if value is None or value is False:
            continue
        if value is True:
            words.append(flag)
        elif isinstance(value, (list, tuple)):
            words += [flag, ",".join(str(x) for x in value)]
        else:
            words += [flag, str(value)]
    if "no-files" in known and "output" not in options:
        words.append("--no-files")
    return words


def command(name, scene, **options):
    """What a command of the tool finds, as the dict of its summary: command("modes", scene, equilibrium=True).

    scene: a Scene or a path. Options are those of the tool with underscores; lists become values with commas, True a
    flag. Nothing is written unless `output` names a folder."""
    inner = scene._inner if isinstance(scene, Scene) else None
    return _json.loads(_costate.run_command(inner, _words(name, scene, options)))


def check(scene, **options):
    """Every formulation with every gradient method on a scene, each judged: the summary of `costate check`.

    check(scene, formulations=["index1", "baumgarte"], methods=["idas-adjoint"], no_motions=True)["disagreements"]"""
    return command("check", scene, **options)


def batch(function, items, processes=None):
    """[function(x) for x in items], by several processes (as many as there are cores). Scenes and problems can be
    handed to them; `function` is one of a module."""
    import concurrent.futures
    with concurrent.futures.ProcessPoolExecutor(max_workers=processes) as pool:
        return list(pool.map(function, items))
