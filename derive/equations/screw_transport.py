"""Transport across an axial screw: rotation about a coordinate axis and shift along it.

Every connection of two hinge axes is a screw about z, then one about x (Denavit and Hartenberg, J.
Appl. Mech. 22 (1955) 215-221; frames as in Khalil and Kleinfinger, Proc. IEEE Int. Conf. Robotics
and Automation (1986) 1174-1179), and a pin's own motion is a screw about z.  In two stages the
transport of S costs less than half of X^T S X with a full rotation.  R maps outboard axes to
inboard ones; the outboard origin is at d along the axis:

    S_I = X^T S X,   e_I = X^T e,   delta = X delta_I,   X = [R^T  -R^T r~; 0  R^T],   r = d e_k

S is carried as R A R^T without simplification, so that its products fold where c and s are
constants.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, tilde
from ..definition.notation import part, stack, symbol
from .riccati_sweep import SOURCES, E, S

ROTATION = Quantity(symbol("turn", 2), "", "cosine and sine of the angle")
SHIFT_ALONG = Quantity(symbol("d", 1), "m", "shift along the axis")
R_GIVEN = Quantity(symbol("Rc", 3, 3), "", "rotation, outboard axes to inboard axes")
OUT_S = Quantity(symbol("S_I", 6, 6), "", "f = S a + e at the inboard origin", symmetric=True)
OUT_E = Quantity(symbol("e_I", 6), "N, N*m", "force part at the inboard origin")

AXES = {"x": 0, "z": 2}

Scalars = dict[tuple[int, int], sp.Expr]
Pair = tuple[sp.MatrixSymbol, sp.MatrixSymbol]


def _plane(k: int) -> tuple[int, int]:
    """Axes mixed by a rotation about axis k, in right-handed order."""
    return (k + 1) % 3, (k + 2) % 3


def _matrix(entries: Scalars) -> sp.ImmutableDenseMatrix:
    return sp.ImmutableDenseMatrix(3, 3, lambda i, j: entries.get((i, j), sp.Integer(0)))


def _block(symbol: sp.MatrixSymbol, row: int, column: int) -> sp.ImmutableDenseMatrix:
    return sp.ImmutableDenseMatrix(3, 3, lambda i, j: symbol[row + i, column + j])


# --- S and e ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Stage:
    """A screw about axis k in a longer derivation; `mark` makes intermediate names unique."""

    k: int
    cosine: sp.Expr
    sine: sp.Expr
    shift: sp.Expr
    mark: str = ""

    @property
    def rotation(self) -> sp.ImmutableDenseMatrix:
        """Rotation, outboard axes to inboard axes."""
        i, j = _plane(self.k)
        c, s = self.cosine, self.sine
        return _matrix({(self.k, self.k): sp.Integer(1),
                        (i, i): c, (j, j): c, (i, j): -s, (j, i): s})  # fmt: skip

    @property
    def position(self) -> sp.ImmutableDenseMatrix:
        """Position of the outboard origin from the inboard one."""
        return sp.ImmutableDenseMatrix(
            [self.shift if i == self.k else sp.Integer(0) for i in range(3)]
        )

    def symbol(self, name: str, rows: int, columns: int = 1) -> sp.MatrixSymbol:
        """Intermediate quantity of this stage."""
        return symbol(name + self.mark, rows, columns)

    def carry_equations(
        self, s: sp.MatrixSymbol, e: sp.MatrixSymbol, out: Pair
    ) -> tuple[Equation, ...]:
        """Equations that carry s and e to the inboard origin; `out` are the results' symbols."""
        rotation = Equation("rotation", self.symbol("R", 3, 3), self.rotation)
        return (
            rotation,
            *self._rotated_blocks(s),
            *self._rotated_load(e),
            *self._shift_equations(*out),
        )

    def _rotated_load(self, e: sp.MatrixSymbol) -> tuple[Equation, ...]:
        turn = self.symbol("R", 3, 3)
        return (
            Equation("force, inboard axes", self.symbol("push", 3), turn * part(e, 0)),
            Equation("moment, inboard axes", self.symbol("moment", 3), turn * part(e, 3)),
        )

    def _rotated_blocks(self, s: sp.MatrixSymbol) -> tuple[Equation, ...]:
        """R A R^T, R B R^T, R C R^T."""
        turn = self.symbol("R", 3, 3)
        return tuple(
            Equation(
                f"{label}, inboard axes", self.symbol(name, 3, 3),
                turn * _block(s, row, column) * turn.T, symmetric=row == column,
            )
            for name, label, row, column in _BLOCKS
        )  # fmt: skip

    def _shift_equations(
        self, out_s: sp.MatrixSymbol, out_e: sp.MatrixSymbol
    ) -> tuple[Equation, ...]:
        """B_I = B - A r~,  C_I = C + r~ B_I - B^T r~,  moment + r x force."""
        a, b, c, mixed, shifted = (self.symbol(n, 3, 3) for n in ("A", "B", "C", "B_I", "C_I"))
        push, moment = self.symbol("push", 3), self.symbol("moment", 3)
        lever = tilde(self.position)
        return (
            Equation(
                "mixed block at the inboard origin", mixed, b - a * lever,
                computed=self._shifted_mixed(a, b),
            ),
            Equation(
                "moment-rotation block at the inboard origin", shifted,
                c + lever * mixed - b.T * lever,
                symmetric=True, computed=self._shifted_corner(b, c, mixed),
            ),
            Equation(
                "S at the inboard origin", out_s, sp.BlockMatrix([[a, mixed], [mixed.T, shifted]])
            ),
            Equation("e at the inboard origin", out_e, stack(push, moment + lever * push)),
        )  # fmt: skip

    def _shifted_mixed(self, a: sp.MatrixSymbol, b: sp.MatrixSymbol) -> sp.ImmutableDenseMatrix:
        i, j = _plane(self.k)
        mixed = _entries(b)
        for m in range(3):
            mixed[m, i] = b[m, i] - self.shift * a[m, j]
            mixed[m, j] = b[m, j] + self.shift * a[m, i]
        return _matrix(mixed)

    def _shifted_corner(
        self, b: sp.MatrixSymbol, c: sp.MatrixSymbol, mixed: sp.MatrixSymbol
    ) -> sp.ImmutableDenseMatrix:
        k, (i, j), d = self.k, _plane(self.k), self.shift
        corner = _entries(c)
        corner[k, i] = corner[i, k] = c[k, i] - d * b[j, k]
        corner[k, j] = corner[j, k] = c[k, j] + d * b[i, k]
        corner[i, i] = c[i, i] - d * (mixed[j, i] + b[j, i])
        corner[j, j] = c[j, j] + d * (mixed[i, j] + b[i, j])
        corner[i, j] = corner[j, i] = c[i, j] + d * (b[i, i] - mixed[j, j])
        return _matrix(corner)

    # --- motion and accelerations ---------------------------------------------------------------

    def outboard_motion(
        self, motion: sp.MatrixSymbol, out: sp.MatrixSymbol
    ) -> tuple[Equation, ...]:
        """Bias motion of the outboard frame, which is at rest in the inboard one."""
        w, wd, rdd = (part(motion, n) for n in (0, 3, 6))
        turn, carrier = self.symbol("R", 3, 3), self.symbol("K", 3, 3)
        back = turn.T
        acceleration = rdd + carrier * self.position
        return (
            Equation("rotation", turn, self.rotation),
            Equation("K = wd~ + w~ w~", carrier, tilde(wd) + tilde(w) * tilde(w)),
            Equation("bias motion", out, stack(back * w, back * wd, back * acceleration)),
        )

    def deviation(self, delta: sp.MatrixSymbol, out: sp.MatrixSymbol) -> tuple[Equation, ...]:
        """X delta: deviation in the outboard frame."""
        a, alpha = part(delta, 0), part(delta, 3)
        turn = self.symbol("R", 3, 3)
        acceleration = a - tilde(self.position) * alpha
        return (
            Equation("rotation", turn, self.rotation),
            Equation("X delta", out, stack(turn.T * acceleration, turn.T * alpha)),
        )


