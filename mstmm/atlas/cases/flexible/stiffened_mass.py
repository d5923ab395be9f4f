"""Inertia of a stiffened beam, truncated after the second order of its deflection."""

from __future__ import annotations

import numpy as np

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import simulate_to_end
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import compile_looped

SHAPES = 4


def _lost_inertia(deflection: float, quadrature: bool) -> float:
    """Largest relative loss of inertia over all motions; above 1 the inertia is negative."""
    beam = {
        "name": "rod", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 50.0,
        "modes": {"y": SHAPES}, "frame": "tangent", "stiffening": True, "quadrature": quadrature,
    }  # fmt: skip
    pin = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod"}
    beam_model = compile_looped({"gravity": [0, 0, 0], "beam": [beam], "hinge": [pin]})
    straight, zeros = beam_model.initial_state()
    bent = straight.copy()
    bent[1] = 1e-3
    run = simulate_to_end(beam_model, 1e-6, initial=(bent, zeros), output_times=[0.0, 1e-6])
    bent[1] *= deflection / float(run.deflection("rod", "tip")[0, 1])
    inverse = np.linalg.inv(np.linalg.cholesky(beam_model.mass_matrix(straight)))
    eigenvalues = np.linalg.eigvalsh(inverse @ beam_model.mass_matrix(bent) @ inverse.T)
    return 1 - float(eigenvalues.min())


CASE = CaseDefinition(
    name="stiffened-mass",
    title="Stiffened beam: inertia truncated after the second order",
    cause="Shortening makes the mass matrix of a beam depend on its deflection. Truncated after "
    "the second power, it subtracts more inertia than there is where shapes carry nearly all of "
    "it, as in a frame tangent to a rotating section. Accelerations then change their sign. Mass "
    "in points along the beam (`quadrature`), or the mean frame, keeps the matrix positive "
    "definite.",
    parameter="deflection of the tip of a pinned beam, relative to its length",
    unit="",
    low=5e-3,
    high=0.4,
    scale=LOG_SCALE,
    measured="lost part of the inertia",
    limit=1.0,
    method=MethodDefinition(
        f"tangent frame, {SHAPES} shapes, truncated", lambda d: _lost_inertia(d, False)
    ),
    remedy=MethodDefinition("the same with quadrature", lambda d: _lost_inertia(d, True)),
    reach=0.6,
    source="Kane, Ryan, Banerjee, Journal of Guidance, Control, and Dynamics 10, 1987; Shabana, "
    "Dynamics of Multibody Systems, 2020, ch. 5",
)
