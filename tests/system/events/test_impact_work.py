"""Work of blows in which drives, and couplings that go by time, take part: closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from tests.support.scenes.linkages import four_bar

Scene = dict[str, Any]


def slider(name: str, body: str, inboard: str = "ground", **more: Any) -> Scene:
    return {"name": name, "type": "prismatic", "axis": [1, 0, 0], "inboard": inboard,
            "outboard": body, **more}  # fmt: skip


def in_a_row(hinges: list[Scene], **more: Any) -> Scene:
    """2 and 3 kg that nothing pulls down."""
    bodies = [{"name": "cart", "mass": 2.0}, {"name": "slug", "mass": 3.0}]
    return {"gravity": [0, 0, 0], "body": bodies, "hinge": hinges, **more}


def hard_stop_slider(name: str, body: str) -> Scene:
    """A slider that moves at 1 m/s from the middle to a hard stop at 1 m."""
    law = {"limits": {"lower": -1.0, "upper": 1.0, "restitution": 0.5}}
    return slider(name, body, law=law, initial={"u": [1.0]})


def run_of(scene: Scene, until: float, **settings: Any) -> mstmm.Result:
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    run = model.simulate(until, certify=True, **settings)
    assert run.success, run.message
    return run


def of_the_first_blow(run: mstmm.Result) -> list[float]:
    """Change of energy, and work, in J."""
    hit = int(np.flatnonzero(run.event > 0)[0])
    return [float(x[hit] - x[hit - 1]) for x in (run.energy(), run.work)]


DRIVEN = [hard_stop_slider("rail", "cart"), slider("act", "slug", "cart", drive="0.5*t")]
STRUCK = [slider("rail", "cart", initial={"u": [1.0]}), slider("way", "slug", drive="1 - 0.3*t")]
COUPLED = [hard_stop_slider("rail", "cart"), slider("way", "slug", initial={"u": [1.0]})]
#: A cart that 3 kg go on to lead by 0.5 m/s; one that a driven wall of 0.3 m/s meets with 1.3 m/s;
#: one that 3 kg lag behind by 0.1 t m/s.
BLOWS: dict[str, tuple[Scene, float | None]] = {
    "driven": (in_a_row(DRIVEN), 2 * (0.5**2 - 1) / 2 + 3 * (0.0**2 - 1.5**2) / 2),
    "struck": (
        in_a_row(STRUCK, event=[{"name": "hit", "when": "cart.x > slug.x", "do": "bounce",
                                 "restitution": 0.5}]), 2 * (0.95**2 - 1) / 2),
    "coupled": (
        in_a_row(COUPLED, coupling=[{"name": "lag", "expression": "rail.q - way.q",
                                     "equals": "0.05*t^2"}]), None),
}  # fmt: skip


@pytest.mark.parametrize("method", ["dop853", "rodas4p2", "scipy-DOP853"])
@pytest.mark.parametrize("name", BLOWS)
def test_what_drives_do_in_a_blow_is_work(name: str, method: str) -> None:
    scene, change = BLOWS[name]
    run = run_of(scene, 1.4, method=method)
    lost, work = of_the_first_blow(run)
    if change is None:  # the cart's speed turns round by half, the slug's is less by 0.1 t
        hit = int(np.flatnonzero(run.event > 0)[0])
        t, u = run.t[hit], run.u[hit - 1, 0]
        change = (u**2 / 4 - u**2) + 1.5 * ((-u / 2 - 0.1 * t) ** 2 - (u - 0.1 * t) ** 2)
    assert work == pytest.approx(change, rel=1e-9)
    assert lost == pytest.approx(change, rel=1e-9)
    assert run.trusted, run.warnings


def test_a_driven_body_on_a_linkage() -> None:
    """The rocker strikes its stops while a slug is driven along the coupler and a rotor turns with
    the crank: what a blow does to the energy is its work."""
    stops = {"limits": {"lower": 1.35, "upper": 1.6, "restitution": 0.7}}
    scene = four_bar(speed=2.0, laws={"end": stops, "foot": {"inertia": 0.05}})
    scene["body"].append({"name": "slug", "mass": 0.8, "inertia": [1e-3, 1e-3, 1e-3]})
    scene["hinge"].append(slider("act", "slug", "coupler", drive="0.3 + 0.2*sin(5*t)"))
    run = run_of(scene, 1.0, rtol=1e-10)
    assert (run.event > 0).sum() >= 2
    for hit in np.flatnonzero(run.event > 0):
        lost = run.energy()[hit] - run.energy()[hit - 1]
        assert run.work[hit] - run.work[hit - 1] == pytest.approx(lost, rel=1e-9)
    assert run.certificate.energy.relative < 1e-8
    assert run.trusted, run.warnings


@pytest.mark.parametrize("inertia", [0.0, 0.7])
def test_a_rotor_is_struck_with_its_hinge(inertia: float) -> None:
    """2 kg, and a rotor on their rail, lose 1 - e^2 of all that they have."""
    hinge = hard_stop_slider("rail", "cart")
    hinge["law"]["inertia"] = inertia
    body = [{"name": "cart", "mass": 2.0}]
    run = run_of({"gravity": [0, 0, 0], "body": body, "hinge": [hinge]}, 1.5)
    change = (0.5**2 - 1) * (2.0 + inertia) / 2
    assert of_the_first_blow(run) == pytest.approx([change, change], rel=1e-12)
