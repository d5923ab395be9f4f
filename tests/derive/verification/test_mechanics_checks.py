"""A sign turned in a derivation is noticed by the statements of mechanics.

The mutated equations are what is lowered too, so that equations, IR and C would agree on the error.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest

from mstmm.derive.catalogue.kernels import Kernel, built_in_kernels
from mstmm.derive.catalogue.registry import Element, builtin_elements, kind_of
from mstmm.pipeline.crosscheck import crosscheck, crosscheck_kernels, mechanics_statements
from mstmm.runtime.kernels import prebuilt_kernels
from tests.support.kernels.mutations import mutants


@cache
def definition(kind: str, name: str) -> Element | None:
    return next((e for e in builtin_elements() if (kind_of(e), e.name) == (kind, name)), None)


@cache
def kernels(kind: str, name: str) -> tuple[Kernel, ...]:
    return built_in_kernels(kind, name)


#: Element, kernel, quantity whose definition is mutated: every summand of it, one at a time.
PLACES = (
    ("hinge", "screw", "hinge", "H"),
    ("hinge", "cylindrical", "hinge", "v"),
    ("hinge", "universal", "hinge", "c"),
    ("hinge", "screw", "forward", "motion"),
    ("hinge", "screw", "forward", "K"),
    ("hinge", "pin", "condense", "D"),
    ("hinge", "pin", "condense", "g"),
    ("hinge", "prismatic", "condense", "S_Q"),
    ("hinge", "prismatic", "condense", "B_I"),
    ("hinge", "pin", "condense", "e_I"),
    ("hinge", "fixed", "condense", "S_I"),
    ("hinge", "pin", "recover", "delta_Q"),
    ("hinge", "pin", "recover", "udot"),
    ("sweep", "generic2", "condense", "D"),
    ("sweep", "generic2", "condense", "e_full"),
    ("sweep", "generic2", "recover", "delta"),
    ("body", "rigid", "bias_load", "e"),
    ("body", "rigid", "inertia", "S"),
    ("body", "rigid", "energy", "T"),
    ("force", "spring", "wrench", "f_local"),
    ("force", "spring", "wrench", "P"),
    ("sweep", "laws", "full", "tau"),
    ("sweep", "laws", "full", "V"),
    ("sweep", "laws", "rotation", "twist"),
)

#: Summands tried per place.
COUNTS = [1, pytest.param(2, marks=pytest.mark.soak)]


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize(("kind", "name", "kernel", "quantity"), PLACES)
def test_a_turned_sign_is_noticed(
    kind: str, name: str, kernel: str, quantity: str, count: int
) -> None:
    good = {k.name: k for k in kernels(kind, name)}
    found = mutants(good[kernel], quantity)
    assert found
    for mutant in found[:: max(1, len(found) // count)]:
        altered = [mutant if k.name == kernel else k for k in good.values()]
        if name == "laws":
            altered = [mutant]
        assert is_detected(kind, name, altered), mutant.derivation.definition(quantity)


def is_detected(kind: str, name: str, altered: list[Kernel]) -> bool:
    """Whether mechanics, or for a symmetric quantity the comparison of kernels, finds it."""
    if not all(s.passed for s in mechanics_statements(kind, name, altered, definition(kind, name))):
        return True
    return any(
        "symmetric" in p
        for p in crosscheck_kernels(kind, name, definition(kind, name), altered, None, 0).problems
    )


def test_a_sign_of_the_swing_twist_torque_is_noticed() -> None:
    good = {k.name: k for k in kernels("sweep", "laws")}
    for mutant in mutants(good["rotation"], "tau")[::11]:
        failed = {s.name for s in mechanics_statements("sweep", "laws", [mutant]) if not s.passed}
        assert failed


def test_unchanged_derivations_pass() -> None:
    for kind, name in (("hinge", "screw"), ("body", "rigid"), ("force", "spring")):
        assert all(
            s.passed
            for s in mechanics_statements(kind, name, kernels(kind, name), definition(kind, name))
        )


def test_an_error_of_lowering_is_noticed() -> None:
    good = kernels("hinge", "screw")
    report = crosscheck_kernels("hinge", "screw", definition("hinge", "screw"), good, None, 1)
    assert report.passed
    assert report.remarks
    declared = [_with_false_zero(k) if k.name == "condense" else k for k in good]
    bad = crosscheck_kernels("hinge", "screw", definition("hinge", "screw"), declared, None, 1)
    assert not bad.passed
    assert [p.split(":")[0] for p in bad.problems] == ["condense"]


def _with_false_zero(kernel: Kernel) -> Kernel:
    """Claims that an entry of S_Q vanishes, which it does not."""
    derivation = kernel.derivation
    claimed = tuple(
        replace(e, zeros=(*e.zeros, (0, 1), (1, 0))) if str(e.left.name) == "S_Q" else e
        for e in derivation.definitions
    )
    return replace(kernel, derivation=replace(derivation, definitions=claimed))


def test_an_error_of_the_compiled_code_is_noticed() -> None:
    """The compiled screw against the equations of a pin, which has the same kernels."""
    screw = prebuilt_kernels.element("hinge", "prismatic")
    report = crosscheck_kernels(
        "hinge", "pin", definition("hinge", "pin"), kernels("hinge", "pin"), screw, 1
    )
    assert not report.passed
    assert any("of its rounding bound" in problem for problem in report.problems)
    assert crosscheck("hinge", "pin", 1).passed
