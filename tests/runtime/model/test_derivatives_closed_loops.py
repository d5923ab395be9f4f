"""Exact derivatives of accelerations of mechanisms, along motions that keep loops closed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from tests.reference.compare import worst
from tests.reference.jets import Array
from tests.runtime.linear.test_constrained_linearisation import LAWS as SPRINGS
from tests.runtime.packing.test_expansion import LAWS
from tests.support.models import compile_scene
from tests.support.scenes.linkages import OBLIQUE, bricard, four_bar

STEP = 1e-5


def ways(model: mstmm.Model, q: Array) -> Array:
    """All speeds for a unit of the first, by inverse masses of a mechanism with one motion."""
    column = model.solve(q, np.eye(model.nu)[0])
    return np.asarray(column / column[0])


def ring() -> dict[str, Any]:
    """Bricard's ring beside the pose in which its axes are those of the ground."""
    scene = bricard()
    scene["hinge"][0] |= {"initial": {"q": 0.4}, "hold": True}
    return scene


@pytest.mark.parametrize(
    "scene", [four_bar(laws=LAWS, tilt=OBLIQUE), ring()], ids=["four-bar", "bricard"]
)
def test_along_closed_motions(scene: dict[str, Any]) -> None:
    """By central differences between states in which loops and speeds fit, at some speed."""
    model = compile_scene(scene)
    q, speed = model.initial_state()[0], 1.7
    found = model.derivatives(q, speed * ways(model, q))

    def displaced_state(size: float) -> tuple[Array, Array, Array]:
        moved = model.assemble(q + size * ways(model, q))[0]
        u = speed * ways(model, moved)
        return moved, u, model.accelerations(moved, u)

    forward, back = displaced_state(STEP), displaced_state(-STEP)
    d_q, d_u, wanted = (a - b for a, b in zip(forward, back, strict=True))
    assert worst(found.q @ d_q + found.u @ d_u, wanted) < 1e-6
    assert worst(found.udot, model.accelerations(q, speed * ways(model, q))) < 1e-11
    assert worst(found.efforts, model.solve(q, np.eye(model.nu))) < 1e-11


def test_by_numbers_of_the_scene() -> None:
    model = compile_scene(four_bar(speed=1.0, laws=LAWS))
    q, u = model.initial_state()
    names = ["coupler.mass", "tip.law.stiffness[0]", "gravity[1]"]
    found = model.derivatives(q, u, parameters=names).parameters
    for name in names:
        value = model.parameters[name]
        sides = [
            model.with_parameters({name: value + s}).accelerations(q, u) for s in (STEP, -STEP)
        ]
        assert worst(found[name], (sides[0] - sides[1]) / (2 * STEP)) < 1e-7


def test_by_rotors() -> None:
    """Of hinges that stay in the tree, and of one that is cut and has a rotor: by differences.  The
    first rotor on a cut hinge has none, whether somebody chose the cut or not."""
    cut = compile_scene(four_bar(speed=1.0, cut="tip"))
    q, u = cut.initial_state()
    for model in (
        cut,
        compile_scene(four_bar(speed=1.0, cut="tip", laws={"tip": {"inertia": 0.02}})),
    ):
        for name in (f"{hinge}.law.inertia[0]" for hinge in ("foot", "knee", "end", "tip")):
            value = model.parameters[name]
            if name.startswith("tip") and not value:
                with pytest.raises(mstmm.errors.SceneError, match="rotor inertia of the cut hinge"):
                    model.derivatives(q, u, parameters=[name])
                continue
            found = model.derivatives(q, u, parameters=[name]).parameters[name]
            after, much = (
                model.with_parameters({name: value + k * STEP}).accelerations(q, u) for k in (1, 2)
            )
            slope = (4 * after - much - 3 * model.accelerations(q, u)) / (2 * STEP)
            assert worst(found, slope) < 1e-6
    scene = four_bar(speed=1.0)
    for hinge in scene["hinge"]:
        del hinge["cut"]
    model = compile_scene(scene)
    (chosen,) = model.loops.cut_hinges
    with pytest.raises(mstmm.errors.SceneError, match=f'cut hinge "{chosen}" is zero'):
        model.derivatives(q, u, parameters=[f"{chosen}.law.inertia[0]"])


def test_those_of_linear_models() -> None:
    """At rest, along the independent motion: -M^-1 K and -M^-1 C."""
    model = compile_scene(four_bar(laws=SPRINGS, tilt=OBLIQUE))
    linear = model.linearize()
    assert linear.constrained_motion is not None
    along, places = linear.constrained_motion.motion_basis, list(linear.free_speed_indices)
    found = model.derivatives(linear.state.q, linear.state.u)
    both = np.hstack([(found.q @ along)[places], (found.u @ along)[places]])
    assert worst(both, linear.A[1:]) < 1e-10
