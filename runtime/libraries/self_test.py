"""Test of a new library in a separate process, so that a crash does not end this one.

The process returns 0 if the library opens, has its symbols, and its self-test, if any, returns 0.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from ..platform_support.subprocesses import ProcessTimeout, run

#: Name of the self-test `int (void)` that a library may export; 0 is success.
SELF_TEST_SYMBOL = "mstmm_self_test"

_TIMEOUT_S = 60.0

# Without site and with the standard library alone: about 12 ms.
_SCRIPT = f"""\
import ctypes, os, sys
library = ctypes.CDLL(sys.argv[1], os.RTLD_NOW)
for name in sys.argv[2:]:
    getattr(library, name)
test = getattr(library, {SELF_TEST_SYMBOL!r}, None)
if test is not None and test() != 0:
    sys.exit("its self-test failed")
"""


def problem(library: Path, symbols: Sequence[str]) -> str:
    """Reason that a library cannot be used, or ""; also "" if no test process can be started."""
    if not sys.executable:  # Python inside another program
        return ""
    try:
        result = run(
            [sys.executable, "-I", "-S", "-c", _SCRIPT, str(library), *symbols],
            library.parent,
            _TIMEOUT_S,
        )
    except ProcessTimeout:
        return f"it did not return within {_TIMEOUT_S:g} s"
    except OSError:
        return ""
    if result.code == 0:
        return ""
    if result.code < 0:
        return f"it crashes ({result.signal()})"
    lines = result.output.splitlines()
    return lines[-1].strip()[:300] if lines else f"its test ended with code {result.code}"
