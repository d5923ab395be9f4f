"""What one implicit step costs, in evaluations of the accelerations by the same engine.

    python -m benchmarks.stiff.steps [--quick] [--rounds 15]

By the looped engine: residual R, tangent T with its elimination, solution S and product P of chains
from 10 to 100 000 bodies; tangent L and solution X by laws alone.  A sum of numbers that no cache
holds is taken beside them: what memory gives at best.  By code of a scene's own: whole steps of an
arm of six pins.  All of a row alternate in one process; CPU times, the least of the rounds counts.
"""

from __future__ import annotations

import json
import time
from argparse import ArgumentParser
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

import mstmm
from mstmm.runtime.engine.looped_engine import LoopedEngine
from mstmm.runtime.engine.tangent_matrix import TangentMatrix

from ..common import measure
from . import scenes

HERE = Path(__file__).resolve().parent
CHAINS: dict[str, Callable[[int], scenes.Scene]] = {
    "pins": lambda n: scenes.damped_rods(n, 1e3),
    "bushings": lambda n: scenes.bushed_rods(n, 1e8, 0.01),
}
METHODS = ("genalpha", "dttmm", "rodas4p2", "kvaerno5")
STEP, STEPS = 1e-4, 20_000  # s
#: Bodies that a cache holds, and that none does.
SHORT, LONG = 1000, 100_000
#: What one Newton iteration is made of.
ITERATION = "RTS"
#: Bytes of an array that no cache holds.
STREAM = 256_000_000
#: 1/s, of a step within which no chain leaves by itself under the weight of 100 000 rods.
STEP_FACTOR = 5000.0


