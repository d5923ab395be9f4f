"""Lawful-looking numbers that defeat double precision: refused by name, never a traceback."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm

HELD = {"name": "h", "type": "fixed", "inboard": "ground", "outboard": "b"}
STEP = [{"from": 0.0, "to": 1.0, "mass_per_length": 4.0}, {"from": 1.0, "to": 3.0}]


def clamped_beam_model(**beam: Any) -> mstmm.Model:
    """A clamped beam "b" of length 1, mass 1 and EI 1 unless given otherwise."""
    table = {"name": "b", "length": 1.0, "bending_stiffness": 1.0, "modes": {"y": 2}, **beam}
    table |= {} if "section" in table else {"mass_per_length": beam.get("mass_per_length", 1.0)}
    return mstmm.compile(
        mstmm.Scene(gravity=[0, -9.81, 0], beam=[table], hinge=[HELD]), engine="looped"
    )


def stepped_beam_keys(mass: float) -> dict[str, Any]:
    return {"length": 3.0, "section": [STEP[0], STEP[1] | {"mass_per_length": mass}]}


@pytest.mark.parametrize(
    ("beam", "said"),
    [
        (
            stepped_beam_keys(1e-300),
            r'beam "b": section\[1\].mass_per_length: expected 1e-12 of the largest',
        ),
        (
            stepped_beam_keys(5e-324),
            r'beam "b": section\[1\].mass_per_length: expected 1e-12 of the largest',
        ),
        (
            {"torsional_stiffness": 5e-324, "polar_inertia_per_length": 1e-3,
             "modes": {"y": 2, "twist": 1}},
            'beam "b": length: .* outside the range of double precision',
        ),
        ({"length": 1e30}, 'beam "b": length: .* outside the range of double precision'),
        ({"axial_stiffness": 1e200, "modes": {"y": 1, "axial": 1}}, "outside the range of double"),
    ],
)  # fmt: skip
def test_a_beam_whose_numbers_lie_too_far_apart(beam: dict[str, Any], said: str) -> None:
    with pytest.raises(mstmm.SceneError, match=said):
        clamped_beam_model(**beam)


@pytest.mark.parametrize("length", [1e13, 1e-9])
def test_a_beam_of_any_length_has_its_pieces(length: float) -> None:
    """A rule of its own length: frequencies scale exactly."""
    body, unit = (
        clamped_beam_model(length=length).flexible_bodies["b"],
        clamped_beam_model().flexible_bodies["b"],
    )
    assert np.diag(body.K) * length**3 == pytest.approx(np.diag(unit.K), rel=1e-9)


def test_a_piece_a_million_times_lighter_is_a_beam() -> None:
    assert clamped_beam_model(**stepped_beam_keys(4e-6)).simulate(1e-3, rtol=1e-5).success


def soft_body_model(**change: Any) -> mstmm.Model:
    box = {"size": [0.5, 0.04, 0.04], "divisions": [8, 1, 1]}
    link = {"name": "b", "box": box, "young": 1e6, "poisson": 0.3, "density": 1100.0, "modes": 2,
            "damping": 0.1}  # fmt: skip
    link |= {"ends": {"root": {"plane": [1, 0, 0, 0.0]}, "tip": {"plane": [1, 0, 0, 0.5]}}}
    hinge = HELD | {"outboard": "b.root"}
    scene = mstmm.Scene(gravity=[0, 0, -9.81], elastic=[link | change], hinge=[hinge])
    return mstmm.compile(scene, engine="looped")


@pytest.mark.parametrize("change", [{"density": 1e300}, {"young": 1e300}])
def test_an_elastic_body_beyond_numbers(change: dict[str, float]) -> None:
    with pytest.raises(
        mstmm.SceneError, match=r'elastic "b".*beyond the range of double precision'
    ):
        soft_body_model(**change)


def test_a_static_shape_beyond_the_model_is_said() -> None:
    """A soft elastic body sags by more than its length; its run knows no tolerance to check."""
    with pytest.raises(
        mstmm.NumericalFailure, match=r'"b": the static deformation .*rotates an end by 1.7'
    ):
        soft_body_model(initial="static").initial_state()


def test_a_start_beyond_the_model_is_named() -> None:
    with pytest.raises(mstmm.NumericalFailure, match=r'"b\.tip" .* section rotates by more than 1'):
        soft_body_model(initial={"eta": [0.0, 0.32]}).simulate(1e-3)


@pytest.mark.parametrize("force", [1e200, 1e300, 1.7e308])
@pytest.mark.parametrize("settings", [("", None), ("rk4", 1e-4)])
def test_loads_beyond_numbers_are_judged(force: float, settings: tuple[str, float | None]) -> None:
    beam = {"name": "b", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 1.0}
    load = {"on": "b.tip", "force": [force, force, 0]}
    hinge = HELD | {"type": "pin"}
    scene = mstmm.Scene(gravity=[0, 0, 0], beam=[beam], hinge=[hinge], load=[load])
    method, step = mstmm.methods.Method(settings[0], max_steps=20), settings[1]
    try:
        result = mstmm.compile(scene, engine="looped").simulate(1e-3, method, step)
    except mstmm.MstmmError:
        return
    assert not result.success or result.certificate.flexible_bodies
