"""The Python module: arrays, derivatives, errors with the tool's text, callbacks, Ctrl-C, other processes, stubs."""
import ast
import inspect
import json
import os
import pickle
import signal
import subprocess
import tempfile
import threading
import time
import unittest
import warnings

import numpy as np

import costate

MODELS = os.environ["COSTATE_MODELS"]
TOOL = os.environ["COSTATE_TOOL"]
FIVE_BAR = os.path.join(MODELS, "five_bar", "five_bar.toml")
PENDULUM = os.path.join(MODELS, "damped_pendulum", "damped_pendulum.toml")
DZHANIBEKOV = os.path.join(MODELS, "rigid_body", "dzhanibekov.toml")

BRISTLES = """
[gravity]
y_m_per_s2 = -9.81
[point.P]
x_m = 0
y_m = 0.4
vx_m_per_s = 1
[mass.P]
point = "P"
mass_kg = 0.5
[contact.floor]
point = "P"
law = "flores"
exponent = 2
stiffness_N_per_m_n = 5e3
restitution = 0.7
friction = "lugre"
friction_coefficient = 0.3
static_coefficient = 0.4
transition_velocity_m_per_s = 0.1
bristle_stiffness_per_m = 3000
bristle_damping_s_per_m = 2
[start]
given = ["P.x", "P.y"]
[run]
t_end_s = 0.6
rtol = 1e-8
parameters = ["y", "K", "mu", "vx"]
[parameter.y]
number = "point.P.y_m"
[parameter.K]
number = "contact.floor.stiffness_N_per_m_n"
[parameter.mu]
number = "contact.floor.friction_coefficient"
[parameter.vx]
number = "point.P.vx_m_per_s"
[[cost.running]]
kind = "square"
output = "floor.friction_force"
"""


def psi_at(problem_and_value):
    problem, value = problem_and_value
    return problem.gradient([value]).psi


def tool(*words):
    return subprocess.run([TOOL, *words], capture_output=True, text=True, check=False)


