"""Elements in a user's store that an earlier mstmm generated."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
import sympy as sp

import mstmm
from mstmm.derive import ForceElement, Hinge, Param
from mstmm.derive.catalogue.element_specs import spec_of
from mstmm.derive.codegen.template_rendering import element_source, mstmm_header
from mstmm.errors import SceneError
from mstmm.runtime.kernels import kernel_store


class Cam(Hinge):
    """Slides along x as it turns."""

    name = "old_cam"
    coordinates = (Param("angle", "rad", "angle"),)

    def position(self, q, p):  # type: ignore[no-untyped-def]
        return sp.Matrix([sp.sin(q.angle), 0, 0])


class Magnet(ForceElement):
    """Pulls with a moment of its own."""

    name = "old_magnet"
    parameters = (Param("pull", "N", "pull"),)

    def wrench(self, x, v, rotation, w, p, effort, t):  # type: ignore[no-untyped-def]
        return sp.Matrix([-p.pull, 0, 0]), sp.zeros(3, 1)


def keep_without_derivatives(element: Hinge | ForceElement) -> None:
    spec = spec_of(element)
    older = replace(spec, kernels=tuple(k for k in spec.kernels if not k.name.endswith("_slope")))
    assert older != spec
    text = element_source(older)
    kernel_store.store_element(
        older, {"mstmm.h": mstmm_header(), f"{spec.kind}_{spec.name}.c": text}
    )


def shoe(hinge: str, **more: object) -> mstmm.Scene:
    return mstmm.Scene(
        gravity=[1, 0, 0],
        body=[{"name": "shoe", "mass": 1.0, "inertia": [1, 1, 1]}],
        hinge=[{"name": "cam", "type": hinge, "inboard": "ground", "outboard": "shoe"}],
        **more,
    )


@pytest.mark.parametrize("culprit", ["cam", "magnet"])
def test_elements_without_derivatives_are_refused_where_they_are_needed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, culprit: str
) -> None:
    monkeypatch.setenv("MSTMM_KERNELS", str(tmp_path))
    keep_without_derivatives(Cam() if culprit == "cam" else Magnet())
    magnet: dict[str, object] = {
        "name": "magnet",
        "type": "old_magnet",
        "from": "ground",
        "to": "shoe",
    }
    magnet["parameters"] = {"pull": 1.0}
    scene = shoe("old_cam") if culprit == "cam" else shoe("pin", spring=[magnet])
    model = mstmm.compile(scene)
    assert model.simulate(0.1).success
    with pytest.raises(SceneError, match=rf'"{culprit}".*earlier mstmm.*mstmm generate FILE'):
        model.simulate(0.1, method="rodas4p2")
