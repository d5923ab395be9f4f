"""Accelerations of mechanisms with closed loops, compared with other programs.

    python benchmarks/loops/run.py [--quick]

CPU time of one evaluation in alternating rounds.  Rows of four-bar windows: time over the number
of windows, compared with an iteration of Exudyn's Newton method with a new Jacobian and the sparse
solver; also the tangent of an implicit step with one solution.  Stewart's platform: MuJoCo with
equality constraints, which are soft; `difference` is the relative difference of accelerations from
the rigid platform.  Andrews' squeezer, 0.03 s to a crank error of 1e-6 rad, interpolated between
two settings: DOP853 in C around Pinocchio's constrained dynamics, Exudyn's generalised alpha.
mstmm: looped engine, or fused where stated, one state at a time.  Set-up is not counted; programs
that are not installed are left out.
"""

from __future__ import annotations

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
#: Numbers of windows for the tangents of implicit steps.
IMPLICIT_SIZES = (50, 400)
#: Scene, program, target of the ratio.
COMPARISONS = (
    (f"{SIZES[-1]} windows", "Exudyn", 0.05), ("platform", "MuJoCo", 0.3),
    ("Andrews to 1e-6", "Pinocchio", 0.1), ("Andrews to 1e-6", "Exudyn", 0.1),
)  # fmt: skip
#: Target error of Andrews' crank, rad.
TARGET_ERROR = 1e-6
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
    """Stewart platform of the examples with springs along the legs, two of them compressed."""
    data = tomllib.loads(PLATFORM.read_text(encoding="utf-8"))
    for k, hinge in enumerate(h for h in data["hinge"] if h["type"] == "prismatic"):
        del hinge["drive"]
        hinge |= {"initial": {"q": 0.414}, "hold": True}
        hinge["law"] = {"stiffness": 4e4, "rest": 0.414 + (0.01 if k < 2 else 0.0)}
    return mstmm.Scene(**data)


def evaluations(model: mstmm.Model, count: int) -> Callable[[], np.ndarray]:
    """Accelerations at the start, `count` times in one call."""
    q, u = model.initial_state()
    q_rows, u_rows = np.tile(q, (count, 1)), np.tile(u, (count, 1))
    return lambda: model.accelerations(q_rows, u_rows, threads=1)


def leg_accelerations(model: mstmm.Model) -> np.ndarray:
    """Accelerations of the six legs at the start."""
    udot = model.accelerations(*model.initial_state())
    return np.array([udot[model.coordinate_layout.hinges[f"slide{k}"].u] for k in range(6)])


def evaluation_times(
    work: dict[str, Callable[[], Any]], count: int, rounds: int
) -> dict[str, list[float]]:
    """Microseconds of one of `count` evaluations, by program."""
    timers = {name: lambda call=call: measure.call_time(call) for name, call in work.items()}
    return {name: [1e6 * s / count for s in samples]
            for name, samples in measure.sample_rounds(timers, rounds).items()}  # fmt: skip


