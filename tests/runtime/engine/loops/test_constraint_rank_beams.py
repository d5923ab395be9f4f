"""Whether straight beams that are held at both ends may bend."""

from __future__ import annotations

from typing import Any

import pytest

import mstmm
from mstmm.errors import SceneError


def supported_beam_model(kind: str, modes: dict[str, int]) -> mstmm.Model:
    """Model of a beam on the ground, supported by a hinge at either end."""
    beam: dict[str, Any] = {
        "name": "b", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 1.0,
        "axial_stiffness": 1e4, "modes": modes,
    }  # fmt: skip
    hinges = [
        {"name": name, "type": kind, "inboard": "ground", "outboard": end, "position": [x, 0, 0]}
        for name, end, x in (("foot", "b", 0.0), ("far", "b.tip", 1.0))
    ]
    return mstmm.compile(mstmm.Scene(gravity=[0, 0, 0], beam=[beam], hinge=hinges))


@pytest.mark.parametrize(("kind", "rows"), [("pin", 2), ("fixed", 3)])
@pytest.mark.parametrize("count", [4, 8, 12])
def test_one_that_stretches_bends(kind: str, rows: int, count: int) -> None:
    """However many shapes there are; the angle of the hinge that is cut goes far with many."""
    loops = supported_beam_model(kind, {"y": count, "axial": 3}).loops
    hinges = 0 if kind == "fixed" else 1
    assert (loops.rank, loops.mobility) == (rows, count + 3 + hinges - rows)
    assert not loops.singular


@pytest.mark.parametrize("kind", ["pin", "fixed"])
@pytest.mark.parametrize("count", [4, 8])
def test_one_that_does_not_is_refused(kind: str, count: int) -> None:
    with pytest.raises(SceneError, match=r'"far" in an isolated configuration.*axial shapes'):
        supported_beam_model(kind, {"y": count})
