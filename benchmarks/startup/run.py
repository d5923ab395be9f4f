"""Start-up: imports, the first result with a warm cache, and with an empty one.

    python benchmarks/startup/run.py [--quick] [--plot]

Fresh processes in alternating rounds; CPU time (user and system, children included), so that a busy
machine and threads of BLAS do not count.  "gcc alone" is the compiler on the text of the cold
first result, with the same flags.
"""

from __future__ import annotations

import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from common import measure, scenes  # noqa: E402

FIRST, CASADI = str(HERE / "first_result.py"), str(HERE / "first_casadi_result.py")
#: Ratio -> largest value allowed.
TARGETS = {
    "import mstmm / import numpy": 1.2,
    "warm first result / import numpy": 3.0,
    "cold first result / (3 import numpy + 1.5 gcc)": 1.0,
}


def process_times(command: list[str], cache: Path) -> dict[str, float]:
    """CPU and wall seconds of a process and its children."""
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    environment["MSTMM_CACHE"] = str(cache)
    start_time = time.perf_counter()
    process = subprocess.Popen(
        command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"{' '.join(command)} ended with {process.returncode}")
    wall_s = time.perf_counter() - start_time
    return {"cpu_s": usage.ru_utime + usage.ru_stime, "wall_s": wall_s}


def compiler(scene: dict[str, Any], folder: Path) -> list[str]:
    """The command of the compiler alone on the text of the scene's fused code."""
    import mstmm
    from mstmm.abi.fused_library import COMPILER_FLAGS

    model = mstmm.compile(mstmm.Scene(**scene), engine="fused")
    sources = model.fusion._sources("scalar", "0" * 64)
    for name, text in sources.items():
        (folder / name).write_text(text)
    files = [str(folder / name) for name in sources if name.endswith(".c")]
    output = str(folder / "alone.so")
    return ["gcc", *COMPILER_FLAGS, "-fPIC", "-shared", *files, "-o", output, "-lm"]


def commands(folder: Path) -> dict[str, Callable[[], dict[str, float]]]:
    """Name -> function that runs and times a process."""
    scene, python = scenes.pins(7), sys.executable
    file, warm, cold = folder / "seven.json", folder / "warm", folder / "cold"
    file.write_text(json.dumps(scene))
    for cache in (warm, cold):
        cache.mkdir(mode=0o700)
    first_result = [python, FIRST, str(file)]
    process_times([*first_result, "fused"], warm)

    def run_with_empty_cache(command: list[str]) -> dict[str, float]:
        shutil.rmtree(cold)
        cold.mkdir(mode=0o700)
        return process_times(command, cold)

    compiler_command = compiler(scene, folder)
    runs: dict[str, Callable[[], dict[str, float]]] = {
        "python": lambda: process_times([python, "-c", "pass"], warm),
        "mstmm, warm": lambda: process_times([*first_result, "auto"], warm),
        "mstmm, cold, fused": lambda: run_with_empty_cache([*first_result, "fused"]),
        "mstmm, cold, auto": lambda: run_with_empty_cache([*first_result, "auto"]),
        "gcc alone": lambda: process_times(compiler_command, warm),
        "CasADi + CVODES, jit": lambda: process_times([python, CASADI, str(file)], warm),
    }
    for module in ("numpy", "mstmm", "casadi", "pinocchio", "mujoco", "pydrake.all", "exudyn"):
        runs[f"import {module}"] = lambda m=module: process_times(
            [python, "-c", f"import {m}"], warm
        )
    return runs


def ratios(results: dict[str, dict[str, list[float]]]) -> dict[str, float]:
    """Ratios with targets, of minimum CPU times."""
    least = {name: min(values["cpu_s"]) for name, values in results.items()}
    numpy = least["import numpy"]
    cold_limit = 3 * numpy + 1.5 * least["gcc alone"]
    values = (least["import mstmm"] / numpy, least["mstmm, warm"] / numpy,
              least["mstmm, cold, fused"] / cold_limit)  # fmt: skip
    return dict(zip(TARGETS, values, strict=True))


def table(results: dict[str, dict[str, list[float]]]) -> str:
    """Markdown: smallest and median CPU ms, median wall ms; then the ratios."""
    lines = ["| process | CPU ms, min | CPU ms, median | wall ms, median |", "|---" * 4 + "|"]
    for name, values in results.items():
        cpu_s, wall_s = values["cpu_s"], values["wall_s"]
        cells = (min(cpu_s), statistics.median(cpu_s), statistics.median(wall_s))
        lines.append(f"| {name} | {' | '.join(f'{1e3 * x:.0f}' for x in cells)} |")
    lines += ["", "| ratio | measured | target |", "|---" * 3 + "|"]
    for name, value in ratios(results).items():
        lines.append(f"| {name} | {value:.2f} | {TARGETS[name]:g} |")
    return "\n".join(lines)


def main() -> None:
    """Measure, print the table, draw."""
    parser = measure.option_parser(str(__doc__).splitlines()[0], HERE)
    parser.add_argument("--rounds", type=int, default=9)
    options = parser.parse_args()
    if not options.plot:
        with tempfile.TemporaryDirectory() as folder:
            work = commands(Path(folder))
            results: dict[str, dict[str, list[float]]] = {
                name: {"cpu_s": [], "wall_s": []} for name in work
            }
            for round_index in range(1 + (2 if options.quick else options.rounds)):
                for name, run in work.items():
                    for key, value in run().items():
                        if (
                            round_index
                        ):  # the first round writes byte code and fills the disk's cache
                            results[name][key].append(round(value, 5))
        measure.save_record(options.json, results)
    record = measure.write_table(options.json, table)
    from picture import draw

    draw(record, options.picture)


if __name__ == "__main__":
    main()
