"""The 20 lowest normal modes of chains, compared with SciPy's eigsh on matrices of the scene.

    python benchmarks/linear_models/modes.py [--quick]

CPU time of a call in alternating rounds.  eigsh (shift and invert at 0) gets two kinds of matrices,
whose assembly is not counted: M and K in hinge coordinates as `linearize` returns them, where M is
full; and sparse matrices of absolute displacements as written by hand for this chain, where a
stiffness of 1e9 replaces rigid constraints.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import eigsh

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from common import measure  # noqa: E402

import mstmm  # noqa: E402

COUNT, LENGTH, TARGET = 20, 0.1, 0.1
OWN, FULL, SPARSE = "mstmm", "eigsh, hinges (full M)", "eigsh, every body (sparse)"
SIZES, ROUNDS = (1000, 3000, 10_000), 4
#: Largest number of coordinates for full matrices, whose time grows with its cube.
MAX_FULL = 10_000
STIFFNESSES = [1e6, 2e6, 3e6, 1e4, 2e4, 3e4]  # along x, y, z in N/m, about x, y, z in N m/rad
PIN, CONSTRAINT_STIFFNESS = 1e4, 1e9

Work = Callable[[], np.ndarray]


def rod_chain(bodies: int, inertia: list[float], hinge: dict[str, Any]) -> mstmm.Scene:
    """A chain of equal rods along x, 0.1 m and 1 kg each, without gravity."""
    rod = {"mass": 1.0, "center_of_mass": [LENGTH / 2, 0, 0], "inertia": inertia,
           "ends": {"tip": [LENGTH, 0, 0]}}  # fmt: skip
    chain = {"name": "row", "count": bodies, "inboard": "ground", "body": rod, "hinge": hinge,
             "end": "tip"}  # fmt: skip
    return mstmm.Scene(gravity=[0, 0, 0], chain=[chain])


def scene(kind: str, bodies: int) -> mstmm.Scene:
    """One of the three chains."""
    if kind == "masses on springs":
        law = {"stiffness": 100.0}
        return rod_chain(bodies, [1, 1, 1], {"type": "prismatic", "axis": [1, 0, 0], "law": law})
    if kind == "rods on pins":
        law = {"stiffness": PIN}
        return rod_chain(bodies, [1e-5, 8.5e-4, 8.5e-4], {"type": "pin", "law": law})
    law = {"stiffness": STIFFNESSES}
    return rod_chain(bodies, [1e-4, 8.5e-4, 8.5e-4], {"type": "elastic", "law": law})


def assemble_matrices(kind: str, bodies: int) -> tuple[Any, Any]:
    """Sparse K and M of a chain in absolute coordinates of the bodies."""
    if kind == "masses on springs":
        diagonal, off_diagonal = np.full(bodies, 200.0), np.full(bodies - 1, -100.0)
        diagonal[-1] = 100.0
        return sp.diags([diagonal, off_diagonal, off_diagonal], [0, 1, -1]).tocsc(), sp.identity(
            bodies
        ).tocsc()
    planar = kind == "rods on pins"
    stiffness_of_hinge = np.diag(
        [CONSTRAINT_STIFFNESS, CONSTRAINT_STIFFNESS, PIN] if planar else STIFFNESSES
    )
    center, tip = np.eye(6), np.eye(6)
    center[:3, 3:], tip[:3, 3:] = -_tilde(LENGTH / 2), -_tilde(LENGTH)
    mass = center.T @ np.diag([1, 1, 1, 1e-4, 8.5e-4, 8.5e-4]) @ center
    directions = [0, 1, 5] if planar else range(6)
    mass, tip = (matrix[np.ix_(directions, directions)] for matrix in (mass, tip))
    inboard_neighbour = sp.diags([np.ones(bodies - 1)], [-1])  # relative displacements of hinges
    hinge_openings = sp.kron(sp.identity(bodies), np.eye(len(directions))) - sp.kron(
        inboard_neighbour, tip
    )
    stiffness = hinge_openings.T @ sp.kron(sp.identity(bodies), stiffness_of_hinge) @ hinge_openings
    return stiffness.tocsc(), sp.kron(sp.identity(bodies), mass).tocsc()


def _tilde(x: float) -> np.ndarray:
    """The cross product by (x, 0, 0)."""
    return np.array([[0, 0, 0], [0, 0, -x], [0, x, 0]])


def timed_calls(kind: str, bodies: int) -> dict[str, Work]:
    """Calls that give omega (20,) in rad/s."""
    linear = mstmm.compile(scene(kind, bodies), engine="looped").linearize(inputs=[])

    def by_eigsh(stiffness: Any, mass: Any) -> Work:
        return lambda: np.sqrt(np.sort(eigsh(stiffness, k=COUNT, M=mass, sigma=0.0)[0]))

    calls = {
        OWN: lambda: linear.modes(COUNT).omega,
        SPARSE: by_eigsh(*assemble_matrices(kind, bodies)),
    }
    if len(linear) <= MAX_FULL:
        calls[FULL] = by_eigsh(linear.K, linear.M)
    return calls


def measure_all(quick: bool) -> list[dict[str, Any]]:
    """Seconds per call, and the relative difference of frequencies."""
    results = []
    for kind in ("masses on springs", "rods on pins", "six elastic directions"):
        for bodies in SIZES[:1] if quick else SIZES:
            work = timed_calls(kind, bodies)
            omega = {name: call() for name, call in work.items()}
            timers = {
                name: lambda call=call: measure.call_time(call) for name, call in work.items()
            }
            for name, samples in measure.sample_rounds(timers, 1 if quick else ROUNDS).items():
                difference = measure.relative_difference(omega[name], omega[OWN])
                results.append(
                    {
                        "chain": kind,
                        "bodies": bodies,
                        "tool": name,
                        "s": samples,
                        "difference": difference,
                    }
                )
                print(kind, bodies, name, f"{min(samples):.4g} s", flush=True)
    return results


def table(results: list[dict[str, Any]]) -> str:
    """Markdown: minimum of the rounds."""
    own_seconds = {(r["chain"], r["bodies"]): min(r["s"]) for r in results if r["tool"] == OWN}
    lines = ["| chain | bodies | tool | s | us per body | mstmm / tool | target | difference |",
             "|---|---|---|---|---|---|---|---|"]  # fmt: skip
    for r in results:
        seconds, is_own = min(r["s"]), r["tool"] == OWN
        comparison = (
            "" if is_own else f"{own_seconds[r['chain'], r['bodies']] / seconds:.2g} | {TARGET}"
        )
        lines.append(
            f"| {r['chain']} | {r['bodies']} | {r['tool']} | {seconds:.4g} "
            f"| {1e6 * seconds / r['bodies']:.3g} "
            f"| {comparison or ' | '} | {'' if is_own else format(r['difference'], '.0e')} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Measure, print the table."""
    parser = measure.option_parser(str(__doc__).splitlines()[0], HERE)
    parser.set_defaults(json=HERE / "modes.json")
    options = parser.parse_args()
    if not options.plot:
        measure.save_record(options.json, measure_all(options.quick))
    measure.write_table(options.json, table)


if __name__ == "__main__":
    main()
