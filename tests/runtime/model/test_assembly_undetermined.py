"""Masses that leave a motion undetermined: one clear error that names the hinge, and no number."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from tests.reference import newton_euler as dense
from tests.reference.compare import worst
from tests.support.models import compile_scene
from tests.support.scenes.rods import ROD, chain, drawn_state


def _tip(kind: str, inertia: tuple[float, ...], center: tuple[float, ...] = (0.5, 0, 0)) -> Any:
    """A sound rod that carries a doubtful body on a hinge of this type."""
    scene = chain(["pin", kind])
    scene["body"][1]["inertia"] = list(inertia)
    scene["body"][1]["center_of_mass"] = list(center)
    return scene


def _massless_tip_scene(kind: str) -> Any:
    scene = chain(["pin", kind])
    scene["body"][1] = {"name": "rod1", "mass": 0.0, "ends": scene["body"][1]["ends"]}
    return scene


UNDETERMINED = {
    "thin rod on a ball": _tip("ball", (0, ROD, ROD)),
    "point mass on a ball": _tip("ball", (0, 0, 0)),
    "point mass in the pin": _tip("pin", (0, 0, 0), (0, 0, 0)),
    "point mass on the axis of the pin": _tip("pin", (0, 0, 0), (0, 0, 0.4)),
    "point mass in free flight": _tip("free", (0, 0, 0)),
    "thin rod in free flight": _tip("free", (0, ROD, ROD)),
    "thin rod on springs": _tip("elastic", (0, ROD, ROD)),
    "point mass on a gimbal": _tip("gimbal", (0, 0, 0), (0, 0, 0)),
    "point mass that slides and turns": _tip("cylindrical", (0, 0, 0), (0, 0, 0.4)),
    "massless tip on a pin": _massless_tip_scene("pin"),
    "massless tip on a slider": _massless_tip_scene("prismatic"),
    "massless tip on a ball": _massless_tip_scene("ball"),
    "massless body in free flight": _massless_tip_scene("free"),
}


@pytest.mark.parametrize("name", UNDETERMINED)
def test_undetermined_motion_names_the_hinge(name: str) -> None:
    with pytest.raises(mstmm.SceneError, match=r'hinge "hinge1".*undetermined'):
        compile_scene(UNDETERMINED[name])


def test_every_hinge_concerned_is_named_with_a_rotor_as_a_remedy() -> None:
    """Thin rods on balls behind a sound one; and the rotors do help."""
    scene = chain(["pin", "ball", "ball", "ball"])
    for k in (1, 2, 3):
        scene["body"][k]["inertia"] = [0, ROD, ROD]
    with pytest.raises(mstmm.SceneError) as caught:
        compile_scene(scene)
    text = str(caught.value)
    assert 'hinges "hinge1", "hinge2" and "hinge3" at t = 0 s' in text
    assert "law.inertia" in text
    for k in (1, 2, 3):
        scene["hinge"][k]["law"] = {"inertia": 1e-3}
    model = compile_scene(scene)
    assert np.isfinite(model.accelerations(*model.initial_state())).all()


def test_links_without_inertia_are_all_named() -> None:
    """Point masses on pins through them: what is swept as links finds the hinges as well."""
    point: dict[str, Any] = {"mass": 1.0, "inertia": [0, 0, 0]}
    pin = {"type": "pin", "axis": [0, 0, 1], "inboard": "ground"}
    scene = {
        "gravity": [0, 0, -9.81],
        "body": [point | {"name": f"b{k}"} for k in range(3)],
        "hinge": [pin | {"name": f"h{k}", "outboard": f"b{k}"} for k in range(3)],
    }
    with pytest.raises(mstmm.SceneError, match='hinges "h0", "h1" and "h2"'):
        compile_scene(scene)


def test_of_many_hinges_some_are_named() -> None:
    body = {"mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0, ROD, ROD],
            "ends": {"tip": [1.0, 0, 0]}}  # fmt: skip
    rope = {"name": "rope", "count": 200, "inboard": "ground", "body": body,
            "hinge": {"type": "ball"}}  # fmt: skip
    with pytest.raises(mstmm.SceneError, match=r'"rope\[\d+\]\.hinge" and more than 41 others'):
        compile_scene({"gravity": (0, 0, 0), "chain": [rope]})


# --- negative moments -----------------------------------------------------------------------------


def _negative(kind: str, inertia: tuple[float, ...], **given: Any) -> Any:
    scene = _tip(kind, inertia)
    scene["body"][1]["allow_unphysical_inertia"] = True
    scene["hinge"][1] |= given
    return scene


@pytest.mark.parametrize("inertia", [(-0.1, ROD, ROD), (ROD, ROD, ROD, 2 * ROD, 0, 0)])
def test_negative_moments_run_where_every_pivot_holds(
    inertia: tuple[float, ...], rng: np.random.Generator
) -> None:
    scene = _negative("pin", inertia)
    q, u = drawn_state(scene, rng)
    assert worst(compile_scene(scene).accelerations(q, u), dense.solve(scene, q, u).udot) < 1e-12
    run = compile_scene(scene).simulate(1.0, certify=True)
    assert run.trusted
    assert any("accepted because of allow_unphysical_inertia" in text for text in run.warnings)


@pytest.mark.parametrize(
    "scene",
    [
        _negative("pin", (ROD, ROD, -0.3)),
        _negative("ball", (-0.1, ROD, ROD)),
        _negative("ball", (1.0, 1.0, 1.0, 1.0, 0, 1.2)),
    ],
    ids=["along an axis", "about the rod", "between the axes"],
)
def test_a_pivot_that_negative_moments_take_is_refused(scene: dict[str, Any]) -> None:
    with pytest.raises(mstmm.SceneError, match=r'hinge "hinge1".*no positive inertia'):
        compile_scene(scene)


@pytest.mark.parametrize("method", ["dop853", "rk4"])
def test_a_pivot_that_goes_on_the_way_ends_the_run(method: str) -> None:
    """The drive draws the tip in until its negative moment takes all of the pin's inertia."""
    scene = _negative("prismatic", (ROD, ROD, -0.5), axis=[1, 0, 0], drive="1 - 3*t")
    scene["body"][0] |= {"mass": 0.01, "inertia": [0, 1e-3, 1e-3]}
    step = 0.05 if method == "rk4" else None
    result = compile_scene(scene).simulate(1.0, method, step=step)
    assert not result.success
    assert "hinge0" in result.message
    assert 0.5 < result.t[-1] < 0.65  # (2.5 - 3 t)^2 + 1e-3 + 0.01/4 = 0.5


