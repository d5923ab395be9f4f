"""[[beam]]: what is read, what it becomes, what it stands for in the tree, what is warned of."""

from __future__ import annotations

import json
import math
import tomllib
from pathlib import Path
from typing import Any

import pytest

from mstmm.errors import SceneError
from mstmm.expression.expression import parse
from mstmm.scene import Scene, load_scene
from mstmm.scene.checks import topology
from mstmm.scene.tables.scene_tables import rigid_body_of_beam
from mstmm.scene.tables.shape_functions import ShapeFunction, shape_at
from tests.support.scenes.minimal import Data, blade_scene, hinge

WHOLE = """
gravity = [0, 0, -9.81]

[[beam]]
name = "blade"
length = 10.0
modes = { y = 2, z = 3, twist = 1, axial = 1 }
frame = "tangent@mid"
basis = "static+fixed-interface"
stiffening = false
quadrature = true
damping = { ratio = [0.01, 0.01, 0.02, 0.02, 0.02, 0.03, 0.04], stiffness = 1e-4 }
viscous_drag = 0.3
initial = { eta = [0.1, 0, 0, 0, 0, 0, 0], etad = [0, 0, 0, 0, 0, 0, 1] }
model = "one-way"
ends = { mid = 5.0, rim = { position = 7.5, orientation = [0, 0, 1] }, far = [9.0, 0, 0] }
axial_stiffness = 2.8e7
torsional_stiffness = 1e3
rotary_inertia = 1e-3

[[beam.section]]
from = 0
to = 4
mass_per_length = 1.2
bending_stiffness = [1.4e4, 2e4]

[[beam.section]]
from = 4
to = 10
mass_per_length = 0.8
bending_stiffness = 1e4
rotary_inertia = [1e-3, 2e-3]

[[hinge]]
name = "hub"
type = "pin"
inboard = "ground"
outboard = "blade.mid"

[[load]]
name = "lift"
on = "blade"
force_per_length = [0, 0, "2*sin(t) - 0.1*blade.u[2]"]
span = [5, 10]
axes = "body"

[[event]]
when = "blade.tip.z < -0.1"
do = "stop"

[[event]]
when = "blade.q[6] > 0.1"
do = "stop"
"""


def scene_warnings(**changes: Any) -> tuple[str, ...]:
    return Scene(**blade_scene(**changes)).warnings


def test_every_key_reads_and_writes(tmp_path: Path) -> None:
    path = tmp_path / "blade.toml"
    path.write_text(WHOLE)
    scene = load_scene(path)
    blade = scene.beam[0]
    assert blade.modes is not None
    assert blade.modes.counts == (2, 3, 1, 1) and blade.modes.total == 7
    assert blade.modes.names == ("y1", "y2", "z1", "z2", "z3", "twist1", "axial1")
    assert (blade.frame_kind, blade.frame_end, blade.basis) == (
        "tangent", "mid", "static+fixed-interface",
    )  # fmt: skip
    assert (blade.stiffening, blade.quadrature, blade.model) == (False, True, "one-way")
    assert blade.damping.stiffness == 1e-4 and blade.damping.ratio[-1] == 0.04
    assert blade.initial.etad == (0, 0, 0, 0, 0, 0, 1) and blade.viscous_drag == 0.3
    assert [blade.end_x(at) for at in ("", "root", "mid", "rim", "far", "tip")] == [
        0, 0, 5, 7.5, 9, 10,
    ]  # fmt: skip
    assert blade.ends["rim"].rotation[0][0] == pytest.approx(math.cos(1))
    assert scene.load[0].span == (5.0, 10.0)
    assert Scene(**tomllib.loads(scene.to_toml())) == scene
    assert Scene(**scene.model_dump()) == scene
    json.dumps(Scene.model_json_schema())