def measure_all(quick: bool) -> list[dict[str, Any]]:
    """Rows of the table."""
    rounds, results = (2, []) if quick else (15, [])
    models = {count: mstmm.compile(windows(count), engine="looped") for count in SIZES}
    calls = {count: max(4, 8000 // count) for count in SIZES}
    work = {str(count): evaluations(model, calls[count]) for count, model in models.items()}
    times, exudyn_times = dict[str, list[float]](), list[float]()
    for _ in range(max(2, rounds // 3)):
        for name, samples in evaluation_times(work, 1, rounds).items():
            times.setdefault(name, []).extend(us / calls[int(name)] for us in samples)
        exudyn_times += exudyn_iteration_times()
    for name, samples in times.items():
        results.append(windows_row(int(name), "mstmm", samples))
    results += [windows_row(SIZES[-1], "Exudyn", exudyn_times)] if exudyn_times else []
    return results + tangent_rows(rounds) + platform_rows(rounds) + squeezer_rows(rounds)


def windows_row(count: int, tool: str, times: list[float], quantity: str = "") -> dict[str, Any]:
    """Row of the table for `count` windows; times in microseconds."""
    bodies = 2 * count + 1
    return {"scene": f"{count} windows{quantity}", "tool": tool, "us": times,
            "ns_per_body": [1e3 * us / bodies for us in times]}  # fmt: skip


def tangent_rows(rounds: int) -> list[dict[str, Any]]:
    """Tangent and one solution of an implicit step of 0.2 ms for rows of windows."""
    rng, calls, work = np.random.default_rng(1), 4000, {}
    for count in IMPLICIT_SIZES:
        model = mstmm.compile(windows(count), engine="looped")
        work[count] = tangent_call(model, rng.normal(size=model.nu), calls // count)
    timers = {str(count): lambda call=call: measure.call_time(call) for count, call in work.items()}
    return [
        windows_row(
            int(name), "mstmm", [1e6 * s / (calls // int(name)) for s in samples], ", implicit"
        )
        for name, samples in measure.sample_rounds(timers, rounds).items()
    ]


def tangent_call(model: mstmm.Model, right_hand_side: np.ndarray, calls: int) -> Callable[[], None]:
    """`calls` tangents at the initial state, each with a solution."""
    tangent = TangentMatrix(model.looped)
    tangent.residual(0.0, *model.initial_state())

    def run() -> None:
        for _ in range(calls):
            tangent.factor(5e3, 5e3)
            tangent.solve(right_hand_side)

    return run


def exudyn_iteration_times() -> list[float]:
    """Microseconds of one Newton iteration of Exudyn on the longest row of windows."""
    try:
        import exudyn_planar
    except ImportError:
        print("Exudyn is not installed")
        return []
    system, count = exudyn_planar.build_windows(SIZES[-1]), [0]

    def run() -> None:
        count[0] = system.run(0.01, 10, sparse=True, reuse_jacobian=False)[0]

    return [1e6 * measure.cpu_time(run) / count[0]]


def platform_rows(rounds: int) -> list[dict[str, Any]]:
    """Rows of the Stewart platform: mstmm and MuJoCo."""
    model = mstmm.compile(platform(), engine="looped")
    fused = mstmm.compile(platform(), engine="fused")
    q, u = fused.initial_state()
    subject = mstmm_engines.fused_subject(fused, q[None], u[None])
    count, work = 2000, {
        "mstmm": evaluations(model, 2000), "mstmm fused": lambda: subject.time(True, 2000)
    }  # fmt: skip
    fused_difference = measure.relative_difference(
        leg_accelerations(fused), leg_accelerations(model)
    )
    differences = {"mstmm": 0.0, "mstmm fused": fused_difference}
    try:
        from mujoco_platform import MujocoPlatform

        peer = MujocoPlatform(model)
        work["MuJoCo"] = lambda: peer.forward(count)
        differences["MuJoCo"] = measure.relative_difference(
            peer.leg_accelerations(), leg_accelerations(model)
        )
    except ImportError:
        print("MuJoCo is not installed")
    return [{"scene": "platform", "tool": name, "us": samples, "difference": differences[name]}
            for name, samples in evaluation_times(work, count, rounds).items()]  # fmt: skip


def squeezer_rows(rounds: int) -> list[dict[str, Any]]:
    """Rows of Andrews' squeezer to 1e-6 rad."""
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
    for name, build in makers.items():
        try:
            settings[name] = squeezer.bracket_error(build(), TARGET_ERROR)
        except (ImportError, SystemExit) as error:
            print(f"{name} left out: {error}")
    work = {f"{name}: {setting}": run for name, bracket in settings.items()
            for setting, (run, _) in bracket.items()}  # fmt: skip
    times = evaluation_times(work, 1, rounds)
    return [_row_at_error(name, bracket, [times[f"{name}: {setting}"] for setting in bracket])
            for name, bracket in settings.items()]  # fmt: skip


def _row_at_error(name: str, bracket: dict[str, Any], times: list[list[float]]) -> dict[str, Any]:
    """Row of a program, interpolated between two settings in each round."""
    import squeezer

    errors = [error for _, error in bracket.values()]
    samples = [
        squeezer.interpolate_time(TARGET_ERROR, errors, list(round_times))
        for round_times in zip(*times, strict=True)
    ]
    return {"scene": "Andrews to 1e-6", "tool": name, "us": samples, "difference": TARGET_ERROR,
            "settings": dict(zip(bracket, errors, strict=True))}  # fmt: skip


def ratios(results: list[dict[str, Any]]) -> list[tuple[str, str, float, float]]:
    """(quantity, scene, measured, target), ratios of minimum times."""
    least_times = {(row["scene"], row["tool"]): min(row["us"]) for row in results}
    bodies = {size: least_times[f"{size} windows", "mstmm"] / (2 * size + 1) for size in SIZES}
    largest = SIZES[-1]
    rows = [("time per body / that of 50 windows", f"{largest} windows",
             bodies[largest] / bodies[50], 1.2)]  # fmt: skip
    short, long = ((f"{count} windows, implicit", "mstmm") for count in IMPLICIT_SIZES)
    loops = IMPLICIT_SIZES[1] / IMPLICIT_SIZES[0]
    if long in least_times:
        rows.append((f"time per loop / that of {IMPLICIT_SIZES[0]} windows", long[0],
        least_times[long] / least_times[short] / loops,
                      1.5))  # fmt: skip
    for scene, tool, target in COMPARISONS:
        if (scene, tool) in least_times:
            own_tool = "mstmm fused" if (scene, "mstmm fused") in least_times else "mstmm"
            rows.append(
                (
                    f"{own_tool} / {tool}",
                    scene,
                    least_times[scene, own_tool] / least_times[scene, tool],
                    target,
                )
            )
    return rows


def table(results: list[dict[str, Any]]) -> str:
    """Markdown: minimum times and ratios."""
    lines = ["# Closed loops", "",
             "| scene | program | us per evaluation, tangent or run | ns per body | difference |",
             "|---|---|---|---|---|"]  # fmt: skip
    for row in results:
        body = f"{min(row['ns_per_body']):.0f}" if "ns_per_body" in row else ""
        difference = f"{row['difference']:.1e}" if "difference" in row else ""
        lines.append(
            f"| {row['scene']} | {row['tool']} | {min(row['us']):.3g} | {body} | {difference} |"
        )
    for quantity, scene, value, target in ratios(results):
        lines += ["", f"{scene}: {quantity}: {value:.3g} (target: at most {target})."]
    lines += [
        "",
        "MuJoCo's constraints are soft. For Andrews' crank `difference` is the error, rad.",
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure and write result.json and result.md; with --quick only print."""
    quick = "--quick" in sys.argv
    results = measure_all(quick)
    print(table(results))
    if not quick:
        measure.save_record(HERE / "result.json", results)
        (HERE / "result.md").write_text(table(results), encoding="utf-8")


if __name__ == "__main__":
    main()
