"""`mstmm cache` and `mstmm doctor`."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from mstmm.runtime.libraries import cache as libraries
from tests.support.commands import Command


@pytest.fixture
def place(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache of the test's own, with a compiler that nobody chose."""
    monkeypatch.setenv("MSTMM_CACHE", str(folder / "cache"))
    for name in ("CC", "MSTMM_CACHE_SIZE", "MSTMM_COMPILE_TIMEOUT"):
        monkeypatch.delenv(name, raising=False)
    return folder / "cache"


def build_libraries(count: int) -> list[libraries.BuiltLibrary]:
    def recipe(i: int) -> libraries.Recipe:
        text = f"const int number = {i};\n"
        return libraries.Recipe("part", {"i": str(i)}, lambda key: {"p.c": text}, (), ("number",))

    return [libraries.library(recipe(i)) for i in range(count)]


def test_empty_cache(mstmm: Command, place: Path) -> None:
    for action in ("list", "verify", "clean"):
        done = mstmm("cache", action)
        assert done.code == 0 and str(place) in done.out and done.err == ""
    data = json.loads(mstmm("cache", "--json").out)
    assert data["ok"] and data["entries"] == [] and data["bytes"] == 0


def test_list_verify_clean(mstmm: Command, place: Path) -> None:
    first, second = build_libraries(2)
    listed = mstmm("cache")
    assert listed.code == 0 and "2 libraries, 2 intact" in listed.out
    assert listed.out.count("part-") >= 2
    data = json.loads(mstmm("cache", "list", "--json").out)
    assert {entry["key"] for entry in data["entries"]} == {first.key, second.key}
    assert all(entry["flags"] == [] and entry["problem"] == "" for entry in data["entries"])
    first.path.write_bytes(first.path.read_bytes()[:50])
    verified = mstmm("cache", "verify")
    assert verified.code == 3 and "2 libraries, 1 intact" in verified.out
    assert first.path.parent.name in verified.err and "50 bytes" in verified.err
    assert mstmm("cache", "list").code == 0
    assert not json.loads(mstmm("cache", "verify", "--json").out)["ok"]
    os.utime(second.path.parent / "entry.json", (1e9, 1e9))
    assert "deleted 1 library" in mstmm("cache", "clean", "--unused", "30").out
    cleaned = json.loads(mstmm("cache", "clean", "--json").out)
    assert cleaned["removed"] == 1 and cleaned["bytes"] > 50
    assert list(place.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("burn",), "list, verify, clean"),
        (("clean", "--unused", "-1"), "0 or more"),
        (("clean", "--unused", "soon"), "not a number"),
        (("list", "--unused", "3"), "clean"),
    ],
)
def test_refused(mstmm: Command, place: Path, arguments: tuple[str, ...], said: str) -> None:
    done = mstmm("cache", *arguments)
    assert done.code == 2 and said in done.err and done.out == ""


def test_cache_that_others_may_write_to(mstmm: Command, place: Path) -> None:
    place.mkdir()
    place.chmod(0o777)
    done = mstmm("cache", "clean")
    assert done.code == 3 and "MSTMM_CACHE" in done.err


def test_doctor_finds_all_well(mstmm: Command, place: Path) -> None:
    done = mstmm("doctor", "--json")
    data = json.loads(done.out)
    assert done.code == 0 and data["ok"], done.out
    found = {finding["subject"]: finding for finding in data["findings"]}
    assert {"versions", "compiler", "flags", "processor", "cache", "kernels"} <= set(found)
    assert found["compiler"]["data"]["version"]
    assert "-march=native" in found["flags"]["data"]["flags"]
    assert found["cache"]["data"]["mode"] == "0700"
    assert {"mstmm", "numpy", "scipy", "cffi", "sympy"} <= set(
        found["versions"]["data"]["versions"]
    )
    assert "hinge pin" in found["kernels"]["data"]["elements"]
    for subject in ("looped engine", "fused engine"):
        assert "closed form" in found[subject]["text"]


def _no_compiler(place: Path, patch: pytest.MonkeyPatch) -> None:
    patch.setenv("CC", "/nonexistent")


def _failing(place: Path, patch: pytest.MonkeyPatch) -> None:
    compiler = place.parent / "cc"
    compiler.write_text("#!/bin/sh\necho 'error: cannot' >&2\nexit 1\n")
    compiler.chmod(0o755)
    patch.setenv("CC", str(compiler))


def _wrong(place: Path, patch: pytest.MonkeyPatch) -> None:
    """A compiler whose square roots are wrong."""
    compiler = place.parent / "cc"
    compiler.write_text('#!/bin/sh\nexec gcc -Dsqrt=cbrt "$@"\n')
    compiler.chmod(0o755)
    patch.setenv("CC", str(compiler))


def _foreign(place: Path, patch: pytest.MonkeyPatch) -> None:
    patch.setenv("MSTMM_CACHE", "/proc/cache")


def _wrong_size(place: Path, patch: pytest.MonkeyPatch) -> None:
    patch.setenv("MSTMM_CACHE_SIZE", "plenty")


def _empty_library(place: Path, patch: pytest.MonkeyPatch) -> None:
    (built,) = build_libraries(1)
    built.path.write_bytes(b"")


@pytest.mark.parametrize(
    ("fault", "subject", "said"),
    [
        (_no_compiler, "compiler", "install"),
        (_failing, "compiling", "cannot"),
        (_wrong, "compiling", "wrong numbers"),
        (_foreign, "cache", "MSTMM_CACHE"),
        (_wrong_size, "cache", "MSTMM_CACHE_SIZE"),
        pytest.param(
            _empty_library, "cache", "mstmm cache clean", id="_damaged-cache-mstmm cache clean"
        ),
    ],
)
def test_doctor_finds_what_is_wrong(
    mstmm: Command, place: Path, monkeypatch: pytest.MonkeyPatch, fault: object, subject: str,
    said: str,
) -> None:  # fmt: skip
    assert callable(fault)
    fault(place, monkeypatch)
    done = mstmm("doctor")
    assert done.code == 3
    (line,) = [
        line for line in done.out.splitlines()
        if line.startswith("PROBLEM") and line.split()[1] == subject
    ]  # fmt: skip
    assert said in line
    assert "problem" in done.out.splitlines()[-1]


def test_doctor_survives_kernels_that_do_not_load(
    mstmm: Command, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def raise_load_error() -> None:
        raise RuntimeError("symbol lookup error")

    monkeypatch.setattr("mstmm.runtime.kernels.prebuilt_kernels.elements", raise_load_error)
    done = mstmm("doctor", "--json")
    problems = [f for f in json.loads(done.out)["findings"] if not f["ok"]]
    assert done.code == 3 and any("symbol lookup" in f["text"] for f in problems)
