"""Elements of users' own, each one file outside the package, from symbols to motion.

Public names only: `mstmm.derive`, `generate_file`, `Scene`, `compile`.  The store is a temporary
folder; every motion is compared with something that shares nothing with it.
"""

from __future__ import annotations

import pickle
import shutil
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import mstmm
from tests.support.paths import TESTS
from tests.support.user_elements.lagrange import lagrange_motion

Array = NDArray[np.float64]
Make = Callable[[str], None]
DEFINITIONS = TESTS / "support" / "user_elements" / "definitions"
GRAVITY = [0.3, -9.81, 0.2]
BODY: dict[str, Any] = {
    "name": "shank", "mass": 3.0, "center_of_mass": [0.02, -0.2, 0.05],
    "inertia": [0.05, 0.02, 0.06, 0.004, -0.003, 0.002],
}  # fmt: skip
XX, YY, ZZ, XY, XZ, YZ = BODY["inertia"]
TENSOR = {**BODY, "inertia": [[XX, XY, XZ], [XY, YY, YZ], [XZ, YZ, ZZ]]}


@pytest.fixture(scope="module", autouse=True)
def store(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """A kernel store of this module's own."""
    folder = tmp_path_factory.mktemp("kernels")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MSTMM_KERNELS", str(folder))
        yield folder


@pytest.fixture(scope="module")
def compile_definition(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], None]:
    """Generates a definition into the module's store, once."""
    folder = tmp_path_factory.mktemp("definitions")

    @cache
    def make(name: str) -> None:
        assert generate_definition(name, folder) == "compiled"

    return make


def generate_definition(name: str, folder: Path) -> str:
    """Generate a definition from a copy outside the repository; how it will run."""
    path = folder / f"my_{name}.py"
    shutil.copy(DEFINITIONS / f"{name}.py", path)
    begin = time.perf_counter()
    (made,) = mstmm.generate_file(path)
    print(f"{name}: {made.execution} after {time.perf_counter() - begin:.2f} s")
    assert made.spec.name == name
    return made.execution


def scene(hinge: dict[str, Any], **more: Any) -> mstmm.Scene:
    joint = {"name": "joint", "inboard": "ground", "outboard": "shank"} | hinge
    return mstmm.Scene(**({"gravity": GRAVITY, "body": [BODY], "hinge": [joint]} | more))


KNEE = {"type": "knee", "parameters": {"width": 0.06, "depth": 0.03, "slip": 0.4}}
WOBBLE = {"type": "wobble", "parameters": {"radius": 0.2, "pitch": 0.05}}
STARTS: dict[str, tuple[dict[str, Any], list[float], list[float]]] = {
    "knee": (KNEE, [0.7], [-0.5]),
    "wobble": (WOBBLE, [0.3, -0.4], [1.0, 2.0]),
    "pilot": ({"type": "pilot"}, [0.2, 0.4, -0.3], [1.0, -2.0, 0.5]),
}


def scene_at_start(name: str) -> mstmm.Scene:
    hinge, q, u = STARTS[name]
    return scene({**hinge, "initial": {"q": q, "u": u}})


def knee_motion(s: sp.Symbol) -> tuple[sp.Matrix, sp.Matrix]:
    """The tangent is the direction of the plate; what has rolled lies between contact and P."""
    width, depth, slip = 0.06, 0.03, 0.4
    length = sp.sqrt((width * sp.cos(s)) ** 2 + (depth * sp.sin(s)) ** 2)
    x, y = width * sp.cos(s) / length, depth * sp.sin(s) / length
    rotation = sp.Matrix([[x, -y, 0], [y, x, 0], [0, 0, 1]])
    rolled = (1 - slip) * (width + depth) / 2 * s
    place = [width * sp.sin(s) - rolled * x, -depth * sp.cos(s) - rolled * y, 0]
    return rotation, sp.Matrix(place)


