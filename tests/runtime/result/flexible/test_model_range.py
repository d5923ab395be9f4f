"""Where the models of flexible bodies end: strain, far bending, sections that cannot be told."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_bvp

import mstmm
from mstmm.runtime.result.flexible.range_estimators import shear_errors
from mstmm.runtime.result.result import Result
from tests.support.models import model_of

ENDS = {"root": {"plane": [1, 0, 0, 0.0]}, "tip": {"plane": [1, 0, 0, 0.5]}}
WALL = {"name": "wall", "type": "fixed", "inboard": "ground", "outboard": "bar"}


def bar(force: list[float], **given: Any) -> mstmm.Scene:
    """A bar of 1 m, its end loaded by a force (N)."""
    one = {"name": "bar", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 100.0,
           "damping": 0.5, "initial": "static", **given}  # fmt: skip
    load = {"on": "bar.tip", "force": force}
    return mstmm.Scene(gravity=(0, 0, 0), beam=[one], hinge=[WALL], load=[load])


def run_of(scene: mstmm.Scene, t_end: float = 1e-3) -> Result:
    return mstmm.compile(scene).simulate(t_end, certify=True)


@pytest.mark.parametrize("pull", [-150.0, 600.0])
def test_a_bar_that_is_pressed_to_nothing_or_pulled_to_a_multiple_is_warned_about(
    pull: float,
) -> None:
    result = run_of(bar([pull, 0, 0], modes={"axial": 2}, axial_stiffness=100.0))
    assert result.success
    (one,) = result.certificate.flexible_bodies
    assert one.strain is not None
    assert one.strain > 0.9 * abs(pull) / 100
    assert any('the strain of "bar" reaches' in text for text in result.warnings)
    assert not result.trusted


@pytest.mark.parametrize("share", [0.5, 1.2])
def test_the_limit_of_strain_is_a_few_per_cent(share: float) -> None:
    """A shape x has the constant strain of a bar under an end load."""
    force, shapes = share * 0.05 * 100.0, {"axial": ["x"]}
    result = run_of(bar([force, 0, 0], shapes=shapes, axial_stiffness=100.0))
    assert result.certificate.flexible_bodies[0].strain == pytest.approx(share * 0.05, rel=1e-6)
    assert any("the strain of" in text for text in result.warnings) == (share > 1)
    assert result.trusted == (share < 1)


def test_fibres_of_a_thick_section_are_strained_by_bending() -> None:
    """Of a rectangle of height h: h/2 M / EI, and h = sqrt(12 EI/EA)."""
    height, moment = 0.1, 3.0
    stretch = 12 * 100.0 / height**2
    scene = bar([0, moment, 0], modes={"y": 5}, axial_stiffness=stretch)
    found = run_of(scene).certificate.flexible_bodies[0].strain
    assert found is not None
    assert found == pytest.approx(height / 2 * moment / 100.0, rel=0.1)
    assert run_of(bar([0, moment, 0], modes={"y": 5})).certificate.flexible_bodies[0].strain is None


def test_an_elastic_body_that_is_pulled_apart_is_strained_too() -> None:
    body = {"name": "bar", "box": {"size": [0.5, 0.04, 0.04], "divisions": [4, 1, 1]},
            "young": 1e6, "poisson": 0.0, "density": 1100.0, "modes": 2, "initial": "static",
            "ends": ENDS}  # fmt: skip
    wall = {**WALL, "outboard": "bar.root"}

    def strain(force: float) -> float:
        load = {"on": "bar.tip", "force": [force, 0, 0]}
        one = mstmm.Scene(gravity=(0, 0, 0), elastic=[body], hinge=[wall], load=[load])
        result = mstmm.compile(one).simulate(1e-3)
        found = result.certificate.flexible_bodies[0].strain
        assert found is not None
        assert any("the strain of" in text for text in result.warnings) == (found > 0.05)
        return found

    assert strain(16.0) == pytest.approx(0.01, rel=0.02)  # 0.04 x 0.04 m^2 times 1 MPa is 1600 N
    assert strain(800.0) == pytest.approx(1 / 3, rel=0.02)  # 1/2, stiffened by the load itself


# --- far bending ----------------------------------------------------------------------------------


def elastica(load: float) -> tuple[float, float]:
    """(shortening, deflection) of the tip of an exact cantilever of 1 m under P L^2/EI = load."""

    def rates(_: Any, y: Any) -> Any:
        return np.vstack([y[1], -load * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])])

    s = np.linspace(0, 1, 101)
    first = np.vstack([load * s * (1 - s / 2), load * (1 - s), s, s**2])
    ends = solve_bvp(rates, lambda a, b: np.array([a[0], b[1], a[2], a[3]]), s, first, tol=1e-9)
    return 1 - ends.y[2, -1], ends.y[3, -1]


@pytest.mark.parametrize("load", [0.5, 1.0, 2.0, 3.0])
def test_the_bounds_of_one_frame_hold_for_deflection_and_shortening(load: float) -> None:
    result = run_of(bar([0, 100.0 * load, 0], modes={"y": 3}))
    (one,) = result.certificate.flexible_bodies
    x, y, _ = result.position("bar.tip")[0]
    shortening, deflection = elastica(load)
    assert abs(y / deflection - 1) <= one.frame_error
    assert one.frame_error < abs((1 - x) / shortening - 1) <= one.shortening_error
    row = next(line for line in str(result.certificate).splitlines() if line.startswith("bar "))
    assert "of the deflection" in row
    assert "of the foreshortening" in row


# --- samples that cannot be evaluated -------------------------------------------------------------


def test_positions_that_are_no_numbers_are_no_success() -> None:
    """A soft body swings past where its sections have an orientation, with nothing on its end."""
    body = {"name": "link", "box": {"size": [0.5, 0.04, 0.04], "divisions": [8, 1, 1]},
            "young": 1e6, "poisson": 0.3, "density": 1100.0, "modes": 2,
            "ends": ENDS}  # fmt: skip
    wall = {**WALL, "outboard": "link.root"}
    scene = mstmm.Scene(gravity=(0, 0, -9.81), elastic=[body], hinge=[wall])
    result = mstmm.compile(scene).simulate(1.0)
    lost = np.flatnonzero(np.isnan(result.position("link.tip")[:, 0]))
    assert len(lost)
    assert not result.success
    assert f"but {len(lost)} of {len(result.t)} samples cannot be evaluated" in result.message
    (link,) = result.certificate.flexible_bodies
    assert link.slope > 1.5  # of all samples, these among them
    assert model_of(result).simulate(0.2).success


# --- slenderness ----------------------------------------------------------------------------------


def welded_beams(
    parts: int, length: float, angle: float = 0.0, kind: str = "fixed", collar: int | None = None,
    **last: str,
) -> mstmm.Scene:  # fmt: skip
    """Parts of equal length end to end, 0.1 m high by EI/EA, and a collar of twice the height."""
    part = {"length": length / parts, "mass_per_length": 1.0, "bending_stiffness": 100.0,
            "axial_stiffness": 12 * 100.0 / 0.1**2, "polar_inertia_per_length": 1e-3,
            "modes": {"y": 2}}  # fmt: skip
    beams = [part | {"name": f"part{k}"} for k in range(parts)]
    if collar is not None:
        beams[collar] |= {"bending_stiffness": 16 * 100.0, "axial_stiffness": 4 * 12e4}
    hinges: list[dict[str, Any]] = [
        {"name": "wall", "type": "fixed", "inboard": "ground", "outboard": "part0"}
    ]
    hinges += [
        {"name": f"weld{k}", "type": kind, "inboard": f"part{k - 1}.tip", "outboard": f"part{k}",
         "orientation": [0, 0, angle]}
        for k in range(1, parts)
    ]  # fmt: skip
    hinges[-1] |= last
    return mstmm.Scene(gravity=(0, 0, 0), beam=beams, hinge=hinges)


def test_the_height_follows_from_bending_and_axial_stiffness() -> None:
    (warning,) = welded_beams(1, 0.5).warnings
    assert "its length is 5 times the height" in warning
    assert "(0.1 m from bending_stiffness and axial_stiffness)" in warning
    assert welded_beams(1, 1.5).warnings == ()


def test_beams_welded_in_line_are_judged_as_one() -> None:
    assert welded_beams(4, 2.0).warnings == ()
    (warning,) = welded_beams(4, 0.8).warnings
    assert 'beam "part0": its line of welded beams is 8 times the height' in warning
    assert len(welded_beams(4, 2.0, angle=1.0).warnings) == 4
    assert len(welded_beams(4, 2.0, kind="pin").warnings) == 4


def test_a_short_thick_piece_does_not_make_a_line_short() -> None:
    """A collar of twice the height on a tenth of a shaft that is 15 heights long."""
    assert welded_beams(10, 1.5, collar=4).warnings == ()


def test_a_beam_welded_tip_to_tip_is_in_line_too() -> None:
    assert welded_beams(2, 1.5, np.pi, outboard="part1.tip").warnings == ()
    assert len(welded_beams(2, 1.5, 0.0, outboard="part1.tip").warnings) == 2  # folded back


def test_shapes_of_welded_beams_are_judged_on_the_line() -> None:
    """As many shapes on four times the length have a sixteenth of the error."""
    alone = mstmm.compile(welded_beams(1, 1.0)).flexible_bodies["part0"]
    by_hand = 0.5 * 4.694091**2 * 0.1**2 / 12 * (3.12 + 1)  # beta L of the second shape: 4.694
    errors = shear_errors(alone)
    assert errors is not None and errors.max() == pytest.approx(by_hand, rel=1e-5)
    model = mstmm.compile(welded_beams(4, 4.0))
    part = shear_errors(model.flexible_bodies["part0"])
    on_line = shear_errors(model.flexible_bodies["part0"], 4.0)
    assert part is not None and on_line is not None
    assert on_line == pytest.approx(part / 16, rel=1e-9)
    moved = model.simulate(1e-3).certificate.flexible_bodies[0].shear
    assert moved is not None and moved <= on_line.max() * (1 + 1e-12)


# --- directions without shapes --------------------------------------------------------------------


@pytest.mark.parametrize(
    ("load", "modes", "bend"),
    [
        ([0, 0, 10.0], {"y": 2}, 10.0 / (2 * 100.0)),  # P L^2 / 2 EI
        ([0, 10.0, 0], {"z": 2}, 10.0 / (2 * 100.0)),
        ([0, 10.0, 10.0], {"y": 2}, 10.0 / (2 * 100.0)),
        ([0, 0, 10.0], {"y": 2, "z": 2}, None),
        ([0, 10.0, 0], {"y": 2}, None),
        ([0, 10.0, 0.1], {"y": 2}, None),  # 1 % of the other plane
    ],
)
def test_a_load_across_a_plane_without_shapes_is_an_objection(
    load: list[float], modes: dict[str, int], bend: float | None
) -> None:
    model = mstmm.compile(bar(load, modes=modes))
    for answer in (model.equilibrium(), model.simulate(1e-3, output_times=[0.0])):
        found = [risk for risk in answer.risks if "no shape functions" in risk.description]
        assert [risk.name for risk in found] == ([] if bend is None else ["shapes"])
        if bend is not None:
            assert not answer.trusted
            assert found[0].value == pytest.approx(bend, rel=1e-3)


@pytest.mark.parametrize(
    ("load", "says"),
    [
        ({"force": [20.0, 0, 0]}, "stretch it by 0.002 of its length"),  # N / EA
        ({"moment": [0.5, 0, 0]}, "twist it by 0.01 rad"),  # T L / GI_t
    ],
)
def test_tension_and_torque_without_shapes_for_them_are_objections(
    load: dict[str, list[float]], says: str
) -> None:
    one = {"name": "bar", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 100.0,
           "torsional_stiffness": 50.0, "axial_stiffness": 1e4, "modes": {"y": 2}}  # fmt: skip
    scene = mstmm.Scene(
        gravity=(0, 0, 0), beam=[one], hinge=[WALL], load=[{"on": "bar.tip", **load}]
    )
    found = mstmm.compile(scene).equilibrium()
    assert not found.trusted
    assert any(says in text for text in found.warnings)
