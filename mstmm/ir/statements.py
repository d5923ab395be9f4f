"""What a kernel is made of: arrays, operands, and the statements of a KernelIR."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

#: Index that stands for the loop variable of an indexed sum or store.
LOOP_INDEX = "k"
#: That of a second loop, inside the first.
INNER_INDEX = "l"
LOOPS = (LOOP_INDEX, INNER_INDEX)


@dataclass(frozen=True)
class Port:
    """One array a kernel reads or writes.  Arrays are dense and row-major.

    `shape` holds whole numbers or the kernel's size symbol; () is a scalar (one number).
    An output with `accumulate` is added to what the array holds (contributions to a parent body).
    """

    name: str
    shape: tuple[int | str, ...] = ()
    unit: str = ""
    meaning: str = ""
    accumulate: bool = False

    def length(self, n: int = 0) -> int:
        """Numbers in the array when the size symbol equals `n`."""
        total = 1
        for extent in self.shape:
            total *= n if isinstance(extent, str) else extent
        return total

    def offset(self, index: tuple[int | str, ...], n: int = 0, k: int = 0, inner: int = 0) -> int:
        """Row-major place of an entry; in it `LOOP_INDEX` is `k`, `INNER_INDEX` is `inner`."""
        place = 0
        for entry, extent in zip(index, self.shape, strict=True):
            width = n if isinstance(extent, str) else extent
            if isinstance(entry, str):
                entry = k if entry == LOOP_INDEX else inner
            place = place * width + entry
        return place


@dataclass(frozen=True)
class Constant:
    """An exact rational number, written "3", "-1/3"; or "pi"."""

    text: str

    @property
    def number(self) -> float:
        """The nearest double.  ValueError if the text is no number or has no finite double."""
        if self.text == "pi":
            return math.pi
        try:
            return float(Fraction(self.text))
        except (ValueError, ZeroDivisionError, OverflowError):
            raise ValueError(f"{self.text!r} is no constant that a double can hold") from None


@dataclass(frozen=True)
class Element:
    """Entry of an input or of a complete output; one entry per axis, `k` or `l` in a loop."""

    port: str
    index: tuple[int | str, ...] = ()


@dataclass(frozen=True)
class Temporary:
    """Value of the statement with this number."""

    number: int


Operand = Constant | Element | Temporary


@dataclass(frozen=True)
class Assign:
    """t[number] = op(args)."""

    number: int
    op: str
    args: tuple[Operand, ...]


@dataclass(frozen=True)
class Sum:
    """t[number] = sum over k < n (or the letter `over`) of `value`, once `body` has been run."""

    number: int
    body: tuple[Assign | Sum, ...]
    value: Operand
    over: str = LOOP_INDEX


#: What stands inside a loop.
Inner = Assign | Sum


@dataclass(frozen=True)
class Store:
    """output[index] = value; with `k` or `l` in the index, `body` is run for every k, l < n."""

    port: str
    index: tuple[int | str, ...]
    value: Operand
    body: tuple[Inner, ...] = ()

    @property
    def loops(self) -> tuple[str, ...]:
        """Letters that are run through, the outermost first."""
        return tuple(letter for letter in LOOPS if letter in self.index)


@dataclass(frozen=True)
class Guard:
    """Leave the kernel with `code` unless `condition` is non-zero; `message` says what failed."""

    condition: Operand
    code: int
    message: str


#: What C returns behind a whole kernel if a matrix that is not symmetric, of which it is not known
#: to be positive definite, has a negative determinant: all results are there.
NEGATIVE = 2


@dataclass(frozen=True)
class Solve:
    """output = A^-1 B for a run-time sized A (n x n), B (n,) or (n, m).

    Of a symmetric positive definite A the lower half is read: LDL^T without pivoting; a pivot below
    `relative_pivot` times its own diagonal entry leaves with `code`.  Otherwise LU with row
    exchange; there it is a pivot below `relative_pivot` times the magnitude of its column in A (the
    sum of the entries').  Fixed sizes are unrolled when the kernel is lowered and never reach this
    statement.
    """

    port: str
    matrix: str
    right: str
    code: int
    message: str
    relative_pivot: float = 1e-13
    symmetric: bool = True


Statement = Assign | Sum | Store | Guard | Solve
