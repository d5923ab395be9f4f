"""Results in files: nothing is lost on the way, nothing half-written, clear words when it fails."""

from __future__ import annotations

import csv
import errno
import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray
from scipy.io import loadmat, savemat

import mstmm
from mstmm.runtime.result.export.column_files import ColumnFile, matlab_names
from mstmm.runtime.result.result import Result
from tests.support.scenes.linkages import four_bar
from tests.support.scenes.results import GRAVITY, motor, pins, rod, tree


@pytest.fixture(scope="module")
def run() -> Result:
    return mstmm.compile(tree()).simulate(0.5, rtol=1e-8, certify=True)


def test_netcdf_brings_everything_back(run: Result, tmp_path: Path) -> None:
    path = run.save(tmp_path / "run.nc")
    again = mstmm.load_result(path)
    assert again.model.scene == run.model.scene
    for name in run.quantity_names():
        np.testing.assert_array_equal(again.quantity(name).values, run.quantity(name).values)
    assert (again.success, again.status, again.message) == (run.success, run.status, run.message)
    assert again.settings == run.settings and again.statistics == run.statistics
    assert str(again.certificate) == str(run.certificate)
    for ours, theirs in zip(again.last_state, run.last_state, strict=True):
        np.testing.assert_array_equal(ours, theirs)
    assert [p.name for p in tmp_path.iterdir()] == ["run.nc"]


def test_a_hinge_may_share_the_name_of_its_body() -> None:
    hinge = {"name": "rod", "type": "pin", "inboard": "ground", "outboard": "rod"}
    data = (
        mstmm.compile(mstmm.Scene(gravity=GRAVITY, body=[rod("rod")], hinge=[hinge]))
        .simulate(0.01)
        .to_xarray()
    )
    assert [*data["hinge"].values] == ["rod"] and [*data["body"].values] == ["rod", "rod.tip"]
    assert data["euler"].dims == ("time", "body", "angle")


def test_files_without_a_place_for_near_singular_poses(tmp_path: Path) -> None:
    """Until 2026-11-24 memory of scenes with loops had a column less, behind those of bounces."""
    stops = {"lower": 1.38, "upper": 1.42, "restitution": 0.7}
    scene = four_bar(speed=4.0, laws={"end": {"limits": stops}})
    scene["body"].append({"name": "bob", "mass": 1.0, "inertia": [0.1, 0.2, 0.3]})
    scene["hinge"].append({"name": "ball", "type": "ball", "inboard": "coupler", "outboard": "bob",
                           "law": {"stiffness": [3.0, 3.0, 2.0]}})  # fmt: skip
    run = mstmm.compile(mstmm.Scene(**scene)).simulate(0.05)
    memory, place = run.trajectory.memory, run.model.packed_scene.system.strain_index
    assert memory[-1, :place].any() and 0 < place < memory.shape[1] - 1
    data = run.to_xarray()
    data = data.isel(memory_place=np.arange(memory.shape[1]) != place)
    data.to_netcdf(tmp_path / "old.nc", engine="h5netcdf")
    again = mstmm.load_result(tmp_path / "old.nc")
    np.testing.assert_array_equal(again.trajectory.memory, memory)
    for name in run.quantity_names():
        np.testing.assert_array_equal(again.quantity(name).values, run.quantity(name).values)


def test_netcdf_is_labelled_with_units_and_provenance(run: Result, tmp_path: Path) -> None:
    with xarray.open_dataset(run.save(tmp_path / "run.nc"), engine="h5netcdf") as data:
        assert data["position"].dims == ("time", "body", "axis")
        assert data["position"].attrs["units"] == "m" and data["force"].attrs["units"] == "N"
        assert all("long_name" in variable.attrs for variable in data.variables.values())
        tip = data["position"].sel(body="arm.tip", axis="y").values
        np.testing.assert_array_equal(tip, run.position("arm.tip")[:, 1])
        wrist = data["moment"].sel(hinge="wrist").values
        np.testing.assert_array_equal(wrist, run.moment("wrist"))
        angle = data["q"].sel(coordinate="elbow.angle2")
        np.testing.assert_array_equal(angle.values, run.coordinates("elbow")[:, 1])
        assert str(angle["coordinate_units"].values) == "rad"
        assert "[[hinge]]" in str(data["scene"].values)
        assert json.loads(data.attrs["versions"])["mstmm"] == mstmm.__version__
        assert len(data.attrs["kernels_sha256"]) == 64
        assert json.loads(data.attrs["settings"])["rtol"] == 1e-8
        assert data["error_q_0"].attrs["units"] == "m"


