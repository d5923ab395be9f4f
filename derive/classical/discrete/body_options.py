"""Options of a body with a discrete-time matrix, and the inputs of its kernel."""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from ...definition.derivation import Quantity, vector
from .mass_moments import ETA
from .state import Space

#: Coefficients of the linear time map, and the tangent operator of a rotation update.
MAP_A, MAP_C = sp.MatrixSymbol("A", 1, 1), sp.MatrixSymbol("C", 1, 1)
A, C = MAP_A[0, 0], MAP_C[0, 0]
TANGENT_OPERATOR = sp.MatrixSymbol("T", 3, 3)


@dataclass(frozen=True)
class BodyStatement:
    """Kind of body: rigid (no modes), beam or elastic; `planes` are directions of its modes."""

    element: str
    title: str
    space: Space
    kind: str
    modes: int
    source: str
    equation: str
    planes: str = ""
    notes: tuple[str, ...] = ()


def body_inputs(statement: BodyStatement) -> tuple[Quantity, ...]:
    """Ends, time map, predictor and loads."""
    return (*_end_inputs(statement), *_map_inputs(statement.space, statement.modes))


def _end_inputs(statement: BodyStatement) -> tuple[Quantity, ...]:
    space, modes = statement.space, statement.modes
    if statement.kind == "beam" and space.planar:
        return (
            Quantity(sp.MatrixSymbol("L", 1, 1), "m", "length"),
            Quantity(sp.MatrixSymbol("phi_O", 1, modes), "1", "deflections at the output end"),
            Quantity(sp.MatrixSymbol("Theta_O", 1, modes), "1/m", "slopes at the output end"),
            Quantity(sp.MatrixSymbol("Theta_I", 1, modes), "1/m", "slopes at the input end"),
        )
    inputs = [
        Quantity(vector("r_e", space.translation_count), "m", "output end at rest, frame axes")
    ]
    if modes:
        rotation_note = (
            ""
            if space.planar
            else " (rate of its rotation at the predictor: T(Psi) Theta of a rotation vector Psi)"
        )
        inputs += [
            Quantity(
                sp.MatrixSymbol("Phi_O", space.translation_count, modes), "1", "shapes, output end"
            ),
            Quantity(
                sp.MatrixSymbol("Theta_O", space.rotation_count, modes),
                "1/m",
                "section rotation per mode at the output end" + rotation_note,
            ),
            Quantity(
                sp.MatrixSymbol("Theta_I", space.rotation_count, modes),
                "1/m",
                "section rotation per mode at the input end" + rotation_note,
            ),
        ]
    return tuple(inputs)


def _map_inputs(space: Space, modes: int) -> tuple[Quantity, ...]:
    shifts, turns = space.translation_count, space.rotation_count
    inputs = [
        Quantity(MAP_A, "1/s2", "time map, ydd = A y + B"),
        Quantity(MAP_C, "1/s", "time map, yd = C y + D"),
        Quantity(vector("B_r", shifts), "m/s2", "B of r"),
    ]
    if space.planar:
        inputs += [
            Quantity(vector("B_theta", 1), "rad/s2", "B of theta"),
            Quantity(vector("D_theta", 1), "rad/s", "D of theta"),
        ]
    else:
        inputs += [
            Quantity(vector("B_w", 3), "rad/s2", "angular acceleration at psi = 0, frame axes"),
            Quantity(vector("D_w", 3), "rad/s", "angular velocity at psi = 0, frame axes"),
            Quantity(
                TANGENT_OPERATOR,
                "1",
                "tangent operator of the rotation update (1: psi itself is mapped)",
            ),
        ]
    if modes:
        inputs += [
            Quantity(vector("B_eta", modes), "m/s2", "B of eta"),
            Quantity(vector("D_eta", modes), "m/s", "D of eta"),
        ]
    inputs.append(Quantity(vector("r_p", shifts), "m", "predicted position of the input end"))
    if space.planar:
        inputs.append(Quantity(vector("theta_p", 1), "rad", "predicted angle of the frame"))
    else:
        inputs.append(Quantity(sp.MatrixSymbol("R_p", 3, 3), "1", "predicted axes of the frame"))
    if modes:
        inputs.append(Quantity(vector(ETA, modes), "m", "predicted modal coordinates"))
    inputs.append(Quantity(vector("q_p", shifts), "N", "predicted force at the output end"))
    if modes and not space.planar:
        inputs += [
            Quantity(vector("m_p", 3), "N*m", "predicted moment at the output end"),
            Quantity(vector("m_pI", 3), "N*m", "predicted moment at the input end"),
            Quantity(
                sp.MatrixSymbol("K_g", modes, modes), "N/m",
                "derivative by eta of Phi_O^T q_p + Theta_O^T m_p - Theta_I^T m_pI (frame axes)",
            ),
        ]  # fmt: skip
    inputs.append(Quantity(vector("g", shifts), "m/s2", "gravity, inertial axes"))
    inputs.append(Quantity(vector("f_r", shifts), "N", "external force, inertial axes"))
    inputs.append(Quantity(vector("f_m", turns), "N*m", "external moment about the input end"))
    if modes:
        inputs.append(Quantity(vector("f_eta", modes), "N", "external modal loads"))
    return tuple(inputs)
