"""Reference positions of the ends at the end of a run, by two explicit methods that must agree.

    python -m benchmarks.stiff --references

writes `references.json`.  Stability limits the steps of explicit methods on stiff scenes, so
that their errors are far below their tolerances.  Their cost is stored too.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

import mstmm

from .cases import CASES, Case

Array = np.ndarray
FILE = Path(__file__).with_name("references.json")

#: Method, rtol and atol; the places are those of the first one.  (With a smaller atol runs stall
#: where a stop's effort jumps.)
METHODS = (("dop853", 1e-12), ("dopri5", 1e-11))


def end_positions(result: Any, case: Case) -> Array:
    """Positions (n, 3) of the ends of a case, m."""
    return np.array([result.position(end)[-1] for end in case.end_names])


def compute_reference(case: Case) -> dict[str, Any]:
    """Positions by the first method, and the difference of the second, m."""
    model = mstmm.compile(mstmm.Scene(**case.scene()), engine="looped")
    positions, runs = [], []
    for method, tolerance in METHODS:
        start_time = time.process_time()
        result = model.simulate(
            case.t_end, method=method, rtol=tolerance, atol=tolerance, output_times=[case.t_end]
        )
        if not result.success:
            raise RuntimeError(f"{case.name} by {method}: {result.message}")
        positions.append(end_positions(result, case))
        statistics = result.statistics
        assert statistics is not None
        runs.append({
            "method": method, "tolerance": tolerance, "evaluations": statistics.evaluations,
            "cpu_s": round(time.process_time() - start_time, 2),
        })  # fmt: skip
    difference = float(np.linalg.norm(positions[0] - positions[1], axis=1).max())
    return {
        "t_end_s": case.t_end,
        "made_by": runs,
        "difference_m": difference,
        "positions_m": dict(zip(case.end_names, positions[0].tolist(), strict=True)),
    }


def write_references(names: Iterable[str]) -> None:
    """Compute and store the references of some cases."""
    stored = json.loads(FILE.read_text()) if FILE.exists() else {}
    for name in names:
        stored[name] = compute_reference(CASES[name])
        print(
            name,
            f"difference {stored[name]['difference_m']:.1e} m",
            stored[name]["made_by"],
            flush=True,
        )
    text = ",\n".join(
        f" {json.dumps(name)}: {json.dumps(stored[name])}" for name in CASES if name in stored
    )
    FILE.write_text("{\n" + text + "\n}\n")


def load_reference(case: Case) -> tuple[Array, float]:
    """Positions (n, 3) and difference of the two methods, m."""
    stored = json.loads(FILE.read_text())[case.name]
    positions = [stored["positions_m"][end] for end in case.end_names]
    return np.array(positions), float(stored["difference_m"])