def least_times(calls: Mapping[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """CPU seconds of each call, the least of rounds in turn."""
    times = dict.fromkeys(calls, float("inf"))
    for _ in range(rounds):
        for name, call in calls.items():
            start_time = time.process_time()
            call()
            times[name] = min(times[name], time.process_time() - start_time)
    return times


def memory_ns_per_byte(rounds: int) -> float:
    """Nanoseconds a byte that is read once, from front to back."""
    numbers = np.ones(STREAM // 8)
    return 1e9 * least_times({"sum": numbers.sum}, rounds)["sum"] / STREAM


def bytes_per_body(engine: LoopedEngine, tangent: TangentMatrix) -> dict[str, float]:
    """Bytes a body of what evaluations, and of what an iteration works on."""
    n = engine.packed.system.count
    tangent_bytes = tangent.work.nbytes + tangent.numbers.nbytes
    return {
        "E": tangent.workspace.nbytes / n,
        ITERATION: (tangent.workspace.nbytes + tangent_bytes) / n,
    }


def measure_chain(name: str, n: int, rounds: int) -> dict[str, Any]:
    """Nanoseconds a body of each pass."""
    model = mstmm.compile(mstmm.Scene(**CHAINS[name](n)), engine="looped")
    engine, tangent = model.looped, TangentMatrix(model.looped)
    random = np.random.default_rng(1)
    q, u = (np.asarray(x, float) for x in model.initial_state())
    q, a = q + 1e-6 * random.normal(size=q.shape), np.zeros(engine.nu)
    right_hand_side, memory = random.normal(size=engine.nu), engine.start_memory()[None]
    tangent.residual(0.0, q, u, a)
    tangent.factor(STEP_FACTOR, STEP_FACTOR)
    law_tangent = TangentMatrix(model.looped)
    law_tangent.residual(0.0, q, u, a)
    law_tangent.factor_laws(STEP_FACTOR, STEP_FACTOR)
    calls: dict[str, Callable[[], object]] = {
        "E": lambda: engine.accelerations(0.0, q[None], u[None], memory),
        "R": lambda: tangent.residual(0.0, q, u, a),
        "T": lambda: tangent.factor(STEP_FACTOR, STEP_FACTOR),
        "S": lambda: tangent.solve(right_hand_side),
        "P": lambda: tangent.slope(0.0, q, u, right_hand_side),
        "L": lambda: law_tangent.factor_laws(STEP_FACTOR, STEP_FACTOR),
        "X": lambda: law_tangent.solve(right_hand_side),
    }
    repeats = max(1, 20_000 // n)
    repeated_calls = {k: (lambda f=f: [f() for _ in range(repeats)]) for k, f in calls.items()}
    seconds = least_times(repeated_calls, rounds)
    times = {k: 1e9 * x / n / repeats for k, x in seconds.items()}
    return {"chain": name, "bodies": n, **times, "bytes": bytes_per_body(engine, tangent)}


def measure_fused(rounds: int) -> dict[str, Any]:
    """Microseconds of a step of the arm of six pins, and of one evaluation, by its own code."""
    model = mstmm.compile(mstmm.Scene(**scenes.rigid_arm()), engine="fused")
    t_end = STEP * STEPS

    def run(method: str) -> Callable[[], object]:
        options: dict[str, Any] = {"certify": False, "output_times": [0.0, t_end], "step": STEP}
        return lambda: model.simulate(t_end, method=method, **options)

    times = least_times({name: run(name) for name in ("rk4", *METHODS)}, rounds)
    microseconds = {name: 1e6 * seconds / STEPS for name, seconds in times.items()}
    return {"E": microseconds.pop("rk4") / 4, **microseconds}


def iteration_time(row: Mapping[str, Any]) -> float:
    """Nanoseconds a body of one Newton iteration."""
    return float(sum(row[k] for k in ITERATION))


def growth_lines(result: Mapping[str, Any]) -> list[str]:
    """What a body costs in many against few, beside what memory costs."""
    lines = [
        f"Memory, read once and in order: {result['stream']:.3f} ns a byte.  Per body, in {LONG}"
        f" against {SHORT}:",
        "",
        "| chain | E | R+T+S | numbers of E | numbers of R, T and S | read once |",
        "|---|---|---|---|---|---|",
    ]
    rows = {(row["chain"], row["bodies"]): row for row in result["looped"]}
    for name in CHAINS:
        short, long = rows[name, SHORT], rows[name, LONG]
        byte_counts = long["bytes"]
        lines.append(
            f"| {name} | {long['E'] / short['E']:.2f} "
            f"| {iteration_time(long) / iteration_time(short):.2f} |"
            f" {byte_counts['E']:.0f} B | {byte_counts[ITERATION]:.0f} B |"
            f" {byte_counts[ITERATION] * result['stream']:.0f} ns |"
        )
    return lines


def table(result: dict[str, Any]) -> str:
    """The result as Markdown."""
    lines = [
        "| chain | bodies | E, ns a body | R/E | T/E | S/E | (R+T+S)/E | P/E | L/E | X/E |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in result["looped"]:
        with_iteration = row | {ITERATION: iteration_time(row)}
        ratios = " | ".join(
            f"{with_iteration[k] / row['E']:.2f}" for k in (*"RTS", ITERATION, *"PLX")
        )
        lines.append(f"| {row['chain']} | {row['bodies']} | {row['E']:.0f} | {ratios} |")
    if any(row["bodies"] == LONG for row in result["looped"]):
        lines += ["", *growth_lines(result)]
    arm = result["fused"]
    lines += ["", f"Arm of six pins by its own code, one evaluation {arm['E']:.3f} us:", ""]
    lines += ["| method | us a step | evaluations |", "|---|---|---|"]
    lines += [f"| {m} | {arm[m]:.2f} | {arm[m] / arm['E']:.1f} |" for m in METHODS]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure, write steps.json and steps.md, print the table."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="try whether it runs; writes nothing")
    parser.add_argument("--rounds", type=int, default=15)
    options = parser.parse_args()
    sizes = (10, 100) if options.quick else (10, 100, SHORT, 10_000, LONG)
    rounds = 1 if options.quick else options.rounds
    looped = [measure_chain(name, n, rounds) for name in CHAINS for n in sizes]
    result = {
        "machine": measure.machine(), "looped": looped, "stream": memory_ns_per_byte(rounds),
        "fused": measure_fused(rounds),
    }  # fmt: skip
    text = table(result)
    print(text)
    if not options.quick:
        (HERE / "steps.json").write_text(json.dumps(result, indent=1) + "\n")
        (HERE / "steps.md").write_text(text)


if __name__ == "__main__":
    main()
