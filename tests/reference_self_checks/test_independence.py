"""The references share no code with what they check."""

from __future__ import annotations

import subprocess
import sys

from tests.support.paths import ROOT, TESTS


def test_references_run_without_the_engine() -> None:
    """Every reference, imported and used in a fresh interpreter, leaves mstmm unloaded."""
    names = sorted(path.stem for path in (TESTS / "reference").glob("*.py"))
    imports = "".join(f"import tests.reference.{name}\n" for name in names if name != "__init__")
    use = (
        "import sys\n"
        "from tests.reference import dae, newton_euler as dense\n"
        "from tests.reference.compare import seeded_scene\n"
        "scene, q, u = seeded_scene(1)\n"
        "dense.solve(scene, q, u)\n"
        "equations = dae.Equations(scene)\n"
        "equations.solve(equations.start(q, u), 0.0)\n"
        "loaded = [name for name in sys.modules if name.partition('.')[0] == 'mstmm']\n"
        "assert not loaded, loaded\n"
    )
    run = subprocess.run(
        [sys.executable, "-c", imports + use], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr
