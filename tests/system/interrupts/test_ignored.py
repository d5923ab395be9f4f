"""Tests that send signals pass as well where the shell ignores them, as for background jobs."""

from __future__ import annotations

import subprocess
import sys

from tests.support.paths import ROOT, TESTS

#: Signals to this process, to one it started, and to a command.
SENDERS = (
    "runtime/platform_support/test_subprocesses.py::test_an_interrupt_ends_work_that_holds_the_lock",
    "runtime/libraries/test_library_build.py::test_lock_and_compiler_end_with_their_killed_owner",
    "runtime/run/test_checkpoint.py::test_ctrl_c_in_the_second_run_costs_the_estimate_only",
    "mstmm/test_signal_handling.py::test_an_import_is_not_cut_off_unless_it_takes_long",
)


def test_senders_of_signals_pass_where_they_are_ignored() -> None:
    script = "trap '' INT TERM QUIT HUP; exec \"$@\""
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--timeout=300"]
    done = subprocess.run(
        ["sh", "-c", script, "sh", *command, *(str(TESTS / name) for name in SENDERS)],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert "skipped" not in done.stdout, done.stdout
