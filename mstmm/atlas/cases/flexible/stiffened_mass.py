"""Inertia of a stiffened beam, truncated after the second order of its deflection."""

from __future__ import annotations

import numpy as np

from ...definition import Definition, Method
from ...measures import simulated
from ...scale import LOG
from ...scenes import model

SHAPES = 4


def _lost(deflection: float, quadrature: bool) -> float:
    """Largest relative loss of inertia over all motions; above 1 the inertia is negative."""
    beam = {
        "name": "rod", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 50.0,
        "modes": {"y": SHAPES}, "frame": "tangent", "stiffening": True, "quadrature": quadrature,
    }  # fmt: skip
    pin = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod"}
    falling = model({"gravity": [0, 0, 0], "beam": [beam], "hinge": [pin]})
    straight, still = falling.initial_state()
    bent = straight.copy()
    bent[1] = 1e-3
    shown = simulated(falling, 1e-6, initial=(bent, still), output_times=[0.0, 1e-6])
    bent[1] *= deflection / float(shown.deflection("rod", "tip")[0, 1])
    inverse = np.linalg.inv(np.linalg.cholesky(falling.mass_matrix(straight)))
    left = np.linalg.eigvalsh(inverse @ falling.mass_matrix(bent) @ inverse.T)
    return 1 - float(left.min())


CASE = Definition(
    name="stiffened-mass",
    title="Stiffened beam: inertia truncated after the second order",
    why="Shortening makes the mass matrix of a beam depend on its deflection. Truncated after "
    "the second power, it subtracts more inertia than there is where shapes carry nearly all of "
    "it, as in a frame tangent to a rotating section. Accelerations then change their sign. Mass "
    "in points along the beam (`quadrature`), or the mean frame, keeps the matrix positive "
    "definite.",
    parameter="deflection of the tip of a pinned beam, relative to its length", unit="", low=5e-3,
    high=0.4, scale=LOG,
    measured="lost part of the inertia", limit=1.0,
    method=Method(f"tangent frame, {SHAPES} shapes, truncated", lambda d: _lost(d, False)),
    remedy=Method("the same with quadrature", lambda d: _lost(d, True)), reach=0.6,
    source="Kane, Ryan, Banerjee, Journal of Guidance, Control, and Dynamics 10, 1987; Shabana, "
    "Dynamics of Multibody Systems, 2020, ch. 5",
)  # fmt: skip
