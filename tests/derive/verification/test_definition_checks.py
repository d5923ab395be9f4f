"""Wrong definitions, files and numbers: one clear message that names the equation, no traceback."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import mstmm

HEAD = """
import math, sys
import numpy, sympy as sp
from mstmm.derive import Body, ForceElement, Hinge, Param, rotation_about
"""
HINGE = """
class Mine(Hinge):
    name = "mine"
    coordinates = (Param("a", "rad"),)
    parameters = (Param("r", "m", minimum=0.1),)
    def rotation(self, q, p): return ROTATION
    def position(self, q, p): return POSITION
"""
BODY = """
class Mine(Body):
    name = "mine"
    parameters = (Param("m", "kg"),)
    def residual(self, a, alpha, w, p): return RESIDUAL
    def kinetic_energy(self, v, w, p): return ENERGY
"""
FORCE = """
class Mine(ForceElement):
    name = "mine"
    parameters = (Param("k", "N/m"),)
    def wrench(self, x, v, rotation, w, p, effort, t): return WRENCH
    def potential(self, x, p): return POTENTIAL
"""
INDENT = "\n    "


def hinge(
    rotation: str = "rotation_about(2, q.a)", position: str = "sp.zeros(3, 1)", *more: str
) -> str:
    text = HINGE.replace("ROTATION", rotation).replace("POSITION", position)
    return HEAD + text + "".join(INDENT + line for line in more)


def hinge_with_position(entry: str) -> str:
    """A hinge whose position has this first entry."""
    return hinge(position=f"sp.Matrix([{entry}, 0, 0])")


def hinge_with_lines(*more: str) -> str:
    """A hinge about z with more lines in its class."""
    return hinge("rotation_about(2, q.a)", "sp.zeros(3, 1)", *more)


def body(
    residual: str = "sp.Matrix.vstack(p.m * a, sp.zeros(3, 1))", energy: str = "p.m * v.dot(v) / 2"
) -> str:
    return HEAD + BODY.replace("RESIDUAL", residual).replace("ENERGY", energy)


def force(wrench: str = "(-p.k * x, sp.zeros(3, 1))", potential: str = "p.k * x.dot(x) / 2") -> str:
    return HEAD + FORCE.replace("WRENCH", wrench).replace("POTENTIAL", potential)


def hinge_source(what: str, text: str) -> str:
    """A hinge with one class attribute of its own."""
    lines = f"class Mine(Hinge):\n    name = 'mine'\n    {what} = {text}\n"
    return HEAD + lines + "    def rotation(self, q, p): return rotation_about(2, q[0])\n"


WRONG: dict[str, tuple[str, str]] = {
    # its place in a scene
    "frame": (
        hinge_with_lines("frame_rule = 'sideways'"),
        "frame_rule: expected one of .*found 'sideways'",
    ),
    "keys": (
        hinge_with_lines("scene_keys = ('axis3',)"),
        "scene_keys: expected a tuple of axis, axis2, lead, found",
    ),
    "one axis": (
        hinge_with_lines("frame_rule = 'crossing'"),
        'frame_rule "crossing" needs axis2 among the scene_keys',
    ),
    "no lead": (
        hinge_with_lines("scene_keys = ('axis', 'lead')"),
        "scene_keys: lead is not a declared parameter",
    ),
    "no angle": (
        hinge_with_lines("frame_rule, scene_keys, parameters = 'crossing', ('axis', 'axis2'), ()"),
        "first parameter is the angle between the axes",
    ),
    # motion
    "rank": (hinge("rotation_about(2, 0 * q.a)"), "motion subspace H loses rank"),
    "stretch": (
        hinge("2 * rotation_about(2, q.a)"),
        r"rotation\(q, p\) is not a rotation: .R\^T R",
    ),
    "mirror": (hinge("sp.diag(1, 1, -1)"), "det R = -1"),
    "subspace": (
        hinge_with_lines("def motion_subspace(self, q, p): return sp.Matrix([0, 0, 0, 0, 0, 2])"),
        r"motion_subspace\(q, p\) disagrees .* entry \(6, 1\): stated 2, derived 1",
    ),
    "subspace shape": (
        hinge_with_lines("def motion_subspace(self, q, p): return sp.eye(3)"),
        r"motion_subspace\(q, p\) is 3 x 3, expected 6 x 1",
    ),
    "bias": (
        hinge(
            "rotation_about(2, q.a)",
            "sp.Matrix([p.r * sp.cos(q.a), 0, 0])",
            "def bias_acceleration(self, q, u, p): return sp.zeros(6, 1)",
        ),
        r"bias_acceleration\(q, u, p\) disagrees .* stated 0, derived",
    ),
    # expressions
    "undefined function": (
        hinge_with_position("p.r * sp.Function('g')(q.a)"),
        "unknown function g",
    ),
    "no such function": (
        hinge_with_position("p.r * sp.erf(q.a)"),
        "unknown function erf; expected one of abs, acos",
    ),
    "integral": (
        hinge_with_position("p.r * sp.Integral(sp.sin(q.a), q.a)"),
        "unknown function Integral",
    ),
    "not a number": (
        hinge_with_position("sp.nan * p.r"),
        r"position\(q, p\) must be finite, found nan",
    ),
    "infinite": (hinge_with_position("sp.oo"), r"position\(q, p\) must be finite, found oo"),
    "division by zero": (hinge_with_position("p.r / 0"), "must be finite, found zoo"),
    "imaginary": (hinge_with_position("p.r * sp.I"), "must be real, found the imaginary unit"),
    "complex": (
        hinge_with_position("p.r * sp.sqrt(-1 - q.a**2)"),
        r"position\(q, p\): .*no finite real value, at q_a",
    ),
    "open piecewise": (hinge_with_position("sp.Piecewise((p.r, q.a > 0))"), "without a last case"),
    "strange symbol": (
        hinge_with_position("p.r * sp.Symbol('z')"),
        r"position\(q, p\) contains z; expected only q, p",
    ),
    "math": (hinge_with_position("p.r * math.sin(q.a)"), "take functions from sympy"),
    "numpy": (hinge_with_position("p.r * numpy.sin(q.a)"), "take functions from sympy"),
    "wrong name": (
        hinge("rotation_about(2, q.angle)"),
        r"rotation\(q, p\) failed with AttributeError: 'angle' is not declared; declared names: a",
    ),
    "wrong parameter": (hinge_with_position("p.R"), "'R' is not declared; declared names: r"),
    "wrong index": (hinge("rotation_about(2, q[4])"), r"rotation\(q, p\) failed with IndexError"),
    "no return": (hinge("None"), r"rotation\(q, p\) returns nothing"),
    "text": (hinge(position="'here'"), r"position\(q, p\) must be a matrix .* found 'here'"),
    "number": (hinge(position="3"), r"position\(q, p\) must be a matrix .* found 3"),
    "shape": (hinge("sp.eye(2)"), r"rotation\(q, p\) must be 3 x 3, found 2 x 2"),
    "signature": (
        HEAD + "class Mine(Hinge):\n    name = 'mine'\n    def rotation(self, q): return 1",
        r"rotation\(q, p\) failed with TypeError",
    ),
    # units
    "length from angle": (
        hinge_with_position("q.a"),
        r"entry \(1, 1\) of position\(q, p\) = q_a: expected m",
    ),
    "sum": (hinge_with_position("p.r + p.r**2"), "adds m and m|adds m.2 and m"),
    "sine of a length": (
        hinge_with_position("p.r * sp.sin(p.r)"),
        "sin.* expects a pure number, found m",
    ),
    "unit": (
        hinge_source("parameters", "(Param('r', 'furlong'),)"),
        "unknown unit 'furlong'; use m, kg",
    ),
    "no unit": (hinge_source("parameters", "(Param('r', 3),)"), "unit of r: expected text such as"),
    # speeds
    "speeds": (
        hinge_with_lines("speeds = (Param('w', 'rad/s'), Param('z', 'rad/s'))"),
        "1 coordinates but 2 speeds; state qdot",
    ),
    "many speeds": (
        hinge_with_lines(
            "speeds = tuple(Param(f'w{i}', 'rad/s') for i in range(7))",
            "def coordinate_rates(self, q, u, p): return sp.Matrix([u[0]])",
        ),
        "at most six",
    ),
    "rates shape": (
        hinge_with_lines("def coordinate_rates(self, q, u, p): return [u[0], u[0]]"),
        "must be 1 x 1, found 2",
    ),
    "rates squared": (
        hinge_with_lines("def coordinate_rates(self, q, u, p): return [u[0]**2]"),
        "must be linear in u",
    ),
    "rates offset": (
        hinge_with_lines("def coordinate_rates(self, q, u, p): return [u[0] + 1]"),
        "must vanish with u",
    ),
    "rates unit": (
        hinge_with_lines("def coordinate_rates(self, q, u, p): return [p.r * u[0]]"),
        "expected rad/s, found m",
    ),
    "rates raise": (
        hinge_with_lines("def coordinate_rates(self, q, u, p): return 1 / 0"),
        r"coordinate_rates\(q, u, p\) failed with ZeroDivisionError",
    ),
    # declarations
    "built in": (hinge().replace('"mine"', '"pin"'), "hinge 'pin' is built in"),
    "built in law": (hinge().replace('"mine"', '"elastic"'), "hinge 'elastic' is built in"),
    "blank": (hinge().replace('"mine"', '"my hinge"'), "'my hinge' is not a name"),
    "accent": (hinge().replace('"mine"', '"charnière"'), "is not a name"),
    "path": (hinge().replace('"mine"', '"../mine"'), "is not a name"),
    "long name": (hinge().replace('"mine"', '"k" * 300'), "is not a name: at most 60"),
    "twice": (
        hinge_source("coordinates", "(Param('a', 'rad'), Param('a', 'rad'))"),
        "'a' is declared twice",
    ),
    "plain text": (hinge_source("coordinates", "('a',)"), "coordinates: expected a tuple such as"),
    "one": (
        hinge_source("coordinates", "Param('a', 'rad')"),
        "coordinates: expected a tuple such as",
    ),
    "name of a coordinate": (
        hinge_source("coordinates", "(Param('a b', 'rad'),)"),
        "'a b' is not a name",
    ),
    "bound": (
        hinge_source("parameters", "(Param('r', 'm', minimum=math.nan),)"),
        "minimum: expected a number",
    ),
    "bounds": (
        hinge_source("parameters", "(Param('r', 'm', minimum=3, maximum=1),)"),
        "minimum <= default",
    ),
    "default": (
        hinge_source("parameters", "(Param('r', 'm', default=1, minimum=2),)"),
        "minimum <= default",
    ),
    # bodies
    "not linear": (
        body("sp.Matrix.vstack(p.m * a * a[0], sp.zeros(3, 1))"),
        "not linear in a and alpha",
    ),
    "residual shape": (body("p.m * a"), "must be 6 x 1, found 3 x 1"),
    "no residual": (HEAD + "class Mine(Body):\n    name = 'mine'\n", "residual.* is missing"),
    "masses": (body(energy="p.m * v.dot(v)"), "state different masses"),
    "gyroscopic": (
        body("sp.Matrix.vstack(p.m * a, sp.Matrix([p.m * w[0]**2, 0, 0]))"),
        "power of residual.* is not the rate of kinetic_energy",
    ),
    "force in m/s2": (
        body("sp.Matrix.vstack(a, sp.zeros(3, 1))", "v.dot(v) / 2"),
        "the force of residual = a_x: expected N",
    ),
    "no energy": (body(energy="None"), r"kinetic_energy\(v, w, p\) returns nothing"),
    "energy as matrix": (body(energy="sp.eye(2)"), "must be one expression"),
    "rigid": (body().replace('"mine"', '"rigid"'), "body 'rigid' is built in"),
    # force elements
    "one matrix": (force("-p.k * x"), "must return two 3 x 1 matrices, force and moment"),
    "no wrench": (force("None"), "must return two 3 x 1 matrices"),
    "wrench shape": (force("(sp.eye(2), sp.zeros(3, 1))"), "must return two 3 x 1 matrices"),
    "wrench unit": (force("(-p.k * v, sp.zeros(3, 1))"), "the force of wrench = .*expected N"),
    "potential unit": (force(potential="p.k"), "potential = p_k: expected J"),
    "potential of v": (
        force(potential="p.k * sp.Symbol('v_1')"),
        r"potential\(x, p\) contains v_1",
    ),
    "spring": (force().replace('"mine"', '"spring"'), "force 'spring' is built in"),
    # files
    "raises": (
        "raise RuntimeError('so it is')",
        "running the file failed with RuntimeError: so it is",
    ),
    "leaves": ("import sys; sys.exit(3)", "running the file failed with SystemExit: 3"),
    "no element": (HEAD + "x = 3", "defines no element; subclass"),
    "empty": ("", "defines no element; subclass"),
    "no Python": ("class Mine(", "running the file failed with SyntaxError"),
    "null": ("\0\0", "expected Python text, found null bytes; save the file as UTF-8"),
    "name": (HEAD + "class Mine(Hinge):\n    name = 3\n", "name: expected text"),
    "arguments": (
        HEAD + "class Mine(Hinge):\n    name = 'mine'\n    def __init__(self, a): ...\n",
        r"Mine: Mine\(\) raises TypeError.*callable without arguments",
    ),
    "same name": (
        hinge() + "\nclass Other(Mine):\n    name = 'mine'\n",
        "defines hinge 'mine' twice",
    ),
}


@pytest.fixture(autouse=True)
def store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("MSTMM_KERNELS", str(tmp_path / "kernels"))
    return tmp_path / "kernels"


@pytest.mark.parametrize("case", WRONG)
def test_wrong_definition_is_refused(case: str, tmp_path: Path, store: Path) -> None:
    text, message = WRONG[case]
    path = tmp_path / "mine.py"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(mstmm.ElementError, match=message) as caught:
        mstmm.generate_file(path)
    assert "\n" not in str(caught.value)
    assert not list(store.glob("*"))


ACCEPTED = {
    "lists": hinge(
        "[[sp.cos(q.a), -sp.sin(q.a), 0], [sp.sin(q.a), sp.cos(q.a), 0], [0, 0, 1]]",
        "[p.r * sp.sin(q.a), 0, 0]",
    ),
    "arrays": hinge("numpy.eye(3)", "numpy.array([p.r * q.a, 0, 0])"),
    "piecewise": hinge_with_position("sp.Piecewise((p.r * q.a**2, q.a > 0), (0, True))"),
    "list of parameters": hinge_source("coordinates", "[Param('a', 'rad')]"),
    "body": body(),
    "force": force("([-p.k * x[0], 0, 0], [0, 0, 0])"),
}


@pytest.mark.parametrize("case", ACCEPTED)
def test_other_ways_to_write_it_are_accepted(case: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.py"
    path.write_text(ACCEPTED[case], encoding="utf-8")
    assert [made.spec.name for made in mstmm.generate_file(path)] == ["mine"]


def _folder(path: Path) -> Path:
    path.mkdir()
    return path


def _binary(path: Path) -> Path:
    path.write_bytes(bytes(range(256)) * 4)
    return path


def _utf_16(path: Path) -> Path:
    path.write_text(hinge(), encoding="utf-16")
    return path


def _toml(path: Path) -> Path:
    target = path.with_suffix(".toml")
    target.write_text("a = 1")
    return target


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda path: path, "no such file"),
        (_folder, "no such file"),
        (_binary, "expected Python text, found null bytes"),
        (_utf_16, "expected Python text, found null bytes; save the file as UTF-8"),
        (_toml, r'expected a Python file \(".py"\)'),
    ],
)
def test_wrong_file_is_refused(make: Callable[[Path], Path], message: str, tmp_path: Path) -> None:
    path = make(tmp_path / "mine.py")
    with pytest.raises(mstmm.ElementError, match=re.escape(str(path)) + ".*" + message):
        mstmm.generate_file(path)


def test_what_is_no_element_is_not_registered() -> None:
    for wrong in (3, int, None):
        with pytest.raises(
            mstmm.ElementError, match=r"expected a subclass of mstmm\.derive\.Hinge"
        ):
            mstmm.register(wrong)  # type: ignore[arg-type]


# --- numbers in a scene -----------------------------------------------------------------------


def crank(parameters: dict[str, Any]) -> dict[str, Any]:
    rod = {"name": "rod", "mass": 1.0, "center_of_mass": [0.1, 0, 0], "inertia": [0.1, 0.1, 0.1]}
    joint = {"name": "joint", "type": "mine", "inboard": "ground", "outboard": "rod"}
    return {"gravity": [0, -9.81, 0], "body": [rod], "hinge": [joint | {"parameters": parameters}]}


CRANK = hinge_source(
    "parameters",
    "(Param('r', 'm', 'throw', minimum=0.1, maximum=2), Param('s', 'm', default=0.5, minimum=0))"
    "\n    coordinates = (Param('a', 'rad'),)"
    "\n    def position(self, q, p): return [p.r * sp.cos(q.a) + p.s, 0, 0]",
)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({}, r'hinge "joint": parameters.r: missing; expected a number in m \(throw\)'),
        ({"r": 0.01}, r'hinge "joint": parameters.r: expected 0.1 m or more, found 0.01'),
        ({"r": 5}, "expected 2 m or less, found 5"),
        ({"r": 1, "s": -1}, "expected 0 m or more, found -1"),
        ({"r": 1, "t": 2}, 'has no parameter "t"'),
        ({"r": float("nan")}, "parameters.r: expected"),
        ({"r": float("inf")}, "parameters.r: expected"),
        ({"r": "wide"}, "parameters.r: expected"),
        ({"r": None}, "parameters.r: expected"),
    ],
)
def test_wrong_numbers_are_refused(
    parameters: dict[str, Any], message: str, tmp_path: Path
) -> None:
    path = tmp_path / "mine.py"
    path.write_text(CRANK)
    mstmm.generate_file(path)
    with pytest.raises(mstmm.SceneError, match=message):
        mstmm.compile(mstmm.Scene(**crank(parameters)))


def test_defaults_are_filled_in_and_bounds_kept(tmp_path: Path) -> None:
    path = tmp_path / "mine.py"
    path.write_text(CRANK)
    mstmm.generate_file(path)
    one, two = (
        mstmm.compile(mstmm.Scene(**crank({"r": 0.7, **more}))) for more in ({}, {"s": 0.5})
    )
    assert one.accelerations([0.3], [1.0]) == two.accelerations([0.3], [1.0])
    assert one.parameters["joint.parameters.r"] == 0.7
    with pytest.raises(mstmm.SceneError, match=r"parameters\.r: expected 0\.1 m or more"):
        one.with_parameters({"joint.parameters.r": 0.01})
    other = one.with_parameters({"joint.parameters.r": 0.4})
    assert other.accelerations([0.3], [1.0]) != one.accelerations([0.3], [1.0])


def test_unknown_type_says_how_to_make_it_known() -> None:
    with pytest.raises(mstmm.SceneError, match='unknown hinge type "mine"'):
        mstmm.compile(mstmm.Scene(**crank({})))


def test_damaged_store_says_so(tmp_path: Path, store: Path) -> None:
    path = tmp_path / "mine.py"
    path.write_text(CRANK)
    (made,) = mstmm.generate_file(path)
    (made.folder / "element.json").write_text("{}")
    with pytest.raises(mstmm.ElementError, match=r"is damaged .*regenerate it"):
        mstmm.compile(mstmm.Scene(**crank({"r": 1.0})))
