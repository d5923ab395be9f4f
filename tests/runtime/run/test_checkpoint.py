"""Interrupted runs: nothing is lost, and a resumed run has the bytes of an uninterrupted one."""

from __future__ import annotations

import errno
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.integrate.c_loop import Integrator
from mstmm.runtime.run import run_execution
from tests.support.scenes.results import motor, pins, rod

#: Runs a scene from a file; says where it is and waits for a line, so that the parent can
#: interrupt it half-way.
PROGRAM = """
import sys
import numpy as np
import mstmm
scene, out, mode, t_end = sys.argv[1:]
model = mstmm.compile(mstmm.load_scene(scene))
pause = lambda t, end: (print(t, flush=True), sys.stdin.readline())
execution = mstmm.Execution(
    progress=pause if mode == "cut" else None, resume=mode == "resume",
    checkpoint=None if mode == "full" else out + ".ck.npz",
)
run = model.simulate(float(t_end), rtol=1e-11, atol=1e-13, execution=execution)
print(run.message)
arrays = {n: getattr(run, n) for n in ("t", "q", "u", "work", "event")}
np.savez(out, memory=run.trajectory.memory, energy=run.energy(), **arrays)
print("status", run.status, "success", run.success)
"""


def remembering() -> mstmm.Scene:
    """A chain with everything a run remembers: work, a release, turns of a ball with a spring."""
    hinges = [
        {"name": "motor", "type": "pin", "inboard": "ground", "outboard": "rod0",
         "drive": "0.5*sin(3*t)", "release": "t >= 1"},
        {"name": "pin", "type": "pin", "inboard": "rod0.tip", "outboard": "rod1",
         "initial": {"q": [0.7]}},
        {"name": "ball", "type": "ball", "inboard": "rod1.tip", "outboard": "rod2",
         "axis": [1, 0, 0], "initial": {"u": [9.0, 0.1, 0.2]},
         "law": {"stiffness": [0.01, 0.01, 0.01], "damping": [0.001, 0.001, 0.001]}},
    ]  # fmt: skip
    bodies = [rod(f"rod{i}") for i in range(3)]
    return mstmm.Scene(gravity=(0, -9.81, 0), body=bodies, hinge=hinges)


Start = Callable[..., "subprocess.Popen[str]"]


@pytest.fixture
def start() -> Iterator[Start]:
    """Starts a run in a process of its own; none of them outlives the test."""
    started: list[subprocess.Popen[str]] = []

    def run(*arguments: str) -> subprocess.Popen[str]:
        command = [sys.executable, "-c", PROGRAM, *arguments]
        started.append(
            subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        )
        return started[-1]

    yield run
    for process in started:
        with process:
            process.kill()


@pytest.mark.slow
def test_ctrl_c_and_resume_give_the_bytes_of_an_uninterrupted_run(
    tmp_path: Path, heard: None, start: Start
) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(remembering().to_toml())
    t_end = "800"  # more than two slices of work
    full = start(str(scene), str(tmp_path / "full.npz"), "full", t_end)
    cut = start(str(scene), str(tmp_path / "cut.npz"), "cut", t_end)
    assert cut.stdin is not None and cut.stdout is not None
    assert cut.stdout.readline()  # after a slice of 0.1 s
    print(file=cut.stdin, flush=True)
    assert cut.stdout.readline()
    cut.send_signal(signal.SIGINT)  # it waits
    told = cut.communicate()[0]
    assert cut.returncode == 0 and "interrupted at t = " in told and "success False" in told
    os.replace(tmp_path / "cut.npz.ck.npz", tmp_path / "rest.npz.ck.npz")
    rest = start(str(scene), str(tmp_path / "rest.npz"), "resume", t_end)
    assert "success True" in rest.communicate()[0]
    full.communicate()
    with (
        np.load(tmp_path / "full.npz") as one,
        np.load(tmp_path / "rest.npz") as other,
        np.load(tmp_path / "cut.npz") as part,
    ):
        assert 10 < len(part["t"]) < len(one["t"])
        assert np.ptp(one["memory"][:, 1]) > 6 and set(one["memory"][:, 0]) == {0.0, 1.0}
        for name in one.files:
            assert one[name].tobytes() == other[name].tobytes(), name
            assert one[name][: len(part["t"])].tobytes() == part[name].tobytes(), name


