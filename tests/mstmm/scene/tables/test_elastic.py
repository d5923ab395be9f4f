"""[[elastic]]: what is read, where its files are looked for, what is refused."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.sparse import csr_array

from mstmm.errors import SceneError
from mstmm.scene import Scene, load_scene
from mstmm.scene.checks import topology
from tests.support.scenes.minimal import Data

ROOT: Data = {"plane": [1, 0, 0, 0.0]}
TIP: Data = {"box": [[1, -1, -1], [1, 1, 1]], "coupling": "mean"}
STEEL: Data = {"young": 2e11, "poisson": 0.3, "density": 7800.0}
HUB: Data = {"name": "hub", "type": "fixed", "inboard": "ground", "outboard": "link.root"}
BLOCK: Data = {"box": {"size": [1, 0.05, 0.02], "divisions": [20, 1, 1]}} | STEEL


def link_scene(source: Data = BLOCK, **changes: Any) -> Data:
    """An elastic body on a fixed hinge; `...` removes a key."""
    table = {"name": "link", "modes": 4, "ends": {"root": ROOT, "tip": TIP}} | source | changes
    table = {key: value for key, value in table.items() if value is not ...}
    return {"gravity": [0, 0, -9.81], "elastic": [table], "hinge": [HUB]}


def arrays(nodes: int = 2, **changes: Any) -> Data:
    unit = np.eye(3 * nodes)
    places = [[float(k), 0, 0] for k in range(nodes)]
    table = {"mass": unit, "stiffness": unit, "nodes": places} | changes
    return {"arrays": table}


def message_of(data: Data) -> str:
    with pytest.raises(SceneError) as caught:
        Scene.from_data(data, "link.toml")
    lines = str(caught.value).split("\n")
    assert all(line.startswith("link.toml: ") and line.isprintable() for line in lines)
    return str(caught.value)


WHOLE = """
gravity = [0, 0, -9.81]

[[elastic]]
name = "link"
mesh = "parts/link.msh"
scale = 1e-3
order = 2
young = 7e10
poisson = 0.33
density = 2700.0
modes = 6
frame = "mean"
highest_frequency = 1e5
stiffening = false
damping = { ratio = 0.01, stiffness = 1e-5 }
initial = "static"
model = "one-way"

[elastic.ends]
root = { set = "clamp", static_shapes = true }
tip = { sphere = [1, 0, 0, 0.02], position = [1, 0, 0], orientation = [0, 0, 1], coupling = "mean" }
eye = { nodes = [0, 4, 7], static_shapes = "auto" }

[[hinge]]
name = "hub"
type = "pin"
inboard = "ground"
outboard = "link.root"

[[event]]
when = "link.tip.z < link.z - 0.1"
do = "stop"

[[event]]
when = "link.q[0] > 0.1"
do = "stop"
"""


def test_every_key_reads_and_writes(tmp_path: Path) -> None:
    (tmp_path / "link.toml").write_text(WHOLE)
    scene = load_scene(tmp_path / "link.toml")
    link = scene.elastic[0]
    assert link.source == "mesh" and link.mesh == str(tmp_path / "parts" / "link.msh")
    assert (link.scale, link.order, link.modes, link.highest_frequency) == (1e-3, 2, 6, 1e5)
    assert (link.frame_kind, link.frame_end, link.model) == ("mean", "", "one-way")
    assert {name: end.region for name, end in link.ends.items()} == {
        "root": "set", "tip": "sphere", "eye": "nodes",
    }  # fmt: skip
    tip = link.ends["tip"]
    assert (tip.coupling, tip.position, tip.sphere) == ("mean", (1, 0, 0), (1, 0, 0, 0.02))
    assert link.ends["root"].static_shapes is True and link.ends["eye"].static_shapes is None
    assert Scene(**tomllib.loads(scene.to_toml())) == scene
    assert Scene(**scene.model_dump()) == scene
    json.dumps(Scene.model_json_schema())
    assert [
        scene.skeleton.bodies[i].name for i in topology.build_topology(scene.skeleton).order
    ] == ["link"]


def test_paths_start_from_the_folder_of_the_scene_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where the scene file itself is named from another folder; a path from Python stays."""
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "link.json").write_text(json.dumps(link_scene({"matrices": "link.npz"})))
    monkeypatch.chdir(tmp_path)
    assert load_scene("a/link.json").elastic[0].matrices == str(tmp_path / "a" / "link.npz")
    absolute = str(tmp_path / "b" / "link.npz")
    (tmp_path / "a" / "link.json").write_text(json.dumps(link_scene({"matrices": absolute})))
    assert load_scene("a/link.json").elastic[0].matrices == absolute
    assert Scene(**link_scene({"matrices": "link.npz"})).elastic[0].matrices == "link.npz"
    assert Scene(**link_scene({"matrices": Path("x/link.npz")})).elastic[0].matrices == "x/link.npz"


