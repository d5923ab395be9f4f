"""Beams with shear against the equations of Timoshenko and closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.optimize import brentq

import mstmm
from tests.reference.compare import worst

Array = NDArray[np.float64]

#: E / (k G) of a rectangle, Poisson's ratio 0.3.
RATIO = 3.12
CLAMP = {"name": "clamp", "type": "fixed", "inboard": "ground", "outboard": "rod"}
PIN = {"name": "pin", "type": "pin", "axis": [0, 0, 1], "inboard": "ground", "outboard": "rod"}
FREE = {"name": "free", "type": "planar", "inboard": "ground", "outboard": "rod"}
ROLLER = {"name": "roller", "type": "point-on-plane", "from": "ground", "to": "rod.tip",
          "normal": [0, 1, 0]}  # fmt: skip
#: Rows of the state (v, psi, M, Q) that vanish at an end.
CLAMPED, FREE_END, SUPPORTED = (0, 1), (2, 3), (0, 2)


def rod(gyration: float, **keys: Any) -> dict[str, Any]:
    """Beam with length, mass per length and E I of one and the given radius of gyration (m)."""
    return {"name": "rod", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 1.0,
            "rotary_inertia": gyration**2, "shear_stiffness": 1 / (RATIO * gyration**2),
            "modes": {"y": 3}} | keys  # fmt: skip


def model(beam: dict[str, Any], hinge: dict[str, Any], **tables: Any) -> mstmm.Model:
    scene = mstmm.Scene(gravity=[0, 0, 0], beam=[beam], hinge=[hinge], **tables)
    return mstmm.compile(scene, engine="looped")


def frequencies(found: mstmm.Model, count: int = 3) -> Array:
    omega = np.sort(np.abs(found.linearize().modes().omega))
    return omega[omega > 1e-3][:count]


def exact_frequencies(
    gyration: float, root: tuple[int, int], tip: tuple[int, int], count: int = 3,
    steps: tuple[tuple[float, float], ...] = ((1.0, 1.0),),
) -> Array:  # fmt: skip
    """Roots of the determinant of the first-order system v' = psi + Q/GA, psi' = M/EI, ...

    `steps` are the length and the scale of all properties of each piece.
    """
    rotary = gyration**2

    def determinant(omega: float) -> float:
        transfer = np.eye(4)
        for length, scale in steps:
            inertia = scale * omega**2
            system = np.zeros((4, 4))
            system[0, 1], system[0, 3] = 1, RATIO * rotary / scale
            system[1, 2] = 1 / scale
            system[2, 1], system[2, 3] = -inertia * rotary, -1
            system[3, 0] = -inertia
            transfer = expm(system * length) @ transfer
        kept = [i for i in range(4) if i not in root]
        return float(np.linalg.det(transfer[np.ix_(tip, kept)]))

    grid = np.linspace(0.5, 130, 600)
    values = [determinant(omega) for omega in grid]
    roots = [
        brentq(determinant, grid[i], grid[i + 1], xtol=1e-11)
        for i in range(len(grid) - 1)
        if values[i] * values[i + 1] < 0
    ]
    return np.array(roots[:count])


@pytest.mark.parametrize("gyration", [0.02, 0.1])
@pytest.mark.parametrize(
    ("hinge", "basis", "root", "constraints"),
    [
        (CLAMP, "clamped-free", CLAMPED, []),
        (FREE, "free-free", FREE_END, []),
        (PIN, "simply-supported", SUPPORTED, [ROLLER]),
    ],
)
def test_frequencies_are_those_of_timoshenko(
    gyration: float, hinge: dict[str, Any], basis: str, root: tuple[int, int], constraints: Any
) -> None:
    found = model(rod(gyration, basis=basis), hinge, constraint=constraints)
    tip = SUPPORTED if constraints else FREE_END
    assert worst(frequencies(found), exact_frequencies(gyration, root, tip)) < 4e-6


def test_clamped_free_frequencies_are_the_published_ones() -> None:
    for gyration, expected in (
        (0.02, [3.5026, 21.4698, 58.1498]),
        (0.1, [3.2271, 14.4689, 31.5025]),
    ):
        assert worst(frequencies(model(rod(gyration), CLAMP)), np.array(expected)) < 1.5e-5


@pytest.mark.parametrize("gyration", [0.02, 0.1])
def test_simply_supported_frequencies_solve_the_closed_form(gyration: float) -> None:
    """(GA k^2 - rho A w^2)(E I k^2 + GA - rho I w^2) = GA^2 k^2."""
    shear, rotary = 1 / (RATIO * gyration**2), gyration**2
    squares = []
    for k in np.pi * np.arange(1, 4):
        roots = np.roots([rotary, -(k**2 + shear + rotary * shear * k**2), shear * k**4])
        squares.append(min(roots.real))
    found = model(rod(gyration, basis="simply-supported"), PIN, constraint=[ROLLER])
    assert worst(frequencies(found), np.sqrt(squares)) < 4e-6


def test_a_stepped_beam_has_the_frequencies_of_its_pieces() -> None:
    beam = rod(0.1)
    keys = ("mass_per_length", "bending_stiffness", "rotary_inertia", "shear_stiffness")
    second = {key: 0.5 * beam[key] for key in keys}
    beam["section"] = [{"from": 0.0, "to": 0.4}, {"from": 0.4, "to": 1.0} | second]
    exact = exact_frequencies(0.1, CLAMPED, FREE_END, steps=((0.4, 1.0), (0.6, 0.5)))
    assert worst(frequencies(model(beam, CLAMP)), exact) < 4e-6


def test_shapes_above_the_cutoff_frequency_are_no_copies_of_those_below() -> None:
    """Above sqrt(k G A / rho I) = 57 rad/s a second family has the waves of the first one."""
    exact = exact_frequencies(0.1, CLAMPED, FREE_END, 7)
    assert exact[4] > 57
    assert worst(frequencies(model(rod(0.1, modes={"y": 12}), CLAMP), 7), exact) < 1e-7


def test_welded_parts_have_the_frequencies_of_the_whole_beam() -> None:
    """A fixed hinge joins the rotations of the sections, and not the slopes of the axes."""
    parts = [rod(0.1, name=name, length=0.5, modes={"y": 4}) for name in ("rod", "end")]
    weld = {"name": "weld", "type": "fixed", "inboard": "rod.tip", "outboard": "end"}
    scene = mstmm.Scene(gravity=[0, 0, 0], beam=parts, hinge=[CLAMP, weld])
    found = frequencies(mstmm.compile(scene, engine="looped"))
    errors = found / exact_frequencies(0.1, CLAMPED, FREE_END) - 1
    assert (errors > -1e-9).all() and (errors < [1e-4, 1e-3, 4e-3]).all()


@pytest.mark.parametrize("plane", ["y", "z"])
def test_a_tip_force_bends_and_shears(plane: str) -> None:
    """w = P L^3 / 3 E I + P L / k G A, psi = P L^2 / 2 E I; each plane has its own stiffness."""
    bending, shear = {"y": (2.0, 30.0), "z": (1.0, 20.0)}[plane]
    beam = rod(0.1, bending_stiffness=[1.0, 2.0], shear_stiffness=[30.0, 20.0],
               modes={plane: 2}, basis="static+fixed-interface", stiffening=False)  # fmt: skip
    force = [0.0, 1e-3, 0.0] if plane == "y" else [0.0, 0.0, 1e-3]
    tip = {"name": "push", "on": "rod.tip", "force": force}
    found = model(beam | {"initial": "static"}, CLAMP, load=[tip]).simulate(t_end=1e-3)
    axis = "xyz".index(plane)
    deflection = found.deflection("rod", "tip")[0]
    assert deflection[axis] == pytest.approx(1e-3 * (1 / (3 * bending) + 1 / shear), rel=1e-9)
    slope = found.slope("rod", "tip")[0, axis - 1]
    assert slope == pytest.approx(1e-3 / (2 * bending), rel=1e-9)


def test_a_spinning_sheared_beam_keeps_its_energy() -> None:
    beam = rod(0.1, modes={"y": 3, "z": 2, "twist": 1}, torsional_stiffness=1.0)
    beam["initial"] = {"eta": [0.02, 0.0, 0.0, 0.01, 0.0, 0.02]}
    spin = PIN | {"initial": {"u": [4.0]}}
    run = model(beam, spin).simulate(t_end=1.0, rtol=1e-11, atol=1e-13)
    energy = run.energy()
    assert np.ptp(energy) < 1e-9 * np.abs(energy).max()


def test_a_sheared_column_buckles_at_the_load_of_haringx() -> None:
    """P (1 + P / k G A) = E I (pi / 2 L)^2 for a column whose shear follows its sections."""
    shear, euler = 5.0, np.pi**2 / 4
    beam = rod(0.1, shear_stiffness=shear, modes={"y": 12}, basis="static+fixed-interface")
    push = {"name": "push", "on": "rod.tip", "force": [-1.0, 0.0, 0.0]}
    free = model(beam, CLAMP).linearize().K
    geometric = model(beam, CLAMP, load=[push]).linearize().K - free
    loads = 1 / np.linalg.eigvals(np.linalg.solve(free, -geometric)).real
    expected = shear / 2 * (np.sqrt(1 + 4 * euler / shear) - 1)
    found = loads[loads > 0].min()
    assert expected < found < 1.001 * expected  # a Ritz method is never too soft