_BLOCKS = (
    ("A", "force-acceleration block", 0, 0),
    ("B", "mixed block", 0, 3),
    ("C", "moment-rotation block", 3, 3),
)


def _entries(symbol: sp.MatrixSymbol) -> Scalars:
    return {(m, n): symbol[m, n] for m in range(3) for n in range(3)}


def screw_from_inputs(axis: str) -> Stage:
    """Screw about `axis` whose rotation and shift are inputs."""
    return Stage(AXES[axis], ROTATION.symbol[0, 0], ROTATION.symbol[1, 0], SHIFT_ALONG.symbol[0, 0])


def condense(axis: str) -> Derivation:
    """S and e carried across a screw about `axis`."""
    return Derivation(
        "screw",
        f"S and e across a screw about {axis}",
        (ROTATION, SHIFT_ALONG, S, E),
        (OUT_S, OUT_E),
        screw_from_inputs(axis).carry_equations(S.symbol, E.symbol, (OUT_S.symbol, OUT_E.symbol)),
        sources=SOURCES,
    )


def turn() -> Derivation:
    """S and e in other axes through the same point."""
    rotation = R_GIVEN.symbol
    equations = []
    for name, label, row, column in _BLOCKS:
        value = rotation * _block(S.symbol, row, column) * rotation.T
        same = row == column
        equations.append(
            Equation(f"{label}, inboard axes", symbol(name, 3, 3), value, symmetric=same)
        )
    a, b, c = (symbol(n, 3, 3) for n in ("A", "B", "C"))
    load = stack(rotation * part(E.symbol, 0), rotation * part(E.symbol, 3))
    return Derivation(
        "screw",
        "S and e in turned axes",
        (R_GIVEN, S, E),
        (OUT_S, OUT_E),
        (
            *equations,
            Equation("S, inboard axes", OUT_S.symbol, sp.BlockMatrix([[a, b], [b.T, c]])),
            Equation("e, inboard axes", OUT_E.symbol, load),
        ),
        sources=SOURCES,
    )


