"""The page on derivatives runs as written and names every result."""

from __future__ import annotations

import dataclasses
import re
import runpy
from pathlib import Path

import numpy as np
import pytest

from mstmm.runtime.model.derivatives import Derivatives

PAGE = (Path(__file__).parents[2] / "docs" / "use" / "derivatives.md").read_text("utf-8")


def test_the_example_runs_as_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (block,) = re.findall(r"^```python\n(.*?)^```", PAGE, re.M | re.S)
    (tmp_path / "run.py").write_text(block, encoding="utf-8")
    done = runpy.run_path(str(tmp_path / "run.py"))
    found, model, q = done["found"], done["model"], done["q"]
    assert len(capsys.readouterr().out.splitlines()) >= 6
    assert np.allclose(found.efforts @ model.mass_matrix(q), np.eye(2), atol=1e-12)
    assert np.abs(q - [-np.pi / 2, 0]).max() < 1e-9
    assert (np.linalg.eigvals(found.state_matrix).real < 0).all()  # the elbow's damping
    assert not found.parameters["elbow.law.damping"].any()  # nothing turns


def test_every_result_is_described() -> None:
    names = [field.name for field in dataclasses.fields(Derivatives)] + ["state_matrix"]
    assert {name for name in names if f"`{name}" not in PAGE} == set()
