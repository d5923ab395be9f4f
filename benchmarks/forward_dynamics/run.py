"""Accelerations of chains, a Puma 560 and a humanoid-size tree, compared with other programs.

    python benchmarks/forward_dynamics/run.py [--quick] [--plot] [pins balls planar puma humanoid]

CPU ns per evaluation in native loops, all programs in alternating rounds of one process, in two
ways: latency-chained (each input depends on the previous output, as in an integrator) and
throughput.  Results are compared before timing.  Drake and Exudyn run inside their integrators.
"""

from __future__ import annotations

import statistics
import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from common import measure  # noqa: E402
from common.programs import MAX_DIFFERENCE, SceneSubjects, program_family, scene_subjects  # noqa: E402

SIZES = {
    "pins": (2, 3, 7, 12, 24, 50, 100, 1000, 10_000, 100_000),
    "balls": (2, 3, 7, 12, 24, 100, 1000, 10_000, 100_000),
    "planar": (2, 3, 7, 12, 24, 50, 100, 1000, 10_000, 100_000),
    "puma": (6,),
    "humanoid": (25,),
}
QUICK = {"pins": (3, 7), "balls": (3,), "planar": (3,), "puma": (6,)}
SAMPLE = 1e6  # approximate duration of a sample, CPU ns


def take_samples(subjects: SceneSubjects, rounds: int) -> dict[str, dict[str, list[float]]]:
    """Mode -> variant of a program -> CPU ns per evaluation."""
    work: dict[str, Any] = {}
    for name, subject in subjects.subjects.items():
        evaluation_ns = subject.time(False, 1) * len(subject.q)
        repeats = max(1, int(SAMPLE / evaluation_ns))
        for mode in ("chained", "throughput"):
            work[f"{mode}:{name}"] = lambda s=subject, m=mode, r=repeats: s.time(m == "chained", r)
    work |= {f"chained:{name}": evaluation_ns for name, evaluation_ns in subjects.runs.items()}
    modes: dict[str, dict[str, list[float]]] = {"chained": {}, "throughput": {}}
    for name, values in measure.sample_rounds(work, rounds).items():
        mode, _, contender = name.partition(":")
        modes[mode][contender] = [round(value, 2) for value in values]
    return modes


def best_times(result: dict[str, Any], mode: str = "chained") -> dict[str, float]:
    """Program -> smallest median of its variants with correct results."""
    times: dict[str, float] = {}
    for name, values in result[mode].items():
        if result["differences"].get(name, 0.0) < MAX_DIFFERENCE:
            value = statistics.median(values)
            times[program_family(name)] = min(value, times.get(program_family(name), value))
    return times


def table(results: list[dict[str, Any]]) -> str:
    """Markdown: best variant of each program, latency-chained, and ratios to CasADi."""
    families = ["mstmm fused", "mstmm fused, baked", "mstmm looped", "CasADi C",
                "CasADi C, baked", "CasADi C + libmvec", "Pinocchio", "MuJoCo", "Drake",
                "Exudyn"]  # fmt: skip
    headings = ["scene", "bodies", *families, "fused/CasADi", "baked/baked", "fused/Pinocchio"]
    lines = [f"| {' | '.join(headings)} |"]
    lines.append("|---" * (len(families) + 5) + "|")
    ratios = []
    for result in results:
        times = best_times(result)
        cells = [f"{times[name]:.3g}" if name in times else "" for name in families]
        pairs = [("mstmm fused", "CasADi C"), ("mstmm fused, baked", "CasADi C, baked"),
                 ("mstmm fused", "Pinocchio")]  # fmt: skip
        ratio = [f"{times[a] / times[b]:.2f}" if {a, b} <= times.keys() else "" for a, b in pairs]
        if ratio[0]:
            ratios.append(times["mstmm fused"] / times["CasADi C"])
        lines.append(f"| {result['kind']} | {result['bodies']} | {' | '.join(cells + ratio)} |")
    if ratios:
        mean = measure.geometric_mean(ratios)
        lines.append(f"\nfused/CasADi C: geometric mean {mean:.3f}, worst {max(ratios):.2f}.")
    return "\n".join(lines)


def main() -> None:
    """Measure, print the table, draw."""
    parser = measure.option_parser(str(__doc__).splitlines()[0], HERE)
    parser.add_argument("kinds", nargs="*", default=[])
    parser.add_argument("--rounds", type=int, default=11)
    parser.add_argument("--compile", action="store_true", help="only compile")
    options = parser.parse_args()
    if not options.plot:
        sizes = QUICK if options.quick else SIZES
        results = []
        for kind in options.kinds or sizes:
            for bodies in sizes[kind]:
                subjects = scene_subjects(kind, bodies)
                if options.compile:
                    continue
                modes = take_samples(subjects, 3 if options.quick else options.rounds)
                results.append(
                    {"kind": kind, "bodies": bodies, "degrees_of_freedom": subjects.tree.nu,
                     "casadi_operations": subjects.operations, "differences": subjects.differences,
                     "error": subjects.error,
                     "failures": subjects.failures, **modes}
                )  # fmt: skip
                del subjects
                print(
                    kind,
                    bodies,
                    {k: round(value, 1) for k, value in best_times(results[-1]).items()},
                )
        if options.compile:
            return
        measure.save_record(options.json, results, unit="CPU ns per evaluation")
    from picture import draw

    record = measure.write_table(options.json, table)
    draw(record, best_times, options.picture)


if __name__ == "__main__":
    main()
