"""Which hinge of a loop is cut changes nothing: it keeps its coordinates, law, drive and loads."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.reference.compare import worst
from tests.reference.expressions import drive
from tests.reference.jets import Array
from tests.support import planar_four_bar as planar
from tests.support.models import compile_scene
from tests.support.scenes.linkages import OBLIQUE, bricard, four_bar, legs

#: Something in every hinge of the four-bar.
LAWS: dict[str, dict[str, Any]] = {
    "foot": {"effort": 4.0, "inertia": 0.02, "damping": 0.05},
    "knee": {"stiffness": 6.0, "rest": -0.3, "damping": 0.1, "inertia": 0.03},
    "tip": {"stiffness": 3.0, "rest": 0.8, "effort": -0.7, "inertia": 0.01,
            "friction": {"coulomb": 0.4, "regularisation_velocity": 0.2}},
    "end": {"damping": 0.2, "stiffness": 2.0, "rest": 1.5, "inertia": 0.05,
            "friction": {"coulomb": 0.3, "regularisation_velocity": 0.1}},
}  # fmt: skip
SPEED = 2.0


def signs(cut: str) -> Array:
    """Of the coordinates of foot, knee, tip and end: hinges behind the cut one are turned round."""
    knee = -1.0 if cut == "foot" else 1.0
    tip = -1.0 if cut in ("foot", "knee") else 1.0
    return np.array([1.0, knee, tip, 1.0])


@pytest.mark.parametrize("tilt", [(0.0, 0.0, 0.0), OBLIQUE])
@pytest.mark.parametrize("cut", planar.NAMES)
def test_any_hinge_of_a_four_bar(cut: str, tilt: tuple[float, float, float]) -> None:
    """Springs, dampers, a motor, friction, rotors in all hinges; in the plane and across."""
    model = compile_scene(four_bar(speed=SPEED, cut=cut, laws=LAWS, tilt=tilt))
    assert model.loops.cut_hinges == (cut,)
    found, rates = planar.start(0.9, SPEED)
    q, u = model.initial_state()
    assert worst(signs(cut) * q, planar.HINGES @ found) < 1e-12
    assert worst(signs(cut) * u, planar.HINGES @ rates) < 1e-12
    wanted = planar.HINGES @ planar.accelerations(found, rates, LAWS)
    assert worst(signs(cut) * model.accelerations(q, u), wanted) < 1e-11


@pytest.mark.parametrize("cut", ["foot", "tip"])
def test_any_hinge_of_a_four_bar_over_time(cut: str) -> None:
    """3 s, against the planar equations by SciPy."""
    times = np.linspace(0.0, 3.0, 7)
    model = compile_scene(four_bar(speed=SPEED, cut=cut, laws=LAWS, tilt=OBLIQUE))
    result = model.simulate(3.0, "dop853", rtol=1e-11, atol=1e-12, output_times=times)
    assert result.success, result.message
    found, rates = planar.motion(0.9, SPEED, LAWS, times)
    assert worst(signs(cut) * result.q, found @ planar.HINGES.T) < 1e-9
    assert worst(signs(cut) * result.u, rates @ planar.HINGES.T) < 1e-9


@pytest.mark.parametrize("cut", planar.NAMES)
def test_a_driven_crank(cut: str) -> None:
    """The effort of the drive is that of the planar equations, its pin in the tree or cut."""
    text = "0.9 + 0.3*sin(2*t) + 0.8*t"
    laws = {name: LAWS[name] for name in ("knee", "tip", "end")}
    scene = four_bar(cut=cut, laws=laws)
    foot = next(hinge for hinge in scene["hinge"] if hinge["name"] == "foot")
    del foot["initial"]
    model = compile_scene(scene | {
        "hinge": [hinge | ({"drive": text} if hinge is foot else {}) for hinge in scene["hinge"]]
    })  # fmt: skip
    angle, speed, turn = drive(text, 0.0)
    found, rates = planar.start(angle, speed)
    result = model.simulate(0.0)
    assert result.success, result.message
    assert worst(signs(cut) * result.u[0], planar.HINGES @ rates) < 1e-12
    wanted = planar.effort_of_crank(found, rates, turn, laws)
    assert abs(result.quantity("foot.effort").values[0] - wanted) < 1e-11 * abs(wanted)


def test_any_hinge_of_a_bricard_ring() -> None:
    """At rest along the cube: power of the weights per speed over inertia per speed squared.

    The one motion turns neighbouring pins at one rate, in two senses; links by sums of these.
    """
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, -1, 0], [1, -1, 1], [0, -1, 1], [0, 0, 1]])
    spin, speed, inertia, power = np.zeros(3), np.zeros(3), 0.0, 0.0
    for k in range(5):
        spin = spin + (-1) ** k * np.roll([0, 1, 0], k)
        along = corners[k + 1] - corners[k]
        center = speed + np.cross(spin, along / 2)
        speed = speed + np.cross(spin, along)
        inertia += 10 * center @ center + 10 / 12 * (spin @ spin - (along @ spin) ** 2)
        power += 10 * -9.81 * center[1]
    assert np.abs(speed).max() < 1e-15
    pins = np.arange(6)
    for cut in range(6):
        model = compile_scene(bricard(cut))
        assert model.loops.cut_hinges == (f"pin{cut}",)
        udot = model.accelerations(*model.initial_state())
        turned_round = (pins > cut) | (pins == 5)
        signs = (-1.0) ** (pins + turned_round)
        assert np.abs(udot - signs * power / inertia).max() < 1e-11


def test_any_leg_carries_the_platform() -> None:
    """Five of six legs close loops, by balls; whichever, the platform and all legs move alike."""
    scene = legs(law=4e4)
    push = next(hinge for hinge in scene["hinge"] if hinge["name"] == "slide1")
    push["law"]["effort"] = 300.0
    found = []
    for first in (0, 3):
        for hinge in scene["hinge"]:
            if hinge["type"] == "ball":
                hinge["cut"] = hinge["name"] != f"head{first}"
        model = compile_scene(scene)
        assert set(model.loops.cut_hinges) == {f"head{k}" for k in range(6) if k != first}
        assert (model.loops.rank, model.loops.mobility) == (15, 6)
        udot = model.accelerations(*model.initial_state())
        slides = [udot[model.coordinate_layout.hinges[f"slide{k}"].u] for k in range(6)]
        found.append([*model.simulate(0.0).acceleration("platform")[0], *slides])
    assert np.abs(found[0]).max() > 1.0
    assert worst(found[1], found[0]) < 1e-11
