"""Bad beams: one line a problem, with beam, key, what was expected, found, and a way out."""

from __future__ import annotations

from typing import Any

import pytest

from mstmm.errors import SceneError
from mstmm.scene import Scene
from tests.support.scenes.minimal import Data, arm, beam, blade_scene

NAN = float("nan")


def message_of(data: Data) -> str:
    with pytest.raises(SceneError) as caught:
        Scene.from_data(data, "blade.toml")
    lines = str(caught.value).split("\n")
    assert all(line.startswith("blade.toml: ") and line.isprintable() for line in lines)
    assert len(lines) <= 11 and caught.value.exit_code == 2
    return str(caught.value)


def pieces(*ranges: tuple[float, float], **changes: Any) -> Data:
    """A beam whose sections go from one x to another."""
    section: list[Data] = [
        {"from": a, "to": b, "mass_per_length": 1.2, "bending_stiffness": 1.4e4} for a, b in ranges
    ]
    section[-1] |= changes
    section[-1] = {key: value for key, value in section[-1].items() if value is not ...}
    return blade_scene(section=section, mass_per_length=..., bending_stiffness=...)


def shape_case(shape: str, direction: str = "y", **changes: Any) -> Data:
    return blade_scene(shapes={direction: [shape]}, modes=..., **changes)


def load_case(load: Data, **changes: Any) -> Data:
    rod = {"name": "rod", "mass": 1.0, "inertia": [1, 1, 1]}
    grip = {"name": "grip", "type": "fixed", "inboard": "blade.tip", "outboard": "rod"}
    data = blade_scene(**changes)
    return data | {"body": [rod], "hinge": [*data["hinge"], grip], "load": [load]}


def hinge_case(**changes: Any) -> Data:
    """A beam on a hinge of another type."""
    hub = {"name": "hub", "type": "ball", "inboard": "ground", "outboard": "blade"} | changes
    return blade_scene() | {"hinge": [hub]}


TWIST: Data = {"modes": {"twist": 1}}

