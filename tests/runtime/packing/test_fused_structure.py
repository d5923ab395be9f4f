"""What is structure and what is a number: collapse, parameter studies, the choice of engine."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import SceneError
from mstmm.ir import KernelIR
from mstmm.pipeline.fused_code import DEFAULT_MAX_BODIES, MAX_BODIES, Fusion, printer_files
from mstmm.runtime.packing.fused_structure import structure_of
from mstmm.runtime.packing.scene_packing import pack
from tests.support.scenes.results import pins


def chain(
    n: int, hinge: dict[str, Any], inertia: list[float], gravity: list[float], **more: Any
) -> mstmm.Scene:
    """n rods along x, each hanging on the tip of the one before."""
    body = {"mass": 1.5, "center_of_mass": [0.5, 0, 0], "inertia": inertia}
    bodies = [{"name": f"b{i}", "ends": {"tip": [1, 0, 0]}, **body} for i in range(n)]
    hinges = [
        {
            "name": f"h{i}",
            "inboard": f"b{i - 1}.tip" if i else "ground",
            "outboard": f"b{i}",
            **hinge,
        }
        for i in range(n)
    ]
    return mstmm.Scene(schema_version=1, gravity=gravity, body=bodies, hinge=hinges, **more)


def kernel(scene: mstmm.Scene) -> KernelIR:
    model = mstmm.compile(scene, engine="looped")
    structure, _ = structure_of(model.packed_scene.system, model.known or {})
    found: KernelIR = model.fusion.structure_ir(structure).kernels["accelerations"]
    return found


PLANAR = {"type": "pin", "axis": [0, 0, 1]}
FULL = [0.2, 0.3, 0.25, 0.01, 0.02, -0.03]


def test_planar_scenes_collapse_to_planar_kernels() -> None:
    # What only matters across the plane is never computed: another tensor changes nothing,
    # nor does gravity across the plane.
    plain = kernel(chain(6, PLANAR, [0.01, 0.2, 0.2], [0, -9.81, 0]))
    full = kernel(chain(6, PLANAR, FULL, [0, -9.81, 3.0]))
    skew = kernel(chain(6, {"type": "pin", "axis": [0, 0.6, 0.8]}, FULL, [0, -9.81, 3.0]))
    ball = kernel(chain(6, {"type": "ball"}, FULL, [0, -9.81, 3.0]))
    assert plain.operation_counts() == full.operation_counts()
    # About sixty operations a body, whatever plane it is; in space several times as many.
    assert full.flops() < 6 * 70
    assert skew.flops() < full.flops() + 20
    assert ball.flops() > 4 * full.flops()


def test_one_reciprocal_a_pin_and_one_sincos() -> None:
    counts = kernel(
        chain(5, {"type": "pin", "axis": [0, 1, 0]}, FULL, [0, 0, -9.81])
    ).operation_counts()
    assert (counts["div"], counts["sin"], counts["cos"]) == (5, 5, 5)


def test_other_numbers_need_no_compiler_and_structural_zeros_do(monkeypatch: Any) -> None:
    scene = chain(2, PLANAR, FULL, [0, -9.81, 0])
    model = mstmm.compile(scene, engine="fused")
    q, u = np.array([0.3, -0.4]), np.array([0.5, 0.2])
    monkeypatch.setenv("CC", "/nonexistent/compiler")
    heavier = model.with_parameters({"b0.mass": 7.0, "h1.law.damping": 0.0})
    assert heavier.fusion.library is model.fusion.library
    expected = mstmm.compile(heavier.scene, engine="looped").accelerations(q, u)
    np.testing.assert_allclose(heavier.accelerations(q, u), expected, rtol=1e-13)
    assert abs(heavier.accelerations(q, u) - model.accelerations(q, u)).max() > 1e-3
    # A damper where there was none is another structure: without a compiler the model says so.
    damped = model.with_parameters({"h1.law.damping": 2.0})
    assert damped.engine == "looped"
    assert "compiler" in damped.engine_reason
    monkeypatch.delenv("CC")
    compiled = model.with_parameters({"h1.law.damping": 2.0})
    assert compiled.engine == "fused"
    expected = mstmm.compile(compiled.scene, engine="looped").accelerations(q, u)
    np.testing.assert_allclose(compiled.accelerations(q, u), expected, rtol=1e-13)
    np.testing.assert_allclose(damped.accelerations(q, u), expected, rtol=1e-13)


def test_numbers_of_expressions_are_no_structure() -> None:
    def loaded_chain(force: str) -> mstmm.Scene:
        load = {"on": "b1.tip", "force": ["0", force, "0"]}
        return chain(2, PLANAR, FULL, [0, -9.81, 0], load=[load])

    q, u = np.array([0.3, -0.4]), np.array([0.5, 0.2])
    found = []
    for force in ("10*cos(3*t)", "4*cos(5*t)"):
        looped = mstmm.compile(loaded_chain(force), engine="looped")
        structure, _ = structure_of(looped.packed_scene.system, {})
        found.append(structure.identity())
        fused = mstmm.compile(loaded_chain(force), engine="fused")
        np.testing.assert_allclose(
            fused.accelerations(q, u, 0.7), looped.accelerations(q, u, 0.7), rtol=1e-13
        )
    assert found[0] == found[1]


# --- the choice -----------------------------------------------------------------------------------


def test_auto_compiles_only_what_pays() -> None:
    scene = chain(3, {"type": "pin", "axis": [1, 0, 0]}, FULL, [0.1, 0.2, -9.81])
    model = mstmm.compile(scene)
    assert model.engine == "looped"
    assert "long run" in model.engine_reason
    assert model.fusion.ready(10) is None
    assert model.fusion.ready(1e9) is not None
    assert model.engine == "fused"
    assert "compiled" in model.engine_reason
    again = mstmm.compile(scene)  # from now on it is in the cache
    assert again.engine == "fused"
    assert "cache" in again.engine_reason


def released_scene() -> mstmm.Scene:
    hinge = {**PLANAR, "drive": ["0"], "release": "t >= 1"}
    return chain(1, hinge, FULL, [0, -9.81, 0])


def long() -> mstmm.Scene:
    return chain(MAX_BODIES + 1, PLANAR, FULL, [0, -9.81, 0])


@pytest.mark.parametrize(
    ("scene", "reason"),
    [pytest.param(released_scene, "released", id="released-released"), (long, "bodies")],
)
def test_what_cannot_be_fused_says_why(scene: Any, reason: str) -> None:
    model = mstmm.compile(scene())
    assert model.fusion.ready(1e12) is None
    assert model.engine == "looped"
    assert reason in model.engine_reason
    with pytest.raises(SceneError, match=reason):
        mstmm.compile(scene(), engine="fused")


def test_scenes_too_large_for_auto_are_fused_when_asked_for() -> None:
    large = chain(DEFAULT_MAX_BODIES + 1, PLANAR, FULL, [0, -9.81, 0])
    assert "bodies" in mstmm.compile(large).engine_reason
    assert not Fusion(pack(large), {}, {}, most=MAX_BODIES).obstacle


def test_contradictory_wishes_are_refused() -> None:
    scene = pins(2, [0.1, 0.2])
    with pytest.raises(SceneError, match="fused"):
        mstmm.compile(scene, engine="looped", bake=True)
    with pytest.raises(SceneError, match="product"):
        mstmm.compile(scene, engine="fused", sweep="product")
    with pytest.raises(SceneError, match="engine"):
        mstmm.compile(scene, engine="quick")


def test_everything_that_prints_the_text_is_part_of_the_key() -> None:
    code = (
        "import sys, mstmm.derive.fuse.scene_kernels, mstmm.derive.codegen.scene_text\n"
        "print(*(m.__file__ for n, m in sys.modules.items() if n.startswith('mstmm')))"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {Path(name).resolve() for name in found.stdout.split()}
    missed = {path.name for path in loaded - {path.resolve() for path in printer_files()}}
    assert missed <= {"__init__.py", "errors.py", "signal_handling.py", "version.py"}
