"""Interrupts while the program starts: one word and 130, never a traceback."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

START = Path(__file__).parent / "start"


@pytest.mark.parametrize(
    ("which", "stride"), [(signal.SIGINT, 53), (signal.SIGTERM, 97)], ids=["SIGINT", "SIGTERM"]
)
def test_an_interrupt_at_any_step_of_the_start(
    tmp_path: Path, heard: None, which: signal.Signals, stride: int
) -> None:
    report = tmp_path / "report.json"
    asked = {"signal": int(which), "stride": stride, "report": str(report)}
    environment = os.environ | {
        "MSTMM_TEST_START": json.dumps(asked), "OPENBLAS_NUM_THREADS": "1",
        "PYTHONPATH": os.pathsep.join([str(START), os.environ.get("PYTHONPATH", "")]),
    }  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-m", "mstmm", "list", "hinges"],
        check=False, capture_output=True, text=True, env=environment,
    )  # fmt: skip
    assert done.returncode == 0 and "pin" in done.stdout, done.stderr
    ended = json.loads(report.read_text())
    assert len(ended) > 5
    wrong = [end for end in ended if (end["code"], end["said"]) != (130, "mstmm: interrupted\n")]
    assert not wrong, (len(wrong), Counter(end["code"] for end in wrong), wrong[:3])


def test_an_ignored_interrupt_is_ignored_from_the_start(tmp_path: Path) -> None:
    script = "trap '' INT; exec \"$@\""
    program = (
        "import signal, sys; sys.argv[0] = 'mstmm'\n"
        "import mstmm.interrupts as found\n"
        "print(signal.getsignal(signal.SIGINT) is signal.SIG_IGN,"
        " callable(signal.getsignal(signal.SIGTERM)))"
    )
    done = subprocess.run(
        ["sh", "-c", script, "sh", sys.executable, "-c", program],
        check=True, capture_output=True, text=True,
    )  # fmt: skip
    assert done.stdout.split() == ["True", "True"]


def test_a_library_leaves_signals_alone() -> None:
    program = (
        "import signal; before = [signal.getsignal(n) for n in (2, 15)]\n"
        "import mstmm, mstmm.runtime.simulate\n"
        "print(before == [signal.getsignal(n) for n in (2, 15)])"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], check=True, capture_output=True, text=True
    )
    assert done.stdout.split() == ["True"]