def test_pieces_take_from_the_beam_what_they_leave_out() -> None:
    first, second = Scene(**tomllib.loads(WHOLE)).beam[0].sections
    assert (first.from_, first.to, second.from_, second.to) == (0, 4, 4, 10)
    assert first.bending_stiffness == (1.4e4, 2e4) and second.bending_stiffness == (1e4, 1e4)
    assert first.axial_stiffness == second.axial_stiffness == 2.8e7
    assert first.rotary_inertia == (1e-3, 1e-3) and second.rotary_inertia == (1e-3, 2e-3)
    assert first.polar_inertia_per_length == 2e-3
    assert second.polar_inertia_per_length == pytest.approx(3e-3)


def test_defaults_and_shorthands() -> None:
    plain = Scene(**blade_scene(modes=...)).beam[0]
    assert plain.modes is None and plain.quadrature is None
    assert (plain.frame, plain.basis, plain.model, plain.stiffening) == (
        "auto", "auto", "flexible", True,
    )  # fmt: skip
    assert list(plain.ends) == ["root", "tip"] and plain.mass == pytest.approx(12.0)
    assert plain.damping.ratio == (0.0,) and not plain.damping.acts
    start = plain.initial
    assert (start.static, start.eta, start.etad) == (False, None, None)
    assert len(plain.sections) == 1 and plain.sections[0].polar_inertia_per_length is None
    same = Scene(**blade_scene(modes="auto", quadrature="auto", initial="undeformed", frame="auto"))
    assert same.beam[0] == plain
    given = Scene(**blade_scene(modes=3, damping=0.02, initial="static")).beam[0]
    assert given.modes is not None and given.modes.counts == (3, 3, 0, 0)
    assert given.damping.ratio == (0.02,) and given.initial.static


def test_the_name_alone_means_the_root() -> None:
    data = blade_scene() | {
        "hinge": [hinge(outboard="blade", axis=[0, 1, 0]), hinge("next", inboard="blade",
                  outboard="rod")],
        "body": [{"name": "rod", "mass": 1.0, "inertia": [1, 1, 1]}],
        "load": [{"on": "blade", "force": [1, 0, 0], "axes": "blade"},
                 {"on": "blade", "force_per_length": [1, 0, 0]}],
        "spring": [{"from": "ground", "to": "blade"}],
        "event": [{"when": "blade.x > 1", "do": "stop"}],
    }  # fmt: skip
    scene = Scene(**data)
    assert [h.outboard for h in scene.hinge] == ["blade.root", "rod"]
    assert scene.hinge[1].inboard == "blade.root" and scene.spring[0].to == "blade.root"
    assert [load.on for load in scene.load] == ["blade.root", "blade"]
    assert scene.load[0].axes == "blade"


def test_the_skeleton_has_the_same_tree_with_rigid_bodies() -> None:
    chain = {
        "name": "rope", "count": 3, "inboard": "blade.tip", "hinge": {"type": "ball"},
        "body": {"mass": 1.0, "inertia": [1, 1, 1], "ends": {"end": [1, 0, 0]}},
    }  # fmt: skip
    rod = {"name": "rod", "mass": 1.0, "inertia": [1, 1, 1]}
    hinges = [hinge(outboard="blade.mid"), hinge("b", inboard="rope[1].end", outboard="rod")]
    parts = {"body": [rod], "chain": [chain], "hinge": hinges}
    scene = Scene(**blade_scene(ends={"mid": 5.0}) | parts)
    assert [b.name for b in scene.bodies] == ["rod", "rope[0]", "rope[1]", "rope[2]"]
    skeleton = scene.skeleton
    names = [b.name for b in skeleton.bodies]
    assert names == ["rod", "blade", "rope[0]", "rope[1]", "rope[2]"]
    tree = topology.build_topology(skeleton)
    assert [names[i] for i in tree.order] == ["blade", "rope[0]", "rope[1]", "rope[2]", "rod"]
    assert tree.links[0].outboard_end == "mid" and tree.links[1].inboard_end == "tip"
    rigid = Scene(body=[rod], hinge=[hinge(outboard="rod")], gravity=[0, 0, 0])
    assert rigid.skeleton is rigid


