"""No compiler, and compilers that fail, hang, are killed, or make what cannot be used."""

from __future__ import annotations

import json
import re
import time
from dataclasses import replace
from pathlib import Path

import pytest

from mstmm.errors import EnvironmentFailure
from mstmm.runtime.libraries import cache, library_build
from tests.support.libraries.library_recipes import (
    Kernel,
    alive,
    assert_tidy,
    false_compiler,
    library_value,
)

#: Script of the compiler -> what the message must say.
BAD = {
    "fails": ("echo 'kernel.c:3:1: error: no luck' >&2\nexit 1", "no luck"),
    "fails silently": ("exit 7", "exit code 7"),
    "fails at length": ("yes 'error: again' | head -n 100000 >&2\nexit 1", "again"),
    "is killed": ("kill -9 $$", "SIGKILL"),
    "runs out of memory": ("ulimit -v 1000\n$REAL --version || kill -11 $$", "SIGSEGV"),
    "makes nothing": ("exit 0", "no library"),
    "makes an empty file": ('for last; do :; done\n: >"$last"', "no library"),
    "makes text": ('for last; do :; done\necho text >"$last"', "invalid ELF header|file too short"),
    "leaves the function out": ('for last; do :; done\n$REAL -shared -o "$last" -x c /dev/null',
                                "mstmm_fused_library"),
    "fills the disk": ("echo 'ld: final link failed: No space left on device' >&2\nexit 1",
                       "no space"),
}  # fmt: skip


def refusal(kernel: Kernel, timeout: float = 60.0) -> str:
    with pytest.raises(EnvironmentFailure) as caught:
        cache.library(kernel.recipe, timeout=timeout)
    message = str(caught.value)
    assert "\n" not in message and len(message) < 1000 and message.isprintable()
    return message


