"""Transport across an axial screw: a turn about a coordinate axis and a shift along the same axis.

Every connection of two hinge axes is a screw about z, then one about x (Denavit and Hartenberg,
J. Appl. Mech. 22 (1955) 215-221; frames as in Khalil and Kleinfinger, Proc. IEEE Int. Conf.
Robotics and Automation (1986) 1174-1179), and a pin's own motion is a screw about z.  In parts the
transport of S costs less than half of X^T S X with a full rotation.  R turns outboard axes to
inboard ones; the outboard origin lies d along the axis:

    S_I = X^T S X,   e_I = X^T e,   delta = X delta_I,   X = [R^T  -R^T r~; 0  R^T],   r = d e_k

In the plane of the turn a symmetric block [a b; b d] becomes, with t = s (a - d) + 2 c b,

    a' = a - s t,   d' = d + s t,   b' = c t - b

and in the mixed block [p q; r w], whose antisymmetric part a turn leaves as it is, with
t = s (p - w) + c (q + r):   p' = p - s t,   w' = w + s t,   q' = c t - r,   r' = c t - q.

These forms rely on c^2 + s^2 = 1 and do not fold where c and s are constants 0 or +-1 (c t - r with
t = q + r); `condense_plain` is R A R^T as it stands and does.
"""

from __future__ import annotations

import sympy as sp

from .derivation import Derivation, Equation, Quantity, tilde
from .sweep import (
    DELTA,
    MOTION,
    PARENT_DELTA,
    PARENT_MOTION,
    SOURCES,
    E,
    S,
    _part,
    _stack,
    _symbol,
)  # fmt: skip

TURN = Quantity(_symbol("turn", 2), "", "cosine and sine of the angle")
SHIFT_ALONG = Quantity(_symbol("d", 1), "m", "shift along the axis")
R_GIVEN = Quantity(_symbol("Rc", 3, 3), "", "rotation, outboard axes to inboard axes")
OUT_S = Quantity(_symbol("S_I", 6, 6), "", "f = S a + e at the inboard origin", symmetric=True)
OUT_E = Quantity(_symbol("e_I", 6), "N, N*m", "force part at the inboard origin")

AXES = {"x": 0, "z": 2}
_ROTATION = _symbol("R", 3, 3)
_COSINE, _SINE, _D = TURN.symbol[0, 0], TURN.symbol[1, 0], SHIFT_ALONG.symbol[0, 0]

Scalars = dict[tuple[int, int], sp.Expr]


def _plane(k: int) -> tuple[int, int]:
    """The axes that a turn about axis k mixes, in right-handed order."""
    return (k + 1) % 3, (k + 2) % 3


def _turn(k: int) -> sp.ImmutableDenseMatrix:
    i, j = _plane(k)
    entries: Scalars = {(k, k): sp.Integer(1)}
    entries |= {(i, i): _COSINE, (j, j): _COSINE, (i, j): -_SINE, (j, i): _SINE}
    return _matrix(entries)


def _matrix(entries: Scalars) -> sp.ImmutableDenseMatrix:
    return sp.ImmutableDenseMatrix(3, 3, lambda i, j: entries.get((i, j), sp.Integer(0)))


def _along(k: int) -> sp.ImmutableDenseMatrix:
    return sp.ImmutableDenseMatrix([_D if i == k else sp.Integer(0) for i in range(3)])


def _block(symbol: sp.MatrixSymbol, row: int, column: int) -> sp.ImmutableDenseMatrix:
    return sp.ImmutableDenseMatrix(3, 3, lambda i, j: symbol[row + i, column + j])


def _screw(name: str, axis: str) -> str:
    return f"{name} across a screw about {axis}"


# --- S and e ----------------------------------------------------------------------------------


def condense(axis: str, *, plain: bool = False) -> Derivation:
    """S and e across a screw about `axis`; `plain` without the double angle (constant turns)."""
    k = AXES[axis]
    turned = _turned_plainly() if plain else _turned(k)
    equations = (Equation("rotation", _ROTATION, _turn(k)), *turned, *_shifted(k))
    title = _screw("S and e", axis) + (", plain products" if plain else "")
    return Derivation(
        "screw", title, (TURN, SHIFT_ALONG, S, E), (OUT_S, OUT_E), equations, sources=SOURCES
    )


def turn() -> Derivation:
    """S and e in other axes through the same point."""
    a, b, c = (_symbol(n, 3, 3) for n in ("A", "B", "C"))
    whole = sp.BlockMatrix([[a, b], [b.T, c]])
    push, moment = _symbol("push", 3), _symbol("moment", 3)
    return Derivation(
        "screw",
        "S and e in turned axes",
        (R_GIVEN, S, E),
        (OUT_S, OUT_E),
        (
            Equation("rotation", _ROTATION, R_GIVEN.symbol),
            *_turned_plainly(),
            Equation("S, inboard axes", OUT_S.symbol, whole),
            Equation("e, inboard axes", OUT_E.symbol, _stack(push, moment)),
        ),
        sources=SOURCES,
    )


def _load_turned() -> tuple[Equation, ...]:
    return (
        Equation("force, inboard axes", _symbol("push", 3), _ROTATION * _part(E.symbol, 0)),
        Equation("moment, inboard axes", _symbol("moment", 3), _ROTATION * _part(E.symbol, 3)),
    )


def _turned_plainly() -> tuple[Equation, ...]:
    """R A R^T, R B R^T, R C R^T, R f, R m."""
    found = []
    for name, words, row, column in _BLOCKS:
        value = _ROTATION * _block(S.symbol, row, column) * _ROTATION.T
        same = row == column
        found.append(Equation(f"{words}, inboard axes", _symbol(name, 3, 3), value, symmetric=same))
    return (*found, *_load_turned())