def interrupt_run(monkeypatch: pytest.MonkeyPatch, at: float) -> None:
    """Send Ctrl-C from within as soon as a run has passed the time `at`."""
    monkeypatch.setattr("mstmm.runtime.run.integration_run.SLICE", 0.0)

    def report_and_save(self: run_execution.RunMonitor, run: Integrator, earlier: object) -> None:
        if run.t > at:
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(run_execution.RunMonitor, "report_and_save", report_and_save)


def test_a_checkpoint_of_another_run_is_refused(
    tmp_path: Path, heard: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, model = tmp_path / "run.npz", mstmm.compile(pins(2, [0.3, 0.4]))
    with monkeypatch.context() as patch:
        interrupt_run(patch, 1.0)
        run = model.simulate(
            5.0, execution=mstmm.Execution(checkpoint=path), step=0.01, method="rk4"
        )
    assert run.status is None and not run.success and 1.0 < run.t[-1] < 1.1
    assert run.last_state[0] == run.t[-1] and path.exists()
    other = mstmm.compile(pins(2, [0.3, 0.5]))
    with pytest.raises(mstmm.SceneError, match=r"run\.npz.*the scene has changed"):
        other.simulate(
            5.0, execution=mstmm.Execution(checkpoint=path, resume=True), step=0.01, method="rk4"
        )
    for change in ({"step": 0.02}, {"t_end": 6.0}, {"method": "dop853", "step": None}):
        settings = {"t_end": 5.0, "step": 0.01, "method": "rk4"} | change
        with pytest.raises(mstmm.SceneError, match="settings or the initial state have changed"):
            model.simulate(execution=mstmm.Execution(checkpoint=path, resume=True), **settings)  # type: ignore[arg-type]
    with np.load(path) as file:
        assert all(file[name].dtype.kind in "fiU" for name in file.files)  # no pickle
    whole = model.simulate(5.0, step=0.01, method="rk4")
    again = model.simulate(
        5.0, execution=mstmm.Execution(checkpoint=path, resume=True), step=0.01, method="rk4"
    )
    assert again.q.tobytes() == whole.q.tobytes() and again.statistics == whole.statistics
    again.save(tmp_path / "run.csv")
    assert [file.name for file in tmp_path.iterdir()] == ["run.csv"]
    once_more = model.simulate(
        0.1, execution=mstmm.Execution(checkpoint=path, resume=True)
    )  # nothing there: from the start
    assert once_more.success and once_more.t[0] == 0.0


@pytest.mark.parametrize("content", [b"", b"rubbish", b"PK\x03\x04 half a zip"])
def test_a_file_that_is_no_checkpoint(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "run.npz"
    path.write_bytes(content)
    with pytest.raises(mstmm.SceneError, match=r"run\.npz"):
        mstmm.compile(pins(1, [0.3])).simulate(
            1.0, execution=mstmm.Execution(checkpoint=path, resume=True)
        )
    np.savez(path, x=1)
    with pytest.raises(mstmm.SceneError, match="not written by this version"):
        mstmm.compile(pins(1, [0.3])).simulate(
            1.0, execution=mstmm.Execution(checkpoint=path, resume=True)
        )


EDITS: dict[str, Callable[[Any], Any]] = {
    "t": lambda t: t[::-1],
    "y": lambda y: y[:, :1],
    "memory": lambda memory: np.zeros((len(memory), 7)),
    "event": lambda event: event[1:],
    "real": lambda real: real[:-1],
    "integer": lambda integer: np.where(np.arange(len(integer)) == 8, 999, integer),
    "engine": lambda engine: np.zeros(3),
    "message": lambda message: np.array(7),
    "seconds": lambda seconds: seconds - 1e9,
}


@pytest.mark.parametrize("name", [*EDITS, "missing"])
def test_a_checkpoint_that_was_edited(tmp_path: Path, name: str) -> None:
    model, path = mstmm.compile(pins(1, [0.3])), tmp_path / "run.npz"
    model.simulate(1.0, execution=mstmm.Execution(checkpoint=path))
    with np.load(path) as file:
        data = {key: file[key] for key in file.files}
    if name == "missing":
        del data["integer"]
    else:
        data[name] = EDITS[name](data[name])
    np.savez(path, **data)
    with pytest.raises(mstmm.SceneError, match=r"damaged|another scene, method or version"):
        model.simulate(1.0, execution=mstmm.Execution(checkpoint=path, resume=True))


def spend(path: Path, seconds: float) -> None:
    """Let the run of a checkpoint have taken so long."""
    with np.load(path) as file:
        data = {key: file[key] for key in file.files}
    np.savez(path, **(data | {"seconds": np.array(seconds)}))


def test_the_time_of_all_pieces_is_kept(
    tmp_path: Path, heard: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, model = tmp_path / "run.npz", mstmm.compile(pins(2, [0.3, 0.4]))
    for at in (1.0, 2.0):
        with monkeypatch.context() as patch:
            interrupt_run(patch, at)
            run = model.simulate(
                5.0,
                execution=mstmm.Execution(checkpoint=path, resume=at > 1),
                step=0.01,
                method="rk4",
            )
        with np.load(path) as file:
            assert file["seconds"] > (5000.0 if at > 1 else 0.0)
        assert run.trajectory.earlier_seconds == (5000.0 if at > 1 else 0.0)
        spend(path, 5000.0)
    run = model.simulate(
        5.0, execution=mstmm.Execution(checkpoint=path, resume=True), step=0.01, method="rk4"
    )
    assert run.success and run.trajectory.earlier_seconds == 5000.0


@pytest.mark.parametrize("share", [0.05, 0.5, 0.97])
def test_a_checkpoint_that_was_cut_or_overwritten(tmp_path: Path, share: float) -> None:
    model, path = mstmm.compile(pins(1, [0.3])), tmp_path / "run.npz"
    model.simulate(1.0, execution=mstmm.Execution(checkpoint=path))
    whole = path.read_bytes()
    place = int(share * len(whole))
    for content in (whole[:place], whole[:place] + b"\0" * 40 + whole[place + 40 :]):
        path.write_bytes(content)
        with pytest.raises(mstmm.SceneError, match=r"run\.npz"):
            model.simulate(1.0, execution=mstmm.Execution(checkpoint=path, resume=True))


def test_a_folder_that_is_not_there_is_noticed_before_the_run(tmp_path: Path) -> None:
    with pytest.raises(mstmm.EnvironmentFailure, match="folder does not exist or is not writable"):
        mstmm.compile(pins(1, [0.3])).simulate(
            1.0, execution=mstmm.Execution(checkpoint=tmp_path / "no" / "run.npz")
        )


def test_a_full_disk_during_the_run_costs_the_checkpoint_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = mstmm.compile(pins(2, [0.3, 0.4]))
    monkeypatch.setattr(run_execution, "CHECKPOINT_INTERVAL", 0.0)
    monkeypatch.setattr("mstmm.runtime.run.integration_run.SLICE", 0.0)

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    run = model.simulate(1.0, execution=mstmm.Execution(checkpoint=tmp_path / "run.npz"))
    assert run.success and run.t[-1] == 1.0
    (note,) = (text for text in run.warnings if "no checkpoint" in text)
    assert "No space left on device" in note
    assert list(tmp_path.iterdir()) == []


def test_checkpoints_are_written_on_the_way(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run_execution, "CHECKPOINT_INTERVAL", 0.0)
    monkeypatch.setattr("mstmm.runtime.run.integration_run.SLICE", 0.0)
    path, seen = tmp_path / "run.npz", list[int]()

    def progress(t: float, t_end: float) -> None:
        if path.exists():
            with np.load(path) as file:
                seen.append(len(file["t"]))

    assert (
        mstmm.compile(pins(1, [0.3]))
        .simulate(1.0, execution=mstmm.Execution(checkpoint=path, progress=progress))
        .success
    )
    assert len(seen) > 3 and seen == sorted(set(seen))


@pytest.mark.parametrize("end", ["event", "failure"])
def test_a_run_that_has_ended_is_kept_until_its_result_is_saved(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, end: str
) -> None:
    """However it ended: who asks again gets the same without another step."""
    scene = motor("sqrt(0.5 - t)") if end == "failure" else pins(1, [0.3])
    if end == "event":
        low: Any = [{"name": "low", "when": "pin0.q < -0.5", "do": "stop"}]
        scene = mstmm.Scene(gravity=scene.gravity, body=scene.body, hinge=scene.hinge, event=low)
    model, path = mstmm.compile(scene), tmp_path / "run.npz"
    first = model.simulate(5.0, execution=mstmm.Execution(checkpoint=path))
    assert first.status is not None and first.t[-1] < 5.0
    assert path.exists() and first.success is (end == "event")

    def never(*_: object) -> None:
        raise AssertionError("a step")

    with monkeypatch.context() as patch:
        patch.setattr(Integrator, "advance", never)
        again = model.simulate(5.0, execution=mstmm.Execution(checkpoint=path, resume=True))
    assert (again.message, again.status) == (first.message, first.status)
    assert again.q.tobytes() == first.q.tobytes() and again.statistics == first.statistics
    again.save(tmp_path / "run.csv")
    assert not path.exists()


# --- progress -------------------------------------------------------------------------------------


@pytest.mark.parametrize("certify", [False, True])
def test_progress_grows_to_the_end(monkeypatch: pytest.MonkeyPatch, certify: bool) -> None:
    monkeypatch.setattr("mstmm.runtime.run.integration_run.SLICE", 0.0)
    told = list[tuple[float, float]]()
    model = mstmm.compile(pins(1, [0.3]))
    run = model.simulate(
        2.0, execution=mstmm.Execution(progress=lambda *x: told.append(x)), certify=certify
    )
    times = [t for t, _ in told]
    assert run.success and {end for _, end in told} == {2.0}
    assert times == sorted(times) and times[-1] > 1.7 and times[0] < 0.5


class CallerError(Exception):
    """What a callback of somebody else raises."""


@pytest.mark.parametrize("method", ["dop853", "rodas5p", "scipy-LSODA", "dttmm-classical"])
def test_an_exception_of_a_progress_callback_ends_the_run(
    monkeypatch: pytest.MonkeyPatch, method: str
) -> None:
    monkeypatch.setattr("mstmm.runtime.run.integration_run.SLICE", 0.0)
    model, step = mstmm.compile(pins(1, [0.3])), 0.01 if method == "dttmm-classical" else None
    calls = list[float]()

    def progress(t: float, t_end: float) -> None:
        calls.append(t)
        raise CallerError("enough")

    with pytest.raises(CallerError, match="enough"):
        model.simulate(1.0, method, step, execution=mstmm.Execution(progress=progress))
    assert len(calls) == 1
    assert model.simulate(1.0, method, step).success  # and leaves the model as it was


@pytest.mark.parametrize("asked", [{"certify": True}, {"error": 1e-4}])
def test_an_exception_of_a_progress_callback_ends_several_runs(
    monkeypatch: pytest.MonkeyPatch, asked: dict[str, Any]
) -> None:
    monkeypatch.setattr("mstmm.runtime.run.integration_run.SLICE", 0.0)

    def progress(t: float, t_end: float) -> None:
        if t > 0.6 * t_end:  # not in the first run
            raise CallerError("enough")

    with pytest.raises(CallerError, match="enough"):
        mstmm.compile(pins(1, [0.3])).simulate(
            1.0, execution=mstmm.Execution(progress=progress), **asked
        )


def test_a_run_goes_on_from_where_a_progress_callback_ended_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("mstmm.runtime.run.integration_run.SLICE", 0.0)
    model, path = mstmm.compile(pins(1, [0.3])), tmp_path / "run.npz"

    def progress(t: float, t_end: float) -> None:
        if t > 0.5:
            raise CallerError("enough")

    with pytest.raises(CallerError):
        model.simulate(1.0, execution=mstmm.Execution(checkpoint=path, progress=progress))
    first = list[float]()
    run = model.simulate(
        1.0,
        execution=mstmm.Execution(
            checkpoint=path, resume=True, progress=lambda t, end: first.append(t)
        ),
    )
    whole = model.simulate(1.0)
    assert first[0] > 0.5
    np.testing.assert_array_equal(run.t, whole.t)
    np.testing.assert_array_equal(run.q, whole.q)


def test_settings_of_a_result_are_plain_numbers(tmp_path: Path) -> None:
    run = mstmm.compile(pins(1, [0.3])).simulate(1.0, output_times=np.linspace(0, 1, 3))
    assert json.dumps(run.settings.output_times) == "[0.0, 0.5, 1.0]"


def test_ctrl_c_in_the_second_run_costs_the_estimate_only(
    heard: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mstmm.runtime.run.integration_run.SLICE", 0.0)

    def report_and_save(self: run_execution.RunMonitor, run: Integrator, earlier: object) -> None:
        if self.run == 1 and run.t > 0.5:
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(run_execution.RunMonitor, "report_and_save", report_and_save)
    run = mstmm.compile(pins(1, [0.3])).simulate(2.0, certify=True)
    assert run.success and run.t[-1] == 2.0 and run.certificate.error is None
    assert any("interrupted" in text for text in run.warnings)
