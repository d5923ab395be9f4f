"""Start-up: imports, the first result with a warm cache, and with an empty one.

    python benchmarks/startup/run.py [--quick] [--plot]

Fresh processes in alternating rounds; CPU time (user and system, children included), so that a busy
machine and threads of BLAS do not count.  "gcc alone" is the compiler on the text that the cold
first result had it compile, with the same flags.
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

FIRST, CASADI = str(HERE / "first.py"), str(HERE / "first_casadi.py")
#: Ratio -> largest value allowed.
TARGETS = {
    "import mstmm / import numpy": 1.2,
    "warm first result / import numpy": 3.0,
    "cold first result / (3 import numpy + 1.5 gcc)": 1.0,
}


def spent(command: list[str], cache: Path) -> dict[str, float]:
    """CPU and wall seconds of a process and its children."""
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    environment["MSTMM_CACHE"] = str(cache)
    begin = time.perf_counter()
    process = subprocess.Popen(
        command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"{' '.join(command)} ended with {process.returncode}")
    wall = time.perf_counter() - begin
    return {"cpu_s": usage.ru_utime + usage.ru_stime, "wall_s": wall}


def compiler(scene: dict[str, Any], folder: Path) -> list[str]:
    """The command of the compiler alone on the text of the scene's fused code."""
    import mstmm
    from mstmm.abi.fused_library import COMPILER_FLAGS

    model = mstmm.compile(mstmm.Scene(**scene), engine="fused")
    sources = model.fusion._sources("scalar", "0" * 64)
    for name, text in sources.items():
        (folder / name).write_text(text)
    files = [str(folder / name) for name in sources if name.endswith(".c")]
    return [
        "gcc",
        *COMPILER_FLAGS,
        "-fPIC",
        "-shared",
        *files,
        "-o",
        str(folder / "alone.so"),
        "-lm",
    ]


def commands(folder: Path) -> dict[str, Callable[[], dict[str, float]]]:
    """What is timed: name -> one run."""
    scene, python = scenes.pins(7), sys.executable
    file, warm, cold = folder / "seven.json", folder / "warm", folder / "cold"
    file.write_text(json.dumps(scene))
    for place in (warm, cold):
        place.mkdir(mode=0o700)
    first = [python, FIRST, str(file)]
    spent([*first, "fused"], warm)

    def emptied(command: list[str]) -> dict[str, float]:
        shutil.rmtree(cold)
        cold.mkdir(mode=0o700)
        return spent(command, cold)

    alone = compiler(scene, folder)
    found: dict[str, Callable[[], dict[str, float]]] = {
        "python": lambda: spent([python, "-c", "pass"], warm),
        "mstmm, warm": lambda: spent([*first, "auto"], warm),
        "mstmm, cold, fused": lambda: emptied([*first, "fused"]),
        "mstmm, cold, auto": lambda: emptied([*first, "auto"]),
        "gcc alone": lambda: spent(alone, warm),
        "CasADi + CVODES, jit": lambda: spent([python, CASADI, str(file)], warm),
    }
    for module in ("numpy", "mstmm", "casadi", "pinocchio", "mujoco", "pydrake.all", "exudyn"):
        found[f"import {module}"] = lambda m=module: spent([python, "-c", f"import {m}"], warm)
    return found


def ratios(results: dict[str, dict[str, list[float]]]) -> dict[str, float]:
    """The targets' ratios, of smallest CPU times."""
    low = {name: min(values["cpu_s"]) for name, values in results.items()}
    numpy = low["import numpy"]
    allowed = 3 * numpy + 1.5 * low["gcc alone"]
    values = (low["import mstmm"] / numpy, low["mstmm, warm"] / numpy,
              low["mstmm, cold, fused"] / allowed)  # fmt: skip
    return dict(zip(TARGETS, values, strict=True))


def table(results: dict[str, dict[str, list[float]]]) -> str:
    """Markdown: smallest and median CPU ms, median wall ms; then the ratios."""
    lines = ["| process | CPU ms, min | CPU ms, median | wall ms, median |", "|---" * 4 + "|"]
    for name, values in results.items():
        cpu, wall = values["cpu_s"], values["wall_s"]
        cells = (min(cpu), statistics.median(cpu), statistics.median(wall))
        lines.append(f"| {name} | {' | '.join(f'{1e3 * x:.0f}' for x in cells)} |")
    lines += ["", "| ratio | measured | target |", "|---" * 3 + "|"]
    for name, value in ratios(results).items():
        lines.append(f"| {name} | {value:.2f} | {TARGETS[name]:g} |")
    return "\n".join(lines)


def main() -> None:
    """Measure, print the table, draw."""
    parser = measure.options(str(__doc__).splitlines()[0], HERE)
    parser.add_argument("--rounds", type=int, default=9)
    options = parser.parse_args()
    if not options.plot:
        with tempfile.TemporaryDirectory() as folder:
            work = commands(Path(folder))
            results: dict[str, dict[str, list[float]]] = {
                name: {"cpu_s": [], "wall_s": []} for name in work
            }
            for turn in range(1 + (2 if options.quick else options.rounds)):
                for name, once in work.items():
                    for key, value in once().items():
                        if turn:  # the first round writes byte code and fills the disk's cache
                            results[name][key].append(round(value, 5))
        measure.save(options.json, results)
    record = json.loads(options.json.read_text())
    text = table(record["results"])
    print(text)
    options.json.with_suffix(".md").write_text(text + "\n")
    from picture import draw

    draw(record, options.picture)


if __name__ == "__main__":
    main()