def test_the_rigid_beam_has_the_mass_and_inertia_of_its_pieces() -> None:
    """Against sums over thin slices."""
    pieces = [
        {"from": 0, "to": 3, "mass_per_length": 2.0, "rotary_inertia": [0.1, 0.3]},
        {"from": 3, "to": 10, "mass_per_length": 0.5, "rotary_inertia": [0.2, 0.1]},
    ]
    scene = Scene(**blade_scene(section=pieces, mass_per_length=...))
    body = rigid_body_of_beam(scene.beam[0])
    n = 20_000
    slices = [(10 * (k + 0.5) / n, 10 / n) for k in range(n)]
    line = [(x, (2.0 if x < 3 else 0.5) * dx) for x, dx in slices]
    mass = sum(m for _, m in line)
    centre = sum(m * x for x, m in line) / mass
    across = sum(m * (x - centre) ** 2 for x, m in line)
    assert body.mass == pytest.approx(mass, rel=1e-6)
    assert body.center_of_mass == pytest.approx((centre, 0, 0), rel=1e-6)
    assert body.inertia == pytest.approx(
        (0.4 * 3 + 0.3 * 7, across + 0.1 * 3 + 0.2 * 7, across + 0.3 * 3 + 0.1 * 7, 0, 0, 0),
        rel=1e-6,
    )


# --- shapes of the user's own ---------------------------------------------------------------------


def test_shapes_and_their_exact_derivatives() -> None:
    f = ShapeFunction(parse("sin(pi*x/L) + (x/L)^3"), 2.0)
    for x in (0.0, 0.3, 1.7, 2.0):
        k, xi = math.pi / 2, x / 2
        assert f(x) == pytest.approx(
            (
                math.sin(k * x) + xi**3,
                k * math.cos(k * x) + 3 * xi**2 / 2,
                -(k**2) * math.sin(k * x) + 6 * xi / 4,
                -(k**3) * math.cos(k * x) + 6 / 8,
            ),
            abs=1e-14,
        )
    assert shape_at(parse("x^2"), 3.0, 9.0)[:3] == (9.0, 6.0, 2.0)


def test_shapes_say_how_many_modes_there_are() -> None:
    shapes = {"z": ["(x/L)^2", "(x/L)^3"], "y": ["1 - cos(pi*x/(2*L))"], "twist": ["x/L"]}
    data = blade_scene(
        shapes=shapes, modes=..., torsional_stiffness=10.0, polar_inertia_per_length=1e-3
    )
    scene = Scene(**data)
    blade = scene.beam[0]
    assert blade.basis == "given" and blade.modes is not None
    assert blade.modes.names == ("y1", "z1", "z2", "twist1")
    assert Scene(**tomllib.loads(scene.to_toml())) == scene


@pytest.mark.parametrize(
    "shape",
    ["where(x < L/2, x^2, L*x - L^2/4)", "sin(60*pi*x/L)", "exp(-40*x/L)", "x*abs(x)", "x^2*1e-9",
     "1e9*(x/L)^2", "(x/L)^2 + 1e-3*(x/L)^30"],
)  # fmt: skip
def test_smooth_shapes_are_accepted_whatever_their_waves_and_units(shape: str) -> None:
    assert Scene(**blade_scene(shapes={"y": [shape]}, modes=...)).beam[0].shapes is not None


@pytest.mark.parametrize(
    ("changes", "known"),
    [
        ({}, True),
        ({"ends": {"mid": 5.0}}, False),
        ({"ends": {"mid": 5.0}, "frame": "chord"}, True),
        ({"ends": {"mid": 5.0}, "frame": "tangent@root"}, True),
        ({"ends": {"mid": 5.0}, "frame": "tangent@mid"}, False),
        ({"ends": {"mid": 5.0}, "basis": "static+fixed-interface"}, True),
        ({"ends": {"end": 10.0}}, True),
    ],
)
def test_how_many_shapes_there_are_is_known_unless_a_frame_may_double_them(
    changes: Data, known: bool
) -> None:
    """Clamped-free shapes stand on either side of an inner section: 2 n of them."""
    data = blade_scene(**changes, initial={"eta": [0.1] * 6})
    blade = Scene(**data).beam[0]
    assert (blade.mode_names is not None) is known
    data["beam"][0]["initial"] = {"eta": [0.1] * 12}
    if known:
        with pytest.raises(SceneError, match="expected 6 entries"):
            Scene(**data)
    else:
        assert len(Scene(**data).beam[0].initial.eta or ()) == 12