def test_events_and_interrupted_runs_survive(tmp_path: Path) -> None:
    data = {
        "gravity": [0, -9.81, 0], "body": [{"name": "a", "mass": 1, "inertia": [1, 1, 1]}],
        "hinge": [{"name": "h", "type": "prismatic", "axis": [0, 1, 0], "inboard": "ground",
                   "outboard": "a"}],
        "event": [{"when": "a.y < -1", "do": "stop"}],
    }  # fmt: skip
    run = mstmm.compile(mstmm.Scene.from_data(data)).simulate(5.0)
    again = mstmm.load_result(run.save(tmp_path / "run.nc"))
    assert again.message == run.message and "stopped by" in run.message
    np.testing.assert_array_equal(again.event, run.event)
    assert run.t[-1] == pytest.approx(np.sqrt(2 / 9.81), rel=1e-8)
    blown = mstmm.compile(motor("exp(u[0])^3", speed=1.0)).simulate(1.0)
    again = mstmm.load_result(blown.save(tmp_path / "blown.nc"))
    assert not again.success and again.status == blown.status and again.message == blown.message


def test_a_fixed_step_is_judged_again_and_other_kernels_are_noted(tmp_path: Path) -> None:
    model = mstmm.compile(motor("0", damping=100.0))
    run = model.simulate(1.0, method="rk4", step=0.02)
    again = mstmm.load_result(run.save(tmp_path / "run.nc"))
    assert again.certificate.step_stability == run.certificate.step_stability is not None
    assert again.warnings == run.warnings
    with xarray.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as file:
        data = file.load()
    data.attrs["kernels_sha256"] = "0" * 64
    data.to_netcdf(tmp_path / "old.nc", engine="h5netcdf")
    assert any("other kernels" in text for text in mstmm.load_result(tmp_path / "old.nc").warnings)


def test_a_scene_longer_than_an_attribute_can_hold(tmp_path: Path) -> None:
    run = mstmm.compile(pins(150, [0.1] * 150)).simulate(0.01)
    assert len(run.model.scene.to_toml()) > 70_000
    assert mstmm.load_result(run.save(tmp_path / "long.nc")).model.nu == 150


def test_csv_has_names_units_and_every_digit(run: Result, tmp_path: Path) -> None:
    with run.save(tmp_path / "run.csv").open(newline="") as file:
        header, *rows = list(csv.reader(file))
    assert header[0] == "time [s]" and len(set(header)) == len(header)
    values = {
        name: np.array(column, float)
        for name, column in zip(header, zip(*rows, strict=True), strict=True)
    }
    np.testing.assert_array_equal(values["time [s]"], run.t)
    np.testing.assert_array_equal(values["arm.tip.y [m]"], run.position("arm.tip")[:, 1])
    np.testing.assert_array_equal(values["elbow.angle1 [rad]"], run.coordinates("elbow")[:, 0])
    np.testing.assert_array_equal(values["energy [J]"], run.energy())
    np.testing.assert_array_equal(values["wrist.qw"] if "wrist.qw" in values else values["wrist.w"],
                                  run.coordinates("wrist")[:, 0])  # fmt: skip


@pytest.mark.parametrize("ending", ["csv", "mat"])
def test_columns_come_back_from_tables(run: Result, tmp_path: Path, ending: str) -> None:
    path = run.save(tmp_path / f"run.{ending}")
    again = mstmm.load_result(path)
    assert isinstance(again, ColumnFile) and len(again.quantity_names()) > 200
    np.testing.assert_array_equal([again.t, again.event], [run.t, run.event])
    for name in again.quantity_names():
        ours, theirs = again.quantity(name), run.quantity(name)
        np.testing.assert_array_equal(ours.values, theirs.values)
        assert ours.unit == theirs.unit
    second = mstmm.load_result(again.save(tmp_path / "again.csv"))
    assert second.quantity_names() == again.quantity_names()
    assert "elbow.angle1" in again.table(rows=3)
    for gone in ("certificate", "q", "u", "model", "success", "statistics", "trajectory"):
        with pytest.raises(mstmm.SceneError, match=rf'"{gone}" needs the scene of the run'):
            getattr(again, gone)
    for name in (
        "arm.tip.orientation",
        "arm.tip.velocity",
        "wrist.moment",
        "momentum",
        "arm.euler",
    ):
        np.testing.assert_array_equal(again.quantity(name).values, run.quantity(name).values)
        assert again.quantity(name).labels == run.quantity(name).labels
    with pytest.raises(mstmm.SceneError, match=r'did you mean "elbow\.angle1"'):
        again.quantity("elbow.angel1")
    assert not hasattr(again, "model") and not hasattr(again, "nothing")


