"""Processor features that -march=native uses: a library for one processor may crash on another."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path

#: Lines of /proc/cpuinfo that do not change while the machine runs: x86, then ARM, then others.
_CONSTANT_LINES = (
    "vendor_id", "cpu family", "model", "model name", "stepping", "flags",
    "CPU implementer", "CPU architecture", "CPU variant", "CPU part", "CPU revision", "Features",
    "cpu", "isa", "uarch", "features",
)  # fmt: skip


@cache
def features(source: Path = Path("/proc/cpuinfo")) -> dict[str, str]:
    """Fields of the first processor in /proc/cpuinfo, and the machine type.

    Where no features are listed the host name is added, so that no two machines share a library:
    slow, but safe.
    """
    lines_found = _first_block(source)
    if not {"flags", "Features", "isa", "features"} & lines_found.keys():
        lines_found["host"] = os.uname().nodename
    return lines_found | {"machine": os.uname().machine}


def _first_block(source: Path) -> dict[str, str]:
    try:
        with source.open("rb", buffering=0) as file:  # one read: every listed processor costs time
            text = file.read(16384)
    except OSError:
        return {}
    block = text.split(b"\n\n", 1)[0].decode("utf-8", "replace")
    lines = (line.partition(":") for line in block.splitlines())
    return {
        name.strip(): value.strip() for name, _, value in lines if name.strip() in _CONSTANT_LINES
    }