BAD: list[tuple[Data, str]] = [
    # section data
    (blade_scene(length=0), 'beam "blade": length: expected a number in m, more than 0, found 0'),
    (blade_scene(length=-3), "length: expected a number in m, more than 0, found -3"),
    (blade_scene(length=...), "length: missing; expected a number in m"),
    (blade_scene(mass_per_length=0),
     "mass_per_length: expected a number in kg/m, more than 0, found 0"),
    (blade_scene(mass_per_length=-1), "mass_per_length: expected a number in kg/m, more than 0"),
    (blade_scene(length=1e-40), "length: a beam of 1e-40 m and 1.2e-40 kg has mass and stiffness"),
    (blade_scene(length=1e200),
     "outside the range of double precision; check the units (m, kg/m, N"),
    (blade_scene(mass_per_length=1e-320), "outside the range of double precision"),
    (blade_scene(bending_stiffness=1e300), "outside the range of double precision"),
    (blade_scene(mass_per_length=NAN), "found nan, which is not finite"),
    (blade_scene(mass_per_length=...), "mass_per_length: missing; expected a number in kg/m"),
    (blade_scene(bending_stiffness=...), "bending_stiffness: missing; expected E I in N m^2"),
    (blade_scene(bending_stiffness=0),
     "bending_stiffness: expected a number, or two, [about y, about"),
    (blade_scene(bending_stiffness=[1, -2]), "bending_stiffness[1]: expected a number, or two,"),
    (blade_scene(bending_stiffness=[1, -2]), "in N m^2, more than 0, found -2"),
    (blade_scene(bending_stiffness=[1, 2, 3]), "in N m^2, found 3 entries"),
    (blade_scene(bending_stiffness="1 N"),
     "found '1 N'; leave out the unit, all numbers are in SI"),
    (blade_scene(axial_stiffness=0),
     "axial_stiffness: expected a number in N, more than 0, found 0"),
    (blade_scene(torsional_stiffness=-1),
     "torsional_stiffness: expected a number in N m^2, more than"),
    (blade_scene(polar_inertia_per_length=0),
     "polar_inertia_per_length: expected a number in kg m"),
    (blade_scene(rotary_inertia=[0, 1]), "rotary_inertia[0]: expected a number, or two"),
    (blade_scene(rotary_inertia=[1, 2], polar_inertia_per_length=5),
     "expected the sum of both entries of rotary_inertia, 3 kg m, as for every plane section"),
    (blade_scene(shear_stiffness=1e4), "rotary_inertia: missing; shear_stiffness needs it: expec"),
    (blade_scene(shear_stiffness=[1, -2], rotary_inertia=1),
     "shear_stiffness[1]: expected a number, or two, [along y, along z], in N, more than 0"),
    (blade_scene(shear_stiffness=1e4, rotary_inertia=1, shapes={"y": ["(x/L)^2"]}, modes=...),
     "shapes: expected no bending shapes with shear_stiffness"),
    (blade_scene(mas_per_length=1), 'mas_per_length: unknown key; did you mean "mass_per_length"?'),
    (blade_scene(mass=1.2), 'mass: unknown key; did you mean "mass_per_length"?'),
    (blade_scene(EI=1.2), 'EI: unknown key; did you mean "bending_stiffness"?'),
    (blade_scene(viscous_drag=-1),
     "viscous_drag: expected a number in N s/m^2, 0 or more, found -1"),
    # pieces
    (pieces((0, 4), (5, 10)), "section[1].from: expected 4 m, where the previous piece ends,"),
    (pieces((0, 4), (5, 10)), "found 5, a gap of 1 m; write from = 4"),
    (pieces((0, 4), (3, 10)), "found 3, an overlap of 1 m; write from = 4"),
    (pieces((1, 10)), "section[0].from: expected 0 m, where the beam begins, found 1"),
    (pieces((0, 4), (4, 9)), "section[1].to: expected the length of the beam, 10 m, found 9"),
    (pieces((0, 4), (4, 11)), "section[1].to: expected the length of the beam, 10 m, found 11"),
    (pieces((0, 4), (4, 4)), "section[1].to: expected a number in m, more than from (4), found 4"),
    (pieces((0, 4), (4, 10), mass_per_length=-1), "section[1].mass_per_length: expected a number"),
    (pieces((0, 4), (4, 10), mass_per_length=...), "section[1].mass_per_length: missing; expected"),
    (pieces((0, 4), (4, 10), bending_stiffness=...), "section[1].bending_stiffness: missing"),
    (pieces((0, 4), (4, 10), rotary_inertia=1e-3),
     "section[0].rotary_inertia: missing, though other pieces have it"),
    (pieces((0, 4), (4, 10), length=3), "section[1].length: unknown key"),
    (blade_scene(section={"from": 0}),
     "section: expected a list of tables; write [[beam.section]]"),
    # shapes
    (blade_scene(modes=0),
     "modes: expected at least one shape, found none; write for example modes"),
    (blade_scene(modes={}),
     'expected at least one shape, found none; write for example modes = 3,'),
    (blade_scene(modes=61), "modes.y: expected 60 shapes or fewer, found 61"),
    (blade_scene(modes={"z": 1000}), "modes.z: expected 60 shapes or fewer, found 1000"),
    (blade_scene(modes=-1), "modes.y: expected a whole number, 0 or more, found -1"),
    (blade_scene(modes=2.5), "modes: expected a whole number of shapes per bending plane, a table"),
    (blade_scene(modes=True), "found true"),
    (blade_scene(modes="many"), "found 'many'"),
    (blade_scene(modes={"x": 1}), "modes.x: unknown key; use one of y, z, twist, axial"),
    (blade_scene(modes=[3, 3]), "modes: expected a whole number of shapes per bending plane"),
    (blade_scene(**TWIST),
     "torsional_stiffness: missing; twist shapes need it: expected G I_t in N"),
    (blade_scene(**TWIST, torsional_stiffness=1),
     "polar_inertia_per_length: missing; twist shapes"),
    (blade_scene(modes={"axial": 1}),
     "axial_stiffness: missing; axial shapes need it: expected E A"),
    (blade_scene(basis="clamped"), 'basis: expected "auto" or "clamped-free" or "free-free"'),
    (blade_scene(basis="given"), 'shapes: missing; basis = "given" needs shapes'),
    (shape_case("x^2", basis="free-free"),
     'basis: expected "given" with shapes, found "free-free";'),
    (blade_scene(shapes={"y": ["x^2"]}, modes=3),
     "modes: shapes has y = 1, z = 0, twist = 0, axial ="),
    (blade_scene(shapes={}, modes=...), "modes: expected at least one shape, found none"),
    (blade_scene(shapes={"v": ["x"]}, modes=...), "shapes.v: unknown key"),
    (shape_case("t^2"), "shapes.y[0]: 't' is unknown; use one of x, L, pi"),
    (shape_case("x[0]^2"), "'x[0]' is unknown; use one of x, L, pi"),
    (shape_case("x^"), "shapes.y[0]: the expression ends where a value is expected"),
    (shape_case("x > 1"), "found a comparison; write where(x > 1, 1, 0)"),
    (shape_case("x"),
     "shapes.y[0]: the shape does not deform the beam; leave it out, the hinge gives"),
    (shape_case("0"), "the shape does not deform the beam"),
    (shape_case("1", "twist", torsional_stiffness=1, polar_inertia_per_length=1),
     "shapes.twist[0]:"),
    (shape_case("log(x)"), "the value, slope or curvature is not finite at x = 0 m; use a smooth"),
    (shape_case("x^1.5"), "the value, slope or curvature is not finite at x = 0 m"),
    (shape_case("sqrt(x)", "axial", axial_stiffness=1),
     "the value or slope is not finite at x = 0 m"),
    (shape_case("abs(x - 3)"), "the slope jumps along the beam; join the pieces smoothly"),
    (shape_case("where(x < 4.9, x^2, 1 + x^2*2)"), "the value jumps along the beam"),
    (shape_case("where(x < 5, 0, 1)", "axial", axial_stiffness=1),
     "the value jumps along the beam"),
    # frame, ends
    (blade_scene(frame="rigid"),
     'frame: expected "auto", "tangent", "chord" or "mean" ("tangent@mid"'),
    (blade_scene(frame="tangent@mid"),
     'frame: there is no end "mid"; use one of root, tip; define a'),
    (blade_scene(frame="tangent@mid"), "as an end, as in ends = { mid = 5 }"),
    (blade_scene(frame="chord@tip"), "frame: expected"),
    (blade_scene(frame="tangent@"), "frame: expected"),
    (blade_scene(ends={"mid": 11}),
     "ends.mid: expected a position on the beam, 0 to 10 m, found 11"),
    (blade_scene(ends={"mid": -1}),
     "ends.mid: expected a position on the beam, 0 to 10 m, found -1"),
    (blade_scene(ends={"mid": [5, 0.1, 0]}),
     "expected a point on the axis of the beam, found [5, 0.1"),
    (blade_scene(ends={"mid": {"position": [1, 2]}}),
     "ends.mid.position: expected three numbers in m"),
    (blade_scene(ends={"tip": 9.0}), 'expected 10 m, the position of "tip" on every beam, found 9'),
    (blade_scene(ends={"mid": "middle"}), "ends.mid.position[0]: expected a number in m, found"),
    (blade_scene(ends={"mid": True}), "ends.mid: expected a table, found true"),
    (blade_scene(ends={"a.b": 3.0}), "expected the name of an end, found 'a.b'"),
    (blade_scene(ends=[5.0]), "ends: expected a table such as { mid = 5.0 }, found [5]"),
    # damping, start, level of model
    (blade_scene(damping=-0.1), "damping.ratio: expected a modal damping ratio"),
    (blade_scene(damping=[0.1, 0.1]),
     "damping.ratio: expected 6 entries, one per shape: y1, y2, y3,"),
    (blade_scene(damping=[]),
     "damping.ratio: expected a modal damping ratio or more, found an empty"),
    (blade_scene(damping={"stifness": 1}),
     'damping.stifness: unknown key; did you mean "stiffness"?'),
    (blade_scene(damping=[0.1, 0.1], modes="auto"), 'modes = "auto" chooses the number of shapes'),
    (blade_scene(initial="steady"),
     "initial: expected \"undeformed\", \"static\" or a table { eta,"),
    (blade_scene(initial={"eta": [0.1]}),
     "initial.eta: expected 6 entries, one per shape: y1, y2, y3,"),
    (blade_scene(initial={"etad": [0.1]}), "initial.etad: expected 6 entries"),
    (blade_scene(initial={"eta": [0] * 9}, modes={"y": 9, "z": 2}),
     "y1, y2, y3, y4, y5, y6, y7, y8,"),
    (blade_scene(initial={"eta": [0.1]}, modes="auto"),
     "initial.eta: modes = \"auto\" chooses the"),
    (blade_scene(initial={"static": True, "eta": [0] * 6}),
     "initial.eta: static already gives the"),
    (blade_scene(initial={"q": [0]}), "initial.q: unknown key; use one of static, eta, etad"),
    (blade_scene(model="stiff"),
     'model: expected "flexible" or "rigid" or "one-way", found \'stiff\''),
    (blade_scene(quadrature="yes"), "quadrature: expected true or false or \"auto\", found 'yes'"),
    (blade_scene(quadrature=1), 'quadrature: expected true or false or "auto", found 1'),
    (blade_scene(stiffening="auto"), "stiffening: expected true or false, found 'auto'"),
    # among the other elements
    (blade_scene() | {"beam": [beam(), beam()]},
     '"blade" is also the name of beam number 1; rename'),
    (arm(beam=[beam("rod1")]), 'beam "rod1": name: "rod1" is also the name of a body; rename one'),
    (arm(beam=[beam("elbow")]), '"elbow" is also the name of a hinge; rename one'),
    (blade_scene() | {"hinge": []},
     'beam "blade": no hinge connects it to the ground; add a hinge of'),
    (blade_scene() | {"beam": [beam(), beam("flap")]}, 'beam "flap": no hinge connects it to the'),
    (hinge_case(outboard="blad"), 'outboard: there is no body "blad"; did you mean "blade"?'),
    (hinge_case(outboard="blade.tp"), 'body "blade" has no end "tp"; did you mean "tip"?'),
    (hinge_case(),
     "polar_inertia_per_length: missing; hinge \"hub\" allows the beam to spin about its"),
    (hinge_case(type="free"), "which it has no inertia; expected rho I_p in kg m, more than 0, or"),
    (hinge_case(type="pin", axis=[1, 0, 0]), "polar_inertia_per_length: missing"),
    (hinge_case(type="fixed", release="t > 1"), "polar_inertia_per_length: missing"),
    # loads per length and expressions
    (load_case({"on": "rod", "force_per_length": [1, 0, 0]}), 'on: "rod" is no beam;'),
    (load_case({"on": "blade.tip", "force_per_length": [1, 0, 0]}), "expected the name of a beam"),
    (load_case({"on": "blad", "force_per_length": [1, 0, 0]}), 'no body "blad"; did you mean'),
    (load_case({"on": "blade", "force_per_length": [1, 0]}), "three numbers or expressions in N/m"),
    (load_case({"on": "blade", "force_per_length": [1, 0, 0], "force": [1, 0, 0]}),
     "write two loads"),
    (load_case({"on": "blade", "force_per_length": ["x", 0, 0]}), "force_per_length[0]: 'x' is"),
    (load_case({"on": "blade", "span": [0, 1]}), "span: only force_per_length acts on a span"),
    (load_case({"on": "blade", "force_per_length": [1, 0, 0], "span": [3, 3]}),
     "with 0 <= from < to"),
    (load_case({"on": "blade", "force_per_length": [1, 0, 0], "span": [-1, 3]}),
     "with 0 <= from <"),
    (load_case({"on": "blade", "force_per_length": [1, 0, 0], "span": [3, 11]}),
     'expected a part of the beam "blade", 0 to 10 m, found [3, 11]'),
    (load_case({"name": "mid", "on": "blade", "force_per_length": [1, 0, 0]}, ends={"mid": 5}),
     '"mid" is also an end of the beam "blade"; rename the load'),
    (load_case({"on": "rod", "force": ["blade.q", 0, 0]}),
     "flexible body \"blade\" has 6 entries;"),
    (load_case({"on": "rod", "force": ["blade.q[6]", 0, 0]}), 'the last entry of flexible body'),
    (load_case({"on": "rod", "force": ["blade.z1", 0, 0]}),
     "'blade.z1' is unknown; write blade.q[3]"),
    (load_case({"on": "rod", "force": ["blade.q", 0, 0]}, modes="auto"), "give the index of the"),
    (load_case({"on": "rod", "force": ["blade.eta[0]", 0, 0]}), "a flexible body has"),
    (load_case({"on": "rod", "force": ["blade.tip.x", 0, 0]}), "are available only in events and"),
    (load_case({"on": "rod", "axes": "blad"}),
     'axes: there is no body "blad"; did you mean "blade"?'),
]  # fmt: skip


