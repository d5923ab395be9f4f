"""Whatever is typed: an exit code of the table, no traceback, no defect."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mstmm.cli.error_boundary import run
from tests.support.commands import PENDULUM

OPTIONS = [
    "--t-end", "--method", "--step", "--rtol", "--atol", "--times", "--output", "-o", "--plot",
    "--quantity", "-q", "--hinge", "--certify", "--no-certify", "--resume", "--json", "--at",
    "--format", "--echo", "--check", "--help", "-h", "--", "--nonsense", "-x",
]  # fmt: skip
WORDS = [
    "scene.toml", "bad.toml", "empty.toml", "binary.toml", "folder", "folder.toml", "none.toml",
    "broken.py", "leaving.py", "nothing.py", "out.csv", "out.nc", "out.png", "away/out.nc", "pin",
    "hinge_pin", "classical_ball", "hinges", "laws", "equations", "matrix", "ir", "c", "text",
    "latex", "html", "rk4", "dopri5", "dop853", "scipy-RK45", "energy", "rod.tip.position",
    "pivot.angle", "0", "0.1", "0.01", "1e-3", "-1", "nan", "inf", "1e999", "1e-400", "3", "3s",
    "1e300", "٣", "", " ", "\0", "\udcff", "\x1b[2J", "é", "a" * 300, "0x1p3", "1_0", "%s", "$(ls)",
]  # fmt: skip

#: Bare `mstmm generate` writes generated/ of the checkout and `--check` derives everything.
COMMANDS = ["simulate", "check", "show", "list", "simulat", ""]
SIMULATE = ["simulate", "scene.toml", "--t-end", "0.1"]

arguments = st.one_of(
    st.tuples(
        st.sampled_from(COMMANDS).map(lambda name: [name]),
        st.lists(st.sampled_from([*OPTIONS, *WORDS]), max_size=5),
    ),
    st.tuples(st.just(SIMULATE), st.lists(st.sampled_from([*OPTIONS[:14], *WORDS]), max_size=4)),
    st.tuples(
        st.sampled_from(COMMANDS).map(lambda name: [name]),
        st.lists(st.text(max_size=12), max_size=3),
    ),
).map(lambda parts: [*parts[0], *parts[1]])


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    folder = tmp_path_factory.mktemp("fuzz")
    (folder / "scene.toml").write_text(PENDULUM)
    (folder / "bad.toml").write_text(PENDULUM.replace("1.0", "-1.0"))
    (folder / "empty.toml").write_bytes(b"")
    (folder / "binary.toml").write_bytes(bytes(range(256)))
    (folder / "broken.py").write_text("1 / 0\n")
    (folder / "leaving.py").write_text("import sys\nsys.exit(0)\n")
    (folder / "nothing.py").write_text("x = 1\n")
    (folder / "folder").mkdir()
    (folder / "folder.toml").mkdir()
    with pytest.MonkeyPatch.context() as patch, contextlib.chdir(folder):
        patch.setenv("MSTMM_KERNELS", str(folder / "store"))
        yield folder


@settings(max_examples=150, suppress_health_check=[HealthCheck.too_slow])
@given(given_arguments=arguments)
def test_any_arguments(place: Path, given_arguments: list[str]) -> None:
    if "1e300" in given_arguments and "--t-end" in given_arguments:
        given_arguments = [a for a in given_arguments if a != "1e300"]  # a run that never ends
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = run(given_arguments)
    assert code in {0, 2, 3, 4}, err.getvalue()
    assert "Traceback" not in out.getvalue() + err.getvalue()
    assert code == 0 or err.getvalue().startswith("mstmm: ")
