"""Accelerations of mechanisms with closed loops, side by side.

    python benchmarks/loops/run.py [--quick]

CPU time of one evaluation of many, contenders in alternating rounds: windows of four-bars in a row,
by the number of windows, beside an iteration of Exudyn's Newton method with a new Jacobian and its
sparse solver; Stewart's platform beside MuJoCo's equality constraints.  MuJoCo's rows yield by
design; `apart` tells how far its accelerations are from those of the rigid platform.  Andrews'
squeezer, run for 0.03 s to an error of its crank of 1e-6 rad, between each tool's settings around
it: DOP853 in C around Pinocchio's constrained dynamics, Exudyn's generalized alpha.  Ours is the
looped engine, and fused code where it says so, of one state at a time.  Windows are also measured
by the tangent of an implicit step and one solution with it.  Building what each needs is not
counted; peers that are not there are left out.
"""

from __future__ import annotations

import json
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from common import measure, mstmm_engines  # noqa: E402

import mstmm  # noqa: E402
from mstmm.runtime.engine.tangent_matrix import TangentMatrix  # noqa: E402

SIZES = (10, 50, 200, 1000)
#: Windows whose tangents are compared, as implicit steps take them.
FACTORED = (50, 400)
#: Scene, peer, ratio that was asked.
COMPARED = (
    (f"{SIZES[-1]} windows", "Exudyn", 0.05), ("platform", "MuJoCo", 0.3),
    ("Andrews to 1e-6", "Pinocchio", 0.1), ("Andrews to 1e-6", "Exudyn", 0.1),
)  # fmt: skip
#: Error of Andrews' crank, rad.
ASKED = 1e-6
PLATFORM = HERE.parents[1] / "examples" / "stewart_platform" / "scene.toml"


def windows(count: int) -> mstmm.Scene:
    """Cranks of 1 m side by side, joined at their tips by couplers of 1 m."""
    rod = {"mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.0, 1 / 12, 1 / 12],
           "ends": {"tip": [1, 0, 0]}}  # fmt: skip
    bodies = [rod | {"name": f"crank{k}"} for k in range(count + 1)]
    bodies += [rod | {"name": f"coupler{k}"} for k in range(count)]
    hinges: list[dict[str, Any]] = [
        {"name": f"foot{k}", "type": "pin", "inboard": "ground", "outboard": f"crank{k}",
         "position": [float(k), 0, 0], "initial": {"q": 0.7}}
        for k in range(count + 1)
    ]  # fmt: skip
    for k in range(count):
        hinges += [
            {"name": f"left{k}", "type": "pin", "inboard": f"crank{k}.tip",
             "outboard": f"coupler{k}", "initial": {"q": -0.7}},
            {"name": f"right{k}", "type": "pin", "inboard": f"coupler{k}.tip",
             "outboard": f"crank{k + 1}.tip", "initial": {"q": 0.7}},
        ]  # fmt: skip
    return mstmm.Scene(gravity=[0, -9.81, 0], body=bodies, hinge=hinges)


def platform() -> mstmm.Scene:
    """The platform of the examples on springs along its legs, two of them pressed."""
    data = tomllib.loads(PLATFORM.read_text(encoding="utf-8"))
    for k, hinge in enumerate(h for h in data["hinge"] if h["type"] == "prismatic"):
        del hinge["drive"]
        hinge |= {"initial": {"q": 0.414}, "hold": True}
        hinge["law"] = {"stiffness": 4e4, "rest": 0.414 + (0.01 if k < 2 else 0.0)}
    return mstmm.Scene(**data)


def evaluations(model: mstmm.Model, count: int) -> Callable[[], np.ndarray]:
    """Accelerations at the start, `count` times in one call."""
    q, u = model.initial_state()
    many_q, many_u = np.tile(q, (count, 1)), np.tile(u, (count, 1))
    return lambda: model.accelerations(many_q, many_u, threads=1)


def slides(model: mstmm.Model) -> np.ndarray:
    """Accelerations of the six legs at the start."""
    udot = model.accelerations(*model.initial_state())
    return np.array([udot[model.coordinate_layout.hinges[f"slide{k}"].u] for k in range(6)])