@pytest.mark.parametrize("case", BAD)
def test_bad_compiler_is_told_and_leaves_nothing(
    case: str, cache_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    script, said = BAD[case]
    path = false_compiler(tmp_path, script)
    monkeypatch.setenv("CC", str(path))
    message = refusal(Kernel())
    assert re.search(said, message) and str(path) in message
    assert_tidy(cache_folder, 0)
    monkeypatch.delenv("CC")
    built = cache.library(Kernel().recipe)
    assert library_value(built.path, built.key) == 21.0


@pytest.mark.parametrize("named", ["/nonexistent/gcc", "no-such-compiler -O3", "'unbalanced"])
def test_compiler_that_is_not_there(
    named: str, cache_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CC", named)
    message = refusal(Kernel())
    assert "CC" in message and "install" in message
    assert cache.find(Kernel().recipe) is None


def test_no_compiler_at_all(
    cache_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    assert "no gcc, cc or clang" in refusal(Kernel())


def test_compiler_that_is_no_program(
    cache_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "cc"
    path.write_bytes(b"\x7fELF of another machine")
    path.chmod(0o755)
    monkeypatch.setenv("CC", str(path))
    assert "could not be run" in refusal(Kernel())
    assert_tidy(cache_folder, 0)


def test_compiler_with_arguments_of_its_own(
    cache_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "with space"
    folder.mkdir()
    path = false_compiler(folder, 'exec $REAL "$@"')
    kernel = Kernel(more="#ifndef GIVEN\n#error nothing was given\n#endif")
    monkeypatch.setenv("CC", f"'{path}'")
    assert "nothing was given" in refusal(kernel)
    monkeypatch.setenv("CC", f"'{path}' -DGIVEN")
    built = cache.library(kernel.recipe)
    assert library_value(built.path, built.key) == 21.0


@pytest.mark.parametrize(
    "complaint",
    [
        "clang: error: unknown argument: '-fone'\nclang: error: unknown argument: '-ftwo'",
        "cc: error: unrecognized command-line option ‘-fone’; did you mean ‘-fno’?",
        "gcc: error: unrecognized command line option '-ftwo'",
    ],
)
def test_compiler_that_does_not_know_a_flag(
    complaint: str, cache_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Left out where the flag is optional; told where it is not."""
    flags = [flag for flag in ("-fone", "-ftwo") if flag in complaint]
    cases = "|".join(f"*{flag}*" for flag in flags)
    script = (
        f'case "$*" in\n{cases}) cat >&2 <<END\n{complaint}\nEND\nexit 1;; esac\nexec $REAL "$@"'
    )
    monkeypatch.setenv("CC", str(false_compiler(tmp_path, script)))
    plain = Kernel().recipe
    needing = replace(plain, flags=("-O1", *flags))
    with pytest.raises(EnvironmentFailure, match=flags[0]):
        cache.library(needing)
    built = cache.library(replace(needing, optional=tuple(flags)))
    assert library_value(built.path, built.key) == 21.0
    about = json.loads((built.path.parent / "entry.json").read_text())
    assert about["flags"] == ["-O1"]


def test_hanging_compiler_is_killed_with_its_children(
    cache_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    note = tmp_path / "pids"
    script = f"sleep 600 &\necho $! $$ >{note}.new\nmv {note}.new {note}\nwait"
    monkeypatch.setenv("CC", str(false_compiler(tmp_path, script)))
    timeout, kernel = 0.25, Kernel()
    while not note.exists():  # else it was killed before it had begun
        timeout, kernel = 2 * timeout, Kernel(kernel.factor + 1)
        assert f"did not finish within {timeout:g} s" in refusal(kernel, timeout)
    pids = [int(text) for text in note.read_text().split()]
    assert len(pids) == 2
    while any(map(alive, pids)):
        time.sleep(0.01)
    assert_tidy(cache_folder, 0)
    # The same process is not kept waiting for the same again.
    note.unlink()
    assert "did not finish" in refusal(kernel, timeout)
    assert not note.exists()


def test_time_allowed_comes_from_the_environment(
    cache_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CC", str(false_compiler(tmp_path, "exec sleep 600")))
    monkeypatch.setenv("MSTMM_COMPILE_TIMEOUT", "0.2")
    with pytest.raises(
        EnvironmentFailure, match=r"within 0\.2 s of wall time .*MSTMM_COMPILE_TIMEOUT"
    ):
        cache.library(Kernel().recipe)
    monkeypatch.setenv("MSTMM_COMPILE_TIMEOUT", "soon")
    with pytest.raises(EnvironmentFailure, match="MSTMM_COMPILE_TIMEOUT"):
        cache.library(Kernel().recipe)


# --- what compiles and cannot be trusted ----------------------------------------------------------

#: C text that the library brings along -> what the message must say.
CRASHES = {
    "wild address": ("int mstmm_self_test(void) { return *(volatile int *)8; }", "SIGSEGV"),
    "unknown instruction": ("int mstmm_self_test(void) { __builtin_trap(); }", "SIGILL|SIGTRAP"),
    "wrong numbers": ("int mstmm_self_test(void) { return scaled(1.0) != 4.0; }", "self-test"),
    "crash when opened": ("__attribute__((constructor)) static void f(void)"
                          " { *(volatile int *)8 = 1; }", "SIGSEGV"),
    "unknown function": ("int nowhere(void); int mstmm_self_test(void) { return nowhere(); }",
                         "nowhere"),
}  # fmt: skip


@pytest.mark.parametrize("case", CRASHES)
def test_library_that_fails_its_test_is_not_kept(case: str, cache_folder: Path) -> None:
    more, said = CRASHES[case]
    message = refusal(Kernel(more=more))
    assert re.search(said, message) and "cannot be used" in message
    assert_tidy(cache_folder, 0)


def test_library_that_hangs_in_its_test_is_not_kept(
    cache_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(library_build, "_SELF_TEST_TIMEOUT_S", 0.5)
    more = "int mstmm_self_test(void) { for (volatile int i = 1; i;) ; return 0; }"
    assert "did not return" in refusal(Kernel(more=more))
    assert_tidy(cache_folder, 0)


def test_library_that_passes_its_test_is_kept(cache_folder: Path) -> None:
    more = "int mstmm_self_test(void) { return scaled(1.0) != 3.0; }"
    built = cache.library(Kernel(more=more).recipe)
    assert library_value(built.path, built.key) == 21.0
    assert_tidy(cache_folder, 1)