def wobble_motion(turn: sp.Symbol, tilt: sp.Symbol) -> tuple[sp.Matrix, sp.Matrix]:
    c, s, b = sp.cos(turn), sp.sin(turn), tilt + sp.sin(turn) / 4
    about_z = sp.Matrix([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    about_x = sp.Matrix([[1, 0, 0], [0, sp.cos(b), -sp.sin(b)], [0, sp.sin(b), sp.cos(b)]])
    return about_z * about_x, sp.Matrix([0.2 * c, 0.2 * s, 0.05 * turn * sp.cos(tilt)])


@pytest.mark.parametrize("name", STARTS)
def test_a_model_with_such_a_hinge_can_be_pickled(name: str, compile_definition: Make) -> None:
    compile_definition(name)
    model = mstmm.compile(scene_at_start(name))
    again, (q, u) = pickle.loads(pickle.dumps(model)), model.initial_state()
    np.testing.assert_array_equal(again.accelerations(q, u), model.accelerations(q, u))


@pytest.mark.parametrize(("name", "motion"), [("knee", knee_motion), ("wobble", wobble_motion)])
def test_hinge_moves_as_lagrange_says(name: str, motion: Any, compile_definition: Make) -> None:
    compile_definition(name)
    _, q, u = STARTS[name]
    symbols = sp.symbols(f"q:{len(q)}", real=True)
    times = np.linspace(0.0, 1.5, 16)
    rotation, position = motion(*symbols)
    expected = lagrange_motion(rotation, position, symbols, TENSOR, GRAVITY, (q, u), times)
    model = mstmm.compile(scene_at_start(name))
    result = model.simulate(1.5, rtol=1e-11, atol=1e-13, output_times=times)
    assert result.success
    assert np.ptp(expected[:, 0]) > 0.2
    assert np.abs(result.q - expected).max() < 1e-8
    energy = result.energy()
    assert np.ptp(energy) < 1e-8 * np.abs(energy).max()


def test_own_speeds_move_as_euler_says(compile_definition: Make) -> None:
    """Angular momentum about the ground's point, with the rotation matrix itself as the state."""
    compile_definition("pilot")
    _, q, u = STARTS["pilot"]
    center, mass = np.array(BODY["center_of_mass"]), BODY["mass"]
    steiner = center @ center * np.eye(3) - np.outer(center, center)
    about = np.array(TENSOR["inertia"]) + mass * steiner

    def rate(_: float, y: Array) -> Array:
        turn, w = y[:9].reshape(3, 3), y[9:]
        moment = mass * np.cross(center, turn.T @ GRAVITY) - np.cross(w, about @ w)
        tilde = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
        return np.concatenate([(turn @ tilde).ravel(), np.linalg.solve(about, moment)])

    turn = Rotation.from_euler("ZYX", q).as_matrix()
    times = np.linspace(0.0, 0.6, 7)
    solved = solve_ivp(rate, (0, 0.6), [*turn.ravel(), *u], "DOP853", times, rtol=1e-12, atol=1e-13)
    result = mstmm.compile(scene_at_start("pilot")).simulate(0.6, rtol=1e-11, output_times=times)
    assert result.success
    assert np.abs(result.u - solved.y[9:].T).max() < 1e-8
    found = Rotation.from_euler("ZYX", result.q).as_matrix().reshape(-1, 9)
    assert np.abs(found - solved.y[:9].T).max() < 1e-8


@pytest.mark.parametrize("name", ["knee", "wobble", "pilot"])
def test_hinge_without_a_compiler(
    name: str, compile_definition: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compile_definition(name)
    library = mstmm.compile(scene_at_start(name))
    monkeypatch.setenv("MSTMM_KERNELS", str(tmp_path / "bare"))
    monkeypatch.setenv("CC", "/nonexistent")
    assert generate_definition(name, tmp_path).startswith("interpreted")
    interpreted = mstmm.compile(scene_at_start(name))
    rng = np.random.default_rng(5)
    q = rng.uniform(-0.9, 0.9, (40, library.nq))
    u = rng.uniform(-2, 2, (40, library.nu))
    expected = library.accelerations(q, u)
    assert np.abs(interpreted.accelerations(q, u) - expected).max() < 1e-11 * np.abs(expected).max()
    both = (library, interpreted)
    ends = [model.simulate(0.25, rtol=1e-10).q[-1] for model in both]
    assert np.abs(ends[0] - ends[1]).max() < 1e-10
    implicit = [model.simulate(0.25, rtol=1e-9, method="rodas5p").q[-1] for model in both]
    assert np.abs(implicit - ends[0]).max() < 1e-6
    assert np.abs(implicit[0] - implicit[1]).max() < 1e-10
    slopes = [model.derivatives(q[0], u[0]).q for model in (library, interpreted)]
    assert np.abs(slopes[0] - slopes[1]).max() < 1e-11 * np.abs(slopes[0]).max()


def check_derivatives(model: mstmm.Model, q: Array, u: Array) -> None:
    """Against differences of accelerations, and of models with other parameters."""
    names = [name for name in model.parameters if ".parameters." in name]
    found, step = model.derivatives(q, u, parameters=names), 1e-5
    along, memory = model.looped.accelerations, model.looped.start_memory()[None].copy()
    for k, unit in enumerate(np.eye(model.nu)):
        increment, _ = along(0.0, q[None].copy(), unit[None].copy(), memory)
        for column, dq, du in ((found.q, increment[0], 0 * u), (found.u, 0 * q, unit)):
            ahead, behind = (
                model.accelerations(q + sign * step * dq, u + sign * step * du) for sign in (1, -1)
            )
            wanted = (ahead - behind) / (2 * step)
            assert np.abs(column[:, k] - wanted).max() < 1e-7 * max(1, np.abs(found.q).max())
    for name in names:
        value = model.parameters[name]
        ahead, behind = (
            model.with_parameters({name: value + s}).accelerations(q, u) for s in (step, -step)
        )
        wanted = (ahead - behind) / (2 * step)
        assert np.abs(found.parameters[name] - wanted).max() < 1e-6 * max(1, np.abs(wanted).max())


@pytest.mark.parametrize("name", ["knee", "wobble", "pilot"])
def test_derivatives_of_a_hinge_by_its_own_numbers(name: str, compile_definition: Make) -> None:
    compile_definition(name)
    model = mstmm.compile(scene_at_start(name))
    q, u = model.initial_state()
    check_derivatives(model, q, u)
    if name == "pilot":  # increments are turns in body axes: dphi' = dw - w x dphi
        wx, wy, wz = u
        turning = [[0, wz, -wy], [-wz, 0, wx], [wy, -wx, 0]]
        found = model.derivatives(q, u)
        assert np.abs(found.rate_q - turning).max() < 1e-13
        assert np.abs(found.rate_u - np.eye(3)).max() < 1e-14


def test_force_element_presses_as_newton_says(compile_definition: Make) -> None:
    compile_definition("bushing")
    point = {"name": "ball", "mass": 2.0, "inertia": [0.1, 0.1, 0.1]}
    numbers = {"stiffness": 40.0, "cubic": 300.0, "damping": 0.7}
    anchor = np.array([0.1, 0.0, -0.05])
    place, speed = [0.3, 0.2, -0.1], [0.0, 1.0, 0.5]
    data = {
        "gravity": GRAVITY,
        "body": [point],
        "hinge": [{"name": "float", "type": "free", "inboard": "ground", "outboard": "ball",
                   "initial": {"q": [*place, 1, 0, 0, 0], "u": [*speed, 0, 0, 0]}}],
        "spring": [{"name": "rubber", "type": "bushing", "from": "ground", "to": "ball",
                    "position": list(anchor), "parameters": numbers}],
    }  # fmt: skip

    def rate(_: float, y: Array) -> Array:
        x = y[:3] - anchor
        force = -(40.0 + 300.0 * x @ x) * x - 0.7 * y[3:]
        return np.concatenate([y[3:], force / 2.0 + GRAVITY])

    times = np.linspace(0, 2, 9)
    start = [*place, *speed]
    solved = solve_ivp(rate, (0, 2), start, "DOP853", times, rtol=1e-12, atol=1e-13)
    result = mstmm.compile(mstmm.Scene(**data)).simulate(2.0, rtol=1e-11, output_times=times)
    assert result.success
    assert np.abs(result.position("ball") - solved.y[:3].T).max() < 1e-9
    x, v = solved.y[:3].T - anchor, solved.y[3:].T
    square = (x**2).sum(1)
    energy = (v**2).sum(1) + 20.0 * square + 75.0 * square**2 - 2 * solved.y[:3].T @ GRAVITY
    assert np.abs(np.diff(result.energy()) - np.diff(energy)).max() < 1e-8
    model = mstmm.compile(mstmm.Scene(**data))
    check_derivatives(model, *model.initial_state())


WHEEL = {"mass": 2.0, "across": 0.02, "along": 0.03, "wheel": 0.025, "spin": 400.0}


def gyroscope(**hinge: Any) -> mstmm.Scene:
    """A flywheel on a pivot 0.15 m from its mass centre, its axis level, at steady precession."""
    rotor = {
        "name": "rotor", "type": "flywheel", "parameters": WHEEL,
        "ends": {"pivot": {"position": [0, 0, -0.15], "orientation": [0.4, -0.7, 1.1]}},
    }  # fmt: skip
    joint = {"name": "pivot", "type": "ball", "inboard": "ground", "outboard": "rotor.pivot"}
    return mstmm.Scene(gravity=[0, 0, -9.81], body=[rotor], hinge=[joint | hinge])


def test_flywheel_precesses_as_euler_says(compile_definition: Make) -> None:
    """m g l = h Phi exactly, for an axis that is level and a body that does not turn about it."""
    compile_definition("flywheel")
    precession = 2.0 * 9.81 * 0.15 / (0.025 * 400.0)
    level = Rotation.from_euler("Y", np.pi / 2)  # body z along inertial x
    skew = Rotation.from_euler("ZYX", [1.1, -0.7, 0.4])  # pivot axes to body axes
    turn = level * skew
    x, y, z, w = turn.as_quat()
    spin = turn.inv().apply([0, 0, precession])
    model = mstmm.compile(gyroscope(initial={"q": [w, x, y, z], "u": list(spin)}))
    times = np.linspace(0, 10.0, 11)
    result = model.simulate(10.0, rtol=1e-11, output_times=times)
    assert result.success
    angle = precession * times
    expected = 0.15 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1)
    assert np.abs(result.position("rotor") - expected).max() < 1e-8
    assert np.ptp(result.energy()) < 1e-9
    force = 2.0 * np.array([0, 0, 9.81]) - 2.0 * precession**2 * expected
    assert np.abs(result.force("pivot") - force).max() < 1e-7


RIGID = """
import sympy as sp
from mstmm.derive import Body, Param

class Copy(Body):
    "Euler's equations about the mass centre, carried to the origin."
    name = "copy"
    parameters = (Param("m", "kg"), Param("cx", "m"), Param("cy", "m"), Param("cz", "m"),
                  *(Param(n, "kg*m^2") for n in ("xx", "yy", "zz", "xy", "xz", "yz")))

    def parts(self, p):
        tensor = sp.Matrix([[p.xx, p.xy, p.xz], [p.xy, p.yy, p.yz], [p.xz, p.yz, p.zz]])
        return sp.Matrix([p.cx, p.cy, p.cz]), tensor

    def residual(self, a, alpha, w, p):
        c, tensor = self.parts(p)
        force = p.m * (a + alpha.cross(c) + w.cross(w.cross(c)))
        return sp.Matrix.vstack(force, tensor * alpha + w.cross(tensor * w) + c.cross(force))

    def kinetic_energy(self, v, w, p):
        c, tensor = self.parts(p)
        center = v + w.cross(c)
        return p.m * center.dot(center) / 2 + (w.T * tensor * w)[0, 0] / 2
"""


def test_users_body_is_held_anywhere(tmp_path: Path, rng: np.random.Generator) -> None:
    """A rigid body stated by a user equals the built-in one at any end and hinge axis."""
    path = tmp_path / "copy_of_rigid.py"
    path.write_text(RIGID)
    mstmm.generate_file(path)
    ends = {
        "a": {"position": [0.3, -0.1, 0.2], "orientation": [0.3, 0.5, -1.2]},
        "b": {"position": [-0.2, 0.4, 0.1], "orientation": [1.3, -0.5, 0.2]},
    }
    numbers = dict(zip(("m", "cx", "cy", "cz", "xx", "yy", "zz", "xy", "xz", "yz"),
                       (3.0, *BODY["center_of_mass"], *BODY["inertia"]), strict=True))  # fmt: skip
    models = []
    for kind in (BODY, {"type": "copy", "parameters": numbers}):
        bodies = [{**kind, "name": name, "ends": ends} for name in ("one", "two", "three")]
        hinges = [
            {"name": "j1", "type": "pin", "axis": [1, 2, -1], "inboard": "ground",
             "outboard": "one.a"},
            {"name": "j2", "type": "ball", "inboard": "one.b", "outboard": "two.b",
             "orientation": [0.1, 0.2, 0.3]},
            {"name": "j3", "type": "universal", "axis": [1, 0, 1], "axis2": [0, 1, 0.2],
             "inboard": "two", "outboard": "three.a"},
        ]  # fmt: skip
        models.append(mstmm.compile(mstmm.Scene(gravity=GRAVITY, body=bodies, hinge=hinges)))
    q, u = rng.uniform(-1, 1, (20, models[0].nq)), rng.uniform(-2, 2, (20, models[0].nu))
    one, two = (model.accelerations(q, u) for model in models)
    assert np.abs(one - two).max() < 1e-11 * np.abs(one).max()
    by_rows = mstmm.compile(models[1].scene, sweep="qr").accelerations(q, u)
    assert np.abs(one - by_rows).max() < 1e-11 * np.abs(one).max()
    energies = []
    for model in models:
        q0 = np.array([0.2, 1, 0, 0, 0, 0.3, -0.4])
        result = model.simulate(0.2, rtol=1e-10, initial=(q0, u[0]))
        energies.append(result.energy()[0])
        assert np.ptp(result.energy()) < 1e-7
    assert energies[0] == pytest.approx(energies[1], rel=1e-12)
