"""Frequency response of chains of rods on pins with springs: one input, one output.

    python benchmarks/frequency_response/run.py [--quick] [--plot]

CPU time of one frequency in alternating rounds: mstmm's sweep, python-control, if installed, on
the A and B of mstmm, and a dense complex solution with M, C and K.  Set-up is not counted.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from common import measure  # noqa: E402

import mstmm  # noqa: E402

#: Largest number of bodies for programs with matrices.
MAX_DENSE = 200
SIZES = (10, 50, 200, 1000, 10_000)
TARGET = "mstmm / python-control at 50 bodies (target 0.1)"


def chain(bodies: int) -> mstmm.Scene:
    """Hanging rods on pins with springs and dampers."""
    rod = {"mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.01, 1 / 12, 1 / 12],
           "ends": {"tip": [1, 0, 0]}}  # fmt: skip
    hinge = {"type": "pin", "axis": [0, 0, 1], "law": {"stiffness": 200.0, "damping": 0.5}}
    chain_table = {"name": "rope", "count": bodies, "inboard": "ground", "body": rod,
    "hinge": hinge,
           "orientation": [0, 0, -np.pi / 2]}  # fmt: skip
    return mstmm.Scene(gravity=[0, -9.81, 0], chain=[chain_table])


def response_calls(bodies: int) -> tuple[int, dict[str, Callable[[], np.ndarray]]]:
    """Number of frequencies, and calls that compute the response at all of them."""
    model = mstmm.compile(chain(bodies), engine="looped")
    linear = model.linearize(np.zeros(model.nq), inputs=["rope[0].hinge.effort"], disturbances=())
    omega = np.linspace(1, 30, max(100, 20_000 // bodies))
    last_coordinate = [linear.coordinate_names[-1]]
    work: dict[str, Callable[[], np.ndarray]] = {
        "mstmm": lambda: linear.frequency_response(omega, None, last_coordinate).response[:, 0, 0]
    }
    if bodies > MAX_DENSE:
        return len(omega), work
    m, c, k, v = linear.M, linear.C, linear.K, linear.V
    work["dense M, C, K"] = lambda: np.array(
        [np.linalg.solve(k + 1j * w * c - w * w * m, v)[-1, 0] for w in omega]
    )
    try:
        import control
    except ImportError:
        return len(omega), work
    row = np.eye(2 * bodies)[bodies - 1 : bodies]
    system = control.ss(linear.A, linear.B, row, 0)
    work["python-control"] = lambda: system(1j * omega)
    return len(omega), work


def measure_all(quick: bool) -> list[dict[str, Any]]:
    """Microseconds per frequency, and the relative difference from mstmm."""
    results = []
    for bodies in SIZES[:2] if quick else SIZES:
        count, work = response_calls(bodies)
        own = work["mstmm"]()
        timers = {name: lambda call=call: measure.call_time(call) for name, call in work.items()}
        for name, samples in measure.sample_rounds(timers, 2 if quick else 7).items():
            results.append({
                "bodies": bodies, "tool": name, "us": [1e6 * s / count for s in samples],
                "difference": measure.relative_difference(work[name](), own),
            })  # fmt: skip
            print(bodies, name, f"{min(results[-1]['us']):.4g} us", flush=True)
    return results


def table(results: list[dict[str, Any]]) -> str:
    """Markdown: minimum of the rounds."""
    lines = ["| bodies | tool | one frequency, us | ns per body | ratio to mstmm | difference |",
             "|---|---|---|---|---|---|"]  # fmt: skip
    own_us = {r["bodies"]: min(r["us"]) for r in results if r["tool"] == "mstmm"}
    for r in results:
        best_us = min(r["us"])
        lines.append(
            f"| {r['bodies']} | {r['tool']} | {best_us:.4g} | {1e3 * best_us / r['bodies']:.4g} | "
            f"{best_us / own_us[r['bodies']]:.3g} | {r['difference']:.1e} |"
        )
    peers = [r for r in results if r["bodies"] == 50 and r["tool"] == "python-control"]
    lines += [f"\n{TARGET}: {own_us[50] / min(r['us']):.3g}" for r in peers]
    return "\n".join(lines)


def draw(record: dict[str, Any], path: Path) -> None:
    """Time of a frequency over the number of bodies."""
    import matplotlib.pyplot as plt
    from common import style

    with plt.rc_context(style.PARAMETERS):
        figure, axes = plt.subplots(figsize=(6, 4.5))
        for tool in ("mstmm", "python-control", "dense M, C, K"):
            rows = [r for r in record["results"] if r["tool"] == tool]
            axes.loglog([r["bodies"] for r in rows], [min(r["us"]) for r in rows], "o-", label=tool)
        axes.set_xlabel("bodies")
        axes.set_ylabel("one frequency, CPU us")
        axes.legend()
        figure.subplots_adjust(bottom=0.2)
        style.add_footer(figure, record, "Chains of rods on pins; one input, one output.")
        style.save_figure(figure, path)


def main() -> None:
    """Measure, print the table, draw."""
    options = measure.option_parser(str(__doc__).splitlines()[0], HERE).parse_args()
    if not options.plot:
        measure.save_record(options.json, measure_all(options.quick))
    record = measure.write_table(options.json, table)
    draw(record, options.picture)


if __name__ == "__main__":
    main()
