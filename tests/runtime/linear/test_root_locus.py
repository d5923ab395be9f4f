"""Motions along a parameter, and where one begins to grow."""

from __future__ import annotations

import csv
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import SceneError
from tests.support.scenes.linear import column, pendulum, rotor_blade


def data_of(scene: mstmm.Scene) -> dict[str, Any]:
    """The tables of a scene."""
    return tomllib.loads(scene.to_toml())


def test_a_spinning_blade() -> None:
    """Campbell's diagram: flapping as published, 3.5160 at rest and 7.3604 at 6."""
    scene = data_of(rotor_blade(0))
    scene["hinge"][0]["drive"] = "spin*t"
    scene["constants"] = {"spin": 0.0}
    model = mstmm.compile(mstmm.Scene.from_data(scene), engine="looped")
    locus = model.root_locus("constants.spin", [0.0, 3.0, 6.0], 4)
    assert locus.eigenvalues.shape == (3, 4) and not locus.growth_rate.any()
    flap = [k for k in range(4) if abs(2 * np.pi * locus.frequency[2, k] - 7.3604) < 1e-3]
    assert 2 * np.pi * locus.frequency[0, flap[0]] == pytest.approx(3.5160, rel=1e-4)


def test_motions_go_on_through_a_crossing(tmp_path: Path) -> None:
    """One pendulum's stiffness passes that of another beside it."""
    scenes = [data_of(pendulum(law={"stiffness": k})) for k in (1.0, 4.0)]
    both = scenes[0]
    for table in ("body", "hinge"):
        other = scenes[1][table][0] | {"name": f"{scenes[1][table][0]['name']}2"}
        both[table].append(other)
    both["hinge"][1]["outboard"] = "bob2"
    model = mstmm.compile(mstmm.Scene.from_data(both), engine="looped")
    values = np.linspace(1.0, 7.0, 7)
    locus = model.root_locus("pivot.law.stiffness[0]", values)
    omega = np.sort(2 * np.pi * locus.frequency, axis=0)
    inertia, weight = 0.53, 9.81
    changed = np.sqrt((values + weight) / inertia)
    held = np.sqrt((4.0 + weight) / inertia)
    straight = [k for k in range(2) if np.allclose(2 * np.pi * locus.frequency[:, k], held)]
    assert len(straight) == 1
    np.testing.assert_allclose(2 * np.pi * locus.frequency[:, 1 - straight[0]], changed)
    assert omega.shape == (7, 2)
    rows = list(csv.reader(locus.save(tmp_path / "locus.csv").read_text().splitlines()))
    assert rows[0][:3] == ["pivot.law.stiffness[0]", "1 frequency [Hz]", "1 growth [1/s]"]
    np.testing.assert_array_equal(np.array(rows[1:], float)[:, 1::2], locus.frequency)
    import xarray

    with xarray.open_dataset(locus.save(tmp_path / "locus.nc"), engine="h5netcdf") as data:
        np.testing.assert_array_equal(data.frequency, locus.frequency)
        np.testing.assert_array_equal(data.value, values)
    locus.plot(tmp_path / "locus.png", orders=[1, 2])
    assert (tmp_path / "locus.png").stat().st_size > 10_000


def test_where_a_column_buckles_and_flutters() -> None:
    """Euler's pi^2/4 by divergence, Beck's 20.05 by flutter, beginning at a constant."""
    for axes, expected, kind, ends in (
        ("inertial", np.pi**2 / 4, "divergence", (1.0, 4.0)),
        ("body", 20.051, "flutter", (10.0, 30.0)),
    ):
        scene = data_of(column(1.0, axes, 10))
        scene["load"][0]["force"] = ["0 - p", 0, 0]
        scene["constants"] = {"p": 1.0}
        model = mstmm.compile(mstmm.Scene.from_data(scene), engine="looped")
        found = model.stability_limit("constants.p", *ends)
        assert found.value == pytest.approx(expected, rel=4e-4)
        assert found.kind == kind and found.dominant_coordinates[0] == "column.y1"
        assert (found.frequency > 1) == (kind == "flutter")


def test_ends_that_are_none() -> None:
    model = mstmm.compile(pendulum(law={"stiffness": 1.0}), engine="looped")
    with pytest.raises(SceneError, match="found a stable scene"):
        model.stability_limit("pivot.law.stiffness[0]", 1.0, 2.0)
    with pytest.raises(SceneError, match="did you mean"):
        model.root_locus("pivot.law.stifness[0]", [1.0])
    with pytest.raises(SceneError, match="values"):
        model.root_locus("pivot.law.stiffness[0]", [])
    with pytest.raises(SceneError, match="values"):
        model.root_locus("pivot.law.stiffness[0]", [1.0, float("nan")])
