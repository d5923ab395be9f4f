"""What is advised for scenes with a known answer, and whether it keeps what was asked."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import mstmm
from tests.support.scenes.advice import (
    HUBS,
    TIP,
    hub_and_beam,
    hub_and_pieces,
    period,
    tip,
    two_beams,
)


@cache
def beam_advice(name: str, error: float) -> mstmm.Advice:
    return mstmm.advise(hub_and_beam(name), period(name), error=error, of=TIP, rounds=0, budget=600)


@pytest.mark.parametrize("error", [1e-3, 1e-2])
@pytest.mark.parametrize("name", HUBS)
def test_keeps_what_was_asked(name: str, error: float) -> None:
    made = beam_advice(name, error)
    scene = hub_and_pieces(name, 10) if made.beam_parts else hub_and_beam(name)
    truth = tip(scene, period(name), method="rodas5p", rtol=1e-6, atol=1e-8)
    found = tip(made.scene, period(name), made.reduced_name(TIP), **made.options)
    assert np.linalg.norm(found - truth, axis=1).max() <= error
    assert made.error <= error


def test_levels() -> None:
    """Rigid for a stiff beam on a heavy hub, one shape for softer ones, and stiffening where the
    loads change the stiffness."""
    (a,), (b,), (c,) = (beam_advice(name, 1e-3).bodies for name in "ABC")
    (d,) = beam_advice("D", 1e-2).bodies
    assert a.model.level == "rigid"
    for body in (b, c):
        assert body.model.is_coupled
        assert body.model.shapes == (("y", 1),)
    assert d.model.level == "stiffened"
    assert d.model.total in (1, 2)  # which of them is cheaper, the machine decides


def test_a_light_hub_at_a_looser_error_is_rigid() -> None:
    """A light hub makes a one-way response worse than none (chi 0.6): rigid errs by 4.7e-3."""
    (body,) = beam_advice("C", 1e-2).bodies
    assert body.model.level == "rigid"
    assert body.error == pytest.approx(4.7e-3, rel=0.05)


def test_estimates() -> None:
    """d, d chi / (1 - chi) and d gamma, as a separate program had them for these scenes."""
    expected = {
        "A": (9.1e-4, 5.9e-5, 7e-7), "B": (1.0e-2, 6.7e-4, 1.7e-5), "C": (1.3e-2, 2.0e-2, 3.2e-5),
        "D": (2.2e-1, 1.4e-1, 8.1e-2),
    }  # fmt: skip
    for name, (d, recoil, shortening) in expected.items():
        known = beam_advice(name, 1e-2).bodies[0].evidence
        assert known is not None
        assert known.deflection == pytest.approx(d, rel=0.06)
        chi = known.coupling
        assert known.deflection * chi / (1 - chi) == pytest.approx(recoil, rel=0.06)
        assert known.deflection * known.load_ratio == pytest.approx(shortening, rel=0.06)


def test_splits_a_beam_that_one_frame_cannot_follow() -> None:
    """A slope of 0.3: one frame errs by 2.1e-3, as against a chain of segments."""
    strict, loose = (beam_advice("D", error) for error in (1e-3, 1e-2))
    assert set(strict.beam_parts) == {body.name for body in strict.bodies}
    assert set(strict.beam_parts.values()) == {"arm"}
    assert len(strict.beam_parts) > 2
    assert strict.reduced_name(TIP) == f"{max(strict.beam_parts)}.tip.position"
    tried = {one.name: one.error for one in strict.tried_models}
    assert tried["as given"] == pytest.approx(2.1e-3, rel=0.1)
    assert any("with one frame its error is 2.1e-03" in text for text in strict.other_changes)
    assert loose.beam_parts == {}


#: A beam with modal damping of 0.1 %, and what damps its first shape alike: the frequency of a
#: clamped beam is 1.8751^2 sqrt(EI / rho A) / L^2.
MODAL = {"damping": 0.001}
ALIKE = {"damping": {"stiffness": 2 * 0.001 / (1.8751**2 * np.sqrt(2.0))}}
DRAG = {"viscous_drag": 0.05}


@pytest.mark.parametrize(("given", "parts"), [(MODAL, ALIKE), (DRAG, DRAG)], ids=["modal", "drag"])
def test_beams_are_split_whatever_damps_them(given: dict[str, Any], parts: dict[str, Any]) -> None:
    """Modal damping is of the whole, and no rigid body has a drag, so that no one-way run tells of
    one that bends."""
    made = mstmm.advise(
        hub_and_beam("D", 2, **given), period("D"), error=2e-3, of=TIP, rounds=0, budget=600
    )
    assert len(made.beam_parts) > 1
    words = " ".join(made.other_changes)
    assert ("stiffness-proportional damping (0.000402 s)" in words) == (given is MODAL)
    scene = hub_and_pieces("D", 10, **parts)
    truth = tip(scene, period("D"), method="rodas5p", rtol=1e-6, atol=1e-8)
    found = tip(made.scene, period("D"), made.reduced_name(TIP), **made.options)
    assert np.linalg.norm(found - truth, axis=1).max() <= 2e-3


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"initial": {"eta": [0.1, 0.0]}}, "split it into welded beams"),
        (
            {"basis": "given", "shapes": {"y": ["x^2"]}, "modes": {"y": 1}},
            "is not split: this requires automatic shapes instead of the given ones",
        ),
    ],
    ids=["start", "shapes"],
)
def test_a_beam_that_cannot_be_split_is_told(given: dict[str, Any], words: str) -> None:
    """A start belongs to the shapes of the whole beam; given ones that bend otherwise are what the
    scene wants."""
    whole = hub_and_beam("D", 2).model_dump(by_alias=True, exclude_none=True)
    scene = mstmm.Scene(**whole | {"beam": [whole["beam"][0] | given]})
    made = mstmm.advise(scene, period("D"), error=1e-3, of=TIP, rounds=0, budget=600)
    assert made.beam_parts == {}
    (body,) = made.bodies
    assert body.frame_error is not None and body.frame_error > 1e-3
    assert words in " ".join([body.reason, *made.notes])


def test_each_body_by_itself_and_in_its_plane() -> None:
    scene = two_beams()
    made = mstmm.advise(scene, 1.0, error=1e-3, of="lash.tip.position", rounds=1, budget=600)
    boom, lash = made.bodies
    assert boom.name == "boom"
    assert boom.model.level == "rigid"
    assert dict(boom.given_model.shapes) == {"y": 2, "z": 1}
    assert boom.error is not None and boom.error < 1e-4
    assert lash.model.is_coupled
    assert made.scene.hinge[1].type == "pin"
    assert any("elbow" in text for text in made.other_changes)
    assert made.model_saving is not None and made.model_saving > 2
    truth = tip(scene, 1.0, "lash.tip.position", method="rodas5p", rtol=1e-8, atol=1e-10)
    found = tip(made.scene, 1.0, made.reduced_name("lash.tip.position"), **made.options)
    assert np.linalg.norm(found - truth, axis=1).max() <= 1e-3


def test_a_given_model_that_is_too_little() -> None:
    """Linear kinematics where the loads change the stiffness by a third err by 4e-2."""
    scene = hub_and_beam("D", 2, stiffening=False)
    made = mstmm.advise(scene, period("D"), error=1e-2, of=TIP, rounds=0, budget=600)
    (body,) = made.bodies
    assert body.given_model.level == "linear"
    assert body.model.level == "stiffened"
    tried = {one.name: one.error for one in made.tried_models}
    assert tried["as given"] == pytest.approx(4.2e-2, rel=0.05)


def test_a_beam_that_cannot_bend_in_the_plane_of_the_motion() -> None:
    scene = hub_and_beam("B").model_dump(by_alias=True, exclude_none=True)
    (beam,) = scene["beam"]
    across = mstmm.Scene(**scene | {"beam": [beam | {"modes": {"z": 2}, "basis": "auto"}]})
    made = mstmm.advise(across, period("B"), error=1e-3, of=TIP, rounds=0, budget=600)
    (body,) = made.bodies
    assert dict(body.given_model.shapes) == {"z": 2}
    assert body.model.level == "rigid"
    assert made.is_reduced


def test_a_body_of_finite_elements_keeps_its_static_shapes() -> None:
    """A rod with a load on its tip: the static shapes carry it, its own vibration is too fast."""
    scene = mstmm.Scene(
        gravity=[0, -9.81, 0],
        elastic=[{
            "name": "rod", "box": {"size": [0.5, 0.02, 0.02], "divisions": [4, 1, 1]}, "order": 2,
            "young": 1e9, "poisson": 0.3, "density": 1000.0, "modes": 2, "frame": "tangent",
            "ends": {"root": {"plane": [1, 0, 0, 0.0]}, "tip": {"plane": [1, 0, 0, 0.5]}},
        }],
        body=[{"name": "load", "mass": 0.1, "inertia": [1e-4] * 3}],
        hinge=[
            {"name": "motor", "type": "pin", "inboard": "ground", "outboard": "rod.root",
             "drive": "0.3*sin(4*t)"},
            {"name": "grip", "type": "fixed", "inboard": "rod.tip", "outboard": "load"},
        ],
    )  # fmt: skip
    made = mstmm.advise(scene, 0.3, error=1e-3, of="rod.tip.position", rounds=0, budget=600)
    (body,) = made.bodies
    assert dict(body.given_model.shapes) == {"vibration": 2}
    assert body.model.is_coupled
    assert dict(body.model.shapes) == {"vibration": 0}
    assert "static only" in str(body.model)
    assert made.scene.elastic[0].modes == 0
    assert made.error <= 1e-3
