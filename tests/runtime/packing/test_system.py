"""System: a scene's numbers in internal frames, frozen, in Python; what C gets is what it says."""

from __future__ import annotations

import dataclasses
import pickle
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.packing import system as records
from mstmm.runtime.packing.fused_structure import structure_of
from mstmm.runtime.packing.packed_scene import PackedScene
from mstmm.runtime.packing.records.body_records import link_kernel
from mstmm.runtime.packing.scene_packing import pack
from mstmm.runtime.packing.system import BodyNumbers, System
from mstmm.runtime.packing.system_builder import system_of

ROD = {"mass": 1.0, "center_of_mass": [0.5, 0.1, 0], "inertia": [0.01, 0.1, 0.1],
       "ends": {"tip": [1, 0, 0.1]}}  # fmt: skip
LIGHT = ROD | {"mass": 0.3}
#: A pattern of two bodies and three hinges, period six.
PATTERN: list[dict[str, Any]] = [
    {"type": "pin", "axis": [0, 1, 0.2], "law": {"effort": "sin(t) - q"}},
    {"type": "ball", "law": {"stiffness": [1.0], "damping": [0.1]}},
    {"type": "screw", "lead": 0.2, "law": {"inertia": [0.4], "friction": [{"coulomb": 1.0}]}},
]


def chain(count: int) -> dict[str, Any]:
    rope = {"name": "rope", "count": count, "inboard": "ground", "body": [ROD, LIGHT]}
    return {"gravity": [0, -9.81, 0], "chain": [rope | {"hinge": PATTERN}]}


def written_out(count: int) -> dict[str, Any]:
    bodies = [(LIGHT if k % 2 else ROD) | {"name": f"b{k}"} for k in range(count)]
    hinges = [
        PATTERN[k % 3] | {"name": f"h{k}", "outboard": f"b{k}"}
        | {"inboard": f"b{k - 1}.tip" if k else "ground"}
        for k in range(count)
    ]  # fmt: skip
    return {"gravity": [0, -9.81, 0], "body": bodies, "hinge": hinges}


def arm(mass: float = 2.0) -> mstmm.Scene:
    """A beam with a body at its tip, driven, loaded and on a spring."""
    return mstmm.Scene(
        gravity=[0, -9.81, 0],
        beam=[{"name": "blade", "length": 1.0, "mass_per_length": 1.0, "axial_stiffness": 1e5,
               "bending_stiffness": [100.0, 80.0], "torsional_stiffness": 30.0}],
        body=[ROD | {"name": "tip", "mass": mass}],
        hinge=[{"name": "base", "type": "pin", "inboard": "ground", "outboard": "blade.root",
                "drive": "0.1*sin(t)"},
               {"name": "wrist", "type": "universal", "inboard": "blade.tip", "outboard": "tip",
                "axis": [1, 0, 0], "axis2": [0, 1, 0]}],
        load=[{"on": "blade.tip", "force": [0, "sin(3*t)", 0.2], "axes": "body"}],
        spring=[{"name": "rope", "from": "ground", "to": "tip.tip", "position": [0, 2, 0],
                 "law": {"stiffness": 3.0, "effort": "0.1*u"}}],
    )  # fmt: skip


def scene_system(scene: mstmm.Scene) -> System:
    return system_of(scene)[0]


def test_every_record_of_a_system_is_frozen() -> None:
    found = [x for x in vars(records).values() if dataclasses.is_dataclass(x)]
    assert len(found) > 10
    assert all(vars(one)["__dataclass_params__"].frozen for one in found)


@pytest.mark.parametrize("make", [arm, lambda: mstmm.Scene(**chain(9))])
def test_equal_scenes_have_equal_systems(make: Any) -> None:
    assert scene_system(make()) == scene_system(make())


def test_another_number_is_another_system() -> None:
    assert scene_system(arm()) != scene_system(arm(2.5))
    stiffer = mstmm.compile(arm(), engine="looped").with_parameters(
        {"blade.bending_stiffness[0]": 99}
    )
    assert scene_system(arm()) != stiffer.packed_scene.system


def test_a_system_holds_nothing_of_c() -> None:
    system = scene_system(arm())
    assert pickle.loads(pickle.dumps(system)) == system