class Scenes(unittest.TestCase):
    def test_load_set_and_dump(self):
        scene = costate.load(FIVE_BAR, set={"run.rtol": 1e-9, "start.given": ["P2.x", "P2.y"]})
        self.assertIn("Five-bar", scene.title)
        self.assertEqual(scene["bar.A1.mass_kg"], costate.load(FIVE_BAR).numbers["bar.A1.mass_kg"])
        other = scene.set({"bar.A1.mass_kg": np.float64(3.5)})
        self.assertEqual(other["bar.A1.mass_kg"], 3.5)
        self.assertNotEqual(scene["bar.A1.mass_kg"], 3.5)
        self.assertEqual(costate.parse(other.dump(), FIVE_BAR).dump(), other.dump())
        self.assertIn("P2.x", scene.coordinates)
        self.assertIn("S1.length", scene.outputs)

    def test_set_changes_all_at_once(self):
        # Numbers of one parameter agree behind both changes, not between them.
        scene = costate.load(PENDULUM)
        both = ["spring.strut.stiffness_N_per_m", "spring.strut.damping_N_s_per_m"]
        first = {path: scene[path] for path in both}
        tied = costate.parse(
            scene.dump() + "\n[parameter.both]\nnumbers = %s\nfactors = %s\n"
            % (str(both).replace("'", '"'), list(first.values())), PENDULUM)
        other = tied.set({path: 1.1 * value for path, value in first.items()})
        self.assertAlmostEqual(other[both[1]], 1.1 * first[both[1]])

    def test_files_are_those_of_the_scenes_own_folder(self):
        text = """[point.P]
x_m = 0
y_m = 0
[mass.m]
point = "P"
mass_kg = 1
[data.d]
file = "d.csv"
[force.f]
point = "P"
x_N = { kind = "data", data = "d", column = "force" }
[start]
given = ["P.x", "P.y"]
[[cost.terminal]]
kind = "value"
output = "P.x"
[parameter.m]
number = "mass.m.mass_kg"
[run]
t_end_s = 1
parameters = ["m"]
"""
        here = os.getcwd()
        with tempfile.TemporaryDirectory() as top:
            for folder, force in (("own", 1), ("other", 100)):
                os.mkdir(os.path.join(top, folder))
                with open(os.path.join(top, folder, "d.csv"), "w", encoding="utf-8") as data:
                    data.write("t [s],force [N]\n0,%d\n1,%d\n" % (force, force))
            with open(os.path.join(top, "own", "s.toml"), "w", encoding="utf-8") as file:
                file.write(text)
            try:
                os.chdir(os.path.join(top, "own"))
                scene = costate.load("s.toml")
                written = costate.parse(text)
                os.chdir(os.path.join(top, "other"))
                saved = os.path.join(top, "other", "saved.toml")
                problem = costate.Problem(scene)
                scene.save(saved)
                for scene in (scene, written, scene.set({"mass.m.mass_kg": 1}), problem.scene_at(problem.values),
                              costate.load(saved), pickle.loads(pickle.dumps(scene)),
                              costate.parse(scene.dump(), "anywhere.toml"),
                              pickle.loads(pickle.dumps(problem)).scene_at([1])):
                    # x = F t^2/(2 m); with the other folder's data 50.
                    self.assertAlmostEqual(costate.Problem(scene).simulate().psi, 0.5, places=7)
            finally:
                os.chdir(here)

    def test_errors_are_those_of_the_tool(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "s.toml")
            with open(PENDULUM, encoding="utf-8") as good, open(path, "w", encoding="utf-8") as bad:
                bad.write(good.read().replace("stiffness_N_per_m", "stifness_N_per_m"))
            with self.assertRaises(costate.SceneError) as caught:
                costate.load(path)
            self.assertIsInstance(caught.exception, costate.Error)
            self.assertEqual(caught.exception.file, path)
            self.assertGreater(caught.exception.line, 20)
            told = " ".join(tool("simulate", path).stderr.split())
            self.assertIn(" ".join(str(caught.exception).split()), told)
        with self.assertRaisesRegex(costate.Error, "--formulation.*baumgarte"):
            costate.Problem(FIVE_BAR, formulation="baumgart")
        with self.assertRaisesRegex(costate.Error, "no command 'nope'"):
            costate.command("nope", FIVE_BAR)
        with self.assertRaisesRegex(costate.Error, "'parameters' is empty"):
            costate.Problem(FIVE_BAR, parameters=[])
        with self.assertRaisesRegex(costate.Error, "--rtol must be below 1"):
            costate.Problem(FIVE_BAR, rtol=2)
        with self.assertRaises(costate.Error):
            costate.Problem(FIVE_BAR).gradient([1.0])  # two parameters
        with self.assertRaisesRegex(costate.SceneError, "no output 'P9.x'. Did you mean"):
            costate.Problem(FIVE_BAR).simulate(outputs=["P9.x"])

    def test_numbers_that_no_scene_may_have(self):
        problem = costate.Problem(PENDULUM, parameters=["bar.rod.mass_kg"])
        good = problem.values
        for f in (problem.simulate, problem.gradient, problem.value_and_gradient, problem.hessian):
            with self.assertRaisesRegex(costate.Error, "must"):
                f(-good)
        self.assertEqual(problem.gradient(2 * good).psi, problem.gradient(2 * good).psi)
        with self.assertRaisesRegex(costate.Error, "max_evaluations"):
            problem.optimize(max_evaluations=0)

    def test_tables_and_arrays_as_values(self):
        scene = costate.load(PENDULUM).set({"gravity": {"x_m_per_s2": 0, "y_m_per_s2": -1.5}})
        self.assertEqual(scene["gravity.y_m_per_s2"], -1.5)


