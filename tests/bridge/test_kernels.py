"""The committed C of every element computes its committed IR, compiled and as a tape."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from support.c_library import ENGINE, CLibrary, compile_library, same

from mstmm.border import elements as abi
from mstmm.derive.audit.rounding import rounding_bounds
from mstmm.ir import KernelIR, Port
from mstmm.ir.replay import GuardFailure, evaluate_floats
from mstmm.ir.spec import ElementSpec
from mstmm.ir.stored import element_from_json
from mstmm.ir.tape import compile_tape

GENERATED = Path(__file__).resolve().parents[2] / "generated"
MANIFEST = json.loads((GENERATED / "manifest.json").read_text())
SPECS: dict[str, ElementSpec] = {
    stem: element_from_json((GENERATED / f"{stem}.json").read_text())
    for stem in (f"{entry['kind']}_{entry['name']}" for entry in MANIFEST["elements"])
}


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> CLibrary:
    """Compiled with every warning an error, and without contraction, so that bits can agree."""
    sources = [*(GENERATED / f"{stem}.c" for stem in (*SPECS, "registry")), ENGINE / "tape.c"]
    target = tmp_path_factory.mktemp("generated") / "all.so"
    return CLibrary(compile_library(sources, target, f"-I{GENERATED}"))


def test_manifest_and_descriptors_agree(library: CLibrary) -> None:
    assert MANIFEST["abi"] == abi.ABI
    for entry, (stem, spec) in zip(MANIFEST["elements"], SPECS.items(), strict=True):
        assert (entry["hash"], entry["kind"], entry["name"]) == (spec.hash(), spec.kind, spec.name)
        assert entry["kernels"] == {kernel.name: kernel.hash() for kernel in spec.kernels}
        descriptor = library.elements[stem]
        assert library.text(descriptor.hash) == spec.hash()
        assert descriptor.abi == abi.ABI
        counts = (descriptor.nq, descriptor.nu, descriptor.np, descriptor.n_kernels)
        groups = (spec.coordinates, spec.speeds, spec.parameters, spec.kernels)
        assert counts == tuple(len(group) for group in groups)


#: Modes of kernels whose size is known at run time.
SIZE = 3


def drawn(port: Port, rng: np.random.Generator, special: bool) -> list[float]:
    """Values a kernel could meet: rotations for 3 x 3, definite inertias for 21 numbers and for
    modal mass matrices.

    Special points are zeros, no rotation, and a unit inertia.
    """
    length = port.length(SIZE)
    if port.name == "S_ff":
        half = np.zeros((SIZE, SIZE)) if special else rng.normal(size=(SIZE, SIZE))
        return [float(v) for v in (half @ half.T + np.eye(SIZE)).ravel()]
    if port.shape == (3, 3):
        turn = np.eye(3) if special else np.linalg.qr(rng.normal(size=(3, 3)))[0]
        return [float(v) for v in turn.ravel()]
    if length == 21:
        half = np.zeros((6, 6)) if special else rng.normal(size=(6, 6))
        return [float(v) for v in (half @ half.T + np.eye(6))[np.triu_indices(6)]]
    return [0.0] * length if special else [float(v) for v in rng.uniform(-1, 1, length)]


def agree(library: CLibrary, stem: str, kernel: KernelIR, inputs: dict[str, list[float]]) -> bool:
    """Compare C, tape, floats and exact values; False if a guard stopped all of them alike.

    Kernels with a run-time size have no tape.
    """
    n = SIZE if kernel.size_symbol else 0
    compiled = library.call(stem, kernel.name, inputs, n)
    rows = None
    if not n:
        code, rows = library.run_tape(compile_tape(kernel), [inputs[p.name] for p in kernel.inputs])
        assert code == compiled.code
    try:
        floats = evaluate_floats(kernel, inputs, n)
    except GuardFailure as failure:
        assert compiled.code == failure.code
        return False
    assert compiled.code == 0
    for name, row in floats.items():
        assert same(compiled.outputs[name], row), name
    for (name, row), interpreted in zip(floats.items(), rows or (), strict=rows is not None):
        assert same(interpreted, row), name
    if all(np.isfinite(row).all() for row in floats.values()):
        for name, limits in rounding_bounds(kernel, inputs, n).items():
            for got, (value, bound) in zip(compiled.outputs[name], limits, strict=True):
                assert abs(got - value) <= bound, name
    return True


@pytest.mark.parametrize("stem", SPECS)
def test_c_tape_and_ir_agree(stem: str, library: CLibrary, rng: np.random.Generator) -> None:
    for kernel in SPECS[stem].kernels:
        passed = 0
        for draw in range(60):  # many draws fail a guard, which has to fail alike in all three
            inputs = {port.name: drawn(port, rng, draw == 0) for port in kernel.inputs}
            passed += agree(library, stem, kernel, inputs)
            if draw >= 3 and passed:
                break
        assert passed, f"{kernel.name}: no drawn point passes its guards"