def test_matrices_of_others_are_refused(tmp_path: Path) -> None:
    path, zeros = tmp_path / "a.mat", np.zeros((3, 1))
    names = np.array([["x", "x", "m"]], dtype=object)
    for x, message in (
        (np.array([["abc"], ["abc"], ["abc"]]), "not all of real numbers"),
        (1j * np.ones((3, 1)), "not all of real numbers"),
        (np.zeros((2, 1)), "not equally long"),
    ):
        savemat(path, {"t": zeros, "event": zeros, "names": names, "x": x})
        with pytest.raises(mstmm.SceneError, match=rf"a\.mat.*{message}"):
            mstmm.load_result(path)


def test_tables_of_few_columns_are_shown_and_written(tmp_path: Path) -> None:
    path = tmp_path / "few.csv"
    path.write_text("time [s],event,x [m]\n0,0,1\n1,0,2\n")
    few = mstmm.load_result(path)
    assert few.table().splitlines()[-1].split() == ["1", "2"]
    path.write_text("time [s],event\n0,0\n1,0\n")
    none = mstmm.load_result(path)
    assert none.table().splitlines()[-1].split() == ["1"]
    assert mstmm.load_result(none.save(tmp_path / "none.mat")).quantity_names() == ()


def test_matlab_finds_names_units_and_the_scene(run: Result, tmp_path: Path) -> None:
    data = loadmat(run.save(tmp_path / "run.mat"))
    np.testing.assert_array_equal(data["elbow_angle1"][:, 0], run.coordinates("elbow")[:, 0])
    rows = {str(row[1][0]): (str(row[0][0]), row[2]) for row in data["names"]}
    assert rows["energy"][0] == "energy" and str(rows["elbow.angle1"][1][0]) == "rad"
    assert "[[hinge]]" in str(data["scene"][0])
    assert matlab_names(["a" * 80, "a" * 81, "1.x", "t"]) == [
        "a" * 63,
        "a" * 61 + "_2",
        "x1_x",
        "t_2",
    ]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "first columns"),
        ("a,b\n1,2\n", "first columns"),
        ("time [s],event,x\n0,0\n", "line 2 has 2 entries, expected 3"),
        ("time [s],event,x\n0,0,1\n1,0,one\n", "line 3.*'one'"),
        ("time [s],event,x\n0,0,1\nnan,0,1\n", "its times are not finite numbers, none before"),
        ("time [s],event,x\n0,0,1\n2,0,1\n1,0,1\n", "its times are not .* none before another"),
        ("time [s],event,x\n0,nan,1\n", "its events are not whole numbers"),
        ("time [s],event,x\n0,1e300,1\n", "its events are not whole numbers"),
    ],
)
def test_tables_of_others_are_refused(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(mstmm.SceneError, match=rf"a\.csv.*{message}"):
        mstmm.load_result(tmp_path / "a.csv")
    (tmp_path / "a.mat").write_text(text)
    with pytest.raises(mstmm.SceneError, match=r"a\.mat.*not a result of mstmm"):
        mstmm.load_result(tmp_path / "a.mat")


@pytest.mark.parametrize("name, package", [("a.nc", "xarray"), ("b.nc", "h5netcdf")])
def test_a_missing_extra_is_named(
    run: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, package: str
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(mstmm.EnvironmentFailure, match=rf"{package}.*pip install 'mstmm\[io\]'"):
        run.save(tmp_path / name)
    assert list(tmp_path.iterdir()) == []
    run.save(tmp_path / "still.csv")


def test_a_full_disk_keeps_the_old_file_and_the_result(
    run: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "run.csv"
    path.write_text("old")

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", full)
        with pytest.raises(mstmm.EnvironmentFailure, match=r"run\.csv.*No space left"):
            run.save(path)
    assert path.read_text() == "old" and len(list(tmp_path.iterdir())) == 1
    run.save(path)
    assert path.read_text().startswith("time")


def test_words_for_paths_that_make_no_sense(run: Result, tmp_path: Path) -> None:
    with pytest.raises(mstmm.SceneError, match=r"ends in \.nc, \.csv or \.mat"):
        run.save(tmp_path / "run.xlsx")
    with pytest.raises(mstmm.EnvironmentFailure, match="cannot be written"):
        run.save(tmp_path / "nowhere" / "run.csv")
    with pytest.raises(mstmm.SceneError, match="there is no such file"):
        mstmm.load_result(tmp_path / "none.nc")
    for text in ("", "rubbish", "\x89HDF\r\n\x1a\n"):
        (tmp_path / "bad.nc").write_text(text, encoding="latin-1")
        with pytest.raises(mstmm.SceneError, match=r"bad\.nc.*not a NetCDF file"):
            mstmm.load_result(tmp_path / "bad.nc")
    xarray.Dataset({"x": 1}).to_netcdf(tmp_path / "other.nc", engine="h5netcdf")
    with pytest.raises(mstmm.SceneError, match="not a result of mstmm"):
        mstmm.load_result(tmp_path / "other.nc")


def _drop_variable(name: str) -> Callable[[xarray.Dataset], xarray.Dataset]:
    return lambda data: data.drop_vars(name)


def _attribute(name: str, value: object) -> Callable[[xarray.Dataset], xarray.Dataset]:
    return lambda data: data.assign_attrs({name: value})


def _without_attribute(name: str) -> Callable[[xarray.Dataset], xarray.Dataset]:
    def change(data: xarray.Dataset) -> xarray.Dataset:
        del data.attrs[name]
        return data

    return change


def _as_text(name: str) -> Callable[[xarray.Dataset], xarray.Dataset]:
    return lambda data: data.assign({name: (data[name].dims, data[name].values.astype(str))})


CHANGES: dict[str, Callable[[xarray.Dataset], xarray.Dataset]] = {
    **{
        f"no {name}": _drop_variable(name)
        for name in ("q", "u", "memory", "work", "event", "last_q")
    },
    **{f"text in {name}": _as_text(name) for name in ("q", "memory", "event", "error_q_0")},
    **{
        f"no {name}": _without_attribute(name)
        for name in ("format_version", "settings", "statistics", "status", "notes", "fail_time")
    },
    "format_version": _attribute("format_version", "two"),
    "settings": _attribute("settings", "{}"),
    "a tolerance": _attribute("settings", '{"t_end": 1.0, "method": "dop853", "rtol": "small"}'),
    "a method": _attribute("settings", '{"t_end": 1.0, "method": "dop999"}'),
    "statistics": _attribute("statistics", '{"steps": 1}'),
    "status": _attribute("status", "DONE"),
    "notes": _attribute("notes", "[[["),
    "scene": lambda data: data.assign(scene=((), "gravity = [0, 0, 0")),
    "another scene": lambda data: data.assign(scene=((), pins(1, [0.3]).to_toml())),
    "times": lambda data: data.assign_coords(time=data["time"].values[::-1].copy()),
    "memory": lambda data: data.drop_vars("memory").assign(
        memory=(("time", "place"), np.zeros((data.sizes["time"], 40)))
    ),
}


@pytest.mark.parametrize("change", CHANGES)
def test_a_result_that_was_edited(run: Result, tmp_path: Path, change: str) -> None:
    path = tmp_path / "run.nc"
    CHANGES[change](run.to_xarray()).to_netcdf(path, engine="h5netcdf")
    with pytest.raises(mstmm.SceneError, match=r"run\.nc"):
        mstmm.load_result(path)


#: Reads damaged files; says what it meets.
READER = """
import sys
import mstmm
for path in sys.argv[1:]:
    try:
        mstmm.load_result(path)
        print("read")
    except mstmm.SceneError as error:
        print("refused" if path in str(error) else error)
"""


def test_changed_bytes_never_reach_the_library(
    run: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """HDF5 1.14 crashes the process on some of them, and 2.0 never comes back."""
    path = run.save(tmp_path / "run.nc")
    whole = path.read_bytes()
    with xarray.open_dataset(path, engine="h5netcdf", decode_times=False) as file:
        np.testing.assert_array_equal(file["q"], run.q)  # others read it as it is
    monkeypatch.delattr("mstmm.runtime.model.result_loading._read_dataset")
    for place in (0, 600, len(whole) // 2, len(whole) - 100):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
        with pytest.raises(mstmm.SceneError, match="file corrupt or modified"):
            mstmm.load_result(path)


def test_damaged_files_are_refused_without_noise(run: Result, tmp_path: Path) -> None:
    """In a process of its own: what objects of h5py complain of as they go shows on its stderr."""
    whole = run.save(tmp_path / "run.nc").read_bytes()
    rng, paths = np.random.default_rng(7), list[str]()
    for number in range(24):
        content = bytearray(whole)
        place = int(rng.integers(len(whole) - 600))  # what ends in the seal may be whole before it
        if number % 3 == 0:
            del content[place:]
        elif number % 3 == 1:
            content[place : place + 512] = bytes(255 - c for c in content[place : place + 512])
        else:
            for at in rng.integers(len(whole) // 8, size=4):
                content[at] ^= int(rng.integers(1, 256))
        paths.append(str(tmp_path / f"{number}.nc"))
        Path(paths[-1]).write_bytes(content)
    done = subprocess.run(
        [sys.executable, "-c", READER, *paths], check=False, capture_output=True, text=True
    )
    assert done.returncode == 0 and done.stderr == ""
    said = done.stdout.splitlines()
    assert said == ["refused"] * 24
