"""Where the watched ends are at the end, by two explicit methods that have to agree.

    python -m benchmarks.stiff --references

writes `references.json`.  Explicit methods take stiff scenes at the limit of their stability, so
that their errors are far below their tolerances; what they cost is kept beside the places.
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
MADE_BY = (("dop853", 1e-12), ("dopri5", 1e-11))


def places(result: Any, case: Case) -> Array:
    """(n, 3) of the watched ends, m."""
    return np.array([result.position(end)[-1] for end in case.watched])


def computed(case: Case) -> dict[str, Any]:
    """Places by the first method, and how far the second one is off (m)."""
    model = mstmm.compile(mstmm.Scene(**case.scene()), engine="looped")
    found, cost = [], []
    for method, tolerance in MADE_BY:
        begin = time.process_time()
        result = model.simulate(
            case.t_end, method=method, rtol=tolerance, atol=tolerance, output_times=[case.t_end]
        )
        if not result.success:
            raise RuntimeError(f"{case.name} by {method}: {result.message}")
        found.append(places(result, case))
        statistics = result.statistics
        assert statistics is not None
        cost.append({
            "method": method, "tolerance": tolerance, "evaluations": statistics.evaluations,
            "cpu_s": round(time.process_time() - begin, 2),
        })  # fmt: skip
    apart = float(np.linalg.norm(found[0] - found[1], axis=1).max())
    return {"t_end_s": case.t_end, "made_by": cost, "apart_m": apart,
            "places_m": dict(zip(case.watched, found[0].tolist(), strict=True))}  # fmt: skip


def write(names: Iterable[str]) -> None:
    """Compute these anew and keep the rest."""
    kept = json.loads(FILE.read_text()) if FILE.exists() else {}
    for name in names:
        kept[name] = computed(CASES[name])
        print(name, f"apart {kept[name]['apart_m']:.1e} m", kept[name]["made_by"], flush=True)
    text = ",\n".join(
        f" {json.dumps(name)}: {json.dumps(kept[name])}" for name in CASES if name in kept
    )
    FILE.write_text("{\n" + text + "\n}\n")


def load(case: Case) -> tuple[Array, float]:
    """(places (n, 3), how far the two methods were apart) in m."""
    kept = json.loads(FILE.read_text())[case.name]
    return np.array([kept["places_m"][end] for end in case.watched]), float(kept["apart_m"])
