"""Reasons of a failure: one number in Python and in C, one sentence each."""

from __future__ import annotations

import tomllib
from pathlib import Path
from types import SimpleNamespace

import mstmm
from mstmm.abi.failure_codes import FailureCode
from tests.support.kernels.c_library import ENGINE, compile_library
from tests.support.paths import ROOT


def test_c_has_the_numbers_of_the_table(tmp_path: Path) -> None:
    """A macro of the engine's own with another value is an error of the compiler."""
    asked = [
        f'_Static_assert(MSTMM_FAILED_{r.name} == {r.value}, "{r.name}");' for r in FailureCode
    ]
    source = tmp_path / "numbers.c"
    source.write_text("\n".join(['#include "sweep.h"', '#include "failures.h"', *asked, ""]))
    compile_library([source], tmp_path / "numbers.so", f"-I{ENGINE}", f"-I{ROOT / 'generated'}")


def test_every_reason_has_a_sentence_of_its_own() -> None:
    path = ROOT / "examples" / "branched_tree" / "scene.toml"
    tables = tomllib.loads(path.read_text())
    tables["event"] = [{"when": "shoulder.q > 3", "do": "bounce", "restitution": 0.5}]
    tables["coupling"] = [{"expression": "shoulder.q - 2*rail.q"}]
    tables["input"] = [{"name": "motor", "unit": "N*m", "value": 0.0}]
    tables["controller"] = [{
        "name": "regulator", "D": [[1.0]], "sample_time": 0.1, "inputs": ["shoulder.angle"],
        "outputs": ["motor"],
    }]  # fmt: skip
    looped = mstmm.compile(mstmm.Scene(**tables)).looped
    said = {
        looped.failure_text(SimpleNamespace(reason=int(r), element=0, code=1), 0.25)
        for r in FailureCode
    }
    assert len(said) == len(FailureCode) and all("at t = 0.25 s" in text for text in said)