_BLOCKS = (
    ("A", "force-acceleration block", 0, 0),
    ("B", "mixed block", 0, 3),
    ("C", "moment-rotation block", 3, 3),
)


def _turned(k: int) -> tuple[Equation, ...]:
    """The same by the double angle."""
    i, j = _plane(k)
    c, s = _COSINE, _SINE
    found = []
    for name, words, row, column in _BLOCKS:
        m = _block(S.symbol, row, column)
        same = row == column
        t = _symbol(f"t_{name}", 1)
        # The sum of the two mixed entries is 2 b of a symmetric block.
        swing = 2 * (c * m[i, j]) if same else c * (m[i, j] + m[j, i])
        found.append(Equation(f"double angle of the {words}", t, s * (m[i, i] - m[j, j]) + swing))
        t0 = t[0, 0]
        entries: Scalars = {
            (k, k): m[k, k],
            (i, i): m[i, i] - s * t0, (j, j): m[j, j] + s * t0,
            (i, j): c * t0 - m[j, i], (j, i): c * t0 - m[i, j],
            (k, i): c * m[k, i] - s * m[k, j], (k, j): s * m[k, i] + c * m[k, j],
            (i, k): c * m[i, k] - s * m[j, k], (j, k): s * m[i, k] + c * m[j, k],
        }  # fmt: skip
        found.append(
            Equation(
                f"{words}, inboard axes",
                _symbol(name, 3, 3),
                _ROTATION * m * _ROTATION.T,
                symmetric=same,
                computed=_matrix(entries),
            )
        )
    return (*found, *_load_turned())


def _shifted(k: int) -> tuple[Equation, ...]:
    """B_I = B - A r~,  C_I = C + r~ B_I - B^T r~,  moment + r x force."""
    i, j = _plane(k)
    a, b, c, moved = (_symbol(n, 3, 3) for n in ("A", "B", "C", "B_I"))
    push, moment = _symbol("push", 3), _symbol("moment", 3)
    lever = tilde(_along(k))
    mixed = {(m, n): b[m, n] for m in range(3) for n in range(3)}
    for m in range(3):
        mixed[m, i] = b[m, i] - _D * a[m, j]
        mixed[m, j] = b[m, j] + _D * a[m, i]
    corner = {(m, n): c[m, n] for m in range(3) for n in range(3)}
    corner[k, i] = corner[i, k] = c[k, i] - _D * b[j, k]
    corner[k, j] = corner[j, k] = c[k, j] + _D * b[i, k]
    corner[i, i] = c[i, i] - _D * (moved[j, i] + b[j, i])
    corner[j, j] = c[j, j] + _D * (moved[i, j] + b[i, j])
    corner[i, j] = corner[j, i] = c[i, j] + _D * (b[i, i] - moved[j, j])
    shifted = _symbol("C_I", 3, 3)
    return (
        Equation(
            "mixed block at the inboard origin", moved, b - a * lever, computed=_matrix(mixed)
        ),
        Equation(
            "moment-rotation block at the inboard origin",
            shifted,
            c + lever * moved - b.T * lever,
            symmetric=True,
            computed=_matrix(corner),
        ),
        Equation(
            "S at the inboard origin",
            OUT_S.symbol,
            sp.BlockMatrix([[a, moved], [moved.T, shifted]]),
        ),
        Equation("e at the inboard origin", OUT_E.symbol, _stack(push, moment + lever * push)),
    )


# --- motion and accelerations -----------------------------------------------------------------


def motion(axis: str) -> Derivation:
    """Angular velocity, angular acceleration and acceleration of the outboard origin."""
    k = AXES[axis]
    w, wd, rdd = (_part(PARENT_MOTION.symbol, n) for n in (0, 3, 6))
    carrier, back = _symbol("K", 3, 3), _ROTATION.T
    return Derivation(
        "screw",
        _screw("bias motion", axis),
        (TURN, SHIFT_ALONG, PARENT_MOTION),
        (MOTION,),
        (
            Equation("rotation", _ROTATION, _turn(k)),
            Equation("K = wd~ + w~ w~", carrier, tilde(wd) + tilde(w) * tilde(w)),
            Equation(
                "bias motion",
                MOTION.symbol,
                _stack(back * w, back * wd, back * (rdd + carrier * _along(k))),
            ),
        ),
        sources=SOURCES,
    )


def delta(axis: str) -> Derivation:
    """Deviation of the outboard acceleration for a rigid connection."""
    k = AXES[axis]
    a, alpha = _part(PARENT_DELTA.symbol, 0), _part(PARENT_DELTA.symbol, 3)
    back = _ROTATION.T
    return Derivation(
        "screw",
        _screw("deviation", axis),
        (TURN, SHIFT_ALONG, PARENT_DELTA),
        (DELTA,),
        (
            Equation("rotation", _ROTATION, _turn(k)),
            Equation(
                "X delta_I",
                DELTA.symbol,
                _stack(back * (a - tilde(_along(k)) * alpha), back * alpha),
            ),
        ),
        sources=SOURCES,
    )


def derivations() -> dict[str, Derivation]:
    """Every step by its kernel's name."""
    found = {"condense_turn": turn()}
    for axis in AXES:
        found[f"condense_{axis}"] = condense(axis)
        found[f"condense_plain_{axis}"] = condense(axis, plain=True)
        found[f"motion_{axis}"] = motion(axis)
        found[f"delta_{axis}"] = delta(axis)
    return found