def test_nearly_nothing_counts_as_nothing() -> None:
    """A relative pivot of 1e-16 is rounding, not inertia."""
    with pytest.raises(mstmm.SceneError, match=r'hinge "hinge1".*undetermined'):
        compile_scene(_tip("ball", (1e-16, ROD, ROD)))
    compile_scene(_tip("ball", (1e-6, ROD, ROD)))


def test_a_state_on_the_way_is_named_too() -> None:
    """Two pins whose axes become parallel as a point mass swings through: only there undefined."""
    scene = chain(["pin", "pin"], gravity=(0, -9.81, 0))
    scene["body"][0] = {"name": "rod0", "mass": 0.0, "ends": {"tip": [1.0, 0, 0]}}
    scene["body"][1]["inertia"] = [0, 0, 0]
    scene["hinge"][0]["initial"] = {"q": [0.0], "u": [0.0]}
    scene["hinge"][1]["initial"] = {"q": [1.0], "u": [0.0]}
    model = compile_scene(scene)
    with pytest.raises(mstmm.NumericalFailure, match=r'hinge "hinge0" at t = 2\.5 s.*undetermined'):
        model.accelerations([0.3, 0.0], [0.0, 0.0], t=2.5)
    assert np.isfinite(model.accelerations([0.3, 0.1], [0.0, 0.0])).all()


def test_a_run_into_an_undetermined_state_keeps_what_was_computed() -> None:
    """The drive stretches the arm just when it lets go: both pins then carry the same inertia."""
    scene = chain(["pin", "pin"], gravity=(0, 0, 0))
    scene["body"][0] = {"name": "rod0", "mass": 0.0, "ends": {"tip": [1.0, 0, 0]}}
    scene["body"][1]["inertia"] = [0, 0, 0]
    scene["hinge"][0]["initial"] = {"q": [0.1], "u": [0.1]}
    scene["hinge"][1] |= {"drive": "1 - 2*t", "release": "t >= 0.5"}
    result = compile_scene(scene).simulate(1.0)
    assert not result.success
    assert "hinge" in result.message
    assert "undetermined" in result.message
    assert "at t = 0.5 s" in result.message
    assert result.t[-1] == pytest.approx(0.5)
    assert np.isfinite(result.q).all()
    assert np.isfinite(result.u).all()


def test_collinear_axes_of_a_universal_are_refused_by_the_scene() -> None:
    scene = chain(["pin"])
    scene["hinge"][0] |= {"type": "universal", "axis": [0, 0, 1], "axis2": [0, 0, 2]}
    with pytest.raises(mstmm.SceneError, match=r'hinge "hinge0".*axis'):
        mstmm.Scene(**scene)


@pytest.mark.parametrize("carrier", ["pin", "prismatic", "universal"])
def test_a_massless_body_that_carries_a_massive_one_moves(
    carrier: str, rng: np.random.Generator
) -> None:
    """Offset, so that each of its motions moves the mass behind it."""
    scene = chain([carrier, "ball"], 0.5, inertia=(0.1, 0.2, 0.2))
    if carrier == "universal":
        scene["hinge"][0]["axis2"] = [0, 1, 0]
    scene["body"][0] = {"name": "rod0", "mass": 0.0, "ends": {"tip": [1.0, 0.3, 0.2]}}
    size = 2 if carrier == "universal" else 1
    q, u = rng.uniform(-0.8, 0.8, size + 4), rng.uniform(-1, 1, size + 3)
    q[size:] = [1.0, 0.1, -0.2, 0.3]
    assert worst(compile_scene(scene).accelerations(q, u), dense.solve(scene, q, u).udot) < 1e-11


def test_a_thin_rod_on_a_pin_or_universal_is_no_trouble(rng: np.random.Generator) -> None:
    scene = chain(["pin"] * 4, 0.7, inertia=(0, ROD, ROD))
    q, u = drawn_state(scene, rng)
    assert worst(compile_scene(scene).accelerations(q, u), dense.solve(scene, q, u).udot) < 1e-12


def test_rotor_inertia_determines_what_the_body_does_not() -> None:
    scene = _tip("pin", (0, 0, 0), (0, 0, 0))
    scene["hinge"][1]["law"] = {"inertia": 0.3, "effort": 0.6}
    found = compile_scene(scene).accelerations([0.2, 0.1], [0.0, 0.0])
    assert found[1] == pytest.approx(2.0, rel=1e-14)


def test_a_driven_hinge_needs_no_inertia() -> None:
    scene = _tip("pin", (0, 0, 0), (0, 0, 0))
    scene["hinge"][1]["drive"] = "0.5*t^2"
    assert compile_scene(scene).accelerations([0.2, 0.0], [0.0, 0.0])[1] == pytest.approx(1.0)
