"""Elements in a user's store that an earlier mstmm generated."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
import sympy as sp

import mstmm
from mstmm.derive import Hinge, Param
from mstmm.derive.catalogue.specs import spec_of
from mstmm.derive.print.render import element_source, header
from mstmm.errors import SceneError
from mstmm.runtime.kernels import store


class Cam(Hinge):
    """Slides along x as it turns."""

    name = "old_cam"
    coordinates = (Param("angle", "rad", "angle"),)

    def position(self, q, p):  # type: ignore[no-untyped-def]
        return sp.Matrix([sp.sin(q.angle), 0, 0])


def test_an_element_without_derivatives_is_refused_where_they_are_needed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MSTMM_KERNELS", str(tmp_path))
    spec = spec_of(Cam())
    older = replace(spec, kernels=tuple(k for k in spec.kernels if not k.name.endswith("_slope")))
    store.keep(older, {"mstmm.h": header(), "hinge_old_cam.c": element_source(older)})
    model = mstmm.compile(
        mstmm.Scene(
            gravity=[1, 0, 0],
            body=[{"name": "shoe", "mass": 1.0, "inertia": [1, 1, 1]}],
            hinge=[{"name": "cam", "type": "old_cam", "inboard": "ground", "outboard": "shoe"}],
        )
    )
    assert model.simulate(0.1).success
    with pytest.raises(SceneError, match=r'"cam".*earlier mstmm.*mstmm generate FILE'):
        model.simulate(0.1, method="rodas4p2")
