"""Accelerations of chains, a Puma 560 and a humanoid-size tree: mstmm's engines and their peers.

    python benchmarks/forward_dynamics/run.py [--quick] [--plot] [pins balls planar puma humanoid]

CPU ns per evaluation in native loops, all contenders in alternating rounds of one run, in two ways:
latency-chained (inputs wait for the outputs before, as in an integrator) and throughput.  Results
are compared before anything is timed.  Drake and Exudyn run inside their own integrators.
"""

from __future__ import annotations

import json
import statistics
import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from common import measure  # noqa: E402
from common.contenders import WRONG, Field, family, field_of  # noqa: E402

SIZES = {
    "pins": (2, 3, 7, 12, 24, 50, 100, 1000, 10_000, 100_000),
    "balls": (2, 3, 7, 12, 24, 100, 1000, 10_000, 100_000),
    "planar": (2, 3, 7, 12, 24, 50, 100, 1000, 10_000, 100_000),
    "puma": (6,),
    "humanoid": (25,),
}
QUICK = {"pins": (3, 7), "balls": (3,), "planar": (3,), "puma": (6,)}
SAMPLE = 1e6  # CPU ns that one sample lasts about


def samples(found: Field, rounds: int) -> dict[str, dict[str, list[float]]]:
    """Mode -> contender -> CPU ns per evaluation."""
    work: dict[str, Any] = {}
    for name, subject in found.subjects.items():
        once = subject.time(False, 1) * len(subject.q)
        repeats = max(1, int(SAMPLE / once))
        for mode in ("chained", "throughput"):
            work[f"{mode}:{name}"] = lambda s=subject, m=mode, r=repeats: s.time(m == "chained", r)
    work |= {f"chained:{name}": once for name, once in found.runs.items()}
    modes: dict[str, dict[str, list[float]]] = {"chained": {}, "throughput": {}}
    for name, values in measure.rounds(work, rounds).items():
        mode, _, contender = name.partition(":")
        modes[mode][contender] = [round(v, 2) for v in values]
    return modes


def best(result: dict[str, Any], mode: str = "chained") -> dict[str, float]:
    """Family -> smallest median of those that are right."""
    found: dict[str, float] = {}
    for name, values in result[mode].items():
        if result["disagreement"].get(name, 0.0) < WRONG:
            value = statistics.median(values)
            found[family(name)] = min(value, found.get(family(name), value))
    return found


def table(results: list[dict[str, Any]]) -> str:
    """Markdown: best of each family, latency-chained, and fused against CasADi."""
    families = ["mstmm fused", "mstmm fused, baked", "mstmm looped", "CasADi C",
                "CasADi C, baked", "CasADi C + libmvec", "Pinocchio", "MuJoCo", "Drake",
                "Exudyn"]  # fmt: skip
    heads = ["scene", "bodies", *families, "fused/CasADi", "baked/baked", "fused/Pinocchio"]
    lines = [f"| {' | '.join(heads)} |"]
    lines.append("|---" * (len(families) + 5) + "|")
    ratios = []
    for result in results:
        found = best(result)
        cells = [f"{found[name]:.3g}" if name in found else "" for name in families]
        pairs = [("mstmm fused", "CasADi C"), ("mstmm fused, baked", "CasADi C, baked"),
                 ("mstmm fused", "Pinocchio")]  # fmt: skip
        ratio = [f"{found[a] / found[b]:.2f}" if {a, b} <= found.keys() else "" for a, b in pairs]
        if ratio[0]:
            ratios.append(found["mstmm fused"] / found["CasADi C"])
        lines.append(f"| {result['kind']} | {result['bodies']} | {' | '.join(cells + ratio)} |")
    if ratios:
        mean = measure.geometric_mean(ratios)
        lines.append(f"\nfused/CasADi C: geometric mean {mean:.3f}, worst {max(ratios):.2f}.")
    return "\n".join(lines)


def main() -> None:
    """Measure, print the table, draw."""
    parser = measure.options(str(__doc__).splitlines()[0], HERE)
    parser.add_argument("kinds", nargs="*", default=[])
    parser.add_argument("--rounds", type=int, default=11)
    parser.add_argument("--compile", action="store_true", help="only build what will be timed")
    options = parser.parse_args()
    if not options.plot:
        sizes = QUICK if options.quick else SIZES
        results = []
        for kind in options.kinds or sizes:
            for bodies in sizes[kind]:
                found = field_of(kind, bodies)
                if options.compile:
                    continue
                timed = samples(found, 3 if options.quick else options.rounds)
                results.append(
                    {"kind": kind, "bodies": bodies, "freedoms": found.tree.nu,
                     "casadi_operations": found.operations, "disagreement": found.disagreement,
                     "error": found.error,
                     "absent": found.absent, **timed}
                )  # fmt: skip
                del found
                print(kind, bodies, {k: round(v, 1) for k, v in best(results[-1]).items()})
        if options.compile:
            return
        measure.save(options.json, results, unit="CPU ns per evaluation")
    from picture import draw

    record = json.loads(options.json.read_text())
    text = table(record["results"])
    print(text)
    options.json.with_suffix(".md").write_text(text + "\n")
    draw(record, best, options.picture)


if __name__ == "__main__":
    main()