def test_no_file_is_opened_by_loading_a_scene(tmp_path: Path) -> None:
    """The file named is a trap that would be found out by reading it."""
    trap = tmp_path / "link.npz"
    trap.write_bytes(b"not a zip")
    path = tmp_path / "link.json"
    path.write_text(json.dumps(link_scene({"matrices": "link.npz"})))
    assert load_scene(path).elastic[0].matrices == str(trap)


def test_arrays_of_numpy_and_scipy_and_lists_are_the_same() -> None:
    dense = Scene(**link_scene(arrays(), frame="tangent"))
    table = arrays()["arrays"]
    lists = {"arrays": {key: np.asarray(value).tolist() for key, value in table.items()}}
    sparse = {"arrays": table | {"mass": csr_array(table["mass"])}}
    assert Scene(**link_scene(lists, frame="tangent")) == dense
    assert Scene(**link_scene(sparse, frame="tangent")) == dense
    held = dense.elastic[0].arrays
    assert held is not None and np.array_equal(held.mass, np.eye(6))
    assert held.scalar_mass is None and held.order == "node"
    assert Scene(**tomllib.loads(dense.to_toml())) == dense


ENDS = "ends.root: expected exactly one of nodes, box, plane, sphere, set for the nodes of this end"
BAD: list[tuple[Data, str]] = [
    (link_scene({}), 'elastic "link": expected exactly one of matrices, arrays, mesh, box as the'),
    (link_scene(matrices="a.npz"),
     "found matrices and box; write for example matrices = \"link.npz\""),
    (link_scene({"matrices": "a.csv"}),
     "matrices: expected the path of a file ending in .npz, found"),
    (link_scene({"matrices": 3}), "matrices: expected the path of a file ending in .npz, found 3"),
    (link_scene({"matrices": "a\0.npz"}), "matrices: expected the path of a file ending in .npz"),
    (link_scene({"mesh": ""} | STEEL), "mesh: expected the path of a file, found ''"),
    (link_scene({"matrices": "a.npz"}, young=1), "young: matrices already contain the material;"),
    (link_scene(arrays(), density=1), "density: arrays already contain the material; leave it out"),
    (link_scene({"matrices": "a.npz"}, order=2), "order: only mesh and box have an element order"),
    (link_scene(scale=0.001), "scale: only a mesh file has its own length unit; leave it out"),
    (link_scene(young=...), "young: missing; a body from a box needs Young's modulus in Pa"),
    (link_scene(young=0), "young: expected a number in Pa, more than 0, found 0"),
    (link_scene(density=-1), "density: expected a number in kg/m^3, more than 0, found -1"),
    (link_scene(poisson=0.5), "found 0.5; no element is incompressible"),
    (link_scene(poisson=-1), "poisson: expected Poisson's ratio, more than -1 and less than 0.5"),
    (link_scene(order=3), "order: expected a whole number from 1 to 2, found 3"),
    (link_scene(modes=-1), 'modes: expected a whole number from 0 to 200 or "auto", found -1'),
    (link_scene(modes="some"), "found 'some'"),
    (link_scene(frame="chord"), 'frame: expected "auto", "tangent" or "mean", found \'chord\''),
    (link_scene(highest_frequency=0), "highest_frequency: expected a number in rad/s, more than 0"),
    (link_scene(materials={}), "materials: unknown key; did you mean \"matrices\"?"),
    (link_scene(initial={"eta": [1], "etad": [1, 2]}),
     "initial.etad: expected as many entries as eta"),
    # box
    (link_scene(box={"size": [1, 0, 1], "divisions": [1, 1, 1]}),
     "box.size: expected three numbers"),
    (link_scene(box={"size": [1, 1, 1], "divisions": [1, 1.5, 1]}),
     "box.divisions: expected three"),
    (link_scene(box={"size": [1, 1, 1], "divisions": [0, 1, 1]}), "numbers from 1 to 10000, found"),
    (link_scene(box={"size": [1, 1, 1]}), "box.divisions: missing; expected three whole numbers"),
    # ends
    (link_scene(ends=...), "ends: missing; an elastic body connects only at its ends"),
    (link_scene(ends={"a b": ROOT}), "expected the name of an end, found 'a b'"),
    (link_scene(ends={"root": {}}),
     f"{ENDS}, found none; write for example plane = [1, 0, 0, 0.0]"),
    (link_scene(ends={"root": ROOT | {"set": "a"}}), f"{ENDS}, found plane, set"),
    (link_scene(ends={"root": {"set": "a"}}), "ends.root.set: only a mesh file has named surfaces"),
    (link_scene(ends={"root": {"plane": [0, 0, 0, 1]}}),
     "ends.root.plane: expected a normal that is"),
    (link_scene(ends={"root": {"plane": [1, 0, 0]}}), "ends.root.plane: expected [nx, ny, nz, d]"),
    (link_scene(ends={"root": {"sphere": [0, 0, 0, 0]}}),
     "ends.root.sphere[3]: expected a radius in"),
    (link_scene(ends={"root": {"box": [[1, 0, 0], [0, 1, 1]]}}),
     "ends.root.box: expected two corners"),
    (link_scene(ends={"root": {"box": [[1, 0, 0]]}}), "ends.root.box: expected two corners"),
    (link_scene(ends={"root": {"nodes": []}}),
     "ends.root.nodes: expected numbers of nodes, from 0"),
    (link_scene(ends={"root": {"nodes": [-1]}}),
     "ends.root.nodes[0]: expected a whole number from 0"),
    (link_scene(arrays(), ends={"root": {"nodes": [2]}}), "expected numbers from 0 to 1, found 2"),
    (link_scene(ends={"root": ROOT | {"coupling": "soft"}}),
     'coupling: expected "rigid" or "mean"'),
    (link_scene(ends={"root": ROOT | {"static_shapes": "no"}}), "static_shapes: expected true or"),
    # arrays
    (link_scene(arrays(mass=np.eye(5))),
     "arrays.mass: expected 6 x 6 or 12 x 12 numbers for 2 nodes"),
    (link_scene(arrays(mass=np.eye(5))), "found 5 x 5"),
    (link_scene(arrays(stiffness=np.eye(12))), "as many unknowns as the mass matrix, 6, found 12"),
    (link_scene(arrays(scalar_mass=np.eye(3))),
     "arrays.scalar_mass: expected 2 x 2 numbers for 2 nod"),
    (link_scene(arrays(nodes=0)), "the mass matrix, rows of numbers"),
    (link_scene(arrays(mass=[[1, 2], [3]])), "arrays.mass[1]: expected rows of 2 numbers, found 1"),
    (link_scene(arrays(mass=np.full((6,
     6), np.nan))), "arrays.mass[0][0]: expected a number, found"),
    (link_scene(arrays(mass="M")),
     "arrays.mass: expected the mass matrix, rows of numbers, found 'M'"),
    (link_scene(arrays(mass=np.zeros((3001,
     1)))), "1 to 3000 rows, found 3001; save larger ones to a"),
    (link_scene(arrays(order="rows")), 'arrays.order: expected "node" or "component"'),
    # among the other elements
    (link_scene() | {"hinge": []}, 'elastic "link": no hinge connects it to the ground'),
    (link_scene() | {"load": [{"on": "link"}]},
     '"link" is an elastic body, which connects only at'),
    (link_scene() | {"load": [{"on": "link"}]}, 'ends; write "link.root"'),
    (link_scene() | {"load": [{"on": "link.top"}]}, 'body "link" has no end "top"; did you mean'),
    (link_scene() | {"load": [{"on": "link", "force_per_length": [1, 0, 0]}]},
     '"link" is an elastic'),
    (link_scene() | {"body": [{"name": "link", "mass": 1}]}, '"link" is also the name of a body;'),
    (link_scene() | {"hinge": [HUB | {"outboard": "link"}]},
     'hinge "hub": outboard: "link" is an elastic body, which connects only at its ends; write'),
]  # fmt: skip


@pytest.mark.parametrize(("data", "fragment"), BAD)
def test_refused_with_element_key_and_way_out(data: Data, fragment: str) -> None:
    assert fragment in message_of(data)


@pytest.mark.parametrize(
    ("kind", "frame", "count"),
    [("ball", "tangent", 1), ("fixed", "tangent", 0), ("ball", "auto", 0), ("ball", "mean", 0)],
)
def test_a_tangent_frame_where_the_hinge_leaves_the_end_free(
    kind: str, frame: str, count: int
) -> None:
    data = link_scene(frame=frame) | {"hinge": [HUB | {"type": kind}]}
    found = Scene(**data).warnings
    assert len(found) == count
    assert all(w.startswith('elastic "link": frame: a tangent frame at "root"') for w in found)