def turn_by_trace() -> Derivation:
    """S and e in other axes, with the first diagonal entry of A from its trace.

    That saves a row of each product, and relies on R R^T = 1 where `turn` does not.  The first
    entry is chosen because with links along x the transverse entries are needed first (and at
    the root, only).
    """
    plain, rotation = turn(), R_GIVEN.symbol
    rows, m = symbol("A_rows", 2, 3), _block(S.symbol, 0, 0)
    entries: Scalars = {(0, j): rows[j - 1, 0] for j in (1, 2)}
    entries |= {(i, j): rows[i - 1, j] for i in (1, 2) for j in range(i, 3)}
    entries[0, 0] = (m[0, 0] + m[1, 1] + m[2, 2]) - rows[0, 1] - rows[1, 2]
    lower = sp.ImmutableDenseMatrix(2, 3, lambda i, j: rotation[i + 1, j])
    first, *remaining = plain.definitions
    return replace(
        plain,
        title="S and e in turned axes, by the trace",
        definitions=(
            Equation("two rows of A, inboard axes", rows, lower * m * rotation.T),
            replace(first, computed=_matrix(entries)),
            *remaining,
        ),
    )


def derivations() -> dict[str, Derivation]:
    """All steps by the names of their kernels."""
    across = {f"condense_{axis}": condense(axis) for axis in AXES}
    return {"condense_turn_by_trace": turn_by_trace(), **across}
