"""Options of a body with a discrete-time matrix, and the inputs of its kernel."""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from ...definition.derivation import Quantity, tilde, vector
from ...definition.notation import Matrix
from ..state_vector import StateVector
from .mass_moments import ETA

# --- state vectors --------------------------------------------------------------------------------
# Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, Wiley 2019, ch. 8, (8.63) to
# (8.65). In the plane z = [r; theta; m; q; eta; 1], 7 + n numbers (10 with three modes), in space
# z = [r; psi; m; q; eta; 1], 13 + n.  r is the position of the section, theta the angle of the
# floating frame, psi the rotation vector (inertial axes) from the frame's predicted orientation to
# the unknown one, eta the modal coordinates of the body that the end belongs to (rigid: none).  m
# and q are the moment and the force of the inboard on the outboard side, inertial axes.

BOOK = "Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, Wiley 2019, ch. 8"


class Space:
    """Plane or space: sizes, cross products and units of a state."""

    def __init__(self, planar: bool) -> None:
        self.planar = planar
        self.name = "planar" if planar else "spatial"
        self.translation_count, self.rotation_count = (2, 1) if planar else (3, 3)
        self.angle = "theta" if planar else "psi"

    @property
    def rigid_count(self) -> int:
        """Number of rigid degrees of freedom."""
        return self.translation_count + self.rotation_count

    def state(self, modes: int) -> StateVector:
        """State vector of an end of a body with this number of modes."""
        has_modes = bool(modes)
        return StateVector(
            ("r", self.angle, "m", "q", *("eta",) * has_modes),
            (
                self.translation_count,
                self.rotation_count,
                self.rotation_count,
                self.translation_count,
                *(modes,) * has_modes,
            ),
            ("m", "rad", "N*m", "N", *("m",) * has_modes, "1"),
        )

    def length(self, modes: int) -> int:
        """Number of entries of a state."""
        return 2 * self.rigid_count + modes + 1

    def moment(self, lever: sp.Basic, force: sp.Basic) -> sp.Basic:
        """lever x force, for a column `lever` and the rows `force` of a state (or a column)."""
        return rotate_plane_column(lever).T * force if self.planar else tilde(lever) * force

    def rotate(self, column: sp.Basic, angle: sp.Basic) -> sp.Basic:
        """angle x column, for the rows `angle` of a small rotation."""
        return rotate_plane_column(column) * angle if self.planar else -tilde(column) * angle

    def change_moment(self, change: sp.Basic, force: sp.Basic) -> sp.Basic:
        """change x force, for the rows `change` of a small displacement and a column `force`."""
        return -rotate_plane_column(force).T * change if self.planar else -tilde(force) * change


def rotate_plane_column(column: sp.Basic) -> Matrix:
    """Plane column rotated by +90 degrees, entry by entry."""
    return Matrix([-column[1, 0], column[0, 0]])


PLANE, SPACE = Space(True), Space(False)


def rows_of(state: StateVector, name: str) -> Matrix:
    """Rows of the unit matrix that select block `name` of a state ("1": the last number)."""
    starts = dict(zip(state.names, _block_starts(state), strict=True)) | {"1": state.length - 1}
    sizes = dict(zip(state.names, state.sizes, strict=True)) | {"1": 1}
    start = starts[name]
    return Matrix(sizes[name], state.length, lambda i, j: int(j == start + i))


def _block_starts(state: StateVector) -> list[int]:
    return [sum(state.sizes[:k]) for k in range(len(state.sizes))]


def row_block(matrix: sp.MatrixSymbol, first: int, count: int) -> Matrix:
    """`count` rows of a matrix symbol."""
    return Matrix(count, int(matrix.cols), lambda i, j: matrix[first + i, j])


def constant_rows(column: sp.Basic, state: StateVector) -> sp.MatrixExpr:
    """`column` in the last column of rows on a state."""
    return column * rows_of(state, "1")


# --- options --------------------------------------------------------------------------------------

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