# --- warnings -------------------------------------------------------------------------------------


def test_no_warning_for_a_slender_beam_left_to_the_defaults() -> None:
    assert scene_warnings(rotary_inertia=1e-4) == ()


@pytest.mark.parametrize(
    ("changes", "fragment"),
    [
        (
            {"rotary_inertia": [1.2 * 1.3**2 / 12, 1e-4]},
            "7.7 times the height of the section along",
        ),
        ({"rotary_inertia": [1.2 * 1.3**2 / 12, 1e-4]}, "(1.3 m from rotary_inertia"),
        ({"damping": 5}, "a ratio of 5 is critical or above; write 0.01 for 1 percent"),
        ({"basis": "free-free"}, 'no bending moment at "root", but hinge "hub" carries one there'),
    ],
)
def test_accepted_with_a_warning(changes: Data, fragment: str) -> None:
    found = scene_warnings(**changes)
    assert len(found) == 1 and fragment in found[0]


def test_height_counts_only_where_the_beam_bends() -> None:
    thick_along_z = {"rotary_inertia": [1.2 * 1.3**2 / 12, 1e-4]}
    assert scene_warnings(modes={"z": 2}, **thick_along_z)
    assert not scene_warnings(modes={"y": 2}, **thick_along_z)


PINNED: Data = {"type": "pin", "axis": [0, 0, 1]}


@pytest.mark.parametrize(
    ("kind", "changes", "count"),
    [
        (PINNED, {"frame": "tangent"}, 1),
        (PINNED, {"frame": "tangent@root"}, 1),
        (PINNED, {"frame": "tangent@tip"}, 0),
        (PINNED, {"frame": "chord"}, 0),
        (PINNED, {"frame": "tangent", "quadrature": True}, 0),
        (PINNED, {"frame": "tangent", "modes": {"z": 2}}, 0),
        (PINNED | {"drive": "t"}, {"frame": "tangent"}, 0),
        (PINNED | {"axis": [1, 0, 0]}, {"frame": "tangent", "rotary_inertia": 1e-4}, 0),
        ({"type": "ball"}, {"frame": "tangent", "rotary_inertia": 1e-4}, 1),
        ({"type": "universal", "axis": [1, 0, 0], "axis2": [0, 1, 0]},
         {"frame": "tangent", "modes": {"y": 1}, "rotary_inertia": 1e-4}, 0),
        ({"type": "fixed"}, {"frame": "tangent"}, 0),
        ({"type": "prismatic"}, {"frame": "tangent"}, 0),
    ],
)  # fmt: skip
def test_tangent_frames_where_the_hinge_leaves_the_section_free(
    kind: Data, changes: Data, count: int
) -> None:
    data = blade_scene(**changes)
    data["hinge"] = [{"name": "hub", "inboard": "ground", "outboard": "blade"} | kind]
    found = Scene(**data).warnings
    assert len(found) == count
    assert all('a tangent frame at "root", which hinge "hub" leaves free' in one for one in found)


@pytest.mark.parametrize(
    ("basis", "kind", "count"),
    [
        ("clamped-free", {"type": "pin"}, 0),
        ("clamped-free", {"type": "pin", "law": {"stiffness": 3.0}}, 1),
        ("clamped-free", {"type": "fixed"}, 1),
        ("clamped-free", {"type": "ball"}, 0),
        ("auto", {"type": "fixed"}, 0),
        ("static+fixed-interface", {"type": "fixed"}, 0),
    ],
)
def test_a_basis_that_cannot_carry_the_moment_at_the_tip(
    basis: str, kind: Data, count: int
) -> None:
    data = blade_scene(basis=basis, modes={"y": 2})
    data["body"] = [{"name": "load", "mass": 1.0, "inertia": [1, 1, 1]}]
    data["hinge"].append({"name": "grip", "inboard": "blade.tip", "outboard": "load"} | kind)
    found = Scene(**data).warnings
    assert len(found) == count
    assert all('moment at "tip", but hinge "grip" carries one' in one for one in found)
