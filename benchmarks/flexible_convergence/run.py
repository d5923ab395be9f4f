"""How the error of flexible bodies falls with the number of shapes.

    python benchmarks/flexible_convergence/run.py [--plot]

Largest distance of the tip from chains of rigid segments (extrapolated; stored in the tests) and
relative error of frequencies against finite elements, for every frame and basis.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(HERE), str(HERE.parent), str(ROOT)]

import picture  # noqa: E402

from tests.reference.flexible import finite_elements as fe  # noqa: E402
from tests.support.scenes import flexible as scenes  # noqa: E402
from tests.system.flexible import test_motions as motions  # noqa: E402

#: Line -> (basis, keys of the beams).
LINES: dict[str, dict[str, tuple[str, dict[str, Any]]]] = {
    "pendulum": {
        "chord": ("chord", {}),
        "mean": ("mean", {}),
        "tangent, quadrature": ("tangent", {"quadrature": True}),
        "chord, linear": ("chord", {"stiffening": False}),
    },
    "two pinned": {
        "chord": ("chord", {}),
        "mean": ("mean", {}),
        "tangent, quadrature": ("tangent", {"quadrature": True}),
        "chord, linear": ("chord", {"stiffening": False}),
    },
    "welded": {
        "clamped-free": ("clamped-free", {}),
        "static + fixed-interface": ("static+fixed-interface", {}),
        "static + fixed-interface, linear": ("static+fixed-interface", {"stiffening": False}),
    },
}
BUILDERS = {
    "pendulum": motions.pendulum,
    "two pinned": motions.two_pinned,
    "welded": motions.welded_beams,
}
COUNTS = {"pendulum": range(1, 9), "two pinned": range(1, 7), "welded": range(1, 7)}


def motion_errors() -> dict[str, Any]:
    """Largest tip error in m over the motion, by scene, line and number of shapes."""
    results: dict[str, Any] = {}
    for case, lines in LINES.items():
        rigid = BUILDERS[case](next(iter(lines.values()))[0], 1, model="rigid")
        correction = motions.CONVERGED[case]["correction"]
        results[case] = {
            "reference_correction": correction,
            "rigid": motions.tip_error(rigid, case),
            "lines": {},
        }
        for line, (choice, keys) in lines.items():
            errors = {}
            for n in COUNTS[case]:
                if "static" in line and n < 2:
                    continue
                errors[n] = motions.tip_error(BUILDERS[case](choice, n, **keys), case)
                print(f"{case:12} {line:34} n = {n}  {errors[n]:.2e} m", flush=True)
            results[case]["lines"][line] = errors
    return results


def spin_up_errors() -> dict[str, Any]:
    """Error of the largest tip deflection over the length, by beam and form."""
    results: dict[str, Any] = {}
    for case, (size, *_) in motions.SPINNING.items():
        results[case] = {}
        for line, keys in (("invariant form", {}), ("quadrature", {"quadrature": True})):
            errors = {}
            for n in range(1, 6):
                _, deflection = motions.deflection(motions.spinning(case, n, **keys))
                largest = float(deflection[:740].min())
                errors[n] = {
                    "deflection": largest,
                    "error": abs(largest - motions.CONVERGED[case]["deflection"]) / size[0],
                }
                print(f"{case:12} {line:34} n = {n}  {largest:.5f} m", flush=True)
            results[case][line] = errors
    return results


def frequency_errors() -> dict[str, Any]:
    """Relative errors of the first three frequencies of an L-frame, and of the first flap and lag
    frequency of a beam that turns with 12 sqrt(EI / (rho A L^4))."""
    l_frame, exact = {}, fe.l_frame(0.6, 0.5, 50.0, 3)
    for basis in ("clamped-free", "simply-supported", "static+fixed-interface"):
        errors = {}
        for n in (2, 3, 4, 6, 8):
            frequencies = scenes.frequencies(
                *scenes.motion_near(weightless_welded_beams(basis, n)), 3
            )
            errors[n] = np.abs(frequencies / exact - 1).tolist()
        l_frame[basis] = errors
    turning = {}
    for word, lag in (("z", False), ("y", True)):
        reference = fe.rotating(0, 12, lag, 1)[0]
        errors = {}
        for n in range(1, 13):
            data = scenes.turning_beam(12.0, modes={word: n})
            frequencies = scenes.frequencies(*scenes.motion_near(data), 1)[0]
            errors[n] = abs(frequencies / reference - 1)
        turning["lag" if lag else "flap"] = errors
    return {"l_frame": l_frame, "turning": turning}


def weightless_welded_beams(basis: str, n: int) -> scenes.Scene:
    """The welded beams at rest, without weight, in suitable frames."""
    frame_keys = {"frame": "chord"} if basis == "simply-supported" else {}
    return {**motions.welded_beams(basis, n, **frame_keys), "gravity": [0.0, 0.0, 0.0]}


def main() -> None:
    """Compute, write result.json, draw."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plot", action="store_true", help="draw again from result.json")
    path = HERE / "result.json"
    if not parser.parse_args().plot:
        record = {
            "motions": motion_errors(),
            "spin_ups": spin_up_errors(),
            "frequencies": frequency_errors(),
        }
        path.write_text(json.dumps(record, indent=1) + "\n")
    picture.draw(json.loads(path.read_text()), HERE / "result.png")


if __name__ == "__main__":
    main()
