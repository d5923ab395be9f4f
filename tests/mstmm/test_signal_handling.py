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

from tests.support.paths import TESTS

START = TESTS / "support" / "interrupts" / "start"


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
    word = "mstmm: interrupted\n"  # alone, or after all that the command had to say
    wrong = [end for end in ended if end["code"] != 130 or not end["said"].endswith(word)]
    wrong += [end for end in ended if end["said"] != word and not end["said"].startswith("hinges")]
    assert not wrong, (len(wrong), Counter(end["code"] for end in wrong), wrong[:3])


@pytest.mark.parametrize(
    ("lasts", "patience", "said"),
    [(0.1, 1e6, "loaded whole, then interrupted"), (1e6, 0.5, "then interrupted")],
)
def test_an_import_is_not_cut_off_unless_it_takes_long(
    tmp_path: Path, heard: None, lasts: float, patience: float, said: str
) -> None:
    """A library of another language may turn the exception into words of its own."""
    (tmp_path / "library.py").write_text(
        "import os, signal, time\nos.kill(os.getpid(), signal.SIGINT)\n"
        f"begin = time.monotonic()\nwhile time.monotonic() - begin < {lasts}: pass\n"
        "print('loaded whole,', end=' ')\n"
    )
    program = (
        "import sys; sys.argv[0] = 'mstmm'\n"
        f"import mstmm.signal_handling; mstmm.signal_handling._MAX_IMPORT_WAIT = {patience}\n"
        "mstmm.signal_handling.raise_on_signal()\n"
        "try:\n    import library\n    while True: pass\n"
        "except KeyboardInterrupt: print('then interrupted')"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, check=True, capture_output=True, text=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, [str(tmp_path), *sys.path]))},
    )  # fmt: skip
    assert done.stdout.strip() == said


def test_an_ignored_interrupt_is_ignored_from_the_start(heard: None) -> None:
    script = "trap '' INT; exec \"$@\""
    program = (
        "import signal, sys; sys.argv[0] = 'mstmm'\n"
        "import mstmm.signal_handling as found\n"
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
        "import mstmm, mstmm.runtime.run.integration_run\n"
        "print(before == [signal.getsignal(n) for n in (2, 15)])"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], check=True, capture_output=True, text=True
    )
    assert done.stdout.split() == ["True"]
