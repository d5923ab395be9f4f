"""Shares of energy by owner, against matrices of scenes in which one body weighs more."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.array_validation import Array
from mstmm.runtime.linear.modes import Modes
from tests.support.scenes.linear import UNIT, masses


def crane(weight: dict[str, float], damping: float = 0.0) -> mstmm.Model:
    """A hub with a rotor in its pin, a boom that bends, and a load on a ball; `weight` makes what
    a body weighs that many times larger."""

    def weight_of(name: str) -> float:
        return weight.get(name, 1.0)

    def body(name: str, mass: float, inertia: float, **more: Any) -> dict[str, Any]:
        return {"name": name, "mass": mass * weight_of(name),
                "inertia": [x * inertia * weight_of(name) for x in (1, 2, 3)], **more}  # fmt: skip

    law = {"stiffness": 50.0, "damping": damping, "inertia": 0.2 * weight_of("hub")}
    return mstmm.compile(
        mstmm.Scene(
            gravity=(0, 0, 0),
            body=[body("hub", 3.0, 0.1, ends={"arm": [0.2, 0, 0]}),
                  body("load", 0.5, 0.01, center_of_mass=[0, -0.4, 0])],
            beam=[{"name": "boom", **UNIT, "mass_per_length": weight_of("boom"),
                   "bending_stiffness": 400.0, "damping": damping, "modes": {"y": 3, "z": 2}}],
            hinge=[
                {"name": "slew", "type": "pin", "axis": [0, 0, 1], "inboard": "ground",
                 "outboard": "hub", "law": law},
                {"name": "foot", "type": "fixed", "inboard": "hub.arm", "outboard": "boom"},
                {"name": "hook", "type": "ball", "inboard": "boom.tip", "outboard": "load"},
            ],
        ),
        engine="looped",
    )  # fmt: skip


def modes_of(damping: float) -> Modes:
    model = crane({}, damping)
    return model.linearize(model.initial_state()[0], disturbances=()).modes()


@pytest.mark.parametrize("damping", [0.0, 0.1])
@pytest.mark.parametrize("body", ["hub", "boom", "load"])
def test_a_share_is_what_the_mass_matrix_gains_where_a_body_weighs_twice(
    body: str, damping: float
) -> None:
    modes = modes_of(damping)
    at = modes.linear.state
    heavier = crane({body: 2.0}, damping).linearize(at.q, disturbances=()).M - modes.linear.M
    x = modes.shapes

    def square(matrix: Array) -> Array:
        return np.real(np.einsum("ik,ij,jk->k", np.conj(x), matrix, x))

    assert np.iscomplexobj(x) == (damping > 0)
    expected = square(heavier) / square(modes.linear.M)
    np.testing.assert_allclose(modes.kinetic_energy_shares()[body], expected, rtol=1e-9, atol=1e-13)
    np.testing.assert_allclose(sum(modes.kinetic_energy_shares().values()), 1.0, rtol=1e-13)


def test_masses_of_many_carry_the_squares_of_their_places() -> None:
    modes = mstmm.compile(masses(500, 0.5, 200.0), engine="looped").modes(3)
    places = np.cumsum(modes.shapes, axis=0)
    shares = modes.kinetic_energy_shares()
    assert list(shares)[7] == "row[7]"
    np.testing.assert_allclose(list(shares.values()), 0.5 * places**2, atol=1e-12)
    strained = modes.strain_energy_shares()
    stretch = modes.shapes**2 / (modes.shapes**2).sum(axis=0)
    np.testing.assert_allclose(list(strained.values()), stretch, atol=1e-12)


def test_shares_are_written(tmp_path: Path) -> None:
    modes = modes_of(0.0)
    data = modes.to_dict()
    assert data["kinetic"]["boom"] == modes.kinetic_energy_shares()["boom"].tolist()
    assert data["strain"]["slew"] == modes.strain_energy_shares()["slew"].tolist()
    head, first = list(csv.reader(modes.save(tmp_path / "modes.csv").read_text().splitlines()))[:2]
    assert (
        float(first[head.index("kinetic energy of load")])
        == modes.kinetic_energy_shares()["load"][0]
    )
    assert (
        float(first[head.index("strain energy of boom")]) == modes.strain_energy_shares()["boom"][0]
    )
    import xarray

    with xarray.open_dataset(modes.save(tmp_path / "modes.nc"), engine="h5netcdf") as found:
        np.testing.assert_array_equal(
            found.kinetic.sel(body="hub"), modes.kinetic_energy_shares()["hub"]
        )
        np.testing.assert_array_equal(
            found.strain.sel(owner="slew"), modes.strain_energy_shares()["slew"]
        )
