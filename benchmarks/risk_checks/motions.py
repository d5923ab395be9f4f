"""Trials of guards of steps, loads, masses and rotations, on scenes drawn afresh."""

from __future__ import annotations

import math

import numpy as np

import mstmm
from mstmm.atlas.error_measures import refinement_correction
from mstmm.atlas.shared_scenes import rod, spinning_top
from mstmm.runtime.engine.eigenvalues import fastest_eigenvalue

from .trials import Scene, Trial, judged, model, off, tried

Rng = np.random.Generator


def drawn(rng: Rng, low: float, high: float) -> float:
    """A number between two others, evenly over their powers."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def row(rng: Rng, count: int, law: Scene, first: Scene | None = None) -> Scene:
    """Rods of different mass on pins in a row; `law` for all, more of it for the `first`."""
    bodies = [rod(f"rod{i}", mass=drawn(rng, 0.3, 3.0)) for i in range(count)]
    hinges = [
        {"name": f"pin{i}", "type": "pin", "outboard": f"rod{i}",
         "inboard": f"rod{i - 1}.tip" if i else "ground",
         "initial": {"q": [float(rng.uniform(-0.5, 0.5))]},
         "law": law if i or first is None else law | first}
        for i in range(count)
    ]  # fmt: skip
    return {"body": bodies, "hinge": hinges}


def explicit_step(rng: Rng) -> Trial:
    """Springs and dampers by explicit methods; the step is drawn against the fastest motion."""
    law = {"stiffness": drawn(rng, 10, 1e5), "damping": drawn(rng, 1e-2, 1e3)}
    one = model(row(rng, int(rng.integers(1, 5)), law))
    q, u = one.initial_state()
    rate = abs(fastest_eigenvalue(one.looped, 0.0, np.append(q, u), one.looped.start_memory())[0])
    product = drawn(rng, 0.2, 20)
    step = product / rate
    t_end = 60 * step
    method = str(rng.choice(["rk4", "dopri5", "dop853"]))
    run, before = tried(one, t_end, method=method, step=step)
    exact = one.simulate(t_end, rtol=1e-11, atol=1e-13, output_times=run.t)
    return judged(product, run, before, off(run, exact) / 0.1)


def implicit_step(rng: Rng) -> Trial:
    """Swinging rods by implicit fixed steps, drawn against their period."""
    one = model(row(rng, int(rng.integers(1, 4)), {}) | {"gravity": [9.81, 0, 0]})
    step = drawn(rng, 2e-3, 1.0)
    t_end = max(2.0, 5 * step)
    method = str(rng.choice(["genalpha", "rodas4p2", "esdirk436", "hht"]))
    run, before = tried(one, t_end, method=method, step=step)
    exact = one.simulate(t_end, rtol=1e-11, atol=1e-13, output_times=run.t)
    return judged(step, run, before, off(run, exact) / 0.1)


def pulse_in_angle(rng: Rng) -> Trial:
    """A push that is narrow in an angle, by steps that are chosen; sometimes between comparisons,
    with other laws, or seen at a few times only."""
    width, place = drawn(rng, 1e-4, 1.0), float(rng.uniform(2.0, 6.0))
    push = f"{0.5 / width / math.sqrt(math.pi)!r}*exp(-((q - {place!r})/{width!r})^2)"
    if rng.random() < 0.3:
        low, high = place - 6 * width, place + 6 * width
        push = f"where(q > {low!r}, where(q < {high!r}, {push}, 0), 0)"
    law = {"stiffness": float(rng.choice([0.0, 0.3])), "damping": float(rng.choice([0.0, 0.02]))}
    scene = row(rng, int(rng.integers(1, 3)), law, {"effort": push})
    scene["hinge"][0]["initial"]["u"] = [float(rng.uniform(3.0, 5.0))]
    one, rtol = model(scene), drawn(rng, 1e-9, 1e-4)
    times = None if rng.random() < 0.5 else np.linspace(0, 3.0, int(rng.integers(2, 20)))
    method = str(rng.choice(["dop853", "dopri5", "auto"]))
    run, before = tried(one, 3.0, method=method, rtol=rtol, atol=rtol / 100, output_times=times)
    short_steps = mstmm.methods.Method(max_step=min(0.05, width / 10))
    exact = one.simulate(3.0, short_steps, rtol=1e-11, atol=1e-13, output_times=run.t)
    return judged(width, run, before, off(run, exact) / max(1e-3, 100 * rtol))


def pulse_in_time(rng: Rng) -> Trial:
    """A push that is narrow in time, by fixed steps."""
    step, place = drawn(rng, 1e-3, 5e-2), float(rng.uniform(0.5, 1.5))
    ratio = drawn(rng, 0.02, 20)
    width = ratio * step
    push = f"{0.3 / width / math.sqrt(math.pi)!r}*exp(-((t - {place!r})/{width!r})^2)"
    one = model(row(rng, int(rng.integers(1, 4)), {"damping": 0.05}, {"effort": push}))
    run, before = tried(one, 2.0, method="rk4", step=step)
    exact = one.simulate(2.0, rtol=1e-11, atol=1e-13, output_times=run.t)
    return judged(ratio, run, before, off(run, exact) / 1e-3)


def heavy_tip(rng: Rng) -> Trial:
    """Light rods before a heavy one, or behind it; the error of accelerations, by refinement."""
    count, mass = int(rng.integers(3, 10)), drawn(rng, 1e2, 1e13)
    place = count - 1 if rng.random() < 0.8 else int(rng.integers(count))
    bodies = [
        rod(f"rod{i}", mass=mass if i == place else drawn(rng, 0.5, 2.0)) for i in range(count)
    ]
    kind = str(rng.choice(["pin", "ball"]))
    hinges: list[Scene] = [
        {"name": f"h{i}", "type": kind, "outboard": f"rod{i}",
         "inboard": f"rod{i - 1}.tip" if i else "ground"}
        for i in range(count)
    ]  # fmt: skip
    for hinge in hinges if kind == "pin" else ():
        hinge["initial"] = {"q": [float(rng.uniform(-1.5, 1.5))]}
    for hinge in hinges if kind == "ball" else ():
        turn = rng.normal(size=4)
        hinge["initial"] = {"q": (turn / np.linalg.norm(turn)).tolist()}
    scene = {"gravity": [0, -9.81, 0], "body": bodies, "hinge": hinges}
    one = model(scene, sweep="riccati")
    run, before = tried(one, 0.0)
    return judged(mass, run, before, refinement_correction(one, [one.initial_state()]) / 1e-8)


def three_angles(rng: Rng) -> Trial:
    """A free top on three angles that passes their lock, by fixed and by chosen steps."""
    distance = drawn(rng, 1e-6, 0.5)
    spin = float(rng.uniform(0.5, 2.0))
    turning = [spin * math.sin(distance), spin * math.cos(distance), 0.0]
    one, t_end = spinning_top("gimbal"), 2.0 / spin
    fixed = rng.random() < 0.5
    step, rtol = drawn(rng, 2e-4, 1e-2), drawn(rng, 1e-9, 1e-5)
    how = {"method": "rk4", "step": step} if fixed else {"rtol": rtol, "atol": rtol / 100}
    run, before = tried(one, t_end, initial=([0.0, 0.0, distance], turning), **how)
    start = [math.cos(distance / 2), 0.0, 0.0, math.sin(distance / 2)]
    exact = spinning_top("ball").simulate(
        t_end, rtol=1e-12, atol=1e-14, initial=(start, turning), output_times=[t_end]
    )
    if not run.success:
        return judged(distance, run, before, math.inf)
    a, b = run.orientation("top")[-1], exact.orientation("top")[-1]
    error = min(np.abs(a - b).max(), np.abs(a + b).max())
    return judged(distance, run, before, float(error) / (1e-5 if fixed else 10 * rtol))


def loose_balls(rng: Rng) -> Trial:
    """Tumbling bodies on balls, tolerances from loose to tight."""
    count, rtol = int(rng.integers(1, 4)), drawn(rng, 1e-8, 3e-2)
    bodies = [rod(f"rod{i}", inertia=(0.05, 0.12, 0.1)) for i in range(count)]
    hinges = [
        {"name": f"h{i}", "type": "ball", "outboard": f"rod{i}",
         "inboard": f"rod{i - 1}.tip" if i else "ground",
         "initial": {"u": rng.uniform(-3, 3, 3).tolist()}}
        for i in range(count)
    ]  # fmt: skip
    one = model({"gravity": [0, -9.81, 0], "body": bodies, "hinge": hinges})
    times = np.linspace(0, 2, 41)
    method = str(rng.choice(["dop853", "dopri5", "rodas4p2", "scipy-RK45"]))
    run, before = tried(one, 2.0, method=method, rtol=rtol, atol=rtol, output_times=times)
    exact = one.simulate(2.0, rtol=1e-12, atol=1e-14, output_times=times)
    return judged(rtol, run, before, off(run, exact) / 1e-2)
