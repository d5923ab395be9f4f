"""Every built-in hinge written anew under another name: nothing goes by what a hinge is called."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.derive.catalogue.registry import builtin_hinges
from mstmm.runtime.packing.fused_structure import structure_of

#: What each type needs besides its name.
KEYS: dict[str, dict[str, Any]] = {
    "screw": {"axis": [0, 1, 0], "lead": 0.3},
    "universal": {"axis": [0, 0, 1], "axis2": [0.1, 1, 0]},
    "planar": {"axis": [0, 0, 1], "axis2": [1, 0.5, 0]},
    "elastic": {"axis": [0, 1, 0], "law": {"stiffness": [90, 80, 70, 6, 5, 4]}},
    "gimbal": {}, "fixed": {},
}  # fmt: skip
HINGES = {hinge.name: hinge for hinge in builtin_hinges()}


@pytest.fixture(scope="module", autouse=True)
def anew(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Every hinge as a user's own, in a store of this module's."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MSTMM_KERNELS", str(tmp_path_factory.mktemp("kernels")))
        for name, hinge in HINGES.items():
            body = {"name": f"my_{name}", "equivalent_builtin": "", "__module__": __name__}
            mstmm.register(type(f"My{type(hinge).__name__}", (type(hinge),), body))
        yield


def scene(hinge: str, name: str) -> mstmm.Scene:
    """A hub that turns, a beam on the hinge, and an elastic body on another one of its kind."""
    keys = {"type": hinge, **KEYS.get(name, {"axis": [0, 0, 1]})}
    ends = {"root": {"plane": [1, 0, 0, 0.0]}, "tip": {"plane": [1, 0, 0, 0.6]}}
    return mstmm.Scene(
        gravity=[0.4, -9.81, 0.3],
        body=[{"name": "hub", "mass": 2.0, "inertia": [0.1, 0.2, 0.3],
               "ends": {"a": [0.2, 0, 0], "b": [-0.2, 0, 0], "c": [0, 0.2, 0]}},
              {"name": "rod", "mass": 1.0, "center_of_mass": [0.3, 0, 0],
               "inertia": [0.01, 0.05, 0.06], "ends": {"tip": [0.6, 0, 0]}},
              {"name": "end", "mass": 0.5, "center_of_mass": [0.2, 0, 0],
               "inertia": [0.01, 0.02, 0.03]}],
        beam=[{"name": "blade", "length": 1.0, "mass_per_length": 1.0, "modes": 2,
               "bending_stiffness": [30.0, 60.0], "rotary_inertia": [1e-4, 2e-4],
               "polar_inertia_per_length": 3e-4}],
        elastic=[{"name": "block", "box": {"size": [0.6, 0.1, 0.1], "divisions": [4, 1, 1]},
                  "young": 1e9, "poisson": 0.3, "density": 1000, "modes": 2, "ends": ends}],
        hinge=[
            {"name": "base", "type": "pin", "inboard": "ground", "outboard": "hub"},
            {"name": "one", "inboard": "hub.a", "outboard": "blade", **keys},
            {"name": "two", "inboard": "hub.b", "outboard": "block.root", **keys},
            {"name": "three", "inboard": "hub.c", "outboard": "rod", **keys},
            {"name": "last", "type": "pin", "inboard": "rod.tip", "outboard": "end"},
        ],
        load=[{"on": "blade.tip", "force": [0, "sin(3*t)", 0.2]}],
    )  # fmt: skip


def builtin_messages(texts: tuple[str, ...]) -> tuple[str, ...]:
    """The same messages with the name of the built-in type."""
    return tuple(text.replace("my_", "") for text in texts)


@pytest.mark.parametrize("name", sorted(HINGES))
def test_nothing_goes_by_the_name(name: str) -> None:
    made = {kind: scene(kind, name) for kind in (name, f"my_{name}")}
    models = [mstmm.compile(one, engine="looped") for one in made.values()]
    ours, theirs = models
    assert ours.scene.warnings == builtin_messages(theirs.scene.warnings)
    for body in ours.flexible_bodies:
        one, other = ours.flexible_bodies[body], theirs.flexible_bodies[body]
        assert (one.frame, one.modes, one.notes) == (
            other.frame,
            other.modes,
            builtin_messages(other.notes),
        )
        assert one.K.tobytes() == other.K.tobytes() and one.C.tobytes() == other.C.tobytes()
    links = [[body.link for body in model.packed_scene.system.distinct] for model in models]
    assert links[0] == links[1]
    first, second = (structure_of(model.packed_scene.system, model.known or {}) for model in models)
    assert first[0] == second[0] and first[1].tobytes() == second[1].tobytes()
    assert ours.coordinate_layout.q_names == theirs.coordinate_layout.q_names
    assert ours.parameters.keys() - theirs.parameters.keys() == set()
    runs = [model.simulate(0.01, method="rk4", step=5e-5) for model in models]
    assert runs[0].success and np.isfinite(runs[0].q).all()
    assert runs[0].q.tobytes() == runs[1].q.tobytes()
    assert runs[0].quantity_names() == runs[1].quantity_names()
    assert runs[0].certificate.warnings == builtin_messages(runs[1].certificate.warnings)
