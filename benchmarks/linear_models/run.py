"""Linear models of arms at a state, called from Python, compared with Pinocchio's derivatives.

    python benchmarks/linear_models/run.py [--quick]

CPU time of a call in alternating rounds: mstmm on the fused and the looped engine, and
pin.computeABADerivatives, if installed, which computes the same derivatives.  Building and
compiling are not counted.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from common import links, measure, scenes  # noqa: E402

import mstmm  # noqa: E402

PEER = "pin.computeABADerivatives"
SCENES = {"puma560": scenes.puma, "arm of seven": lambda: scenes.arm(7)}
TARGETS = {"linearize(q, u)": 2.0, "linearize(q, u).A": 2.0, "derivatives(q, u)": 1.5}

Work = dict[str, Callable[[], object]]


def own_calls(scene: scenes.Scene, q: np.ndarray, u: np.ndarray) -> tuple[Work, np.ndarray]:
    """Calls of mstmm, and their derivatives of accelerations (nu, 2 nu) by q and u."""
    fused, looped = (
        mstmm.compile(mstmm.Scene(**scene), engine=engine) for engine in ("fused", "looped")
    )
    for model in (fused, looped):  # the first call compiles or loads code
        model.linearize(q, u)
        model.derivatives(q, u)
    work: Work = {
        "linearize(q, u)": lambda: fused.linearize(q, u),
        "linearize(q, u).A": lambda: fused.linearize(q, u).A,
        "derivatives(q, u)": lambda: fused.derivatives(q, u),
        "looped linearize(q, u).A": lambda: looped.linearize(q, u).A,
    }
    return work, fused.linearize(q, u).A[len(u) :]


def peer_calls(scene: scenes.Scene, q: np.ndarray, u: np.ndarray) -> tuple[Work, np.ndarray | None]:
    """Call of Pinocchio and its derivatives; nothing if pin is not installed."""
    try:
        import pinocchio as pin
    except ImportError:
        return {}, None
    tree, model = links.link_tree(scene), pin.Model()
    model.gravity.linear = tree.gravity
    for link in tree.links:
        joint = model.addJoint(
            link.parent + 1, pin.JointModelRevoluteUnaligned(link.axis),
            pin.SE3(link.orientation, link.position), link.name,
        )  # fmt: skip
        inertia = pin.Inertia(link.mass, link.center, link.inertia)
        model.appendBodyToJoint(joint, inertia, pin.SE3.Identity())
    model.armature = np.array([link.armature for link in tree.links])
    data, efforts = model.createData(), np.zeros(len(u))

    def call() -> object:
        pin.computeABADerivatives(model, data, q, u, efforts)
        return data.ddq_dq, data.ddq_dv, data.Minv

    call()
    return {PEER: call}, np.hstack([data.ddq_dq, data.ddq_dv])


def measure_all(quick: bool) -> list[dict[str, Any]]:
    """Microseconds per call, and the relative difference of the derivatives."""
    results = []
    for name, build in SCENES.items():
        scene = without_laws(build())
        (q,), (u,) = links.random_states(links.link_tree(scene), 1)
        work, slopes = own_calls(scene, q, u)
        peer_work, peer_slopes = peer_calls(scene, q, u)
        difference = (
            None if peer_slopes is None else measure.relative_difference(slopes, peer_slopes)
        )
        timers = {
            label: lambda call=call: measure.call_time(call)
            for label, call in (peer_work | work).items()
        }
        for label, samples in measure.sample_rounds(timers, 3 if quick else 40).items():
            us = [1e6 * s for s in samples]
            results.append({"scene": name, "call": label, "us": us, "difference": difference})
            print(name, label, f"{min(us):.4g} us", flush=True)
    return results


def without_laws(scene: scenes.Scene) -> scenes.Scene:
    """Scene without laws except drive inertia, which Pinocchio differentiates too."""
    hinges = [
        hinge | {"law": {"inertia": hinge.get("law", {}).get("inertia", 0.0)}}
        for hinge in scene["hinge"]
    ]
    return {key: scene[key] for key in ("gravity", "body")} | {"hinge": hinges}


def table(results: list[dict[str, Any]]) -> str:
    """Markdown: minimum of the rounds."""
    lines = [
        "| scene | call | us | ratio to pin | target | difference |",
        "|---|---|---|---|---|---|",
    ]
    best_us = {(r["scene"], r["call"]): min(r["us"]) for r in results}
    for r in results:
        us, peer_us = min(r["us"]), best_us.get((r["scene"], PEER))
        ratio = "" if peer_us is None else f"{us / peer_us:.3g}"
        difference = (
            "" if r["difference"] is None or r["call"] == PEER else f"{r['difference']:.1e}"
        )
        target = TARGETS.get(r["call"], "")
        lines.append(
            f"| {r['scene']} | {r['call']} | {us:.4g} | {ratio} | {target} | {difference} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Measure, print the table."""
    options = measure.option_parser(str(__doc__).splitlines()[0], HERE).parse_args()
    if not options.plot:
        measure.save_record(options.json, measure_all(options.quick))
    measure.write_table(options.json, table)


if __name__ == "__main__":
    main()
