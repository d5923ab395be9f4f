"""Levels of model: which there are, what they err by, and what does not apply."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import mstmm
from mstmm.runtime.experiments.chart.chart import Chart
from mstmm.runtime.experiments.model_levels import beam_modes, limit_modes, model_levels
from tests.support.scenes.chart import hub, pendulum

T_END, SAMPLES = 1.2, 13
TIMES = np.linspace(0.0, T_END, SAMPLES)
METHODS = ("dop853", "rodas5p")


@cache
def hub_chart() -> Chart:
    return mstmm.chart(
        hub(), T_END, methods=METHODS, models=True, quantities=["blade.tip.position"],
        samples=SAMPLES, rounds=0, budget=300,
    )  # fmt: skip


def tip(scene: mstmm.Scene, flexibility: str | None = None) -> np.ndarray:
    model = mstmm.compile(scene, engine="looped", flexibility=flexibility)
    result = model.simulate(T_END, rtol=1e-11, atol=1e-13, output_times=TIMES)
    return result.position("blade.tip")


def test_the_ladder() -> None:
    names = [level.name for level in hub_chart().model_levels]
    assert names == [
        "rigid", "one-way, 1 shape", "one-way, 2 shapes", "linear, 1 shape", "linear, 2 shapes",
        "stiffened, 1 shape", "stiffened, 2 shapes",
    ]  # fmt: skip
    assert hub_chart().reference.model == names[-1]
    assert [level.degrees_of_freedom for level in hub_chart().model_levels] == [1, 1, 1, 2, 3, 2, 3]
    assert {(p.model, p.method) for p in hub_chart().points} == {
        (name, method) for name in names for method in METHODS
    }


@pytest.mark.parametrize(
    ("name", "scene", "flexibility"),
    [
        ("rigid", hub(), "rigid"),
        ("one-way, 1 shape", hub(modes={"y": 1}), "one-way"),
        ("linear, 2 shapes", hub(stiffening=False), None),
        ("stiffened, 1 shape", hub(modes={"y": 1}), None),
    ],
)
def test_a_level_errs_by_what_its_scene_errs(
    name: str, scene: mstmm.Scene, flexibility: str | None
) -> None:
    """Scenes that are written for a level give the error that the chart finds for it."""
    apart = np.linalg.norm(tip(scene, flexibility) - tip(hub()), axis=1).max()
    level = next(level for level in hub_chart().model_levels if level.name == name)
    assert level.error == pytest.approx(apart, rel=1e-2, abs=1e-7)
    errors = [p.error for p in hub_chart().points if p.model == name and p.error is not None]
    assert min(errors) == pytest.approx(apart, rel=0.15, abs=1e-7)


def test_smaller_models_are_recommended_for_larger_errors() -> None:
    """For an error beyond that of the rigid level, and for one that shapes alone can meet."""
    errors = {level.name: level.error for level in hub_chart().model_levels}
    rigid, linear = errors["rigid"], errors["linear, 2 shapes"]
    assert rigid is not None and linear is not None and rigid > 10 * linear
    cheap, fine = hub_chart().recommend(1.3 * rigid), hub_chart().recommend(1e-8)
    assert fine.model == "stiffened, 2 shapes"
    assert cheap.cpu_s is not None and fine.cpu_s is not None and cheap.cpu_s <= fine.cpu_s


def test_what_stays_straight_is_left_out() -> None:
    """A beam with shapes across the plane in which it moves."""
    scene = hub(modes={"y": 1, "z": 1}, bending_stiffness=[30.0, 20.0])
    made = mstmm.chart(
        scene, T_END, methods=["dop853"], models=True, samples=SAMPLES, rounds=0, budget=300
    )
    flat = next(level for level in made.model_levels if level.name.startswith("planar"))
    assert flat.degrees_of_freedom == made.model_levels[-1].degrees_of_freedom - 1
    assert flat.error is not None and flat.error < 1e-7
    assert made.reference.measure == "positions of all bodies and ends"


def test_what_is_given_per_shape_goes_with_its_shapes() -> None:
    scene = hub(
        modes={"y": 2, "z": 2}, bending_stiffness=[30.0, 20.0], damping=[0.1, 0.2, 0.3, 0.4],
        initial={"eta": [1e-3, 2e-3, 3e-3, 4e-3]},
    )  # fmt: skip
    one = limit_modes(scene, beam_modes(scene), 1, stiffening=True).beam[0]
    assert one.modes is not None and one.modes.counts == (1, 1, 0, 0)
    assert one.damping.ratio == (0.1, 0.3)
    assert one.initial.eta == (1e-3, 3e-3)
    assert scene.beam[0].damping.ratio == (0.1, 0.2, 0.3, 0.4)


@pytest.mark.parametrize("frame", ["tangent@mid", "tangent", "mean", "chord"])
def test_numbers_of_shapes_are_counted_as_the_scene_does(frame: str) -> None:
    """About a section in its middle a beam has coordinates for both sides of each shape."""
    scene = hub(modes="auto", frame=frame, ends={"mid": 0.5})
    whole = beam_modes(scene)["blade"]
    model = mstmm.compile(scene, engine="looped")
    richest = model_levels(scene)[-1]
    assert richest.name == f"stiffened, {whole.y} shapes"
    assert mstmm.compile(richest.scene, engine="looped").nu == model.nu
    smaller = mstmm.compile(model_levels(scene)[-2].scene, engine="looped")
    assert smaller.nu < model.nu


def test_bodies_that_the_scene_makes_rigid_stay_rigid() -> None:
    scene = hub()
    two = mstmm.Scene.from_data({
        "gravity": [0, 0, 0], "body": [b.model_dump(by_alias=True) for b in scene.body],
        "beam": [
            {"name": name, "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 20.0,
             "modes": {"y": count}, "model": model}
            for name, count, model in (("soft", 2, "flexible"), ("hard", 5, "rigid"))
        ],
        "hinge": [
            {"name": "motor", "type": "pin", "inboard": "ground", "outboard": "hub"},
            {"name": "clamp", "type": "fixed", "inboard": "hub", "outboard": "soft"},
            {"name": "other", "type": "fixed", "inboard": "hub", "outboard": "hard",
             "orientation": [0, 0, np.pi]},
        ],
    })  # fmt: skip
    levels = model_levels(two)
    assert [one.name for one in levels][-1] == "stiffened, 2 shapes"
    assert all(one.scene.beam[1].model == "rigid" for one in levels)


def test_shapes_of_the_users_own_are_cut_too() -> None:
    scene = hub(modes=None, shapes={"y": ["(x/L)^2", "(x/L)^3"]})
    variants = {variant.name: variant.scene for variant in model_levels(scene)}
    shapes = variants["linear, 1 shape"].beam[0].shapes
    assert shapes is not None and [one.text for one in shapes.y] == ["(x/L)^2"]
    assert mstmm.compile(variants["stiffened, 2 shapes"]).nu == 3
    assert mstmm.compile(variants["stiffened, 1 shape"]).nu == 2


def test_levels_that_a_scene_does_not_allow_are_told() -> None:
    """Rigid bodies have no drag: the levels without deformation in the run fall away."""
    made = mstmm.chart(
        hub(drag=0.1), T_END, methods=["dop853"], models=True, samples=SAMPLES, rounds=0,
        budget=300, quantities=["blade.tip.y"],
    )  # fmt: skip
    refused = {one.model for one in made.skipped if one.is_unsupported}
    assert refused == {"rigid", "one-way, 1 shape", "one-way, 2 shapes"}
    assert all("viscous_drag" in one.reason for one in made.skipped if one.is_unsupported)
    assert not refused & {level.name for level in made.model_levels}


def test_quantities_that_a_level_does_not_have() -> None:
    made = mstmm.chart(
        hub(), 0.1, methods=["dop853"], models=True, samples=3, rounds=0, budget=300,
        quantities=["blade.y2"],
    )  # fmt: skip
    refused = {one.model: one.reason for one in made.skipped if one.is_unsupported}
    assert "rigid" in refused and "linear, 1 shape" in refused
    assert 'quantity "blade.y2"' in refused["rigid"]


def test_a_scene_of_rigid_bodies_has_one_level() -> None:
    assert [variant.name for variant in model_levels(pendulum())] == ["rigid"]
    made = mstmm.chart(
        pendulum(), 0.5, methods=["dop853"], models=True, samples=3, rounds=0, budget=300
    )
    assert [level.name for level in made.model_levels] == ["rigid"]
    (told,) = [one for one in made.skipped if one.is_unsupported]
    assert "no model levels to compare: the scene has no flexible bodies" in str(told)
