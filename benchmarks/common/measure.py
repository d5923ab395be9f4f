"""CPU times in alternating rounds, the machine, and the record as JSON and Markdown."""

from __future__ import annotations

import argparse
import datetime
import json
import os
import platform
import re
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
    """Processor, programs, date and load of a measurement."""
    names, vectors = [], ""
    info = Path("/proc/cpuinfo")
    for line in info.read_text().splitlines() if info.exists() else []:
        if line.startswith("model name"):
            names.append(line.partition(":")[2].strip())
        if line.startswith("flags"):
            extensions = [x for x in ("avx512f", "avx2", "avx") if x in line.split()]
            vectors = extensions[0] if extensions else ""
    return {
        "date": datetime.date.today().isoformat(),
        "run": os.environ.get("BENCHMARK_RUN", ""),
        "processor": names[0] if names else platform.processor(),
        "cores": len(names) or os.cpu_count(),
        "vectors": vectors,
        "system": f"{platform.system()} {platform.machine()}",
        "python": sys.version.split()[0],
        "gcc": subprocess.check_output(["gcc", "-dumpfullversion"], text=True).strip(),
        "load": os.getloadavg()[0],
        "versions": versions(),
    }  # fmt: skip


def versions() -> dict[str, str]:
    """Versions of the installed programs."""
    versions_by_name = {}
    for name in PEERS:
        try:
            versions_by_name[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    import mstmm

    folder = Path(mstmm.__file__).parent
    command = ["git", "-C", str(folder), "rev-parse", "--short", "HEAD"]
    try:
        commit = subprocess.run(command, capture_output=True, text=True).stdout.strip()
    except OSError:  # a machine without git
        commit = ""
    versions_by_name["mstmm"] = f"{mstmm.__version__} {commit}".strip()
    return versions_by_name


def sample_rounds(work: Mapping[str, Callable[[], float]], count: int) -> dict[str, list[float]]:
    """Samples of every program, one after the other in each round, after one warm-up round."""
    samples: dict[str, list[float]] = {name: [] for name in work}
    for round_index in range(count + 1):
        for name, sample in work.items():
            value = sample()
            if round_index:
                samples[name].append(value)
    return samples


def cpu_time(work: Callable[[], object]) -> float:
    """CPU time of a call, all threads of this process, s."""
    start_time = time.process_time()
    work()
    return time.process_time() - start_time


def call_time(work: Callable[[], object], min_duration: float = 5e-3) -> float:
    """CPU seconds of one run; short ones are repeated until they last `min_duration` s."""
    first = cpu_time(work)
    if first > min_duration:
        return first
    count = max(2, int(min_duration / max(first, 1e-5)))
    return cpu_time(lambda: [work() for _ in range(count)]) / count


def geometric_mean(values: list[float]) -> float:
    """Geometric mean of positive numbers."""
    return float(np.exp(np.mean(np.log(values))))


def relative_difference(values: np.ndarray, reference: np.ndarray) -> float:
    """Largest difference relative to the largest reference entry; infinite if not finite."""
    if not np.isfinite(values).all():
        return float("inf")
    return float(np.abs(values - reference).max() / np.abs(reference).max())


def save_record(path: Path, results: Any, **metadata: Any) -> None:
    """Write a JSON file with the machine and the results; samples of a list on one line."""
    text = json.dumps({"machine": machine(), **metadata, "results": results}, indent=1)
    # One line for each list of plain numbers.
    text = re.sub(r"\[\s+([-\d.e+,\s]+?)\s+\]", lambda m: f"[{' '.join(m[1].split())}]", text)
    path.write_text(text + "\n")


def write_table(path: Path, table: Callable[[list[dict[str, Any]]], str]) -> dict[str, Any]:
    """Print the table of a stored record, write it beside the JSON, and return the record."""
    record = dict(json.loads(path.read_text()))
    text = table(record["results"])
    print(text)
    path.with_suffix(".md").write_text(text.rstrip("\n") + "\n")
    return record


def option_parser(description: str, folder: Path) -> argparse.ArgumentParser:
    """Parser of the options that all benchmarks have."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--json", type=Path, default=folder / "result.json")
    parser.add_argument("--picture", type=Path, default=folder / "result.png")
    parser.add_argument(
        "--quick", action="store_true", help="few sizes and rounds, to test the script"
    )
    parser.add_argument(
        "--plot", action="store_true", help="tables and pictures from the stored JSON"
    )
    return parser
