"""What "auto" chooses, and that the choice is the one that needs the fewest shapes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.linalg

import mstmm
from mstmm.runtime.flexible.flexible_bodies import modal_bodies
from mstmm.scene import Scene
from tests.support.scenes.single_beam import FREE, HELD, PIN, body_of

ROD = {"name": "r", "mass": 1.0, "inertia": [0.01, 0.05, 0.05]}


def carrying(hinge: str, mass: float = 1.0, at: str = "tip", **more: Any) -> dict[str, Any]:
    """A rigid body on an end of the beam."""
    table = {"name": "k", "inboard": f"b.{at}", "outboard": "r", "type": hinge, **more}
    return {"body": [ROD | {"mass": mass}], "hinge": [table]}


@pytest.mark.parametrize(
    ("hinge", "more", "frame", "basis"),
    [
        (HELD, {}, "tangent", "clamped-free"),
        ({"type": "prismatic", "axis": [1, 0, 0]}, {}, "tangent", "clamped-free"),
        ({"type": "pin", "drive": "sin(t)"}, {}, "tangent", "clamped-free"),
        ({"type": "pin", "law": {"inertia": 5.0}}, {}, "tangent", "clamped-free"),
        ({"type": "pin", "law": {"inertia": 1e-3}}, {}, "chord", "simply-supported"),
        ({"type": "pin", "law": {"stiffness": 50.0}}, {}, "chord", "simply-supported"),
        (PIN, {}, "chord", "simply-supported"),
        ({"type": "ball"}, {}, "chord", "simply-supported"),
        ({"type": "pin", "axis": [0, 1, 0]}, {}, "tangent", "clamped-free"),
        (FREE, {}, "mean", "free-free"),
        ({"type": "planar"}, {}, "mean", "free-free"),
        (HELD, carrying("fixed"), "tangent", "static+fixed-interface"),
        (HELD, carrying("pin", 0.01), "tangent", "clamped-free"),
        (HELD, carrying("pin", 0.5), "tangent", "static+fixed-interface"),
        (HELD, carrying("pin", 0.01, law={"stiffness": 3.0}), "tangent", "static+fixed-interface"),
        (HELD, carrying("pin", 0.01, axis=[0, 1, 0]), "tangent", "static+fixed-interface"),
        (FREE, carrying("fixed"), "mean", "static+fixed-interface"),
        (PIN, carrying("fixed", at="mid"), "chord", "static+fixed-interface"),
        (HELD, {"load": [{"on": "b.tip", "force": [0, 1, 0]}]}, "tangent", "clamped-free"),
        (HELD, {"load": [{"on": "b.tip", "moment": [0, 0, 1]}]}, "tangent",
         "static+fixed-interface"),
    ],
)  # fmt: skip
def test_frame_and_basis_follow_the_hinges(
    hinge: dict[str, Any], more: dict[str, Any], frame: str, basis: str
) -> None:
    body = body_of(hinge, more=more, ends={"mid": 0.5})
    assert body.frame == frame
    assert f" {basis} shapes" in body.notes[0]


def test_a_sprung_pin_takes_a_frame_that_keeps_its_inertia() -> None:
    """Two links, a motor at the shoulder, a spring at the elbow, a payload: a tangent frame at the
    elbow would be left without inertia at 0.2 s."""
    link = {"damping": 0.01}
    pin = {"type": "pin", "axis": [0, 0, 1]}
    scene = mstmm.Scene(
        gravity=[0, -9.81, 0],
        beam=[
            link | {"name": "upper", "length": 1.0, "mass_per_length": 1.5,
                    "bending_stiffness": 150.0},
            link | {"name": "fore", "length": 0.8, "mass_per_length": 0.8,
                    "bending_stiffness": 40.0},
        ],
        body=[{"name": "payload", "mass": 0.5, "inertia": [5e-4, 5e-4, 5e-4]}],
        hinge=[
            pin | {"name": "shoulder", "inboard": "ground", "outboard": "upper",
                   "law": {"effort": "20*sin(2*pi*t) + 15", "inertia": 0.05}},
            pin | {"name": "elbow", "inboard": "upper.tip", "outboard": "fore",
                   "law": {"stiffness": 30.0, "damping": 0.1}},
            {"name": "grip", "type": "fixed", "inboard": "fore.tip", "outboard": "payload"},
        ],
    )  # fmt: skip
    model = mstmm.compile(scene, engine="looped")
    assert [body.frame for body in model.flexible_bodies.values()] == ["chord", "mean"]
    assert model.simulate(0.5, rtol=1e-6, atol=1e-8).success


def test_each_bending_plane_has_its_own_frame() -> None:
    body = body_of(PIN, modes=2)
    assert body.frame == "chord/tangent"
    root, tip = body.ports["root"], body.ports["tip"]
    assert not tip.phi[1].any() and root.theta[2, :2].all()
    assert not root.theta[1].any() and tip.phi[2, 2:].all()


@pytest.mark.parametrize(
    ("hinge", "more", "modes"),
    [
        (HELD, {}, ("y1", "y2", "y3")),
        (FREE, {}, ("y1", "y2", "y3", "y4", "z1", "z2", "z3", "z4")),
        (HELD, carrying("fixed"), ("y1", "y2", "y3", "y4")),
        (
            HELD,
            {"load": [{"on": "b.tip", "force": [0, 0, 1]}]},
            ("y1", "y2", "y3", "z1", "z2", "z3"),
        ),
    ],
)
def test_how_many_shapes_auto_takes(
    hinge: dict[str, Any], more: dict[str, Any], modes: tuple[str, ...]
) -> None:
    scene = {"gravity": [0, -9.81, 0], "body": more.get("body", []), "load": more.get("load", [])}
    beam = {"name": "b", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 9.0,
            "polar_inertia_per_length": 1e-6}  # fmt: skip
    base = {"name": "h", "inboard": "ground", "outboard": "b", **hinge}
    bodies = modal_bodies(Scene(**scene, beam=[beam], hinge=[base, *more.get("hinge", [])]))
    assert bodies["b"].modes == modes


@pytest.mark.parametrize(
    ("stiffness", "inertia", "joins"), [(0.001, 0.1, True), (1000.0, 1e-5, False)]
)
def test_twist_joins_where_it_is_slow(stiffness: float, inertia: float, joins: bool) -> None:
    body = body_of({"type": "ball"}, modes="auto", torsional_stiffness=stiffness,
                   polar_inertia_per_length=inertia)  # fmt: skip
    assert ("twist1" in body.modes) == joins


def test_a_beam_that_may_spin_twists_about_its_mean() -> None:
    data: dict[str, Any] = {
        "modes": {"twist": 2},
        "torsional_stiffness": 1.0,
        "polar_inertia_per_length": 0.1,
    }
    free, fixed = (body_of({"type": kind}, **data) for kind in ("ball", "fixed"))
    assert abs(free.E[1, 2] - free.E[2, 1]).max() < 1e-14  # no share in the spin of the whole
    assert free.ports["root"].theta[0] == pytest.approx([2**0.5, 2**0.5])
    assert not fixed.ports["root"].can_move
    found = np.sqrt(np.linalg.eigvals(np.linalg.solve(free.Mff, free.K)).real)
    assert np.sort(found) == pytest.approx(np.pi * np.array([1, 2]) * 10**0.5, rel=1e-9)


def test_too_few_shapes_for_the_moments_at_the_ends_are_warned_about() -> None:
    body = body_of(HELD, modes={"y": 1}, more=carrying("fixed"))
    assert len(body.warnings) == 1
    assert 'beam "b": modes: 1 in direction y cannot represent' in body.warnings[0]
    assert not body_of(HELD, modes={"y": 2}, more=carrying("fixed")).warnings


def pendulum(**change: Any) -> Scene:
    """Two beams on pins about z that stay in the plane z = 0, or not, by `change`."""
    beam = {"length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 5.0,
            "polar_inertia_per_length": 1e-4}  # fmt: skip
    pins = [{"name": "h", "type": "pin", "inboard": "ground", "outboard": "a"},
            {"name": "k", "type": "pin", "inboard": "a.tip", "outboard": "b"}]  # fmt: skip
    pins[1] |= change.pop("pin", {})
    beams = [{"name": "a", **beam}, {"name": "b", **beam}]
    return Scene(**({"gravity": [0, -9.81, 0], "beam": beams, "hinge": pins} | change))


@pytest.mark.parametrize(
    ("change", "planar"),
    [
        ({}, True),
        ({"gravity": [0, 0, -9.81]}, False),
        ({"pin": {"axis": [0, 1, 0]}}, False),
        ({"pin": {"orientation": [0.3, 0, 0]}}, False),
        ({"pin": {"orientation": [0, 0, 0.3]}}, True),
        ({"load": [{"on": "b.tip", "force": ["cos(t)", 1, 0], "axes": "body"}]}, True),
        ({"load": [{"on": "b.tip", "force": [0, 0, "cos(t)"]}]}, False),
        ({"load": [{"on": "b.tip", "moment": [0, 0, 1]}]}, True),
        ({"load": [{"on": "b.tip", "moment": [1, 0, 0]}]}, False),
        ({"load": [{"on": "b", "force_per_length": [0, 1, 0]}]}, True),
        ({"load": [{"on": "b", "force_per_length": [0, 0, 1]}]}, False),
        ({"spring": [{"from": "ground", "to": "b.tip", "position": [0, 1, 0]}]}, True),
        ({"spring": [{"from": "ground", "to": "b.tip", "position": [0, 1, 0.1]}]}, False),
    ],
)
def test_a_scene_in_a_plane_has_no_shapes_out_of_it(change: dict[str, Any], planar: bool) -> None:
    for body in modal_bodies(pendulum(**change)).values():
        assert any(name.startswith("z") for name in body.modes) != planar


def test_a_body_beside_the_plane_brings_the_other_shapes_back() -> None:
    for height, inertia, planar in ((0.0, [1, 1, 1], True), (0.1, [1, 1, 1], False),
                                    (0.0, [1, 1, 1, 0, 0.2, 0], False)):  # fmt: skip
        body = {"name": "r", "mass": 1.0, "center_of_mass": [0.1, 0, height], "inertia": inertia}
        weld = {"name": "w", "type": "fixed", "inboard": "b.tip", "outboard": "r"}
        plain = pendulum()
        scene = Scene(gravity=plain.gravity, beam=plain.beam, body=[body],
                      hinge=[*plain.hinge, weld])  # fmt: skip
        names = modal_bodies(scene)["a"].modes
        assert any(name.startswith("z") for name in names) != planar


def test_a_beam_that_nothing_bends_keeps_one_plane() -> None:
    scene = Scene(
        gravity=[-9.81, 0, 0],
        beam=[{"name": "b", "length": 1, "mass_per_length": 1, "bending_stiffness": 1}],
        hinge=[{"name": "h", "type": "fixed", "inboard": "ground", "outboard": "b"}],
    )
    assert modal_bodies(scene)["b"].modes == ("y1", "y2", "y3")


def test_what_is_not_known_to_stay_in_the_plane_counts_as_leaving_it() -> None:
    plain = pendulum()
    disc = {"name": "d", "mass": 1.0, "inertia": [1, 1, 1], "ends": {"rim": [0, 0.1, 0]}}
    chain = {"name": "rope", "count": 3, "inboard": "b.tip", "body": {"mass": 0.1, "ends": {
        "tip": [0.1, 0, 0]}}, "hinge": {"type": "pin"}}  # fmt: skip
    ball = {"name": "s", "type": "ball", "inboard": "b.tip", "outboard": "d"}
    slider = ball | {"type": "prismatic", "axis": [0, 1, 0]}
    push = {"on": "d.rim", "force": [1, 1, 0], "axes": "b"}
    gravity, beam, hinge = plain.gravity, plain.beam, plain.hinge
    for scene, planar in (
        (Scene(gravity=gravity, beam=beam, hinge=hinge, chain=[chain]), False),
        (Scene(gravity=gravity, beam=beam, hinge=[*hinge, ball], body=[disc]), False),
        (Scene(gravity=gravity, beam=beam, hinge=[*hinge, slider], body=[disc]), True),
        (Scene(gravity=gravity, beam=beam, hinge=[*hinge, slider], body=[disc], load=[push]), True),
        # Hinges in any order; a beam turned about its own axis.
        (Scene(gravity=gravity, beam=beam, hinge=hinge[::-1]), True),
    ):
        names = modal_bodies(scene)["a"].modes
        assert any(name.startswith("z") for name in names) != planar
    turned = modal_bodies(pendulum(pin={"orientation": [np.pi / 2, 0, 0], "axis": [0, 1, 0]}))
    assert [body.modes[0] for body in turned.values()] == ["y1", "z1"]


def test_a_chain_on_a_beam_is_heavy() -> None:
    chain = {"name": "rope", "count": 3, "inboard": "b.tip", "body": {"mass": 0.01, "ends": {
        "tip": [0.1, 0, 0]}}, "hinge": {"type": "pin"}}  # fmt: skip
    body = body_of(HELD, more={"chain": [chain]})
    assert " static+fixed-interface shapes" in body.notes[0]


def test_quadrature_is_taken_where_the_frame_hangs_on_a_pin() -> None:
    assert body_of(PIN, frame="tangent", modes={"y": 4}).points
    assert not body_of(PIN, frame="tangent", modes={"y": 4}, stiffening=False).points
    assert not body_of(PIN, frame="chord", modes={"y": 4}).points
    assert not body_of(HELD, modes={"y": 4}).points
    assert not body_of(PIN, frame="tangent", modes={"y": 4}, quadrature=False).points


def test_equal_beams_are_worked_out_once_and_keep_their_names() -> None:
    beam = {"length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 1.0, "modes": {"y": 2}}
    names = [f"b{k}" for k in range(12)]
    hinges = [
        {"name": f"h{k}", "type": "pin", "inboard": f"b{k - 1}.tip" if k else "ground",
         "outboard": name}
        for k, name in enumerate(names)
    ]  # fmt: skip
    load = {"name": "wind", "on": "b5", "force_per_length": [0, 1, 0]}
    scene = Scene(gravity=[0, -9.81, 0], beam=[{"name": n, **beam} for n in names], hinge=hinges,
                  load=[load])  # fmt: skip
    bodies = modal_bodies(scene)
    assert [body.name for body in bodies.values()] == names
    # The first one hangs on the ground, the last one carries nothing.
    assert len({id(body.K) for body in bodies.values()}) == 3
    assert [name for name, body in bodies.items() if "wind" in body.ports] == ["b5"]


def test_auto_beats_every_named_basis_on_a_heavy_tip() -> None:
    """Clamped beam with a welded body as heavy as itself, two shapes, two frequencies."""

    def lowest(n: int, basis: str) -> np.ndarray[Any, Any]:
        more = carrying("fixed")
        body = body_of(HELD, modes={"y": n}, basis=basis, frame="tangent", more=more)
        phi, theta = body.ports["tip"].phi[1], body.ports["tip"].theta[2]
        mass = body.Mff + np.outer(phi, phi) + 0.05 * np.outer(theta, theta)
        return np.sqrt(scipy.linalg.eigvalsh(body.K, mass)[:2])

    exact = lowest(12, "static+fixed-interface")
    errors = {
        basis: float(np.abs(lowest(2, basis) / exact - 1).max())
        for basis in ("auto", "clamped-free", "free-free", "simply-supported")
    }
    assert errors["auto"] < 0.02
    assert all(errors["auto"] < 0.1 * error for basis, error in errors.items() if basis != "auto")
