"""Rounds side by side, the machine they ran on, and their record as JSON."""

from __future__ import annotations

import argparse
import datetime
import json
import os
import platform
import re
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

PEERS = ("numpy", "scipy", "casadi", "pin", "mujoco", "drake", "exudyn", "scikit-sundae", "control")


def machine() -> dict[str, Any]:
    """What figures were taken on, when, and how busy it was."""
    names, vector = [], ""
    info = Path("/proc/cpuinfo")
    for line in info.read_text().splitlines() if info.exists() else []:
        if line.startswith("model name"):
            names.append(line.partition(":")[2].strip())
        if line.startswith("flags"):
            found = [x for x in ("avx512f", "avx2", "avx") if x in line.split()]
            vector = found[0] if found else ""
    return {
        "date": datetime.date.today().isoformat(),
        "processor": names[0] if names else platform.processor(),
        "cores": len(names) or os.cpu_count(),
        "vectors": vector,
        "system": f"{platform.system()} {platform.machine()}",
        "python": sys.version.split()[0],
        "gcc": subprocess.check_output(["gcc", "-dumpfullversion"], text=True).strip(),
        "load": os.getloadavg()[0],
        "versions": versions(),
    }  # fmt: skip


def versions() -> dict[str, str]:
    """Of the peers that this Python has."""
    found = {}
    for name in PEERS:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    import mstmm

    home = Path(mstmm.__file__).parent
    ask = ["git", "-C", str(home), "rev-parse", "--short", "HEAD"]
    try:
        commit = subprocess.run(ask, capture_output=True, text=True).stdout.strip()
    except OSError:  # a machine without git
        commit = ""
    found["mstmm"] = f"{mstmm.__version__} {commit}".strip()
    return found


def rounds(work: Mapping[str, Callable[[], float]], count: int) -> dict[str, list[float]]:
    """Samples of every contender, one after the other in each round; one round to warm up."""
    samples: dict[str, list[float]] = {name: [] for name in work}
    for turn in range(count + 1):
        for name, once in work.items():
            value = once()
            if turn:
                samples[name].append(value)
    return samples


def cpu(work: Callable[[], object]) -> float:
    """CPU seconds of all threads of this process."""
    begin = time.process_time()
    work()
    return time.process_time() - begin


def once(work: Callable[[], object], least: float = 5e-3) -> float:
    """CPU seconds of one run; short ones are repeated until they last `least` s."""
    first = cpu(work)
    if first > least:
        return first
    count = max(2, int(least / max(first, 1e-5)))
    return cpu(lambda: [work() for _ in range(count)]) / count


def summary(samples: list[float]) -> str:
    """Minimum and median."""
    return f"{min(samples):12.4g} {statistics.median(samples):12.4g}"


def geometric_mean(values: list[float]) -> float:
    """Of positive numbers."""
    return float(np.exp(np.mean(np.log(values))))


def disagreement(found: np.ndarray, reference: np.ndarray) -> float:
    """Largest difference, relative to the largest entry; infinite for numbers that are not."""
    if not np.isfinite(found).all():
        return float("inf")
    return float(np.abs(found - reference).max() / np.abs(reference).max())


def save(path: Path, results: Any, **more: Any) -> None:
    """JSON with the machine; arrays of samples on one line."""
    text = json.dumps({"machine": machine(), **more, "results": results}, indent=1)
    # One line for each list of plain numbers.
    text = re.sub(r"\[\s+([-\d.e+,\s]+?)\s+\]", lambda m: f"[{' '.join(m[1].split())}]", text)
    path.write_text(text + "\n")


def options(description: str, folder: Path) -> argparse.ArgumentParser:
    """What every benchmark understands."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--json", type=Path, default=folder / "result.json")
    parser.add_argument("--picture", type=Path, default=folder / "result.png")
    parser.add_argument("--quick", action="store_true", help="few sizes and rounds: does it run?")
    parser.add_argument("--plot", action="store_true", help="only draw what the JSON holds")
    return parser