@pytest.mark.parametrize("count", [1, 2, 6, 7, 8, 20])
def test_a_chain_is_the_bodies_written_out(count: int) -> None:
    pattern = 1 if count < 3 else 3
    data, plain = chain(count), written_out(count)
    data["chain"][0]["hinge"] = PATTERN[:pattern]
    data["chain"][0]["body"] = [ROD, LIGHT][: min(2, count)]
    for k, hinge in enumerate(plain["hinge"]):
        plain["hinge"][k] = PATTERN[k % pattern] | {
            key: hinge[key] for key in ("name", "inboard", "outboard")
        }
    one, other = scene_system(mstmm.Scene(**data)), scene_system(mstmm.Scene(**plain))
    assert [one.body(k) for k in range(count)] == [other.body(k) for k in range(count)]
    assert (one.parents == other.parents).all()
    structures = [structure_of(system, {}) for system in (one, other)]
    assert structures[0][0] == structures[1][0]
    assert structures[0][1].tobytes() == structures[1][1].tobytes()


def test_members_of_a_chain_share_their_numbers() -> None:
    system = scene_system(mstmm.Scene(**chain(1_000_000) | {"chain": [
        chain(1_000_000)["chain"][0] | {"hinge": PATTERN[1:]}
    ]}))  # fmt: skip
    assert system.count == 1_000_000
    assert sum(1 for _ in system.distinct) == 2 + 2
    assert sum(len(run.pattern) for run in system.laws) == 2


def link_numbers(body: BodyNumbers) -> tuple[float, ...]:
    """Numbers of the body, of its rotor and its hinge, and of the way from its parent."""
    if not link_kernel(body):
        return ()
    return (*body.body_p, body.rotor[0], *(body.hinge_p or (0.0,)),
            *(body.link or body.connection))  # fmt: skip


def read(packed: PackedScene, place: int) -> dict[str, Any]:
    """What C has of a body."""
    record, body = packed.model.bodies[place], packed.system.body(place)
    lengths = {
        "connection": 15, "hinge_p": len(body.hinge_p), "rotor": body.nu, "imposed_mask": body.nu,
        "body_p": len(body.body_p) + len(body.body_frame), "link": len(link_numbers(body)),
    }  # fmt: skip
    arrays = {
        name: tuple(packed.ffi.unpack(getattr(record, name), n)) if n else ()
        for name, n in lengths.items()
    }
    return arrays | {"q": record.q, "u": record.u, "parent": record.parent, "nu": record.nu,
                     "release": record.release}  # fmt: skip


@pytest.mark.parametrize(
    "scene", [arm(), mstmm.Scene(**chain(20)), mstmm.Scene(**written_out(5))],
    ids=["arm", "chain", "bodies"],
)  # fmt: skip
def test_c_has_the_numbers_of_the_system(scene: mstmm.Scene) -> None:
    packed = pack(scene)
    system, places = packed.system, packed.system.first_indices
    for k in range(system.count):
        body = system.body(k)
        assert read(packed, k) == {
            "connection": (*body.connection, 0.0, 0.0, -body.height), "hinge_p": body.hinge_p,
            "rotor": body.rotor, "imposed_mask": body.imposed,
            "body_p": (*body.body_p, *body.body_frame), "link": link_numbers(body),
            "q": places["q"][k], "u": places["u"][k],
            "parent": system.parents[k], "nu": body.nu, "release": body.release,
        }  # fmt: skip
    laws = [packed.model.laws[k] for k in range(packed.model.n_laws)]
    said = [entry for run in system.laws for entry in run.iterate_laws()]
    assert len(laws) == len(said)
    for record, (law, place, twist, effort) in zip(laws, said, strict=True):
        assert (record.body, record.twist, record.n) == (place, twist, law.n)
        assert tuple(packed.ffi.unpack(record.effort, law.n)) == effort
        assert tuple(packed.ffi.unpack(record.p, len(law.p))) == law.p


def test_places_follow_from_member_to_member() -> None:
    scene = mstmm.Scene(**chain(11))
    model = mstmm.compile(scene, engine="looped")
    layout, places = model.coordinate_layout, model.packed_scene.system.first_indices
    assert (places["q"] == layout.q_starts).all() and (places["u"] == layout.u_starts).all()
    rows = model.packed_scene.system.rows(lambda body: body.nu)
    assert (np.diff([*places["u"], model.nu]) == rows).all()
