"""What KernelIR refuses when it is made, each with a message that names kernel and place."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from mstmm.ir import (
    Assign,
    Constant,
    Element,
    Guard,
    KernelIR,
    Port,
    Solve,
    Statement,
    Store,
    Sum,
    Temporary,
)

X = Element("x", (0,))
INPUTS = (Port("x", (2,)), Port("m", ("n",)), Port("A", ("n", "n")))
OUTPUTS = (Port("y"), Port("z", ("n",)), Port("total", ("n",), accumulate=True))


def kernel(*statements: Statement, size: str | None = "n") -> KernelIR:
    return KernelIR("made", INPUTS, OUTPUTS, statements, size)


def negation(operand: object) -> Assign:
    return Assign(0, "neg", (operand,))  # type: ignore[arg-type]


def test_a_sound_kernel_is_accepted() -> None:
    made = kernel(
        Solve("z", "A", "m", 1, "singular"),
        Sum(1, (Assign(0, "mul", (Element("z", ("k",)), X)),), Temporary(0)),
        Guard(Temporary(1), 2, "sum is zero"),
        Store("y", (), Temporary(1)),
    )
    assert made.operation_counts() == {"mul": 1}
    assert made.flops() == 1


REFUSED: dict[str, tuple[Callable[[], KernelIR], str]] = {
    "unknown operation": (lambda: kernel(Assign(0, "cbrt", (X,))), "cbrt with 1 operands"),
    "operands": (lambda: kernel(Assign(0, "add", (X,))), "add with 1 operands"),
    "undefined": (lambda: kernel(negation(Temporary(3))), "t3 is used before it is defined"),
    "itself": (lambda: kernel(negation(Temporary(0))), "t0 is used before it is defined"),
    "twice": (lambda: kernel(negation(X), negation(X)), "t0 is defined twice"),
    "unknown port": (lambda: kernel(negation(Element("q", (0,)))), "no port named 'q'"),
    "output read": (lambda: kernel(negation(Element("y"))), "no port named 'y'"),
    "input written": (lambda: kernel(Store("x", (0,), X)), "no port named 'x'"),
    "rank": (lambda: kernel(negation(Element("x", (0, 0)))), r"x\[0, 0\] does not fit \(2,\)"),
    "range": (lambda: kernel(negation(Element("x", (2,)))), r"x\[2\] is out of range"),
    "below": (lambda: kernel(negation(Element("x", (-1,)))), r"x\[-1\] is out of range"),
    "loop index": (lambda: kernel(negation(Element("m", ("k",)))), r"m\['k'\] outside a loop"),
    "other index": (
        lambda: kernel(Sum(1, (negation(Element("m", ("j",))),), Temporary(0))),
        r"m\['j'\] outside a loop",
    ),
    "loop on a fixed axis": (
        lambda: kernel(Sum(1, (negation(Element("x", ("k",))),), Temporary(0))),
        r"x\['k'\] does not fit \(2,\)",
    ),
    "fixed entry of a sized axis": (
        lambda: kernel(negation(Element("m", (0,)))),
        r"m\[0\] does not fit \('n',\)",
    ),
    "local of a loop": (
        lambda: kernel(Sum(1, (negation(X),), Temporary(0)), Store("y", (), Temporary(0))),
        "t0 is used before it is defined",
    ),
    "loop without size": (
        lambda: KernelIR("made", INPUTS[:1], OUTPUTS[:1], (Sum(1, (negation(X),), Temporary(0)),)),
        "a loop without a size symbol",
    ),
    "other size": (lambda: kernel(size="m"), r"m has the shape \('n',\)"),
    "names": (
        lambda: KernelIR("made", (Port("x"),), (Port("x"),), ()),
        "two ports have the same name",
    ),
    "code": (lambda: kernel(Guard(X, 0, "never")), "code 0 means success, not 'never'"),
    "constant": (lambda: kernel(negation(Constant("e"))), "'e' is no number"),
    "division": (lambda: kernel(negation(Constant("1/0"))), "'1/0' is no number"),
    "overflow": (
        lambda: kernel(negation(Constant("1" + "0" * 400))),
        "is no number within the range of a double",
    ),
    "solve code": (lambda: kernel(Solve("z", "A", "m", 0, "no")), "code 0 means success"),
    "solve port": (lambda: kernel(Solve("w", "A", "m", 1, "no")), "no port named 'w'"),
    "solve matrix": (lambda: kernel(Solve("z", "B", "m", 1, "no")), "no port named 'B'"),
    "solve shapes": (lambda: kernel(Solve("z", "m", "A", 1, "no")), "solve: z, m, A do not fit"),
    "solve into a scalar": (
        lambda: kernel(Solve("y", "A", "m", 1, "no")),
        "solve: y, A, m do not fit",
    ),
    "solve and add": (
        lambda: kernel(Solve("total", "A", "m", 1, "no")),
        "solve: total, A, m do not fit",
    ),
    "solve twice": (
        lambda: kernel(Solve("z", "A", "m", 1, "no"), Solve("z", "A", "m", 1, "no")),
        "z is solved for twice",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused(case: str) -> None:
    make, message = REFUSED[case]
    with pytest.raises(ValueError, match=f"^made: .*{message}"):
        make()


def test_offsets_are_row_major() -> None:
    fixed, sized = Port("A", (2, 3, 4)), Port("B", (3, "n"))
    places = [fixed.offset((i, j, k)) for i in range(2) for j in range(3) for k in range(4)]
    assert places == list(range(24))
    assert sized.offset((2, "k"), n=5, k=4) == 14 == sized.length(5) - 1
    assert Port("s").offset(()) == 0


def test_constants_are_the_nearest_doubles() -> None:
    assert Constant("1/3").number == 1 / 3
    assert Constant("-7/2").number == -3.5
    assert Constant("pi").number == 3.141592653589793
