"""Random kernels over every operation: C, tape and evaluator agree; a flipped sign is noticed."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from pathlib import Path

import mpmath
import pytest

from mstmm.derive.verification.kernel_evaluation import evaluate
from mstmm.ir import OPERATIONS, Assign, KernelIR, Statement, from_json, to_json
from mstmm.ir.interpreter import GuardFailure, evaluate_floats
from mstmm.ir.tape import compile_tape
from tests.support.kernels.c_library import CLibrary, are_same_numbers, build
from tests.support.kernels.random_kernels import INPUTS, element, random_inputs, random_kernel

SEEDS = range(30)
JUMPS = ("sign", "floor", "lt", "le", "eq", "and", "or", "not", "select")
CONTINUOUS = tuple(op for op in OPERATIONS if op not in JUMPS)
SMOOTH = ("add", "sub", "mul", "div", "sin", "cos", "exp", "sqrt")
KERNELS = {seed: random_kernel(f"drawn{seed}", seed) for seed in SEEDS}


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> CLibrary:
    return build(tmp_path_factory.mktemp("random"), element("drawn", *KERNELS.values()))


def test_the_draw_covers_every_operation() -> None:
    used = {op for kernel in KERNELS.values() for op in kernel.operation_counts()}
    assert used == set(OPERATIONS)


@pytest.mark.parametrize("seed", SEEDS)
def test_c_equals_floats_and_tape(seed: int, library: CLibrary) -> None:
    kernel = KERNELS[seed]
    tape = compile_tape(kernel)
    for point in range(3):
        inputs = random_inputs(100 * seed + point)
        wanted = evaluate_floats(kernel, inputs)
        compiled = library.call("drawn", kernel.name, inputs)
        code, interpreted = library.run_tape(tape, [inputs[p.name] for p in INPUTS])
        assert compiled.code == code == 0
        assert are_same_numbers(compiled.outputs["y"], wanted["y"])
        assert are_same_numbers(compiled.outputs["total"], wanted["total"])
        assert are_same_numbers(interpreted[0], wanted["y"])
        assert are_same_numbers(interpreted[1], wanted["total"])


@pytest.mark.parametrize("seed", SEEDS)
def test_fifty_digits_equal_floats_to_rounding(seed: int) -> None:
    """Values of order one through about 60 well conditioned steps without jumps."""
    kernel, inputs = random_kernel("smooth", seed, 60, CONTINUOUS), random_inputs(seed)
    wanted = evaluate(kernel, inputs)["y"]
    got = evaluate_floats(kernel, inputs)["y"]
    assert close(got, wanted, 1e-11)


@pytest.mark.parametrize("seed", [0, 1])
def test_outputs_that_accumulate_are_added_to(seed: int, library: CLibrary) -> None:
    kernel, inputs = KERNELS[seed], random_inputs(seed)
    increment = evaluate_floats(kernel, inputs)["total"]
    wanted = [2.5 + value for value in increment]
    assert are_same_numbers(
        library.call("drawn", kernel.name, inputs, start=2.5).outputs["total"], wanted
    )
    tape = compile_tape(kernel)
    _, (_, total) = library.run_tape(tape, [inputs[p.name] for p in INPUTS], start=2.5)
    assert are_same_numbers(total, wanted)


def test_a_failed_guard_leaves_with_its_code(library: CLibrary) -> None:
    inputs = random_inputs(3) | {"x": [math.nan, 1.0, 1.0, 1.0]}
    kernel = KERNELS[0]
    assert library.call("drawn", kernel.name, inputs).code == 5
    tape = compile_tape(kernel)
    code, rows = library.run_tape(tape, [inputs[p.name] for p in INPUTS], start=2.5)
    assert code == 5
    assert tape.message(code) == "x[0] is a number"
    assert rows == [[2.5] * 60, [2.5] * 4]
    with pytest.raises(GuardFailure, match=r"drawn0: x\[0\] is a number \(code 5\)") as caught:
        evaluate(kernel, inputs)
    assert caught.value.code == 5


def close(got: Sequence[float], wanted: Sequence[mpmath.mpf], tolerance: float) -> bool:
    """Number for number, relative above one and absolute below; never for a NaN."""
    pairs = zip(got, wanted, strict=True)
    return all(abs(a - b) <= tolerance * max(1.0, abs(a)) for a, b in pairs)


def sign_mutants(kernel: KernelIR) -> list[KernelIR]:
    """The kernel with one sign changed, in every possible way."""
    swap = {"add": "sub", "sub": "add"}
    found = []
    for place, statement in enumerate(kernel.statements):
        if isinstance(statement, Assign) and statement.op in swap:
            changed: list[Statement] = list(kernel.statements)
            changed[place] = dataclasses.replace(statement, op=swap[statement.op])
            found.append(dataclasses.replace(kernel, statements=tuple(changed)))
    return found


def test_one_flipped_sign_is_noticed(tmp_path: Path) -> None:
    """Smooth operations alone, every value an output: no flip can hide behind a later step."""
    kernel, inputs = random_kernel("smooth", 1, 40, SMOOTH), random_inputs(1)
    compiled = build(tmp_path, element("smooth", kernel)).call("smooth", "smooth", inputs)
    assert close(compiled.outputs["y"], evaluate(kernel, inputs)["y"], 1e-12)
    mutants = sign_mutants(kernel)
    assert len(mutants) >= 10
    for mutant in mutants:
        assert mutant.hash() != kernel.hash()
        assert not close(compiled.outputs["y"], evaluate(mutant, inputs)["y"], 1e-6)


@pytest.mark.parametrize("seed", SEEDS)
def test_stored_form_gives_the_kernel_back(seed: int) -> None:
    kernel = KERNELS[seed]
    assert from_json(to_json(kernel)) == kernel
    assert from_json(to_json(kernel)).hash() == kernel.hash()
