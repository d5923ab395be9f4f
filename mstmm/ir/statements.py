"""Parts of a KernelIR: arrays (ports), operands and statements."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

#: Loop variable of an indexed sum or store, used as an index.
LOOP_INDEX = "k"
#: Loop variable of a second loop, inside the first.
INNER_INDEX = "l"
LOOPS = (LOOP_INDEX, INNER_INDEX)


@dataclass(frozen=True)
class Port:
    """Array that a kernel reads or writes.  Arrays are dense and row-major.

    `shape` holds integers or the kernel's size symbol; () is a scalar (one number).
    An output with `accumulate` is added to the contents of the array (contributions to a parent
    body).
    """

    name: str
    shape: tuple[int | str, ...] = ()
    unit: str = ""
    meaning: str = ""
    accumulate: bool = False

    def length(self, n: int = 0) -> int:
        """Count of numbers in the array for the value `n` of the size symbol."""
        total = 1
        for extent in self.shape:
            total *= n if isinstance(extent, str) else extent
        return total

    def offset(self, index: tuple[int | str, ...], n: int = 0, k: int = 0, inner: int = 0) -> int:
        """Row-major index of an entry, for `LOOP_INDEX` = `k` and `INNER_INDEX` = `inner`."""
        if len(index) == len(self.shape) == 1 and isinstance(index[0], int):  # fast path
            return index[0]
        offset = 0
        for entry, extent in zip(index, self.shape, strict=True):
            width = n if isinstance(extent, str) else extent
            if isinstance(entry, str):
                entry = k if entry == LOOP_INDEX else inner
            offset = offset * width + entry
        return offset


@dataclass(frozen=True)
class Constant:
    """Exact rational number, written "3", "-1/3"; or "pi"."""

    text: str

    @property
    def number(self) -> float:
        """Nearest double.  ValueError if the text is no number, or is not finite as a double."""
        if self.text == "pi":
            return math.pi
        try:
            return float(Fraction(self.text))
        except (ValueError, ZeroDivisionError, OverflowError):
            raise ValueError(f"{self.text!r} is no number within the range of a double") from None


@dataclass(frozen=True)
class Element:
    """Entry of an input or of a complete output; one entry per axis, `k` or `l` in a loop."""

    port: str
    index: tuple[int | str, ...] = ()


@dataclass(frozen=True)
class Temporary:
    """Operand: value of the statement with this number."""

    number: int


Operand = Constant | Element | Temporary


@dataclass(frozen=True)
class Assign:
    """Assignment t[number] = op(args)."""

    number: int
    op: str
    args: tuple[Operand, ...]


@dataclass(frozen=True)
class Sum:
    """Sum t[number] of `value` over k < n (or the letter `over`); `body` is run in each pass."""

    number: int
    body: tuple[Assign | Sum, ...]
    value: Operand
    over: str = LOOP_INDEX


#: Statements that are allowed inside a loop.
Inner = Assign | Sum


@dataclass(frozen=True)
class Store:
    """Write output[index] = value; with `k` or `l` in the index, run `body` for all k, l < n."""

    port: str
    index: tuple[int | str, ...]
    value: Operand
    body: tuple[Inner, ...] = ()

    @property
    def loops(self) -> tuple[str, ...]:
        """Letters of the loops, outermost first."""
        return tuple(letter for letter in LOOPS if letter in self.index)


@dataclass(frozen=True)
class Guard:
    """Leave the kernel with `code` unless `condition` is non-zero; `message` states the failure."""

    condition: Operand
    code: int
    message: str


#: Code that C returns after a complete kernel if an unsymmetric matrix, not known to be positive
#: definite, has a negative determinant; all results are valid.
NEGATIVE_DETERMINANT = 2


@dataclass(frozen=True)
class Solve:
    """Linear solve, output = A^-1 B, for a run-time sized A (n x n), B (n,) or (n, m).

    A symmetric positive definite A is factored as LDL^T without pivoting, from its lower half; a
    pivot below `relative_pivot` times its diagonal entry of A leaves the kernel with `code`.
    Otherwise A is factored as LU with row exchange; the limit of a pivot is then `relative_pivot`
    times the sum of magnitudes in its column of A.  Solves of fixed size are unrolled when the
    kernel is lowered and never become this statement.
    """

    port: str
    matrix: str
    right: str
    code: int
    message: str
    relative_pivot: float = 1e-13
    symmetric: bool = True


Statement = Assign | Sum | Store | Guard | Solve