@pytest.mark.parametrize(("data", "fragment"), BAD)
def test_refused_with_beam_key_and_way_out(data: Data, fragment: str) -> None:
    assert fragment in message_of(data)


def test_the_whole_line() -> None:
    assert message_of(blade_scene(**TWIST, polar_inertia_per_length=1.0)) == (
        'blade.toml: beam "blade": torsional_stiffness: missing; twist shapes need it: '
        "expected G I_t in N m^2, more than 0"
    )


def test_several_problems_of_a_beam_are_reported_together() -> None:
    message = message_of(
        blade_scene(modes=70, ends={"mid": 20}, bending_stiffness=..., frame="tangent@a")
    )
    for key in ("modes.y", "bending_stiffness", "ends.mid", "frame"):
        assert f'beam "blade": {key}: ' in message


def test_the_most_shapes_are_accepted() -> None:
    assert Scene(**blade_scene(modes=60)).beam[0].modes is not None


@pytest.mark.parametrize("changes", [{"type": "screw", "axis": [1, 0, 0], "lead": 0.1},
    {"type": "pin", "axis": [1, 0, 0], "law": {"inertia": 1.0}}, {"type": "planar"},
    {"type": "universal", "axis": [0, 1, 0], "axis2": [0, 0, 1]}])  # fmt: skip
def test_beams_that_cannot_spin_freely_need_no_polar_inertia(changes: Data) -> None:
    assert Scene(**hinge_case(**changes)).beam[0].sections[0].polar_inertia_per_length is None


def test_a_rigid_beam_needs_mass_alone() -> None:
    scene = Scene(**blade_scene(model="rigid", modes=..., bending_stiffness=...))
    assert scene.beam[0].mass == pytest.approx(12.0)
