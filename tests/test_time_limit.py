"""A test that hangs ends, and the run says which one it was."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path

from tests.support.kernels.c_library import compile_library

ROOT = Path(__file__).parents[1]

IN_PYTHON = """\
import time, pytest

@pytest.mark.timeout(0.5)
@pytest.mark.parametrize("number", [3])
def test_that_waits(number): time.sleep(1000)

def test_after(): pass
"""

IN_C = """\
import ctypes, pathlib

def test_that_spins(): ctypes.CDLL(str(pathlib.Path(__file__).parent / "hang.so")).hang()
"""


def run(folder: Path, text: str, *options: str) -> subprocess.CompletedProcess[str]:
    """These tests under the project's own settings."""
    (folder / "test_hangs.py").write_text(text)
    command = [sys.executable, "-m", "pytest", "-v", "-c", str(ROOT / "pyproject.toml")]
    command += ["--rootdir", str(folder), "-p", "no:cacheprovider", *options, "test_hangs.py"]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def test_every_test_has_a_limit_and_compiled_code_a_later_one() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["pytest"]
    kept = settings["ini_options"]
    assert kept["faulthandler_timeout"] > kept["timeout"] > 0


def test_a_test_that_waits_is_named_and_the_next_one_follows(tmp_path: Path) -> None:
    done = run(tmp_path, IN_PYTHON)
    assert done.returncode == 1, done.stdout + done.stderr
    assert "test_that_waits[3] FAILED" in done.stdout and "Timeout (>0.5s)" in done.stdout
    assert "test_after PASSED" in done.stdout


def test_a_test_that_spins_in_compiled_code_is_named(tmp_path: Path) -> None:
    (tmp_path / "hang.c").write_text("void hang(void);\nvoid hang(void) { for (;;) { } }\n")
    compile_library([tmp_path / "hang.c"], tmp_path / "hang.so")
    done = run(tmp_path, IN_C, "-o", "timeout=0.5", "-o", "faulthandler_timeout=1")
    assert done.returncode == 1, done.stdout + done.stderr
    assert "in test_that_spins" in done.stderr
