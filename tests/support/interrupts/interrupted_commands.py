"""Commands that are killed at chosen points, and what must hold after every one of them."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.support.commands import PENDULUM

CHECKPOINT, RESULT = "a.csv.checkpoint", "a.csv"

#: A run of a few steps.
RUN = ("pendulum.toml", "--method", "rk4", "--step", "0.1", "--t-end", "0.3", "--no-certify",
       "--engine", "looped", "-o", RESULT)  # fmt: skip


@dataclass(frozen=True)
class End:
    """Exit code (-n: killed by signal n), how many points the command passed, what it said."""

    code: int
    points: int
    out: str
    err: str


class Laboratory:
    """A folder with a scene, and a process that forks commands in it."""

    def __init__(self, root: Path) -> None:
        self.root, self.folder = root, root / "work"
        self.folder.mkdir()
        (root / "first").mkdir()
        self.clear()
        shutil.copy(self.folder / "pendulum.toml", root / "first")
        environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
        self.process = subprocess.Popen(
            [sys.executable, str(Path(__file__).with_name("fork_server.py")), *RUN],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=root / "first",
            env=environment,
        )  # fmt: skip
        while not self._answer().get("ready"):
            pass

    def _answer(self) -> Any:
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        assert line, "the zygote has died"
        return json.loads(line) if line.startswith("{") else {}

    def close(self) -> None:
        self.process.kill()
        self.process.communicate()

    def clear(self) -> None:
        """Leave the scene alone in the folder."""
        shutil.rmtree(self.folder)
        self.folder.mkdir()
        (self.folder / "pendulum.toml").write_text(PENDULUM)

    def command(
        self, *more: str, which: int = 0, at: int = -1, points: str = "files",
        every: int = 0, ignored: tuple[int, ...] = (), after: float | None = None,
        pace: float = 0.0,
    ) -> End:  # fmt: skip
        """One `mstmm simulate`, signalled when it passes point number `at`, or `after` seconds.

        A checkpoint is made every `pace` seconds; 0 for after every step.
        """
        kill = {
            "folder": str(self.folder), "streams": str(self.root), "signal": which, "at": at,
            "every": every, "points": points, "arguments": ["simulate", *RUN, *more],
            "ignored": ignored, "after": after, "pace": pace,
        }  # fmt: skip
        for name in ("out", "err"):
            (self.root / name).write_text("")
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps(kill) + "\n")
        self.process.stdin.flush()
        answer = self._answer()
        said = [(self.root / name).read_text() for name in ("out", "err")]
        assert "Traceback" not in said[1] and "Exception ignored" not in said[1], said[1]
        return End(answer["code"], answer["points"], *said)

    def names(self) -> set[str]:
        """What lies in the folder beside the scene."""
        return {path.name for path in self.folder.iterdir()} - {"pendulum.toml"}

    def uninterrupted_result(self) -> bytes:
        """Content of the result of an uninterrupted run; the folder is clear afterwards."""
        self.clear()
        end = self.command()
        assert end.code == 0 and self.names() == {RESULT}, end
        content = (self.folder / RESULT).read_bytes()
        self.clear()
        return content

    def half_way(self) -> bytes:
        """A checkpoint from the midst of the run; the folder is clear afterwards."""
        self.clear()
        end = self.command(which=signal.SIGKILL, at=self.command().points // 2)
        assert end.code == -signal.SIGKILL
        content = (self.folder / CHECKPOINT).read_bytes()
        self.clear()
        return content

    def finish_run(self) -> bytes:
        """Content of the result, after resuming as a user would; no other file is left then."""
        if CHECKPOINT in self.names():
            end = self.command("--resume")
            assert end.code == 0, end
        elif RESULT not in self.names():
            assert self.command().code == 0
        assert self.names() == {RESULT}
        return (self.folder / RESULT).read_bytes()