def per_evaluation(
    work: dict[str, Callable[[], Any]], count: int, rounds: int
) -> dict[str, list[float]]:
    """Microseconds of one of `count` evaluations, by contender."""
    timed = {name: lambda one=one: measure.once(one) for name, one in work.items()}
    return {name: [1e6 * s / count for s in found]
            for name, found in measure.rounds(timed, rounds).items()}  # fmt: skip


def measured(quick: bool) -> list[dict[str, Any]]:
    """Rows of the table."""
    rounds, results = (2, []) if quick else (15, [])
    models = {count: mstmm.compile(windows(count), engine="looped") for count in SIZES}
    calls = {count: max(4, 8000 // count) for count in SIZES}
    work = {str(count): evaluations(model, calls[count]) for count, model in models.items()}
    times, beside = dict[str, list[float]](), list[float]()
    for _ in range(max(2, rounds // 3)):
        for name, found in per_evaluation(work, 1, rounds).items():
            times.setdefault(name, []).extend(us / calls[int(name)] for us in found)
        beside += iteration_beside()
    for name, found in times.items():
        results.append(row_of(int(name), "mstmm", found))
    results += [row_of(SIZES[-1], "Exudyn", beside)] if beside else []
    return results + tangents(rounds) + platform_beside(rounds) + squeezer_beside(rounds)


def row_of(count: int, tool: str, times: list[float], what: str = "") -> dict[str, Any]:
    """A row of the table for so many windows, by microseconds of an evaluation or of `what`."""
    bodies = 2 * count + 1
    return {"scene": f"{count} windows{what}", "tool": tool, "us": times,
            "ns a body": [1e3 * us / bodies for us in times]}  # fmt: skip


def tangents(rounds: int) -> list[dict[str, Any]]:
    """Factors and one solution of an implicit step of 0.2 ms, windows in a row."""
    rng, calls, work = np.random.default_rng(1), 4000, {}
    for count in FACTORED:
        model = mstmm.compile(windows(count), engine="looped")
        work[count] = factoring(model, rng.normal(size=model.nu), calls // count)
    timed = {str(count): lambda one=one: measure.once(one) for count, one in work.items()}
    return [
        row_of(int(name), "mstmm", [1e6 * s / (calls // int(name)) for s in found], ", implicit")
        for name, found in measure.rounds(timed, rounds).items()
    ]


def factoring(model: mstmm.Model, r: np.ndarray, calls: int) -> Callable[[], None]:
    """So many tangents at the start, each with a solution."""
    tangent = TangentMatrix(model.looped)
    tangent.residual(0.0, *model.initial_state())

    def run() -> None:
        for _ in range(calls):
            tangent.factor(5e3, 5e3)
            tangent.solve(r)

    return run


def iteration_beside() -> list[float]:
    """Microseconds of an iteration of Exudyn's on the longest row of windows, if it is there."""
    try:
        import exudyn_planar
    except ImportError:
        print("Exudyn is not here")
        return []
    made, count = exudyn_planar.windows(SIZES[-1]), [0]

    def run() -> None:
        count[0] = made.run(0.01, 10, sparse=True, modified=False)[0]

    return [1e6 * measure.cpu(run) / count[0]]


def platform_beside(rounds: int) -> list[dict[str, Any]]:
    """Stewart's platform by us and by MuJoCo."""
    model = mstmm.compile(platform(), engine="looped")
    fused = mstmm.compile(platform(), engine="fused")
    q, u = fused.initial_state()
    subject = mstmm_engines.fused(fused, q[None], u[None])
    count, work = 2000, {
        "mstmm": evaluations(model, 2000), "mstmm fused": lambda: subject.time(True, 2000)
    }  # fmt: skip
    off = measure.disagreement(slides(fused), slides(model))
    apart = {"mstmm": 0.0, "mstmm fused": off}
    try:
        from mujoco_platform import MujocoPlatform

        peer = MujocoPlatform(model)
        work["MuJoCo"] = lambda: peer.forward(count)
        apart["MuJoCo"] = measure.disagreement(peer.slides(), slides(model))
    except ImportError:
        print("MuJoCo is not here")
    return [{"scene": "platform", "tool": name, "us": found, "apart": apart[name]}
            for name, found in per_evaluation(work, count, rounds).items()]  # fmt: skip


def squeezer_beside(rounds: int) -> list[dict[str, Any]]:
    """Andrews' squeezer to 1e-6 rad."""
    import squeezer

    scene = mstmm.load_scene(squeezer.SCENE)
    looped, fused = (mstmm.compile(scene, engine=engine) for engine in ("looped", "fused"))
    data = squeezer.Data(looped)
    makers = {
        "mstmm": lambda: squeezer.mstmm_runs(looped),
        "mstmm fused": lambda: squeezer.mstmm_runs(fused),
        "Pinocchio": lambda: squeezer.pinocchio_runs(data),
        "Exudyn": lambda: squeezer.exudyn_runs(data),
    }
    settings = {}
    for name, make in makers.items():
        try:
            settings[name] = squeezer.around(make(), ASKED)
        except (ImportError, SystemExit) as error:
            print(f"{name} is not here: {error}")
    work = {f"{name}: {setting}": run for name, two in settings.items()
            for setting, (run, _) in two.items()}  # fmt: skip
    times = per_evaluation(work, 1, rounds)
    return [_at_error(name, two, [times[f"{name}: {setting}"] for setting in two])
            for name, two in settings.items()]  # fmt: skip


def _at_error(name: str, two: dict[str, Any], times: list[list[float]]) -> dict[str, Any]:
    """The row of a tool from the times of its settings, round by round."""
    import squeezer

    errors = [error for _, error in two.values()]
    found = [squeezer.at_error(ASKED, errors, list(both)) for both in zip(*times, strict=True)]
    return {"scene": "Andrews to 1e-6", "tool": name, "us": found, "apart": ASKED,
            "settings": dict(zip(two, errors, strict=True))}  # fmt: skip


def ratios(results: list[dict[str, Any]]) -> list[tuple[str, str, float, float]]:
    """(what, where, measured, asked at most), least times over least times."""
    by = {(row["scene"], row["tool"]): min(row["us"]) for row in results}
    bodies = {size: by[f"{size} windows", "mstmm"] / (2 * size + 1) for size in SIZES}
    found = [("a body / one of 50 windows", f"{SIZES[-1]} windows", bodies[SIZES[-1]] / bodies[50],
              1.2)]  # fmt: skip
    few, many = ((f"{count} windows, implicit", "mstmm") for count in FACTORED)
    loops = FACTORED[1] / FACTORED[0]
    if many in by:
        found.append((f"a loop / one of {FACTORED[0]} windows", many[0], by[many] / by[few] / loops,
                      1.5))  # fmt: skip
    for scene, tool, asked in COMPARED:
        if (scene, tool) in by:
            own = "mstmm fused" if (scene, "mstmm fused") in by else "mstmm"
            found.append((f"{own} / {tool}", scene, by[scene, own] / by[scene, tool], asked))
    return found


def table(results: list[dict[str, Any]]) -> str:
    """Least times, and ratios."""
    lines = ["# Closed loops", "",
             "| scene | tool | us an evaluation, tangent or run | ns a body | apart |",
             "|---|---|---|---|---|"]  # fmt: skip
    for row in results:
        body = f"{min(row['ns a body']):.0f}" if "ns a body" in row else ""
        apart = f"{row['apart']:.1e}" if "apart" in row else ""
        lines.append(
            f"| {row['scene']} | {row['tool']} | {min(row['us']):.3g} | {body} | {apart} |"
        )
    for what, where, value, asked in ratios(results):
        lines += ["", f"{where}: {what}, where {asked} was asked at most: {value:.3g}."]
    lines += ["", "MuJoCo's rows yield, as stiff as it lets them be; `apart` is how far its legs "
              "are off. Of Andrews' crank `apart` is the error, between two settings."]  # fmt: skip
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measures and writes result.json and result.md; with --quick it only prints."""
    quick = "--quick" in sys.argv
    results = measured(quick)
    print(table(results))
    if not quick:
        record = {"machine": measure.machine(), "results": results}
        (HERE / "result.json").write_text(json.dumps(record, indent=1), encoding="utf-8")
        (HERE / "result.md").write_text(table(results), encoding="utf-8")


if __name__ == "__main__":
    main()
