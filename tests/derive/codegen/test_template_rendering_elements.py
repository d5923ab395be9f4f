"""The C of every element computes its IR, compiled and as a tape.

Committed C and IR; of classical matrices that no run uses what is derived on demand.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from functools import cache

import numpy as np
import pytest

from mstmm.abi import element_library as abi
from mstmm.derive.classical.catalogue import CLASSICAL, RUN_ELEMENTS, classical_spec
from mstmm.derive.verification.kernel_evaluation import rounding_bounds
from mstmm.ir import KernelIR, Port
from mstmm.ir.element_spec import ElementSpec, element_from_json
from mstmm.ir.interpreter import GuardFailure, evaluate_floats
from mstmm.ir.statements import NEGATIVE_DETERMINANT
from mstmm.ir.tape import compile_tape
from mstmm.runtime.kernels import prebuilt_kernels
from tests.support.kernels.c_library import CLibrary, Outcome, are_same_numbers, build
from tests.support.paths import ROOT

GENERATED = ROOT / "generated"
MANIFEST = json.loads((GENERATED / "manifest.json").read_text())
STEMS = [f"{entry['kind']}_{entry['name']}" for entry in MANIFEST["elements"]]
ON_DEMAND = sorted(set(CLASSICAL) - set(RUN_ELEMENTS))


@cache
def stored_spec(stem: str) -> ElementSpec:
    """Element as stored in `generated/`."""
    return element_from_json((GENERATED / f"{stem}.json").read_text())


@pytest.fixture(scope="module")
def library() -> CLibrary:
    """As installed: runs call these very functions.  `.ci/sanitize.sh` compiles the same files with
    every warning an error."""
    return CLibrary(*prebuilt_kernels.module())


@pytest.fixture(scope="module")
def on_demand(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, ElementSpec], CLibrary]:
    """The classical matrices that no run uses, and their C, compiled here with every warning an
    error and, as what is installed, without contraction."""
    specs = {name: classical_spec(name) for name in ON_DEMAND}
    return specs, build(tmp_path_factory.mktemp("on_demand"), *specs.values())


def test_manifest_and_descriptors_agree(library: CLibrary) -> None:
    assert MANIFEST["abi"] == abi.ABI_VERSION
    for entry, stem in zip(MANIFEST["elements"], STEMS, strict=True):
        spec = stored_spec(stem)
        assert (entry["hash"], entry["kind"], entry["name"]) == (spec.hash(), spec.kind, spec.name)
        if stem not in library.elements:
            assert not (GENERATED / f"{stem}.c").exists() and not abi.has_c(spec)
            continue
        descriptor = library.elements[stem]
        assert library.text(descriptor.hash) == spec.hash()
        assert descriptor.abi == abi.ABI_VERSION
        counts = (descriptor.nq, descriptor.nu, descriptor.np, descriptor.n_kernels)
        groups = (spec.coordinates, spec.speeds, spec.parameters, abi.c_kernels(spec))
        assert counts == tuple(len(group) for group in groups)


#: Modes of kernels whose size is known at run time.
SIZE = 3


def random_values(port: Port, rng: np.random.Generator, special: bool) -> list[float]:
    """Values a kernel could meet: rotations for 3 x 3, definite inertias for 21 numbers and for
    modal mass matrices, no negative inertia of rotors.

    Special points are zeros, no rotation, and a unit inertia.
    """
    length = port.length(SIZE)
    if port.name == "S_ff":
        half = np.zeros((SIZE, SIZE)) if special else rng.normal(size=(SIZE, SIZE))
        return [float(v) for v in (half @ half.T + np.eye(SIZE)).ravel()]
    if port.shape == (3, 3):
        turn = np.eye(3) if special else np.linalg.qr(rng.normal(size=(3, 3)))[0]
        return [float(v) for v in turn.ravel()]
    if port.name == "J" and not special:
        return [float(v) for v in rng.uniform(0, 1, length)]
    if length == 21:
        half = np.zeros((6, 6)) if special else rng.normal(size=(6, 6))
        return [float(v) for v in (half @ half.T + np.eye(6))[np.triu_indices(6)]]
    return [0.0] * length if special else [float(v) for v in rng.uniform(-1, 1, length)]


def ways(
    library: CLibrary, stem: str, kernel: KernelIR, inputs: dict[str, list[float]], in_c: bool
) -> Iterator[Outcome]:
    """What C gives, and the tape; kernels with a run-time size have no tape."""
    if in_c:
        yield library.call(stem, kernel.name, inputs, SIZE if kernel.size_symbol else 0)
    if not kernel.size_symbol:
        code, rows = library.run_tape(compile_tape(kernel), [inputs[p.name] for p in kernel.inputs])
        yield Outcome(code, {p.name: row for p, row in zip(kernel.outputs, rows, strict=True)})


def agree(kernel: KernelIR, inputs: dict[str, list[float]], found: Iterable[Outcome]) -> bool:
    """Compare with floats and exact values; False if a guard stopped all of them alike."""
    n = SIZE if kernel.size_symbol else 0
    outcomes = list(found)
    assert outcomes
    try:
        floats = evaluate_floats(kernel, inputs, n)
    except GuardFailure as failure:
        assert {outcome.code for outcome in outcomes} == {failure.code}
        return False
    for outcome in outcomes:
        assert outcome.code in (0, NEGATIVE_DETERMINANT)  # behind all results
        for name, row in floats.items():
            assert are_same_numbers(outcome.outputs[name], row), name
    if all(np.isfinite(row).all() for row in floats.values()):
        for name, limits in rounding_bounds(kernel, inputs, n).items():
            for got, (value, bound) in zip(outcomes[0].outputs[name], limits, strict=True):
                assert abs(got - value) <= bound, name
    return True


def compare(library: CLibrary, stem: str, spec: ElementSpec, rng: np.random.Generator) -> None:
    """Every kernel of an element at points that pass its guards."""
    compiled = {kernel.name for kernel in abi.c_kernels(spec)}
    for kernel in spec.kernels:
        passed = 0
        for draw in range(60):  # many draws fail a guard, which has to fail alike in all three
            inputs = {port.name: random_values(port, rng, draw == 0) for port in kernel.inputs}
            found = ways(library, stem, kernel, inputs, kernel.name in compiled)
            passed += agree(kernel, inputs, found)
            if draw >= 3 and passed:
                break
        assert passed, f"{kernel.name}: no drawn point passes its guards"


@pytest.mark.parametrize("stem", STEMS)
def test_c_tape_and_ir_agree(stem: str, library: CLibrary, rng: np.random.Generator) -> None:
    compare(library, stem, stored_spec(stem), rng)


@pytest.mark.parametrize("name", ON_DEMAND)
def test_what_is_derived_on_demand_agrees(
    name: str, on_demand: tuple[dict[str, ElementSpec], CLibrary], rng: np.random.Generator
) -> None:
    specs, library = on_demand
    assert f"classical_{name}" not in STEMS
    compare(library, f"classical_{name}", specs[name], rng)