class Runs(unittest.TestCase):
    def test_a_simulation_is_the_tools(self):
        problem = costate.Problem(FIVE_BAR)
        run = problem.simulate()
        summary = json.loads(tool("simulate", FIVE_BAR, "--no-files", "--json").stdout)
        self.assertEqual(run.psi, summary["psi"])
        self.assertEqual(run.data.shape, (len(run.t), len(run.names)))
        self.assertEqual(run.units["P2.x"], "m")
        self.assertAlmostEqual(run["P2.x"][-1], summary["terminal"]["P2.x"], delta=1e-6)
        chosen = problem.simulate(times=[0, 1, 2.5], outputs=["S1.length", "time"])
        np.testing.assert_array_equal(chosen["time"], [0, 1, 2.5])
        self.assertEqual(chosen.names, ["S1.length", "time"])
        with self.assertRaises(KeyError):
            chosen["P2.x"]

    def test_a_simulation_is_confirmed(self):
        # An unstable rotation: at rtol 1e-4 it may be off by its whole range, and the tool says so.
        problem = costate.Problem(DZHANIBEKOV, rtol=1e-4)
        with warnings.catch_warnings(record=True):
            warnings.simplefilter("always")
            run, alone = problem.simulate(times=[1]), problem.simulate(times=[1], confirm=False)
        self.assertTrue(any("makes much of small errors" in w for w in run.warnings), run.warnings)
        self.assertFalse(alone.warnings)
        self.assertEqual(run.counters, alone.counters)
        summary = json.loads(tool("simulate", DZHANIBEKOV, "--rtol", "1e-4", "--no-files", "--json").stdout)
        self.assertEqual(run.psi_error, summary["psi_error"])

    def test_gradient_and_hessian(self):
        problem = costate.Problem(FIVE_BAR, rtol=1e-10)
        g = problem.gradient()
        summary = json.loads(tool("gradient", FIVE_BAR, "--rtol", "1e-10", "--no-files", "--json").stdout)
        self.assertEqual(list(g.gradient), list(summary["gradient"].values()))
        self.assertEqual(problem.parameters, list(summary["gradient"]))
        forward = problem.gradient(method="idas-forward")
        np.testing.assert_allclose(forward.gradient, g.gradient, rtol=1e-6)
        H = problem.hessian()
        np.testing.assert_allclose(H, H.T, rtol=1e-9)
        # Central differences of gradients: an error of h^2 times the third derivatives, of rtol / h; 1e-4 of the
        # entries is far above both.
        h = 1e-4
        for i in range(2):
            step = h * np.eye(2)[i]
            column = (problem.gradient(problem.values + step).gradient
                      - problem.gradient(problem.values - step).gradient) / (2 * h)
            np.testing.assert_allclose(problem.hessian_product(np.eye(2)[i]), column, rtol=1e-4, atol=1e-3)
            np.testing.assert_allclose(H[:, i], problem.hessian_product(np.eye(2)[i]), rtol=1e-5, atol=1e-6)

    def test_hessian_says_how_far_it_is_known(self):
        # Bristles turn round within a millionth of their transition velocity: at rtol 1e-8 a tenth of it changes more
        # than 1e-3 of the largest entry. A five-bar's is known far better.
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            costate.Problem(costate.parse(BRISTLES)).hessian()
        self.assertTrue(any("The Hessian is known to" in str(w.message) for w in caught), caught)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            costate.Problem(FIVE_BAR, rtol=1e-10).hessian()

    def test_optimize_and_callbacks(self):
        problem = costate.Problem(PENDULUM)
        seen = []
        best = problem.optimize(callback=lambda e: seen.append(e["psi"]))
        self.assertTrue(best.converged)
        self.assertAlmostEqual(best.parameters[0], 5.10735, places=4)
        self.assertEqual(len(seen), len(best.evaluations))
        # Of what differs by less than the runs' tolerance any may be the best.
        self.assertIn(best.psi, seen)
        self.assertLessEqual(best.psi, min(seen) + 1e-8 * abs(best.psi))
        self.assertEqual(problem.scene_at(best.parameters)["spring.strut.damping_N_s_per_m"], best.parameters[0])

        def until_third(e):
            if e["index"] == 3:
                raise StopIteration
        early = problem.optimize(callback=until_third)
        self.assertEqual(len(early.evaluations), 3)
        self.assertIn("callback", early.stop_reason)

        def broken(e):
            raise ZeroDivisionError("mine")
        with self.assertRaisesRegex(ZeroDivisionError, "mine"):
            problem.optimize(callback=broken)
        with self.assertRaises(TypeError):
            problem.optimize(gradient_tolerence=1e-3)
        self.assertEqual(len(problem.optimize(max_evaluations=2).evaluations), 2)

    def test_a_callback_may_run_other_problems(self):
        inner = costate.Problem(FIVE_BAR, t_end=0.1)
        found = []
        costate.Problem(PENDULUM).optimize(callback=lambda e: found.append(inner.gradient().psi), max_evaluations=2)
        self.assertEqual(found, [inner.gradient().psi] * 2)

    def test_commands_of_the_tool(self):
        j = costate.check(PENDULUM, formulations=["index1", "baumgarte"], methods=["idas-adjoint"], no_motions=True)
        self.assertEqual((j["status"], j["disagreements"], len(j["rows"])), ("ok", [], 2))
        scene = costate.load(FIVE_BAR).set({"bar.A1.mass_kg": 2.0})
        modes = costate.command("modes", scene, equilibrium=True)
        self.assertEqual(len(modes["modes"]), 2)
        self.assertNotEqual(modes["modes"], costate.command("modes", FIVE_BAR, equilibrium=True)["modes"])
        with self.assertRaisesRegex(costate.Error, "--no-such"):
            costate.command("simulate", FIVE_BAR, no_such=1)

    def test_warnings(self):
        problem = costate.Problem(os.path.join(MODELS, "flyball_governor", "flyball_governor.toml"),
                                  formulation="index1")
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            run = problem.simulate(outputs=["time"])
        self.assertTrue(run.warnings)
        self.assertTrue(issubclass(told[0].category, costate.RunWarning))
        self.assertEqual(str(told[0].message), run.warnings[0])

    def test_times_that_are_not_those_of_a_run_are_refused(self):
        problem = costate.Problem(FIVE_BAR, t_end=1)
        for times in ([0, 1.5], [-1, 0.5], [0.5, 0.2], [0.5, 0.5], [float("nan")]):
            with self.assertRaisesRegex(costate.Error, r"times\[\d\] is "):
                problem.simulate(times=times, outputs=["time"])

    def test_times_behind_an_event_that_ends_the_run(self):
        problem = costate.Problem(os.path.join(MODELS, "shortest_swing", "shortest_swing.toml"))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            run = problem.simulate(times=[0.1, 0.3], outputs=["time"])
            self.assertEqual(list(run.t), [0.1, 0.3])
            run = problem.simulate(times=[0.1, 4.5], outputs=["time"])
        self.assertEqual(list(run.t), [0.1])
        self.assertTrue(any("nothing at the times behind it" in text for text in run.warnings))

    def test_ctrl_c_ends_a_run(self):
        # Some 700,000 steps; index1 would end by its drift after a tenth of them.
        problem = costate.Problem(FIVE_BAR, formulation="baumgarte", t_end=5000)
        threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
        with self.assertRaises(KeyboardInterrupt):
            problem.simulate(times=[0], outputs=["time"])
        threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
        with self.assertRaises(KeyboardInterrupt):
            costate.check(costate.load(FIVE_BAR), t_end=5000)
        self.assertGreater(costate.Problem(FIVE_BAR).gradient().psi, 0)  # nothing stays behind

    def test_the_lock_is_free_while_a_run_goes(self):
        problem = costate.Problem(FIVE_BAR, formulation="index2", t_end=100)
        ticks = []
        worker = threading.Thread(target=problem.simulate, kwargs={"times": [0], "outputs": ["time"]})
        worker.start()
        while worker.is_alive():
            ticks.append(1)
            time.sleep(0.001)
        self.assertGreater(len(ticks), 5)

    def test_arguments_that_are_no_vectors(self):
        problem = costate.Problem(costate.load(PENDULUM))
        for times, told in (([[0, 0.1]], "one dimension, found an array of shape (1, 2)"), ({"t": 1}, "times must be numbers"),
                            ("now", "times must be numbers"), (0.1, "one dimension")):
            with self.assertRaisesRegex(TypeError, told.replace("(", r"\(").replace(")", r"\)")):
                problem.simulate(times=times)
        with self.assertRaisesRegex(TypeError, "rho must be real numbers"):
            problem.gradient([1 + 1e-30j] * len(problem.parameters))
        with self.assertRaisesRegex(ValueError, "direction must be finite"):
            problem.hessian_product([float("nan")] * len(problem.parameters))
        with self.assertRaisesRegex(TypeError, "rho must be numbers"):
            problem.gradient(["a"] * len(problem.parameters))
        with self.assertRaisesRegex(KeyError, "'none' is no parameter of the problem: these are "):
            problem.gradient({"none": 1})
        # By name, the others as the scene has them; one output by its name alone.
        name, values = problem.parameters[0], np.array(problem.values)
        values[0] *= 1.1
        self.assertEqual(problem.gradient({name: values[0]}).psi, problem.gradient(values).psi)
        run = problem.simulate(times=[0, 0.1])
        output = run.names[1]
        np.testing.assert_array_equal(problem.simulate(times=[0, 0.1], outputs=output)[output], run[output])

    def test_other_processes(self):
        problem = pickle.loads(pickle.dumps(costate.Problem(costate.load(PENDULUM).set({"bar.rod.mass_kg": 3}))))
        self.assertEqual(problem.scene["bar.rod.mass_kg"], 3)
        values = [1.0, 2.0, 4.0]
        found = costate.batch(psi_at, [(problem, v) for v in values], processes=2)
        self.assertEqual(found, [psi_at((problem, v)) for v in values])


class Stubs(unittest.TestCase):
    def test_every_public_name_is_in_the_stub(self):
        stub = os.path.join(os.path.dirname(costate.__file__), "__init__.pyi")
        with open(stub, encoding="utf-8") as file:
            tree = ast.parse(file.read())
        stubbed = {n.name: n for n in tree.body if isinstance(n, (ast.ClassDef, ast.FunctionDef))}
        self.assertEqual(set(costate.__all__) - set(stubbed), set())
        for name, node in stubbed.items():
            real = getattr(costate, name)
            if isinstance(node, ast.FunctionDef):
                self.assertEqual([a.arg for a in node.args.args],
                                 [p for p, k in inspect.signature(real).parameters.items() if k.kind != k.VAR_KEYWORD])
                continue
            for member in node.body:
                if isinstance(member, ast.FunctionDef):
                    self.assertTrue(hasattr(real, member.name), f"{name}.{member.name}")
            public = {m for m in vars(real) if not m.startswith("_")}
            self.assertEqual(public - {m.name for m in node.body if isinstance(m, ast.FunctionDef)}, set(), name)


if __name__ == "__main__":
    unittest.main(verbosity=2)
