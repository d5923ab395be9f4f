"""What reaches the user of an exception; closed pipes, full disks, Ctrl-C; start-up time."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from mstmm import errors
from mstmm.cli.error_boundary import message_and_code
from mstmm.optional_packages import missing_package_error
from tests.support.commands import Command

PROGRAM = [sys.executable, "-m", "mstmm"]


def program(folder: Path, *arguments: str, **options: Any) -> subprocess.CompletedProcess[str]:
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options
    return subprocess.run([*PROGRAM, *arguments], check=False, text=True, cwd=folder, **streams)


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (errors.SceneError("x"), 2),
        (errors.ElementError("x"), 2),
        (errors.EnvironmentFailure("x"), 3),
        (errors.NumericalFailure("x"), 4),
        (MemoryError(), 3),
        (PermissionError(13, "Permission denied", "x"), 3),
        (ModuleNotFoundError("x", name="xarray"), 3),
        (KeyboardInterrupt(), 130),
        (SystemExit(7), 2),
        (ZeroDivisionError("x"), 1),
    ],
)
def test_exit_codes(error: BaseException, code: int) -> None:
    message, found = message_and_code(error)
    assert found == code and message


def test_defect_is_owned_up_to(mstmm: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    def divide_by_zero(*_: object) -> None:
        raise ZeroDivisionError("seven by zero")

    monkeypatch.setattr("mstmm.load_scene", divide_by_zero, raising=False)
    done = mstmm("simulate", "pendulum.toml")
    assert done.code == 1 and "Traceback" not in done.err
    assert "ZeroDivisionError: seven by zero" in done.err and "MSTMM_DEBUG=1" in done.err
    monkeypatch.setenv("MSTMM_DEBUG", "1")
    assert "Traceback" in mstmm("simulate", "pendulum.toml").err


def test_errors_as_json(mstmm: Command) -> None:
    done = mstmm("simulate", "none.toml", "--json")
    problem = json.loads(done.out)["error"]
    assert problem["exit_code"] == done.code == 2 and "none.toml" in problem["message"]
    assert json.loads(mstmm("simulate", "--json").out)["error"]["exit_code"] == 2


def test_help_is_quick_and_light(folder: Path) -> None:
    script = (
        "import sys; from mstmm.cli.error_boundary import run; code = run(['--help']);"
        "print([m for m in ('numpy', 'scipy', 'sympy', 'pydantic', 'cffi') if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, cwd=folder
    )
    assert done.stdout.splitlines()[-1] == "[]"
    for command in ("demo", "simulate", "check", "list", "show", "generate"):
        assert command in done.stdout


def test_no_arguments_show_the_help(mstmm: Command) -> None:
    assert mstmm() == mstmm("--help") and mstmm().code == 0


def test_version(mstmm: Command) -> None:
    assert mstmm("--version").out.startswith("mstmm 0.")


@pytest.mark.parametrize("command", ["", "demo", "simulate", "check", "list", "show", "generate"])
def test_every_command_has_help(mstmm: Command, command: str) -> None:
    done = mstmm(*command.split(), "-h")
    assert done.code == 0 and "Usage: mstmm" in done.out
    assert max(map(len, done.out.splitlines())) <= 80


def test_reader_that_stops_reading_is_no_error(folder: Path) -> None:
    shell = (
        f"{sys.executable} -m mstmm show sweep_generic6 --at c | head -n 1; echo ${{PIPESTATUS[0]}}"
    )
    done = subprocess.run(
        ["bash", "-c", shell], capture_output=True, text=True, check=True, cwd=folder
    )
    assert done.stdout.splitlines()[-1] == "0" and done.stderr == ""


def test_full_disk_is_said(folder: Path) -> None:
    with open("/dev/full", "w") as full:
        done = program(folder, "list", stdout=full)
    assert done.returncode == 3 and "No space left" in done.stderr
    assert "Traceback" not in done.stderr and "Exception ignored" not in done.stderr


@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&-", "<&-"])
def test_closed_streams(folder: Path, closed: str) -> None:
    for command, code in (("list hinges", 0), ("check none.toml", 2)):
        shell = f"{sys.executable} -m mstmm {command} {closed}"
        done = subprocess.run(
            ["bash", "-c", shell], capture_output=True, text=True, check=False, cwd=folder
        )
        assert done.returncode == code and "Traceback" not in done.stderr + done.stdout


def test_ascii_terminal(folder: Path) -> None:
    environment = os.environ | {"PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0", "LC_ALL": "C"}
    done = program(folder, "show", "pin", env=environment)
    assert done.returncode == 0 and done.stderr == ""


def test_nothing_in_a_name_reaches_the_terminal_raw(mstmm: Command, folder: Path) -> None:
    name = "\x1b]0;own\x07\x1b[31mred\x9b.toml"
    (folder / name).write_bytes((folder / "pendulum.toml").read_bytes())
    (folder / "store").mkdir()
    for command in (
        ("simulate", name, "--t-end", "0.1", "-o", "\x1b[2J.csv", "--plot", "\x1b[2J.svg"),
        ("check", name), ("check", "\x1bnone.toml"), ("simulate", "\x1bnone.toml"),
        ("simulate", "--\x1boption"), ("show", "\x1bpin"), ("list", "\x1bpart"),
        ("show", "pin", "--output", "\x1bpage.txt"), ("generate", "\x1bhinge.py"),
    ):  # fmt: skip
        done = mstmm(*command)
        for text in (done.out, done.err):
            assert all(c.isprintable() or c == "\n" for c in text), command
    assert mstmm("simulate", name, "--t-end", "0.1").code == 0


@pytest.mark.parametrize("options", [(), ("--json",)])
def test_an_interrupted_command_says_so(
    mstmm: Command, monkeypatch: pytest.MonkeyPatch, options: tuple[str, ...]
) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("mstmm.load_scene", interrupt, raising=False)
    done = mstmm("simulate", "pendulum.toml", *options)
    assert (done.code, done.err) == (130, "mstmm: interrupted\n")
    assert not options or json.loads(done.out)["error"]["exit_code"] == 130


def test_a_message_that_nobody_reads_does_not_change_the_exit_code(folder: Path) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(
        [sys.executable, "-m", "mstmm", "nonsense"], stdout=writing, stderr=writing, check=False
    )
    os.close(writing)
    assert done.returncode == 2


def test_a_lack_of_memory_is_no_defect(monkeypatch: pytest.MonkeyPatch) -> None:
    """Libraries fail in many ways where memory is short."""
    odd = RuntimeError("error in a library")
    assert message_and_code(odd)[1] == 1
    limits = resource.getrlimit(resource.RLIMIT_AS)
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + 2**24, limits[1]))
    try:
        message, code = message_and_code(odd)
    finally:
        resource.setrlimit(resource.RLIMIT_AS, limits)
    assert "not enough memory" in message and code == 3


def test_a_package_that_does_not_load_is_told_from_one_that_is_missing() -> None:
    broken = missing_package_error(
        "io", "a file", ImportError("failed to map segment", name="xarray")
    )
    assert "cannot be loaded (failed to map segment); give the process more memory" in str(broken)
    absent = missing_package_error("io", "a file", ModuleNotFoundError("no", name="not_there"))
    assert "not_there, which is not installed" in str(absent)
