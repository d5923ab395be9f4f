"""Every example checks its own statement; here each is run as a user would run it."""

from pathlib import Path

import pytest

from tests.support.paths import EXAMPLES
from tests.support.preloaded_process import run_script

CHECKS = sorted(EXAMPLES.glob("*/check.py"))
PICTURES = sorted(EXAMPLES.glob("*/picture.py"))


@pytest.mark.slow
@pytest.mark.parametrize("script", CHECKS, ids=lambda script: script.parent.name)
def test_example(script: Path, tmp_path: Path) -> None:
    run = run_script(script, [], tmp_path)
    assert run.returncode == 0, f"{run.stdout}\n{run.stderr}"
    assert run.stdout, "an example says what it measured"


@pytest.mark.slow
@pytest.mark.parametrize("script", PICTURES, ids=lambda script: script.parent.name)
def test_picture(script: Path, tmp_path: Path) -> None:
    target = tmp_path / "new.png"
    run = run_script(script, [str(target)], tmp_path)
    assert run.returncode == 0, f"{run.stdout}\n{run.stderr}"
    assert target.read_bytes().startswith(b"\x89PNG"), "a picture was drawn"
    assert (script.parent / "picture.png").is_file(), "the README shows one"


def test_every_example_is_whole() -> None:
    folders = sorted(path for path in EXAMPLES.iterdir() if path.is_dir())
    assert len(folders) >= 10
    for folder in folders:
        for name in ("scene.toml", "README.md", "check.py"):
            assert (folder / name).is_file(), f"{folder.name} lacks {name}"
